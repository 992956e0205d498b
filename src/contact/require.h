/// \file How functions of contacts turn down what makes no sense.
#pragma once

#include <stdexcept>
#include <string>

namespace holdfast::contact {

/// \param caller which function was asked
/// \param error of a validityError(): nothing where there is none
/// \throw std::invalid_argument
inline void
requireValid(const std::string& caller, const std::string& error)
{
  if (!error.empty())
    throw std::invalid_argument("holdfast::" + caller + ": " + error);
}

} // namespace holdfast::contact
