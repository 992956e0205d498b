#include <holdfast/uncertainty/covariance_mode.h>

namespace holdfast {

std::string_view
covarianceModeName(CovarianceMode mode)
{
  switch (mode) {
  case CovarianceMode::Exact:
    return "exact";
  case CovarianceMode::GaussNewton:
    return "gauss_newton";
  case CovarianceMode::SecondOrder:
    return "second_order";
  case CovarianceMode::Stagewise:
    return "stagewise";
  case CovarianceMode::MonteCarlo:
    return "monte_carlo";
  }
  return "unknown";
}

} // namespace holdfast
