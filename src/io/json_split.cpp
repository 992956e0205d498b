#include "json_split.h"

#include <algorithm>

namespace holdfast::io {
namespace {

/// Finds where values end, and looks no closer at them.
class Scanner {
public:
  explicit Scanner(std::string_view text) : text_(text) {}

  std::size_t at() const
  {
    return at_;
  }

  /// The next character that is not blank; 0 at the end.
  char peek()
  {
    at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size());
    return at_ < text_.size() ? text_[at_] : '\0';
  }

  /// Takes it if it is this one.
  bool take(char c)
  {
    const bool is_there = peek() == c;
    at_ += is_there ? 1 : 0;
    return is_there;
  }

  /// A string with its quotes; empty where there is none.
  std::string_view takeString()
  {
    if (peek() != '"')
      return {};
    const std::size_t begin = at_;
    skipString();
    return text_.substr(begin, at_ - begin);
  }

  /// A value; empty where there is none.
  std::string_view takeValue()
  {
    const char first = peek();
    const std::size_t begin = at_;
    if (first == '"')
      skipString();
    else if (first == '{' || first == '[')
      skipNested();
    else
      at_ = std::min(text_.find_first_of(",]} \t\r\n", at_), text_.size());
    return text_.substr(begin, at_ - begin);
  }

private:
  void skipString()
  {
    for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_)
      at_ += text_[at_] == '\\' ? 1 : 0;
    at_ = std::min(at_ + 1, text_.size());
  }

  /// What begins with a bracket, to its counterpart.
  void skipNested()
  {
    int depth = 0;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"') {
        skipString();
        continue;
      }
      ++at_;
      depth += c == '{' || c == '[' ? 1 : c == '}' || c == ']' ? -1 : 0;
      if (depth == 0)
        return;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

/// False where a comma or a value is missing.
bool
takeElements(Scanner& scanner, std::vector<std::string_view>& elements)
{
  if (!scanner.take('['))
    return false;
  if (scanner.take(']'))
    return true;
  do {
    const std::string_view element = scanner.takeValue();
    if (element.empty())
      return false;
    elements.push_back(element);
  } while (scanner.take(','));
  return scanner.take(']');
}

} // namespace

std::optional<SplitJson>
splitJsonArray(std::string_view text, std::string_view name)
{
  const std::string quoted = '"' + std::string(name) + '"';
  Scanner scanner(text);
  if (!scanner.take('{'))
    return std::nullopt;
  do {
    const std::string_view key = scanner.takeString();
    if (key.empty() || !scanner.take(':'))
      return std::nullopt;
    if (key != quoted) {
      scanner.takeValue();
      continue;
    }
    SplitJson split;
    scanner.peek();
    const std::size_t begin = scanner.at();
    if (!takeElements(scanner, split.elements))
      return std::nullopt;
    split.rest.append(text.substr(0, begin)).append("[]");
    split.rest.append(text.substr(scanner.at()));
    return split;
  } while (scanner.take(','));
  return std::nullopt;
}

} // namespace holdfast::io
