/// \file The pattern of a camera as other poses show it than the one it is tested on.
#pragma once

#include "recordings.h"

#include <string>
#include <vector>

namespace holdfast::app {

/// The number of each recording's pose, from 0. Recordings are of one pose where their
/// planes lie closer together, in all pixels that see both, than the sigma of a single
/// point: then they share what is bent or uneven in the plane itself.
std::vector<int> posesOf(const std::vector<RecordedCloud>& recordings);

/// Gives each recording the pattern that calibratePattern() finds in the recordings of
/// all other poses; white noise stays that of the sensor.
/// \param remarks is told which.
/// \throw std::runtime_error when all are of one pose, differ in size, or show none.
void usePatternsOfOtherPoses(std::vector<RecordedCloud>& recordings,
                             std::vector<std::string>& remarks);

/// "0.101 px exponential over 1.6 px, 0.089 px gaussian over 56 px", or "none".
std::string patternText(const NoisePattern& pattern);

} // namespace holdfast::app
