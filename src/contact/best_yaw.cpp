#include "contact/best_yaw.h"

#include "contact/evaluation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <tuple>

namespace holdfast::contact {
namespace {

/// Differences of totals below it decide nothing: no foot is safer for them.
constexpr double kTotalStep = 1e-6;

double
stepsOf(double total)
{
  return std::round(total / kTotalStep);
}

/// A direction with enough support.
struct Direction {
  std::size_t index = 0;
  double support_share = 0.0;
  Range steps; ///< of the total
  std::optional<double> area; ///< where it was asked for
};

/// The best direction, of whose totals and areas only those are worked out which bounds
/// leave open.
class Choice {
public:
  Choice(Evaluation& evaluation, const std::vector<Sole>& soles)
  : evaluation_(evaluation), soles_(soles)
  {}

  /// \param open not empty
  std::size_t bestOf(std::vector<Direction>& open) const
  {
    std::sort(open.begin(), open.end(), [](const Direction& a, const Direction& b) {
      return std::tie(a.steps.low, a.index) < std::tie(b.steps.low, b.index);
    });
    Direction* best = nullptr;
    for (Direction& next : open) {
      if (best != nullptr && next.steps.low > best->steps.low)
        break; // so are all further ones
      settle(next);
      if (best == nullptr || isBetter(next, *best))
        best = &next;
    }
    return best->index;
  }

private:
  void settle(Direction& d) const
  {
    if (d.steps.low < d.steps.high)
      d.steps.low = d.steps.high =
          stepsOf(evaluation_.total(soles_[d.index], d.support_share));
  }

  double areaOf(Direction& d) const
  {
    if (!d.area)
      d.area = evaluation_.contactArea(soles_[d.index]);
    return *d.area;
  }

  bool isBetter(Direction& one, Direction& other) const
  {
    if (one.steps.low != other.steps.low)
      return one.steps.low < other.steps.low;
    const double a = areaOf(one), b = areaOf(other);
    return a != b ? a > b : one.index < other.index;
  }

  Evaluation& evaluation_;
  const std::vector<Sole>& soles_;
};

} // namespace

bool
isBetter(const ContactRisk& one, const ContactRisk& other)
{
  if (!one.quality || !other.quality)
    return one.quality.has_value() && !other.quality.has_value();
  const double a = stepsOf(one.quality->risk.total);
  const double b = stepsOf(other.quality->risk.total);
  return a != b ? a < b : one.quality->contact_area_m2 > other.quality->contact_area_m2;
}

ContactRisk
atBestYaw(const ContactSurface& surface,
          const std::vector<Sole>& soles,
          Placement& placement)
{
  Evaluation evaluation(surface, soles.front().foot(), placement);
  std::vector<Direction> open;
  std::size_t best = 0;
  double most_support = 0.0;
  for (std::size_t i = 0; i < soles.size() && evaluation.isFacingTheLoad(); ++i) {
    const double share = evaluation.supportShare(soles[i]);
    if (share > most_support) {
      most_support = share;
      best = i;
    }
    if (!evaluation.isEnough(share))
      continue;
    const Range total = evaluation.totalWithin(soles[i], share);
    open.push_back({i, share, {stepsOf(total.low), stepsOf(total.high)}, {}});
  }
  if (!open.empty())
    best = Choice(evaluation, soles).bestOf(open);
  placement.yaw += soles[best].turn();
  return evaluation.at(soles[best]);
}

} // namespace holdfast::contact
