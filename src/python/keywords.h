/// \file Options by name, as keyword arguments: one table gives what is read, the
/// signature, the defaults and the help.
#pragma once

#include <holdfast/enum_names.h>

#include <pybind11/pybind11.h>

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace holdfast::python {

namespace py = pybind11;

/// Conversions that say what is wrong: a TypeError for another kind of thing, a
/// ValueError for what it may not be.
void read(const std::string& name, py::handle value, double& out);
void read(const std::string& name, py::handle value, int& out);
void read(const std::string& name, py::handle value, std::uint64_t& out);
void read(const std::string& name, py::handle value, bool& out);
std::string readText(const std::string& name, py::handle value);

/// None: nothing.
template <typename T>
void
read(const std::string& name, py::handle value, std::optional<T>& out)
{
  if (value.is_none()) {
    out.reset();
    return;
  }
  out.emplace();
  read(name, value, *out);
}

/// As Python writes it.
std::string show(double value);
std::string show(int value);
std::string show(std::uint64_t value);
std::string show(bool value);

template <typename T>
std::string
show(const std::optional<T>& value)
{
  return value ? show(*value) : "None";
}

/// \throw py::value_error with all the names.
[[noreturn]] void failWord(const std::string& name,
                           const std::string& word,
                           const std::vector<std::string>& known);

template <typename Names>
typename Names::Enum
readWord(const Names& names, const std::string& name, py::handle value)
{
  const std::string word = readText(name, value);
  if (const auto found = names.find(word))
    return *found;
  failWord(name, word, {names.words.begin(), names.words.end()});
}

/// Lines of an entry of help, the first further to the left.
std::string wrapped(const std::string& words);

/// The options of a function.
template <typename Options>
class Keywords {
public:
  explicit Keywords(std::string function) : function_(std::move(function)) {}

  /// \param get the member of the options, or a function from them to a reference
  template <typename Get>
  Keywords& add(const std::string& name, Get get, const std::string& help)
  {
    return put(
        name,
        [name, get](Options& o, py::handle value) {
          read(name, value, std::invoke(get, o));
        },
        [get](Options& o) { return show(std::invoke(get, o)); },
        help);
  }

  /// One of an enumeration.
  template <typename Names, typename Get>
  Keywords& add(const std::string& name,
                const Names& names,
                Get get,
                const std::string& help)
  {
    return put(
        name,
        [name, names, get](Options& o, py::handle value) {
          std::invoke(get, o) = readWord(names, name, value);
        },
        [names, get](Options& o) {
          return "'" + std::string(names.of(std::invoke(get, o))) + "'";
        },
        help);
  }

  /// Anything else.
  Keywords& put(const std::string& name,
                std::function<void(Options&, py::handle)> set,
                std::function<std::string(Options&)> text,
                const std::string& help)
  {
    index_[name] = entries_.size();
    entries_.push_back({name, std::move(set), std::move(text), help});
    return *this;
  }

  /// \throw py::type_error for an option there is not.
  void set(Options& options, const py::kwargs& given) const
  {
    for (const auto& [key, value] : given) {
      const auto name = py::cast<std::string>(key);
      const auto found = index_.find(name);
      if (found == index_.end())
        throw py::type_error(function_ + "() has no option '" + name + "'; it has " +
                             names());
      entries_[found->second].set(options, value);
    }
  }

  /// "surface='auto', containment=0.95, ...".
  std::string signature(Options defaults = {}) const
  {
    std::string text;
    for (const Entry& entry : entries_)
      text += (text.empty() ? "" : ", ") + entry.name + "=" + entry.text(defaults);
    return text;
  }

  /// Lines for each.
  std::string help() const
  {
    std::string text;
    for (const Entry& entry : entries_)
      text += wrapped(entry.name + ": " + entry.help);
    return text;
  }

private:
  struct Entry {
    std::string name;
    std::function<void(Options&, py::handle)> set;
    std::function<std::string(Options&)> text;
    std::string help;
  };

  std::string names() const
  {
    std::string text;
    for (const Entry& entry : entries_)
      text += (text.empty() ? "" : ", ") + entry.name;
    return text;
  }

  std::string function_;
  std::vector<Entry> entries_;
  std::map<std::string, std::size_t> index_;
};

} // namespace holdfast::python
