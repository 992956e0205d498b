#include "core/trouble.h"

#include <fmt/core.h>

namespace holdfast::robot {

std::optional<std::string>
TroubleThrottle::pass(Trouble trouble, const std::string& text, Clock::time_point now)
{
  Past& past = past_.at(static_cast<std::size_t>(trouble));
  if (past.said && now - *past.said < period_) {
    ++past.not_said;
    return std::nullopt;
  }
  std::string line = text;
  if (past.not_said > 0)
    line += fmt::format(" ({} more like this since it was last said)", past.not_said);
  past = {now, 0};
  return line;
}

} // namespace holdfast::robot
