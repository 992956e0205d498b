#include <holdfast/io/patch_map_file.h>

#include "file_bytes.h"
#include <holdfast/io/atomic_file.h>

#include <boost/crc.hpp>
#include <fmt/core.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

namespace holdfast {
namespace {

constexpr std::string_view kSignature = "holdfast patch map\n";
constexpr std::uint32_t kVersion = 2;
constexpr std::uint64_t kMostPatches = 100'000'000;
constexpr std::uint64_t kLongestName = 1000, kMostWaves = 1000;

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "maps are stored as little-endian machines have them");

/// Appends to a text.
class Writer {
public:
  static constexpr bool kReads = false;

  static constexpr std::uint32_t version()
  {
    return kVersion;
  }

  template <typename T>
  void value(const T& x)
  {
    static_assert(std::is_arithmetic_v<T>);
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  }

  std::string bytes;
};

/// Takes from one.
class Reader {
public:
  static constexpr bool kReads = true;

  explicit Reader(std::string_view bytes, std::uint32_t version = kVersion)
  : bytes_(bytes), version_(version)
  {}

  std::uint32_t version() const
  {
    return version_;
  }

  template <typename T>
  void value(T& x)
  {
    static_assert(std::is_arithmetic_v<T>);
    if (bytes_.size() < sizeof x)
      throw std::runtime_error("is cut short");
    std::memcpy(&x, bytes_.data(), sizeof x);
    bytes_.remove_prefix(sizeof x);
  }

  bool isAtEnd() const
  {
    return bytes_.empty();
  }

private:
  std::string_view bytes_;
  std::uint32_t version_;
};

// The same functions write and read, so that neither can forget what the other has.

template <typename Archive, typename Derived>
void
pass(Archive& archive, Eigen::PlainObjectBase<Derived>& matrix)
{
  for (Eigen::Index i = 0; i < matrix.size(); ++i)
    archive.value(matrix.data()[i]);
}

template <typename Archive, typename T, std::size_t n>
void
pass(Archive& archive, std::array<T, n>& values)
{
  for (T& value : values)
    archive.value(value);
}

template <typename Archive>
void
pass(Archive& archive, Pose& pose)
{
  pass(archive, pose.R);
  pass(archive, pose.c);
}

template <typename Archive>
void
pass(Archive& archive, PatchMapOptions& o)
{
  for (double* x : {&o.radius_m,
                    &o.association_radius,
                    &o.max_normal_angle_rad,
                    &o.gate_level,
                    &o.max_tilt_rad,
                    &o.max_uncertainty_rad,
                    &o.s3_floor_per_m2,
                    &o.s3_limit_per_m2,
                    &o.min_radius_m,
                    &o.max_depth_change,
                    &o.volume_radius_m,
                    &o.max_height_sigma_m})
    archive.value(*x);
  archive.value(o.max_views);
  archive.value(o.conflicts_to_replace);
  std::uint64_t waves = o.pattern.size();
  archive.value(waves);
  if (waves > kMostWaves)
    throw std::runtime_error("is damaged: its pattern has too many waves");
  o.pattern.resize(waves);
  for (PatternReach& wave : o.pattern) {
    archive.value(wave.variance);
    archive.value(wave.length);
  }
}

template <typename Archive>
void
pass(Archive& archive, JetFilter& filter)
{
  JetFilter::State state = filter.state();
  pass(archive, state.value);
  pass(archive, state.pattern);
  // Before, what third derivatives do was in the joint covariance, in doubles.
  constexpr std::uint32_t kFirstWithThird = 2;
  if (archive.version() >= kFirstWithThird) {
    pass(archive, state.joint.v);
    pass(archive, state.by_third);
    archive.value(state.s3_per_m2);
  }
  else {
    Packed<12> joint;
    pass(archive, joint.v);
    state.joint = Packed<12, float>::of(joint.matrix());
  }
  filter = JetFilter(state);
}

template <typename Archive>
void
pass(Archive& archive, MapPatch& patch)
{
  archive.value(patch.id);
  pass(archive, patch.anchor);
  pass(archive, patch.jet);
  archive.value(patch.radius_m);
  pass(archive, patch.moments);
  pass(archive, patch.moments_covariance);
  auto rows = patch.support.rows();
  pass(archive, rows);
  patch.support = SupportGrid::fromRows(rows);
  archive.value(patch.chi2);
  archive.value(patch.chi2_expected);
  archive.value(patch.chi2_per_roughness);
  pass(archive, patch.epoch_direction);
  archive.value(patch.epoch_depth_m);
  pass(archive, patch.epoch_kept);
  for (int* x : {&patch.views,
                 &patch.epochs,
                 &patch.conflicts,
                 &patch.last_seen,
                 &patch.taken_in})
    archive.value(*x);
  archive.value(patch.restarts);
}

template <typename Archive>
void
pass(Archive& archive, std::string& name)
{
  std::uint64_t size = name.size();
  archive.value(size);
  if (size > kLongestName)
    throw std::runtime_error("is damaged: a name has " + std::to_string(size) +
                             " letters");
  name.resize(size);
  for (char& letter : name)
    archive.value(letter);
}

template <typename Archive>
void
pass(Archive& archive, PatchMap::Snapshot& map)
{
  pass(archive, map.options);
  pass(archive, map.pose);
  archive.value(map.frames);
  archive.value(map.next_id);
  std::uint64_t count = map.patches.size();
  archive.value(count);
  if (count > kMostPatches)
    throw std::runtime_error("is damaged: it announces " + std::to_string(count) +
                             " patches");
  for (std::uint64_t i = 0; i < count; ++i) {
    // One by one: a count that is a lie must not take memory.
    if (Archive::kReads)
      map.patches.emplace_back();
    pass(archive, map.patches[i]);
  }
}

std::uint32_t
checksum(std::string_view bytes)
{
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

StoredMap
parsed(std::string_view bytes)
{
  if (bytes.substr(0, kSignature.size()) != kSignature) {
    const auto stranger = io::nameOfStranger(bytes);
    throw std::runtime_error(
        fmt::format("is {}, not a map of patches (holdfast map -o FILE.map)",
                    stranger ? *stranger : std::string_view("something else")));
  }
  bytes.remove_prefix(kSignature.size());
  Reader head(bytes);
  std::uint32_t version = 0;
  head.value(version);
  if (version > kVersion)
    throw std::runtime_error(
        fmt::format("is a map of version {}; this program reads up to {}",
                    version,
                    kVersion));
  std::uint32_t sum = 0;
  if (bytes.size() < sizeof version + sizeof sum)
    throw std::runtime_error("is cut short");
  const std::string_view body = bytes.substr(0, bytes.size() - sizeof sum);
  std::memcpy(&sum, body.data() + body.size(), sizeof sum);
  if (sum != checksum(body))
    throw std::runtime_error("is cut short or damaged: its checksum is another one");
  Reader reader(body.substr(sizeof version), version);
  std::string sensor;
  pass(reader, sensor);
  PatchMap::Snapshot snapshot;
  pass(reader, snapshot);
  if (!reader.isAtEnd())
    throw std::runtime_error("is damaged: there is something behind its patches");
  return {PatchMap(std::move(snapshot)), sensor};
}

} // namespace

void
writePatchMap(std::ostream& out, const StoredMap& stored)
{
  Writer writer;
  std::uint32_t version = kVersion;
  std::string sensor = stored.sensor.substr(0, kLongestName);
  PatchMap::Snapshot snapshot = stored.map.snapshot();
  writer.value(version);
  pass(writer, sensor);
  pass(writer, snapshot);
  writer.value(checksum(writer.bytes));
  out << kSignature << writer.bytes;
}

void
savePatchMap(const std::string& path, const StoredMap& stored)
{
  AtomicFile file(path);
  writePatchMap(file.stream(), stored);
  file.commit();
}

StoredMap
loadPatchMap(const std::string& path)
{
  try {
    return parsed(io::readBytes(path, "a map of patches").view());
  }
  catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

} // namespace holdfast
