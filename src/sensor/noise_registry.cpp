#include <holdfast/sensor/constant_noise_model.h>
#include <holdfast/sensor/dryanovski_noise_model.h>
#include <holdfast/sensor/khoshelham_noise_model.h>
#include <holdfast/sensor/linear_noise_model.h>
#include <holdfast/sensor/noise_registry.h>
#include <holdfast/sensor/quadratic_noise_model.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/sensor/time_of_flight_noise_model.h>

#include <algorithm>

namespace holdfast {

namespace {

double
valueOr(const NoiseParameters& parameters, const std::string& name, double fallback)
{
  const auto found = parameters.find(name);
  return found != parameters.end() ? found->second : fallback;
}

NoiseModel::ConstPtr
makeStereo(const NoiseParameters& p)
{
  return std::make_shared<StereoNoiseModel>(
      StereoNoiseModel::Parameters{p.at("sigma_point_px"),
                                   p.at("sigma_disparity_px"),
                                   p.at("baseline_m"),
                                   p.at("focal_px")});
}

NoiseModel::ConstPtr
makeConstant(const NoiseParameters& p)
{
  // Isotropic unless a lateral sigma is given.
  return std::make_shared<ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{p.at("sigma_m"),
                                     valueOr(p, "sigma_lateral_m", p.at("sigma_m"))});
}

NoiseModel::ConstPtr
makeLinear(const NoiseParameters& p)
{
  return std::make_shared<LinearNoiseModel>(
      LinearNoiseModel::Parameters{valueOr(p, "sigma_m", 0.0),
                                   p.at("sigma_per_m"),
                                   p.at("sigma_lateral_rad")});
}

NoiseModel::ConstPtr
makeQuadratic(const NoiseParameters& p)
{
  return std::make_shared<QuadraticNoiseModel>(
      QuadraticNoiseModel::Parameters{valueOr(p, "sigma_m", 0.0),
                                      p.at("sigma_per_m2"),
                                      p.at("sigma_lateral_rad")});
}

NoiseModel::ConstPtr
makeKhoshelham(const NoiseParameters& p)
{
  const double published = KhoshelhamNoiseModel::Parameters{}.sigma_z_per_m2;
  return std::make_shared<KhoshelhamNoiseModel>(
      KhoshelhamNoiseModel::Parameters{valueOr(p, "sigma_z_per_m2", published),
                                       p.at("sigma_point_px"),
                                       p.at("focal_px")});
}

NoiseModel::ConstPtr
makeDryanovski(const NoiseParameters& p)
{
  return std::make_shared<DryanovskiNoiseModel>(makeKhoshelham(p));
}

NoiseModel::ConstPtr
makeTimeOfFlight(const NoiseParameters& p)
{
  TimeOfFlightNoiseModel::Parameters parameters;
  parameters.sigma_m = p.at("sigma_m");
  parameters.sigma_per_m2 = p.at("sigma_per_m2");
  parameters.best_depth_m = valueOr(p, "best_depth_m", 0.0);
  parameters.sigma_incidence_m = valueOr(p, "sigma_incidence_m", 0.0);
  parameters.sigma_point_px = p.at("sigma_point_px");
  parameters.focal_px = p.at("focal_px");
  return std::make_shared<TimeOfFlightNoiseModel>(parameters);
}

void
checkParameters(const NoiseModelKind& kind, const NoiseParameters& parameters)
{
  for (const NoiseParameter& parameter : kind.parameters)
    if (parameter.required && parameters.count(parameter.name) == 0)
      throw std::invalid_argument(kind.name + " noise needs " + parameter.name);
  for (const auto& [name, value] : parameters)
    if (!kind.has(name))
      throw std::invalid_argument(kind.name + " noise has no parameter " + name);
}

} // namespace

bool
NoiseModelKind::has(const std::string& parameter) const
{
  return std::any_of(parameters.begin(), parameters.end(), [&](const auto& p) {
    return p.name == parameter;
  });
}

const std::vector<NoiseModelKind>&
noiseModelKinds()
{
  static const std::vector<NoiseParameter> pixel_depth{{"sigma_z_per_m2", false},
                                                       {"sigma_point_px"},
                                                       {"focal_px"}};
  static const std::vector<NoiseModelKind> kinds{
      {"stereo",
       {{"sigma_point_px"}, {"sigma_disparity_px"}, {"baseline_m"}, {"focal_px"}},
       makeStereo},
      {"constant", {{"sigma_m"}, {"sigma_lateral_m", false}}, makeConstant},
      {"linear",
       {{"sigma_m", false}, {"sigma_per_m"}, {"sigma_lateral_rad"}},
       makeLinear},
      {"quadratic",
       {{"sigma_m", false}, {"sigma_per_m2"}, {"sigma_lateral_rad"}},
       makeQuadratic},
      {"khoshelham", pixel_depth, makeKhoshelham},
      {"dryanovski", pixel_depth, makeDryanovski},
      {"time_of_flight",
       {{"sigma_m"},
        {"sigma_per_m2"},
        {"best_depth_m", false},
        {"sigma_incidence_m", false},
        {"sigma_point_px"},
        {"focal_px"}},
       makeTimeOfFlight},
  };
  return kinds;
}

const NoiseModelKind*
findNoiseModelKind(const std::string& name)
{
  for (const NoiseModelKind& kind : noiseModelKinds())
    if (kind.name == name)
      return &kind;
  return nullptr;
}

NoiseModel::ConstPtr
makeNoiseModel(const std::string& name, const NoiseParameters& parameters)
{
  const NoiseModelKind* kind = findNoiseModelKind(name);
  if (kind == nullptr)
    throw std::invalid_argument("unknown noise model " + name);
  checkParameters(*kind, parameters);
  return kind->make(parameters);
}

} // namespace holdfast
