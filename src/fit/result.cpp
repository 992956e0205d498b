#include <holdfast/fit/names.h>
#include <holdfast/fit/result.h>

namespace holdfast {

std::string_view
statusName(FitStatus status)
{
  return kStatusNames.of(status);
}

bool
isUsable(FitStatus status)
{
  return status == FitStatus::Converged || status == FitStatus::AxisNotObservable ||
         status == FitStatus::CurvatureNotObservable;
}

} // namespace holdfast
