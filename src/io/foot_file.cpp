#include "built_in_files.h"
#include "one_line.h"
#include "yaml_section.h"
#include <holdfast/contact/names.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/io/foot_file.h>

#include <cmath>

namespace holdfast {
namespace {

using io::Section;

/// A regular polygon of the area of a disc.
std::vector<Eigen::Vector2d>
discOf(double radius_m)
{
  constexpr int kCorners = 12;
  const double turn = 2.0 * kPi / kCorners;
  const double reach = radius_m * std::sqrt(turn / std::sin(turn));
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < kCorners; ++i)
    corners.emplace_back(reach * std::cos(i * turn), reach * std::sin(i * turn));
  return corners;
}

/// One of the three ways to say it, and no other beside it.
std::vector<Eigen::Vector2d>
readSole(Section section)
{
  std::string chosen;
  for (const char* name : {"corners_m", "radius_m", "length_m", "width_m"}) {
    if (!section.has(name))
      continue;
    if (chosen.empty())
      chosen = name;
    else if (chosen != "length_m")
      section.fail(name,
                   "goes without " + chosen +
                       ": a sole is corners_m, radius_m, or length_m and width_m");
  }
  std::vector<Eigen::Vector2d> sole;
  if (section.has("corners_m"))
    sole = section.points("corners_m");
  else if (section.has("radius_m"))
    sole = discOf(section.positive("radius_m"));
  else {
    const double length = section.positive("length_m");
    sole = rectangularFoot(length, section.positive("width_m")).sole;
  }
  section.rejectUnknown();
  return sole;
}

Eigen::Vector2d
readCurvature(Section section)
{
  Eigen::Vector2d curvature;
  curvature.x() = section.number("x_per_m");
  curvature.y() = section.number("y_per_m");
  section.rejectUnknown();
  return curvature;
}

Ankle
readAnkle(Section& section)
{
  const std::string word = section.text("ankle");
  const auto ankle = kAnkleNames.find(word);
  if (!ankle)
    section.fail("ankle", "must be compliant or stiff, not " + io::oneLine(word));
  return *ankle;
}

Friction
readFriction(Section section)
{
  Friction friction;
  friction.mean = section.positive("mean");
  friction.sigma = section.number("sigma");
  if (friction.sigma < 0.0)
    section.fail("sigma", "must be >= 0");
  if (friction.sigma > friction.mean)
    section.fail("sigma", "must not be above the mean");
  section.rejectUnknown();
  return friction;
}

ContactTolerances
readTolerances(Section section, Ankle ankle)
{
  ContactTolerances tolerances;
  tolerances.height_m = section.positive("height_m");
  tolerances.gap_m = section.positive("gap_m");
  tolerances.contact_m = section.positive("contact_m");
  if (tolerances.contact_m > tolerances.gap_m)
    section.fail("contact_m",
                 "must not be above gap_m: what is in contact would be too far");
  if (ankle == Ankle::Stiff)
    tolerances.tilt_rad = section.positive("tilt_rad");
  else if (section.has("tilt_rad"))
    section.fail("tilt_rad", "goes with ankle: stiff; a compliant one tilts freely");
  if (section.has("min_support")) {
    tolerances.min_support = section.positive("min_support");
    if (tolerances.min_support > 1.0)
      section.fail("min_support", "must be a share, at most 1");
  }
  section.rejectUnknown();
  return tolerances;
}

} // namespace

Foot
loadFoot(const std::string& name_or_path)
{
  Section root = io::loadYaml(io::findBuiltIn("foot", "feet", name_or_path));
  Foot foot;
  foot.name = root.text("name");
  foot.sole = readSole(root.section("sole"));
  if (const std::string error = validityError(foot); !error.empty())
    root.fail("sole", "makes no sense: " + error); // all else is as it was made
  if (root.has("curvature"))
    foot.curvature = readCurvature(root.section("curvature"));
  foot.ankle = readAnkle(root);
  foot.friction = readFriction(root.section("friction"));
  foot.tolerances = readTolerances(root.section("tolerances"), foot.ankle);
  root.rejectUnknown();
  if (const std::string error = validityError(foot); !error.empty())
    root.fail("tolerances", "make no sense: " + error);
  return foot;
}

std::vector<std::string>
listFeet()
{
  return io::listBuiltIn("feet");
}

} // namespace holdfast
