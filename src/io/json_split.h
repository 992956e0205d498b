/// \file A long array of a JSON text, element by element.
///
/// So that each of a hundred thousand patches can be parsed and forgotten, by several
/// threads: the tree of them all takes gigabytes.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast::io {

struct SplitJson {
  std::vector<std::string_view>
      elements; ///< of the array, unchecked, in the text given
  std::string rest; ///< the text with an empty array in their place
};

/// Takes the array that is the member `name` of the outermost object apart. Nothing
/// when there is none or the text is not JSON as far as that shows: whoever parses it
/// as a whole will say what is wrong.
std::optional<SplitJson> splitJsonArray(std::string_view text, std::string_view name);

} // namespace holdfast::io
