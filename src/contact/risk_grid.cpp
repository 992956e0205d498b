#include <holdfast/contact/risk_grid.h>

#include "contact/best_yaw.h"
#include "contact/field.h"
#include "contact/require.h"
#include "parallel/parallel_for.h"
#include <holdfast/contact/foothold.h>
#include <holdfast/geometry/constants.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace holdfast {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kLayers = kRiskLayerNames.size();

/// A patch as the load meets it: over the grid's plane, about its anchor.
struct SeenFromAbove {
  const ContactSurface* patch = nullptr;
  Pose load; ///< frame of the load at the middle of its support
  Pose to_anchor; ///< from that frame
  JetVector jet = JetVector::Zero(); ///< in that frame
  double reach_m = 0.0; ///< of its support from there
};

std::optional<SeenFromAbove>
seenFromAbove(const ContactSurface& patch, const Eigen::Matrix3d& axes)
{
  const auto middle = middleOfSupport(patch);
  if (!middle)
    return std::nullopt;
  SeenFromAbove seen;
  seen.patch = &patch;
  seen.load = {axes, *middle};
  const Pose from_anchor = patch.anchor.inverse() * seen.load;
  const auto moved = movedJet(patch.jet.value, from_anchor);
  if (!moved || !moved->value.allFinite())
    return std::nullopt;
  seen.to_anchor = from_anchor;
  seen.jet = moved->value;
  const double corner = std::sqrt(2.0) * SupportGrid::kReach * patch.radius_m;
  seen.reach_m = corner + (*middle - patch.anchor.c).norm();
  return seen;
}

/// Nothing where the patch was not seen over that place.
struct Sighting {
  double elevation = 0.0; ///< in the axes of the grid
  double distance = 0.0; ///< from the anchor, in radii
};

std::optional<Sighting>
sightingAt(const SeenFromAbove& seen, const Eigen::Vector2d& place)
{
  const Eigen::Vector3d origin = seen.load.R.transpose() * seen.load.c;
  const Eigen::Vector2d p = place - origin.head<2>();
  const double height = jetBasis(p.x(), p.y()).dot(seen.jet);
  const Eigen::Vector3d q =
      seen.to_anchor.toWorld({p.x(), p.y(), height}) / seen.patch->radius_m;
  if (!seen.patch->support.contains(q.x(), q.y()))
    return std::nullopt;
  return Sighting{origin.z() + height, q.head<2>().norm()};
}

/// The patch of a cell: the highest, and of those that lie with it the nearest.
class CellChoice {
public:
  void offer(const ContactSurface* patch, const Sighting& sighting)
  {
    if (patch_ == nullptr || isBetter(*patch, sighting)) {
      patch_ = patch;
      best_ = sighting;
    }
  }

  const ContactSurface* patch() const
  {
    return patch_;
  }
  double elevation() const
  {
    return best_.elevation;
  }

private:
  bool isBetter(const ContactSurface& patch, const Sighting& sighting) const
  {
    // Two patches of one surface differ by much less than that, two storeys by more.
    const double same = 0.25 * std::min(patch.radius_m, patch_->radius_m);
    const double higher = sighting.elevation - best_.elevation;
    return std::abs(higher) > same ? higher > 0.0 : sighting.distance < best_.distance;
  }

  const ContactSurface* patch_ = nullptr;
  Sighting best_;
};

GridBounds
boundsOf(const std::vector<SeenFromAbove>& patches)
{
  constexpr double kFar = std::numeric_limits<double>::max();
  GridBounds bounds{Eigen::Vector2d::Constant(kFar), Eigen::Vector2d::Constant(-kFar)};
  for (const SeenFromAbove& seen : patches)
    for (int row = 0; row < SupportGrid::kCells; ++row)
      for (int column = 0; column < SupportGrid::kCells; ++column)
        if (seen.patch->support.isSet(column, row)) {
          const double radius = seen.patch->radius_m;
          const Eigen::Vector2d p(radius * SupportGrid::middle(column),
                                  radius * SupportGrid::middle(row));
          const double height = jetBasis(p.x(), p.y()).dot(seen.patch->jet.value);
          const Eigen::Vector3d at = seen.load.R.transpose() *
                                     seen.patch->anchor.toWorld({p.x(), p.y(), height});
          bounds.low = bounds.low.cwiseMin(at.head<2>());
          bounds.high = bounds.high.cwiseMax(at.head<2>());
        }
  return patches.empty() ? GridBounds() : bounds;
}

/// An empty grid over the bounds, its cells on multiples of the resolution.
RiskGrid
emptyGrid(const GridBounds& bounds, const Eigen::Matrix3d& axes, double resolution)
{
  const Eigen::Array2d low = (bounds.low / resolution).array().floor();
  const Eigen::Array2d size =
      ((bounds.high / resolution).array().ceil() - low).max(Eigen::Array2d::Zero());
  if (!(size.x() * size.y() <= kMaxRiskGridCells))
    throw std::invalid_argument(
        "holdfast::riskGrid: a grid of that resolution and these bounds would have "
        "more than " +
        std::to_string(kMaxRiskGridCells / 1'000'000) + " million cells");
  RiskGrid grid;
  grid.rows = static_cast<int>(size.x());
  grid.columns = static_cast<int>(size.y());
  grid.info.resolution_m = resolution;
  grid.info.length_x_m = size.x() * resolution;
  grid.info.length_y_m = size.y() * resolution;
  grid.info.position.head<2>() = resolution * (low + 0.5 * size);
  grid.info.axes = axes;
  grid.layers.assign(kRiskLayerNames.begin(), kRiskLayerNames.end());
  grid.basic_layers = {std::string(kRiskLayerNames[0])};
  const auto cells =
      static_cast<std::size_t>(grid.rows) * static_cast<std::size_t>(grid.columns);
  grid.data.assign(kLayers, std::vector<float>(cells, kNaN));
  return grid;
}

/// Which patch each cell is of, in the order of the data.
std::vector<CellChoice>
choicesOf(const RiskGrid& grid, const std::vector<SeenFromAbove>& patches)
{
  std::vector<CellChoice> choices(static_cast<std::size_t>(grid.rows) *
                                  static_cast<std::size_t>(grid.columns));
  const Eigen::Vector2d top =
      grid.info.position.head<2>() +
      0.5 * Eigen::Vector2d(grid.info.length_x_m, grid.info.length_y_m);
  const auto indexOf = [&](double from_top, int size) {
    const double index = std::floor(from_top / grid.info.resolution_m);
    return static_cast<int>(std::clamp(index, -1.0, static_cast<double>(size)));
  };
  for (const SeenFromAbove& seen : patches) {
    const Eigen::Vector2d at = (grid.info.axes.transpose() * seen.load.c).head<2>();
    const Eigen::Vector2d d = top - at;
    const int first_row = std::max(indexOf(d.x() - seen.reach_m, grid.rows), 0);
    const int last_row =
        std::min(indexOf(d.x() + seen.reach_m, grid.rows), grid.rows - 1);
    const int first_column = std::max(indexOf(d.y() - seen.reach_m, grid.columns), 0);
    const int last_column =
        std::min(indexOf(d.y() + seen.reach_m, grid.columns), grid.columns - 1);
    for (int column = first_column; column <= last_column; ++column)
      for (int row = first_row; row <= last_row; ++row)
        if (const auto sighting = sightingAt(seen, grid.position(row, column)))
          choices[static_cast<std::size_t>(column * grid.rows + row)].offer(seen.patch,
                                                                            *sighting);
  }
  return choices;
}

/// One value of each layer.
using Cell = std::array<float, kLayers>;

void
set(Cell& cell, RiskLayer layer, double value)
{
  cell[static_cast<std::size_t>(layer)] = static_cast<float>(value);
}

/// Height, normal and curvature of the surface at the load's origin.
void
setSurface(const contact::Field& field, double plane, Cell& cell)
{
  const Eigen::Vector2d g = field.mean.segment<2>(1);
  const double s = std::sqrt(1.0 + g.squaredNorm());
  Eigen::Matrix2d H;
  H << field.mean[3], field.mean[4], field.mean[4], field.mean[5];
  // W = (I + g g^T)^-1 H / s has the principal curvatures as eigenvalues; mean and
  // product of them are half its trace and its determinant.
  const Eigen::Matrix2d W =
      (Eigen::Matrix2d::Identity() + g * g.transpose()).inverse() * H / s;
  const double mean = 0.5 * W.trace();
  const double half = std::sqrt(std::max(0.0, mean * mean - W.determinant()));
  const Eigen::Matrix2d slope = field.slopeCovariance();
  const double largest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(slope).eigenvalues()[1];
  set(cell, RiskLayer::Elevation, plane + field.mean[0]);
  set(cell, RiskLayer::ElevationSigma, field.factor.row(0).norm());
  set(cell, RiskLayer::NormalX, -g.x() / s);
  set(cell, RiskLayer::NormalY, -g.y() / s);
  set(cell, RiskLayer::NormalZ, 1.0 / s);
  set(cell, RiskLayer::SlopeSigma, std::sqrt(std::max(0.0, largest)));
  set(cell, RiskLayer::CurvatureMin, mean - half);
  set(cell, RiskLayer::CurvatureMax, mean + half);
}

void
setRisk(const ContactRisk& risk, double yaw, Cell& cell)
{
  set(cell, RiskLayer::RiskSupport, 1.0 - risk.support_share);
  if (!risk.quality)
    return;
  set(cell, RiskLayer::RiskSlip, risk.quality->risk.slip);
  set(cell, RiskLayer::RiskGap, risk.quality->risk.gap);
  set(cell, RiskLayer::RiskTotal, risk.quality->risk.total);
  set(cell, RiskLayer::ContactArea, risk.quality->contact_area_m2);
  set(cell, RiskLayer::YawBest, std::remainder(yaw, 2.0 * kPi));
}

/// What a cell of the grid says, over the surface its patch has there.
Cell
cellAt(const ContactSurface& surface,
       const Eigen::Vector3d& in_grid,
       const std::vector<contact::Sole>& soles,
       const RiskGridOptions& options)
{
  Cell cell;
  cell.fill(kNaN);
  Placement placement;
  placement.load_direction = options.load_direction;
  Pose load = loadFrame(placement);
  load.c = load.R * in_grid;
  const auto field = contact::fieldAt(surface, load);
  if (!field)
    return cell;
  setSurface(*field, in_grid.z(), cell);
  // The sole is planned where the surface is expected.
  placement.point = load.toWorld({0.0, 0.0, field->mean[0]});
  const ContactRisk risk = contact::atBestYaw(surface, soles, placement);
  setRisk(risk, placement.yaw, cell);
  return cell;
}

} // namespace

std::string
validityError(const RiskGridOptions& options)
{
  if (!std::isfinite(options.resolution_m) || options.resolution_m <= 0.0)
    return "the resolution must be > 0";
  if (options.bounds &&
      !(options.bounds->low.allFinite() && options.bounds->high.allFinite() &&
        (options.bounds->low.array() < options.bounds->high.array()).all()))
    return "the bounds must be finite, the low ones below the high ones";
  FootholdOptions same;
  same.load_direction = options.load_direction;
  same.yaws = options.yaws;
  same.threads = options.threads;
  return validityError(same);
}

Eigen::Vector2d
RiskGrid::position(int row, int column) const
{
  const Eigen::Vector2d half(0.5 * info.length_x_m, 0.5 * info.length_y_m);
  return info.position.head<2>() + half -
         info.resolution_m * Eigen::Vector2d(row + 0.5, column + 0.5);
}

Eigen::Vector3d
RiskGrid::point(int row, int column) const
{
  Eigen::Vector3d point;
  point << position(row, column),
      static_cast<double>(at(RiskLayer::Elevation, row, column));
  return info.axes * point;
}

RiskGrid
riskGrid(const PatchMap& map, const Foot& foot, const RiskGridOptions& options)
{
  contact::requireValid("riskGrid", validityError(foot));
  contact::requireValid("riskGrid", validityError(options));
  const std::vector<contact::Sole> soles =
      contact::inAllDirections(contact::Sole(foot), options.yaws);
  Placement level;
  level.load_direction = options.load_direction;
  const Eigen::Matrix3d axes = loadFrame(level).R;
  const SurfacePrior prior = surfacePriorOf(map, options.load_direction);
  std::vector<ContactSurface> surfaces;
  for (const MapPatch& patch : map.patches())
    surfaces.push_back(contactSurfaceOf(map, patch, prior));
  std::vector<SeenFromAbove> patches;
  for (const ContactSurface& surface : surfaces)
    if (const auto seen = seenFromAbove(surface, axes))
      patches.push_back(*seen);
  RiskGrid grid =
      emptyGrid(options.bounds.value_or(boundsOf(patches)), axes, options.resolution_m);
  const std::vector<CellChoice> choices = choicesOf(grid, patches);
  parallelFor(grid.columns, options.threads, [&](int column, int) {
    for (int row = 0; row < grid.rows; ++row) {
      const auto index = static_cast<std::size_t>(column * grid.rows + row);
      const CellChoice& choice = choices[index];
      if (choice.patch() == nullptr)
        continue;
      Eigen::Vector3d in_grid;
      in_grid << grid.position(row, column), choice.elevation();
      const Cell cell = cellAt(*choice.patch(), in_grid, soles, options);
      for (std::size_t layer = 0; layer < kLayers; ++layer)
        grid.data[layer][index] = cell[layer];
    }
  });
  return grid;
}

} // namespace holdfast
