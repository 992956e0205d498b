/// \file What may be wrong with a frame, and how often that is said.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace holdfast::robot {

enum class Trouble : std::uint8_t {
  Unreadable, ///< the message is no cloud or depth image
  NoValidPoint,
  WrongFrame, ///< the points are not where the sensor can see
  MissingTransform,
  TimeJump,
  Lost, ///< where the sensor is in the map was not found
  Unusable ///< whatever else the library says
};

inline constexpr std::size_t kTroubles = 7;

/// Why a frame has no patches.
class FrameError : public std::runtime_error {
public:
  FrameError(Trouble kind, const std::string& what)
  : std::runtime_error(what), trouble(kind)
  {}

  Trouble trouble;
};

/// Says each kind of trouble once in a while, and how often it was not said.
class TroubleThrottle {
public:
  using Clock = std::chrono::steady_clock;

  explicit TroubleThrottle(Clock::duration period) : period_(period) {}

  /// \return the line to print, or nothing where the last one was less than a period
  /// ago.
  std::optional<std::string> pass(Trouble trouble,
                                  const std::string& text,
                                  Clock::time_point now = Clock::now());

private:
  struct Past {
    std::optional<Clock::time_point> said;
    std::uint64_t not_said = 0;
  };

  Clock::duration period_;
  std::array<Past, kTroubles> past_;
};

} // namespace holdfast::robot
