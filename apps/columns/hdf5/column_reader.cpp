#include "column_reader.h"

#include "patch_columns.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace holdfast::app {
namespace {

Handle
openDataset(hid_t file, const std::string& name)
{
  return {H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose};
}

/// Rows of a dataset whose rows hold `count` numbers. \throw std::runtime_error for
/// another shape.
std::size_t
rowsOf(hid_t dataset, std::size_t count)
{
  const Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = count > 1 ? 2 : 1;
  hsize_t size[2] = {0, 1};
  if (H5Sget_simple_extent_ndims(space) != rank ||
      H5Sget_simple_extent_dims(space, size, nullptr) != rank || size[1] != count)
    throw std::runtime_error("a column has another shape");
  return size[0];
}

std::vector<std::string>
readTexts(hid_t file, const std::string& name)
{
  const Handle dataset = openDataset(file, name);
  const Handle type = stringType();
  const Handle space(H5Dget_space(dataset), H5Sclose);
  std::vector<char*> raw(rowsOf(dataset, 1), nullptr);
  if (raw.empty())
    return {};
  checkedCall(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, raw.data()));
  std::vector<std::string> texts;
  for (const char* text : raw)
    texts.emplace_back(text != nullptr ? text : "");
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, raw.data());
  return texts;
}

template <typename Value>
std::vector<Value>
readNumbers(hid_t file, const std::string& name, hid_t type, std::size_t count)
{
  const Handle dataset = openDataset(file, name);
  std::vector<Value> values(rowsOf(dataset, count));
  if (!values.empty())
    checkedCall(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  return values;
}

Handle
openFile(const std::string& path)
{
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  checkedCall(H5Pset_file_locking(access, 0, 1));
  return {H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose};
}

std::vector<CloudRow>
readClouds(hid_t file)
{
  const auto name = readTexts(file, "clouds/name");
  const auto path = readTexts(file, "clouds/path");
  const auto fingerprint = readTexts(file, "clouds/fingerprint");
  const auto settings = readTexts(file, "settings/json");
  const auto number =
      readNumbers<std::uint32_t>(file, "clouds/settings", H5T_NATIVE_UINT32, 1);
  using Triple = std::array<double, 3>;
  const auto position =
      readNumbers<Triple>(file, "clouds/position", H5T_NATIVE_DOUBLE, 3);
  const auto orientation = readNumbers<std::array<double, 4>>(file,
                                                              "clouds/orientation_wxyz",
                                                              H5T_NATIVE_DOUBLE,
                                                              4);
  const auto offset = readNumbers<Triple>(file, "clouds/offset", H5T_NATIVE_DOUBLE, 3);
  const auto first =
      readNumbers<std::uint64_t>(file, "clouds/first_patch", H5T_NATIVE_UINT64, 1);
  const auto patches =
      readNumbers<std::uint64_t>(file, "clouds/patches", H5T_NATIVE_UINT64, 1);
  std::vector<CloudRow> clouds;
  for (std::size_t i = 0; i < name.size(); ++i)
    clouds.push_back({name[i],
                      path.at(i),
                      fingerprint.at(i),
                      settings.at(number.at(i)),
                      position.at(i),
                      orientation.at(i),
                      offset.at(i),
                      first.at(i),
                      patches.at(i)});
  return clouds;
}

class Reader : public ColumnReader {
public:
  explicit Reader(const std::string& path)
  : path_(path), file_(openFile(path)), clouds_(readClouds(file_))
  {
    for (PatchColumn& column : patchColumns()) {
      Handle dataset = openDataset(file_, std::string("patches/") + column.name);
      const std::size_t rows = rowsOf(dataset, column.count);
      if (!columns_.empty() && rows != rows_)
        throw std::runtime_error("columns are of different lengths");
      rows_ = rows;
      columns_.push_back({std::move(column), std::move(dataset)});
    }
  }

  const std::vector<CloudRow>& clouds() const override
  {
    return clouds_;
  }

  void readPatches(std::size_t first,
                   std::size_t count,
                   std::vector<PatchRow>& rows) const override
  {
    rows.assign(first < rows_ ? std::min(count, rows_ - first) : 0, {});
    if (rows.empty())
      return;
    try {
      for (const Column& column : columns_)
        readColumn(column, first, rows);
    }
    catch (const std::runtime_error& error) {
      throw std::runtime_error(path_ + ": " + error.what());
    }
  }

private:
  struct Column {
    PatchColumn of_row;
    Handle dataset;
  };

  static void readColumn(const Column& column,
                         std::size_t first,
                         std::vector<PatchRow>& rows)
  {
    const PatchColumn& of_row = column.of_row;
    const int rank = of_row.count > 1 ? 2 : 1;
    const hsize_t start[2] = {first, 0};
    const hsize_t size[2] = {rows.size(), of_row.count};
    const Handle space(H5Dget_space(column.dataset), H5Sclose);
    checkedCall(
        H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr));
    const Handle memory(H5Screate_simple(rank, size, nullptr), H5Sclose);
    const std::size_t width = H5Tget_size(of_row.type) * of_row.count;
    std::vector<char> bytes(width * rows.size());
    checkedCall(
        H5Dread(column.dataset, of_row.type, memory, space, H5P_DEFAULT, bytes.data()));
    for (std::size_t i = 0; i < rows.size(); ++i)
      std::memcpy(reinterpret_cast<char*>(&rows[i]) + of_row.offset,
                  bytes.data() + i * width,
                  width);
  }

  std::string path_;
  Handle file_;
  std::vector<CloudRow> clouds_;
  std::size_t rows_ = 0;
  std::vector<Column> columns_;
};

} // namespace

std::unique_ptr<ColumnReader>
makeColumnReader(const std::string& path)
{
  try {
    return std::make_unique<Reader>(path);
  }
  catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

} // namespace holdfast::app
