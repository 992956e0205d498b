/// \file JSON as text, written straight away.
///
/// For the patches, of which there may be a hundred thousand with some hundred numbers
/// each: nlohmann would build a tree of values first. Everything else goes through it.
#pragma once

#include <Eigen/Core>

#include <charconv>
#include <string>
#include <string_view>
#include <type_traits>

namespace holdfast::io {

/// The fewest digits that give the number back bit for bit; null when it is not finite.
void appendJson(double number, std::string& out);

/// A word of our own: nothing in it needs a backslash.
void appendJson(std::string_view word, std::string& out);

/// Row by row; entries that are the same as their mirror image are printed once.
void appendJsonMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                      std::string& out);

template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer>>>
void
appendJson(Integer number, std::string& out)
{
  if constexpr (std::is_same_v<Integer, bool>)
    out += number ? "true" : "false";
  else {
    char text[24];
    out.append(text, std::to_chars(text, text + sizeof text, number).ptr);
  }
}

/// A vector, as an array.
template <typename Derived>
void
appendJson(const Eigen::MatrixBase<Derived>& vector, std::string& out)
{
  static_assert(Derived::ColsAtCompileTime == 1, "a matrix needs appendJsonMatrix()");
  char before = '[';
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    out += before;
    appendJson(static_cast<double>(vector(i)), out);
    before = ',';
  }
  out += vector.size() > 0 ? "]" : "[]";
}

/// An object that grows member by member at the end of a text.
class JsonObject {
public:
  explicit JsonObject(std::string& out) : out_(out)
  {
    out_ += '{';
  }

  /// What its value is appended to.
  std::string& member(std::string_view name)
  {
    if (out_.back() != '{')
      out_ += ',';
    appendJson(name, out_);
    out_ += ':';
    return out_;
  }

  template <typename Value>
  void add(std::string_view name, const Value& value)
  {
    appendJson(value, member(name));
  }

  void addMatrix(std::string_view name, const Eigen::Ref<const Eigen::MatrixXd>& matrix)
  {
    appendJsonMatrix(matrix, member(name));
  }

  /// Members that are text already, without the braces.
  void addText(std::string_view members)
  {
    if (out_.back() != '{')
      out_ += ',';
    out_ += members;
  }

  void addNull(std::string_view name)
  {
    member(name) += "null";
  }

  void end()
  {
    out_ += '}';
  }

private:
  std::string& out_;
};

} // namespace holdfast::io
