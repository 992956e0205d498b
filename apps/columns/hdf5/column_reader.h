/// \file Reads columns.
#pragma once

#include "columns/column_file.h"

#include <memory>
#include <string>

namespace holdfast::app {

/// \throw std::runtime_error "PATH: cause".
std::unique_ptr<ColumnReader> makeColumnReader(const std::string& path);

} // namespace holdfast::app
