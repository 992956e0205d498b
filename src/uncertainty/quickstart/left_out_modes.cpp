// In place of the covariance modes that HOLDFAST_QUICKSTART leaves out.
#include "uncertainty/second_order.h"
#include "uncertainty/stagewise.h"

#include <stdexcept>

namespace holdfast {
namespace {

[[noreturn]] void
refuse(const char* mode)
{
  throw std::invalid_argument(std::string("the covariance mode ") + mode +
                              " is not in this build (HOLDFAST_QUICKSTART)");
}

} // namespace

ParameterMatrix
stagewiseCovariance(const PatchFit&, const PointBatch&, const FitOptions&)
{
  refuse("stagewise");
}

SecondOrderTerms
secondOrderTerms(const PatchFit&,
                 const PatchFitter&,
                 const Eigen::Vector3d&,
                 const Eigen::Matrix<double, JointLayout::kSize, JointLayout::kSize>&)
{
  refuse("second_order");
}

} // namespace holdfast
