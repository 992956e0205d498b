#include <holdfast/pcl/print.h>

#include <holdfast/fit/names.h>
#include <holdfast/patch/names.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/validation/names.h>

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <locale>
#include <ostream>
#include <sstream>
#include <stdexcept>

namespace holdfast {

namespace {

/// Text with the number format of another stream, in the C locale: a decimal comma
/// would run into those of the vectors.
class Line {
public:
  explicit Line(const std::ostream& like)
  {
    text_.copyfmt(like);
    text_.exceptions(std::ios::goodbit);
    text_.imbue(std::locale::classic());
    text_.width(0);
  }

  template <typename T>
  Line& operator<<(const T& value)
  {
    text_ << value;
    return *this;
  }

  template <typename Vector>
  Line& vector(const Vector& v)
  {
    text_ << '(';
    for (Eigen::Index i = 0; i < v.size(); ++i)
      text_ << (i == 0 ? "" : ", ") << v[i];
    text_ << ')';
    return *this;
  }

  std::string str() const
  {
    return text_.str();
  }

private:
  std::ostringstream text_;
};

template <typename Counts, typename Name>
void
list(const Counts& counts, const char* title, Name&& name, Line& line)
{
  if (counts.empty())
    return;
  line << title;
  const char* separator = " ";
  for (const auto& [reason, count] : counts) {
    line << separator << name(reason) << ' ' << count;
    separator = ", ";
  }
}

} // namespace

std::ostream&
operator<<(std::ostream& out, const Patch& patch)
{
  Line line(out);
  line << kSurfaceNames.of(patch.type.surface) << ' '
       << kBoundaryNames.of(patch.type.boundary) << " at ";
  line.vector(patch.c) << " m, normal ";
  line.vector(patch.normal());
  if (patch.type.surface != SurfaceType::Plane) {
    line << ", curvatures ";
    line.vector(patch.principalCurvatures()) << " /m";
  }
  return out << line.str();
}

std::ostream&
operator<<(std::ostream& out, const ExtractedPatch& patch)
{
  Line line(out);
  const FitResult& fit = patch.fit;
  if (!isUsable(fit.status))
    line << "no patch: " << kStatusNames.of(fit.status);
  else if (!isAccepted(patch))
    line << "no patch: " << kVerdictNames.of(patch.validation->verdict);
  else
    line << fit.patch << ", sigma " << centreSigma(fit, fit.patch.normal())
         << " m, chi2 " << chi2PerDof(fit) << ", " << fit.points << " points";
  return out << line.str();
}

std::ostream&
operator<<(std::ostream& out, const PatchPoint& point)
{
  try {
    return out << toExtractedPatch(point);
  }
  catch (const std::invalid_argument&) {
    return out << "no patch of a known type";
  }
}

std::ostream&
operator<<(std::ostream& out, const ExtractionResult& result)
{
  Line line(out);
  const auto accepted =
      std::count_if(result.patches.begin(), result.patches.end(), isAccepted);
  line << accepted << (accepted == 1 ? " patch of " : " patches of ")
       << result.points.used << " points";
  if (!result.sensor.name.empty())
    line << " by " << result.sensor.name;
  list(
      result.rejected,
      "; no fit:",
      [](FitStatus s) { return kStatusNames.of(s); },
      line);
  list(
      result.turned_down,
      "; turned down:",
      [](PatchVerdict v) { return kVerdictNames.of(v); },
      line);
  return out << line.str();
}

std::ostream&
operator<<(std::ostream& out, const RangeCloud& cloud)
{
  if (!cloud.points)
    return out << "no points";
  Line line(out);
  const auto valid =
      std::count_if(cloud.points->begin(),
                    cloud.points->end(),
                    [](const pcl::PointXYZ& point) { return pcl::isFinite(point); });
  line << cloud.points->width << " x " << cloud.points->height << " points, "
       << (cloud.points->height > 1 ? "organized, " : "") << valid << " valid"
       << (cloud.hasCovariances() ? ", with covariances" : "") << ", seen from ";
  line.vector(cloud.sensor_pose.c);
  return out << line.str();
}

} // namespace holdfast
