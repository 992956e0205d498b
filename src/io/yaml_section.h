/// \file YAML files read strictly: every key is known, given once, and of its type.
#pragma once

#include <Eigen/Core>
#include <yaml-cpp/yaml.h>

#include <map>
#include <string>
#include <vector>

namespace holdfast::io {

/// One map of a YAML file; knows where it stands, for messages, and which of its keys
/// were read, to find those nobody asked for. Whatever is wrong is thrown as
/// std::runtime_error "FILE:LINE: KEY PROBLEM".
class Section {
public:
  /// \param line of the key that introduces the map; \param path its name, with those
  /// of the maps around it.
  Section(const YAML::Node& node,
          std::string file,
          int line = 1,
          std::string path = "");

  const std::string& file() const
  {
    return file_;
  }

  bool has(const std::string& name) const
  {
    return entries_.count(name) > 0;
  }

  std::string text(const std::string& name);
  double number(const std::string& name);
  double positive(const std::string& name);

  /// A whole number from 1 to 20000: more than any image sensor has, less than
  /// overflows an index.
  int pixels(const std::string& name);

  Section section(const std::string& name);

  /// The maps of a list, named `name[0]` and so on.
  std::vector<Section> list(const std::string& name);

  /// A list of pairs of numbers.
  std::vector<Eigen::Vector2d> points(const std::string& name);

  /// To be called once all keys were read.
  void rejectUnknown() const;

  /// \throw std::runtime_error about the entry of that name.
  [[noreturn]] void fail(const std::string& name, const std::string& problem) const;

private:
  struct Entry {
    YAML::Node value;
    int line = 0;
    bool used = false;
  };

  std::string fullName(const std::string& name) const;
  const Entry& read(const std::string& name);
  std::string scalar(const std::string& name);
  [[noreturn]] void failAt(int line,
                           const std::string& what,
                           const std::string& problem) const;

  std::string file_;
  int line_;
  std::string path_;
  std::map<std::string, Entry> entries_;
};

/// The map that a file is. \throw std::runtime_error "FILE:LINE: CAUSE".
Section loadYaml(const std::string& file);

} // namespace holdfast::io
