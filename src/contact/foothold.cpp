#include <holdfast/contact/foothold.h>

#include "contact/best_yaw.h"
#include "contact/require.h"
#include "parallel/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace holdfast {
namespace {

/// Distance of the farthest cell that was hit from the middle of all, m.
double
supportReach(const MapPatch& patch, const Eigen::Vector2d& middle)
{
  double reach = 0.0;
  for (int row = 0; row < SupportGrid::kCells; ++row)
    for (int column = 0; column < SupportGrid::kCells; ++column)
      if (patch.support.isSet(column, row)) {
        const Eigen::Vector2d cell(SupportGrid::middle(column),
                                   SupportGrid::middle(row));
        reach = std::max(reach, (cell - middle).norm());
      }
  return patch.radius_m * (reach + 0.5 * SupportGrid::cellSize());
}

/// In the plane of the anchor, in radii.
std::optional<Eigen::Vector2d>
middleInPlane(const SupportGrid& support)
{
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int cells = 0;
  for (int row = 0; row < SupportGrid::kCells; ++row)
    for (int column = 0; column < SupportGrid::kCells; ++column)
      if (support.isSet(column, row)) {
        sum += Eigen::Vector2d(SupportGrid::middle(column), SupportGrid::middle(row));
        ++cells;
      }
  if (cells == 0)
    return std::nullopt;
  return Eigen::Vector2d(sum / cells);
}

Foothold
tried(const MapPatch& patch,
      const ContactSurface& surface,
      const std::vector<contact::Sole>& soles,
      const FootholdOptions& options)
{
  Foothold foothold;
  foothold.patch = patch.id;
  foothold.views = patch.epochs;
  foothold.last_seen = patch.last_seen;
  foothold.placement.load_direction = options.load_direction;
  const auto middle = middleOfSupport(surface);
  if (!middle)
    return foothold;
  foothold.placement.point = *middle;
  foothold.risk = contact::atBestYaw(surface, soles, foothold.placement);
  return foothold;
}

/// Keeps the best that are far enough from all better ones. \param sorted best first
void
keepApart(const std::vector<const Foothold*>& sorted,
          const FootholdOptions& options,
          FootholdRanking& ranking)
{
  const double spacing = options.spacing_m * options.spacing_m;
  std::vector<Foothold>& kept = ranking.footholds;
  for (const Foothold* foothold : sorted) {
    const Eigen::Vector3d& point = foothold->placement.point;
    const bool is_near =
        std::any_of(kept.begin(), kept.end(), [&](const Foothold& better) {
          return (better.placement.point - point).squaredNorm() < spacing;
        });
    if (is_near)
      ++ranking.too_near;
    else if (kept.size() >= static_cast<std::size_t>(options.max_footholds))
      ++ranking.beyond_limit;
    else
      kept.push_back(*foothold);
  }
}

} // namespace

std::string
validityError(const FootholdOptions& options)
{
  Placement along_load;
  along_load.load_direction = options.load_direction;
  if (const std::string error = validityError(along_load); !error.empty())
    return error;
  if (options.yaws < 1)
    return "at least one yaw must be tried";
  if (!std::isfinite(options.spacing_m) || options.spacing_m < 0.0)
    return "the spacing of footholds must not be negative";
  if (options.max_footholds < 1)
    return "at least one foothold must be asked for";
  return options.threads >= 0 ? "" : "the number of threads must not be negative";
}

std::optional<Eigen::Vector3d>
middleOfSupport(const ContactSurface& surface)
{
  const auto middle = middleInPlane(surface.support);
  if (!middle)
    return std::nullopt;
  const Eigen::Vector2d p = surface.radius_m * *middle;
  return surface.anchor.toWorld({p.x(), p.y(), surface.jet.height(p.x(), p.y())});
}

FootholdRanking
rankFootholds(const PatchMap& map, const Foot& foot, const FootholdOptions& options)
{
  contact::requireValid("rankFootholds", validityError(foot));
  contact::requireValid("rankFootholds", validityError(options));
  const std::vector<contact::Sole> soles =
      contact::inAllDirections(contact::Sole(foot), options.yaws);
  const SurfacePrior prior = surfacePriorOf(map, options.load_direction);
  const std::vector<MapPatch>& patches = map.patches();
  FootholdRanking ranking;
  ranking.candidates = static_cast<int>(patches.size());
  ranking.tried.resize(patches.size());
  parallelFor(ranking.candidates, options.threads, [&](int item, int) {
    const auto i = static_cast<std::size_t>(item);
    const ContactSurface surface = contactSurfaceOf(map, patches[i], prior);
    ranking.tried[i] = tried(patches[i], surface, soles, options);
  });

  std::vector<const Foothold*> possible;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const ContactRisk& risk = ranking.tried[i].risk;
    const auto middle = middleInPlane(patches[i].support);
    if (middle)
      ranking.widest_support_m =
          std::max(ranking.widest_support_m, supportReach(patches[i], *middle));
    if (!middle)
      ++ranking.unseen;
    else if (risk.status == ContactStatus::NotFacingTheLoad)
      ++ranking.not_facing;
    else if (!risk.quality)
      ++ranking.without_support;
    else
      possible.push_back(&ranking.tried[i]);
  }
  std::stable_sort( // patches of equal rank stay in the order of their ids
      possible.begin(),
      possible.end(),
      [](const Foothold* a, const Foothold* b) {
        return contact::isBetter(a->risk, b->risk);
      });
  keepApart(possible, options, ranking);
  return ranking;
}

ContactRisk
bestYaw(const ContactSurface& surface, const Foot& foot, Placement& placement, int yaws)
{
  if (const std::string error = validityError(placement); !error.empty())
    throw std::invalid_argument("holdfast::bestYaw: " + error);
  if (yaws < 1)
    throw std::invalid_argument("holdfast::bestYaw: at least one yaw must be tried");
  return contact::atBestYaw(surface,
                            contact::inAllDirections(contact::Sole(foot), yaws),
                            placement);
}

} // namespace holdfast
