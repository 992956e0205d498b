/// \file The noise models that YAML files may name.
#pragma once

#include <holdfast/sensor/noise_model.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace holdfast {

/// Values by name; units are part of the names.
using NoiseParameters = std::map<std::string, double>;

struct NoiseParameter {
  std::string name;
  bool required = true;
};

/// A model by name, the parameters it has, and how it is made from all of them.
struct NoiseModelKind {
  std::string name;
  std::vector<NoiseParameter> parameters;
  std::function<NoiseModel::ConstPtr(const NoiseParameters&)> make;

  bool has(const std::string& parameter) const;
};

/// All models. A new one is one more entry here; YAML files can use it at once.
const std::vector<NoiseModelKind>& noiseModelKinds();

/// The kind of that name, or null.
const NoiseModelKind* findNoiseModelKind(const std::string& name);

/// A model from its name and parameters.
/// \throw std::invalid_argument naming the culprit when the model is unknown, a
/// parameter is missing or unknown, or a value makes no sense.
NoiseModel::ConstPtr makeNoiseModel(const std::string& name,
                                    const NoiseParameters& parameters);

} // namespace holdfast
