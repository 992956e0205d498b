/// \file Which commit the program was built from.
#pragma once

#include <string>

namespace holdfast::app {

/// Abbreviated, with a "+" when files differed from it; empty where there was no
/// repository.
std::string commit();

/// "0.1.0 (1234567890)", or without commit.
std::string versionWithCommit();

} // namespace holdfast::app
