#include "column_writer.h"

#include "patch_columns.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <map>

namespace holdfast::app {
namespace {

/// Of clouds, settings and failures, which are few beside patches.
constexpr std::size_t kCloudsPerChunk = 256;

/// Of zlib, 1 to 9: more makes covariances hardly smaller, and takes much longer.
constexpr unsigned kCompression = 1;

/// How something is created. Without the time of day: the same rows make the same file.
Handle
creation(hid_t of_what)
{
  Handle properties(H5Pcreate(of_what), H5Pclose);
  checkedCall(H5Pset_obj_track_times(properties, 0));
  return properties;
}

Handle
makeGroup(hid_t file, const char* name)
{
  const Handle properties = creation(H5P_GROUP_CREATE);
  return {H5Gcreate2(file, name, H5P_DEFAULT, properties, H5P_DEFAULT), H5Gclose};
}

void
addText(hid_t object, const char* name, const std::string& text)
{
  const Handle type = stringType();
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(
      H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  const char* const value = text.c_str();
  checkedCall(H5Awrite(attribute, type, &value));
}

/// A dataset that grows row by row.
class GrowingColumn {
public:
  GrowingColumn(hid_t group,
                const char* name,
                Handle type,
                std::size_t count,
                std::size_t chunk)
  : type_(std::move(type)), count_(count)
  {
    const int rank = count > 1 ? 2 : 1;
    const hsize_t none[2] = {0, count};
    const hsize_t most[2] = {H5S_UNLIMITED, count};
    const hsize_t chunks[2] = {chunk, count};
    const Handle space(H5Screate_simple(rank, none, most), H5Sclose);
    const Handle properties = creation(H5P_DATASET_CREATE);
    checkedCall(H5Pset_chunk(properties, rank, chunks));
    checkedCall(H5Pset_shuffle(properties));
    checkedCall(H5Pset_deflate(properties, kCompression));
    dataset_ = Handle(
        H5Dcreate2(group, name, type_, space, H5P_DEFAULT, properties, H5P_DEFAULT),
        H5Dclose);
  }

  void append(const void* values, std::size_t rows)
  {
    if (rows == 0)
      return;
    const int rank = count_ > 1 ? 2 : 1;
    const hsize_t first[2] = {rows_, 0};
    const hsize_t size[2] = {rows, count_};
    rows_ += rows;
    const hsize_t all[2] = {rows_, count_};
    checkedCall(H5Dset_extent(dataset_, all));
    const Handle space(H5Dget_space(dataset_), H5Sclose);
    checkedCall(
        H5Sselect_hyperslab(space, H5S_SELECT_SET, first, nullptr, size, nullptr));
    const Handle memory(H5Screate_simple(rank, size, nullptr), H5Sclose);
    checkedCall(H5Dwrite(dataset_, type_, memory, space, H5P_DEFAULT, values));
  }

  hid_t dataset() const
  {
    return dataset_;
  }

private:
  Handle type_;
  std::size_t count_;
  hsize_t rows_ = 0;
  Handle dataset_;
};

/// Rows of one kind, a member of each per column.
template <typename Row>
class Table {
public:
  void addText(hid_t group, const char* name, std::string Row::*member)
  {
    auto column =
        std::make_shared<GrowingColumn>(group, name, stringType(), 1, kCloudsPerChunk);
    writes_.push_back([column, member](const std::vector<Row>& rows) {
      std::vector<const char*> texts;
      for (const Row& row : rows)
        texts.push_back((row.*member).c_str());
      column->append(texts.data(), texts.size());
    });
  }

  template <typename Value>
  void add(hid_t group,
           const char* name,
           hid_t type,
           std::size_t count,
           Value Row::*member)
  {
    auto column = std::make_shared<GrowingColumn>(group,
                                                  name,
                                                  Handle(H5Tcopy(type), H5Tclose),
                                                  count,
                                                  kCloudsPerChunk);
    writes_.push_back([column, member](const std::vector<Row>& rows) {
      std::vector<Value> values;
      for (const Row& row : rows)
        values.push_back(row.*member);
      column->append(values.data(), values.size());
    });
  }

  void append(Row row)
  {
    rows_.push_back(std::move(row));
    if (rows_.size() == kCloudsPerChunk)
      flush();
  }

  void flush()
  {
    for (const auto& write : writes_)
      write(rows_);
    rows_.clear();
  }

private:
  std::vector<std::function<void(const std::vector<Row>&)>> writes_;
  std::vector<Row> rows_;
};

struct Settings {
  std::string json;
};

/// CloudRow, with the number of its settings.
struct CloudEntry {
  std::string name, path, fingerprint;
  std::uint32_t settings = 0;
  std::array<double, 3> position{}, offset{};
  std::array<double, 4> orientation{};
  std::uint64_t first_patch = 0, patches = 0;
};

/// For files that many versions of HDF5 read; other processes may hold the file locked
/// as one that is not complete yet.
Handle
createFile(const std::string& path)
{
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  checkedCall(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
  checkedCall(H5Pset_file_locking(access, 0, 1));
  return {H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation(H5P_FILE_CREATE), access),
          H5Fclose};
}

class Writer : public ColumnWriter {
public:
  Writer(const std::string& path, std::size_t rows_per_chunk)
  : rows_per_chunk_(rows_per_chunk), file_(createFile(path))
  {
    makePatches();
    makeClouds();
    Handle settings = makeGroup(file_, "settings");
    settings_.addText(settings, "json", &Settings::json);
    Handle failed = makeGroup(file_, "failed");
    failed_.addText(failed, "name", &FailedCloud::name);
    failed_.addText(failed, "path", &FailedCloud::path);
    failed_.addText(failed, "fingerprint", &FailedCloud::fingerprint);
    failed_.addText(failed, "reason", &FailedCloud::reason);
  }

  void addCloud(CloudRow cloud) override
  {
    const auto [known, is_new] =
        settings_numbers_.emplace(cloud.settings,
                                  static_cast<std::uint32_t>(settings_numbers_.size()));
    if (is_new)
      settings_.append({cloud.settings});
    CloudEntry entry;
    entry.name = cloud.name;
    entry.path = cloud.path;
    entry.fingerprint = cloud.fingerprint;
    entry.settings = known->second;
    entry.position = cloud.position;
    entry.offset = cloud.offset;
    entry.orientation = cloud.orientation_wxyz;
    entry.first_patch = patches_;
    entry.patches = cloud.patches;
    clouds_.append(std::move(entry));
    ++cloud_count_;
  }

  void addPatches(const PatchRow* rows, std::size_t count) override
  {
    for (std::size_t i = 0; i < count; ++i) {
      buffer_.push_back(rows[i]);
      buffer_.back().cloud = cloud_count_ - 1;
      if (buffer_.size() == rows_per_chunk_)
        flushPatches();
    }
    patches_ += count;
  }

  void addFailure(const FailedCloud& failed) override
  {
    failed_.append(failed);
  }

  void close() override
  {
    flushPatches();
    clouds_.flush();
    settings_.flush();
    failed_.flush();
    columns_.clear();
    clouds_ = {};
    settings_ = {};
    failed_ = {};
    file_.close();
  }

private:
  void makePatches()
  {
    Handle group = makeGroup(file_, "patches");
    addText(group, "names", columnNames());
    layout_ = patchColumns();
    for (const PatchColumn& column : layout_) {
      Handle type(H5Tcopy(column.type), H5Tclose);
      columns_.emplace_back(group,
                            column.name,
                            std::move(type),
                            column.count,
                            rows_per_chunk_);
      if (*column.about != '\0')
        addText(columns_.back().dataset(), "about", column.about);
    }
  }

  void makeClouds()
  {
    Handle group = makeGroup(file_, "clouds");
    clouds_.addText(group, "name", &CloudEntry::name);
    clouds_.addText(group, "path", &CloudEntry::path);
    clouds_.addText(group, "fingerprint", &CloudEntry::fingerprint);
    clouds_.add(group, "settings", H5T_NATIVE_UINT32, 1, &CloudEntry::settings);
    clouds_.add(group, "position", H5T_NATIVE_DOUBLE, 3, &CloudEntry::position);
    clouds_.add(group,
                "orientation_wxyz",
                H5T_NATIVE_DOUBLE,
                4,
                &CloudEntry::orientation);
    clouds_.add(group, "offset", H5T_NATIVE_DOUBLE, 3, &CloudEntry::offset);
    clouds_.add(group, "first_patch", H5T_NATIVE_UINT64, 1, &CloudEntry::first_patch);
    clouds_.add(group, "patches", H5T_NATIVE_UINT64, 1, &CloudEntry::patches);
  }

  void flushPatches()
  {
    for (std::size_t c = 0; c < layout_.size(); ++c) {
      const PatchColumn& column = layout_[c];
      const std::size_t width = H5Tget_size(column.type) * column.count;
      bytes_.resize(width * buffer_.size());
      for (std::size_t i = 0; i < buffer_.size(); ++i)
        std::memcpy(bytes_.data() + i * width,
                    reinterpret_cast<const char*>(&buffer_[i]) + column.offset,
                    width);
      columns_[c].append(bytes_.data(), buffer_.size());
    }
    buffer_.clear();
  }

  std::size_t rows_per_chunk_;
  Handle file_;
  std::vector<PatchColumn> layout_;
  std::vector<GrowingColumn> columns_;
  Table<CloudEntry> clouds_;
  Table<Settings> settings_;
  Table<FailedCloud> failed_;
  std::map<std::string, std::uint32_t> settings_numbers_;
  std::vector<PatchRow> buffer_;
  std::vector<char> bytes_;
  std::uint64_t patches_ = 0;
  std::uint32_t cloud_count_ = 0;
};

} // namespace

std::unique_ptr<ColumnWriter>
makeColumnWriter(const std::string& path, std::size_t rows_per_chunk)
{
  return std::make_unique<Writer>(path, rows_per_chunk);
}

} // namespace holdfast::app
