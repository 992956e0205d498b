/// \file The pose of a sensor from patches whose truth is known.
#pragma once

#include "spots.h"

#include <optional>
#include <random>

namespace holdfast::app {

/// What a sensor stands above.
enum class RegistrationGround : std::uint8_t {
  Gentle, ///< bumps of 3 cm
  Rocks ///< boulders, their edges left out
};

/// Of one registration.
struct RegistrationError {
  ObservedError error;
  int pairs = 0, refused = 0;
};

/// 500 patches of 4 cm on 1.2 x 0.9 m, which a Kinect 1.3 m above has seen once, and
/// 300 of them seen again from up to 10 cm beside, where they are by a guess of that
/// pose.
/// \param guess_error of the guess: as many rad about an axis and m along one
/// \return nothing where no pose came out.
std::optional<RegistrationError> registerOnce(RegistrationGround ground,
                                              double guess_error,
                                              std::mt19937_64& generator);

} // namespace holdfast::app
