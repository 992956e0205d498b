/// \file What the writer and the reader of patches as JSON share.
#pragma once

namespace holdfast::io {

/// Raised where a reader of the former one would go wrong: 2 since patches have a
/// state, and null in the covariance of parameters that are not observable. Files of
/// version 1 do not name it.
constexpr int kPatchJsonSchema = 2;

} // namespace holdfast::io
