/// \file A number that makes no sense, and its name.
#pragma once

#include <stdexcept>
#include <string>

namespace holdfast {

/// Thrown by noise models; knows the parameter, so that a reader of configuration files
/// can point to its line.
class ParameterError : public std::invalid_argument {
public:
  ParameterError(const std::string& parameter, const std::string& problem)
  : std::invalid_argument(parameter + " " + problem)
  , parameter_(parameter)
  , problem_(problem)
  {}

  const std::string& parameter() const
  {
    return parameter_;
  }

  const std::string& problem() const
  {
    return problem_;
  }

private:
  std::string parameter_;
  std::string problem_;
};

} // namespace holdfast
