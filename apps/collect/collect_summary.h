/// \file What a data set holds, in a few numbers.
#pragma once

#include "columns/column_file.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>

namespace holdfast::app {

/// Sums over patches as they pass by.
class CollectSummary {
public:
  void add(const CloudRow& cloud);
  void add(const PatchRow& patch);
  void add(const FailedCloud& failed);

  /// A table for people. \param bytes of the file.
  std::string table(const std::string& path, std::uint64_t bytes) const;

  /// The same, and what fingerprints there are, as one JSON object and a newline.
  std::string json(const std::string& path, std::uint64_t bytes) const;

  /// Of how many kinds of options, versions or sensors the clouds are.
  std::size_t fingerprints() const
  {
    return fingerprints_.size();
  }

private:
  struct Sums {
    std::uint64_t patches = 0;
    double points = 0.0;
    double chi2_ratio = 0.0;
    std::uint64_t with_chi2 = 0;
    double coverage = 0.0;
    std::uint64_t with_coverage = 0;
  };

  std::uint64_t clouds_ = 0;
  std::uint64_t failed_ = 0;
  std::uint64_t patches_ = 0;
  std::array<Sums, kSurfaceTraits.size()> surfaces_{};
  std::map<std::string, std::uint64_t> fingerprints_; ///< clouds of each
};

} // namespace holdfast::app
