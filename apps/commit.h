/// \file Which commit the program was built from.
#pragma once

#include <string>

namespace holdfast::app {

/// As `git describe --long` says it, v0.1.0-3-g1234567890, or the abbreviated commit
/// where no version is tagged; with a "+" when files differed from it. Empty where
/// there was neither a repository nor an archive of one.
std::string commit();

/// "0.1.0 (v0.1.0-3-g1234567890)", or without commit.
std::string versionWithCommit();

} // namespace holdfast::app
