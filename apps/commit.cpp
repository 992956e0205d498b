#include "commit.h"

#include <holdfast/version.h>

namespace holdfast::app {

std::string
versionWithCommit()
{
  const std::string version = HOLDFAST_VERSION, from = commit();
  return from.empty() ? version : version + " (" + from + ")";
}

} // namespace holdfast::app
