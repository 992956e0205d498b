/// \file What a cloud of a manifest leaves in the output folder.
#pragma once

#include "fit_settings.h"

#include <holdfast/io/patch_io.h>

#include <string>

namespace holdfast::app {

/// What there is of a cloud.
enum class CloudState : std::uint8_t {
  Open, ///< nothing, a part, or what was made otherwise
  Done, ///< results
  Failed ///< a record of why there are none
};

/// The files of one name in one folder, of which there is one kind at a time: results
/// in one of the formats, or a record of failure.
class BatchFiles {
public:
  BatchFiles(const std::string& folder, const std::string& name, BatchFormat format);

  /// As far as it was made with what the fingerprint stands for.
  CloudState state(const std::string& fingerprint) const;

  /// Writes the results. \throw std::runtime_error "PATH: cause".
  void write(const PatchReport& report) const;

  /// Writes a record instead. \param reason one line. \throw as write().
  void writeFailure(const std::string& cloud,
                    const std::string& fingerprint,
                    const std::string& reason) const;

  /// Removes what a process that was killed between writing one kind and removing the
  /// other may have left beside the results.
  void keepResults() const;

private:
  std::string path(const char* ending) const;
  bool hasResults(const std::string& fingerprint) const;
  void removeOthers(const std::vector<const char*>& endings) const;

  std::string folder_;
  std::string name_;
  BatchFormat format_;
};

} // namespace holdfast::app
