/// \file The waves that a Kinect's pixels share, as measured on recorded tables.
#pragma once

#include <holdfast/noise_pattern.h>

namespace holdfast::test {

inline NoisePattern
kinectPattern()
{
  return {
      {{0.101, 1.6, PatternShape::Exponential}, {0.089, 56.0, PatternShape::Gaussian}}};
}

} // namespace holdfast::test
