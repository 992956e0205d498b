/// \file Writes columns.
#pragma once

#include "columns/column_file.h"

#include <memory>
#include <string>

namespace holdfast::app {

/// \throw std::runtime_error in one line.
std::unique_ptr<ColumnWriter> makeColumnWriter(const std::string& path,
                                               std::size_t rows_per_chunk);

} // namespace holdfast::app
