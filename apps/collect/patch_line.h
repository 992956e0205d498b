/// \file A patch in the text of a result, read without the tree of its values.
#pragma once

#include "columns/patch_row.h"

#include <string_view>

namespace holdfast::app {

/// The row of one JSON object among the "patches" of a result. Members that no column
/// is made of are skipped.
/// \throw std::runtime_error in one line when it is no such object.
PatchRow rowOfJson(std::string_view text);

} // namespace holdfast::app
