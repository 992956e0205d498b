#include <holdfast/uncertainty/covariance_mode.h>
#include <holdfast/uncertainty/names.h>

namespace holdfast {

std::string_view
covarianceModeName(CovarianceMode mode)
{
  return kCovarianceModeNames.of(mode);
}

} // namespace holdfast
