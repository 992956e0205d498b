/// \file Which columns there are, and where a row keeps them.
#pragma once

#include "hdf5_handle.h"

#include "columns/patch_row.h"

#include <cstddef>
#include <vector>

namespace holdfast::app {

/// A column of patches.
struct PatchColumn {
  const char* name;
  Handle type; ///< of one number, in file and memory
  std::size_t offset; ///< in PatchRow, bytes
  std::size_t count; ///< numbers per row; one makes a plain column
  const char* about; ///< with unit, for the file
};

/// All of PatchRow. Made anew: handles have one owner.
std::vector<PatchColumn> patchColumns();

/// What else the columns' readers need to know: the names of states and parameters by
/// type, and of flags, as JSON.
std::string columnNames();

} // namespace holdfast::app
