/// \file A list of clouds, and the part of it that is one process's own.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast::app {

/// A cloud of a manifest.
struct ManifestEntry {
  std::string path;
  std::string name; ///< of its results: NAME.patches.json
};

/// Reads one cloud per line: its path, relative to the current folder as on the command
/// line, and behind a tab a name for its results where that of the file will not do.
/// Empty lines and those that begin with # say nothing.
/// \throw std::runtime_error "FILE: cause" when it cannot be read, lists nothing, has a
/// name that is no file name, or one name twice.
std::vector<ManifestEntry> readManifest(const std::string& path);

/// One of so many parts. 0 <= index < count.
struct Shard {
  std::size_t index = 0;
  std::size_t count = 1;
};

/// "I/N", 1 <= I <= N; nothing for another text.
std::optional<Shard> parseShard(std::string_view text);

/// True when a cloud of this name belongs to the shard: exactly one of `count` shards,
/// and always the same one, whatever else is listed.
bool isOf(const Shard& shard, std::string_view name);

/// The entries of a shard, in their order.
std::vector<ManifestEntry> shardOf(const std::vector<ManifestEntry>& entries,
                                   const Shard& shard);

} // namespace holdfast::app
