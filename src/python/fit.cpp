// Fits of points that are given.
#include "bindings.h"

#include "arrays.h"
#include "fit_keywords.h"
#include "patch_objects.h"
#include "sensor_object.h"

#include "parallel/parallel_for.h"
#include "parallel/thread_memory.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

namespace holdfast::python {
namespace {

const Keywords<FitRequest>&
fitKeywords()
{
  static const Keywords<FitRequest> keywords = [] {
    Keywords<FitRequest> k("fit");
    addFitOptions(
        k,
        [](FitRequest& r) -> FitOptions& { return r.fit; },
        [](FitRequest& r) -> CovarianceMode& { return r.covariance; });
    return k;
  }();
  return keywords;
}

/// How all is fitted.
struct Settings {
  PatchEstimator estimator;
  Eigen::Vector3d viewpoint;
  bool noise_at_surface;
};

/// What is fitted, in the caller's memory or a copy.
struct Task {
  Numbers points;
  std::optional<CovarianceRows> covariances; ///< none: the sensor's
  const SensorNoise* sensor = nullptr;
};

Task
taskOf(py::handle points, py::handle covariances, const SensorNoise* sensor)
{
  Task task{pointRows(points, "points"), std::nullopt, sensor};
  if (sensor == nullptr)
    task.covariances.emplace(covariances, task.points.shape(0), "covariances");
  return task;
}

void
fillBatch(const Task& task, const Settings& settings, PointBatch& batch)
{
  const double* q = task.points.data();
  const auto n = static_cast<int>(task.points.shape(0));
  if (task.sensor != nullptr) {
    task.sensor->fill(q, n, settings.noise_at_surface, batch);
    return;
  }
  const double origin[3] = {q[0], q[1], q[2]};
  batch.clear(Eigen::Vector3d(q[0], q[1], q[2]), settings.viewpoint);
  batch.resize(n);
  constexpr PointBatch::Channel kCovariance[6] = {PointBatch::SXX,
                                                  PointBatch::SXY,
                                                  PointBatch::SXZ,
                                                  PointBatch::SYY,
                                                  PointBatch::SYZ,
                                                  PointBatch::SZZ};
  double* to[6];
  for (int k = 0; k < 6; ++k)
    to[k] = batch.channel(kCovariance[k]);
  double* const xyz[3] = {batch.channel(PointBatch::X),
                          batch.channel(PointBatch::Y),
                          batch.channel(PointBatch::Z)};
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k)
      xyz[k][i] = q[3 * i + k] - origin[k];
    double s[6];
    task.covariances->get(i, s);
    for (int k = 0; k < 6; ++k)
      to[k][i] = s[k];
  }
}

/// \return false where a point is no measurement; requireMeasurements() says which.
bool
fitTask(const Task& task, const Settings& settings, ExtractedPatch& patch)
{
  auto& batch = threadMemory<PointBatch, struct FittedPoints>();
  fillBatch(task, settings, batch);
  patch.fit = settings.estimator.estimate(batch);
  return patch.fit.invalid_points == 0;
}

double
medianSigma(const Task& task)
{
  std::vector<double> variances;
  for (py::ssize_t i = 0; i < task.points.shape(0); ++i) {
    double s[6];
    task.covariances->get(i, s);
    variances.push_back(s[0] + s[3] + s[5]);
  }
  const auto middle =
      variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return std::sqrt(*middle);
}

/// Noise that is larger than everything that was measured is another unit's.
void
requireSameUnit(const Task& task)
{
  constexpr double kRatio = 10.0;
  if (!task.covariances)
    return;
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>
      rows(task.points.data(), task.points.shape(0), 3);
  const double extent = (rows.colwise().maxCoeff() - rows.colwise().minCoeff()).norm();
  const double sigma = medianSigma(task);
  if (sigma > kRatio * extent && extent > 0.0)
    throw py::value_error("covariances: their sigma (" + show(sigma) +
                          " m in the median) is many times the extent of the points (" +
                          show(extent) + " m); points are in m, covariances in m^2");
}

void
checkTask(const Task& task, bool all_measured, const FitResult& fit)
{
  if (task.sensor != nullptr)
    task.sensor->requireInView(task.points.data(), task.points.shape(0));
  if (!all_measured)
    requireMeasurements(task.points.data(),
                        task.points.shape(0),
                        task.covariances ? &*task.covariances : nullptr);
  if (!isUsable(fit.status))
    requireSameUnit(task);
}

/// One of covariances and sensor, and a viewpoint only where the sensor is none.
const SensorNoise*
noiseOf(py::handle covariances, py::handle sensor, py::handle viewpoint)
{
  if (covariances.is_none() == sensor.is_none())
    throw py::type_error("either covariances or a sensor is needed");
  if (sensor.is_none())
    return nullptr;
  if (!viewpoint.is_none())
    throw py::type_error("points with a sensor are in its own frame: there is no other "
                         "viewpoint");
  if (!py::isinstance<SensorObject>(sensor))
    throw py::type_error("sensor: a holdfast.Sensor is needed, not " +
                         kindText(sensor));
  return &sensor.cast<const SensorObject&>().noise();
}

Settings
settingsOf(py::handle viewpoint, const py::kwargs& options)
{
  const Eigen::Vector3d from = viewpoint.is_none() ?
                                   Eigen::Vector3d(Eigen::Vector3d::Zero()) :
                                   vectorOf(viewpoint, "viewpoint");
  static const Settings usual{PatchEstimator(FitOptions()),
                              Eigen::Vector3d::Zero(),
                              FitOptions().noise_at_surface};
  if (options.empty())
    return {usual.estimator, from, usual.noise_at_surface};
  FitRequest request;
  fitKeywords().set(request, options);
  return {PatchEstimator(request.fit, request.covariance),
          from,
          request.fit.noise_at_surface};
}

PatchObject
fit(const py::object& points,
    const py::object& covariances,
    const py::object& sensor,
    const py::object& viewpoint,
    const py::kwargs& options)
{
  const Task task =
      taskOf(points, covariances, noiseOf(covariances, sensor, viewpoint));
  const Settings settings = settingsOf(viewpoint, options);
  const auto patch = std::make_shared<ExtractedPatch>();
  bool all_measured = false;
  {
    const py::gil_scoped_release release;
    all_measured = fitTask(task, settings, *patch);
  }
  checkTask(task, all_measured, patch->fit);
  return {patch};
}

/// What a fit takes without Python, for test/benchmark/python_call.py: the fastest of
/// many, s.
double
fitSeconds(const py::object& points, const py::object& covariances, int repeats)
{
  using Clock = std::chrono::steady_clock;
  const Task task = taskOf(points, covariances, nullptr);
  const Settings settings = settingsOf(py::none(), {});
  Clock::duration best = Clock::duration::max();
  for (int i = 0; i < repeats; ++i) {
    const auto start = Clock::now();
    ExtractedPatch patch;
    fitTask(task, settings, patch);
    best = std::min(best, Clock::now() - start);
  }
  return std::chrono::duration<double>(best).count();
}

std::vector<Task>
tasksOf(const py::object& points,
        const py::object& covariances,
        const SensorNoise* sensor)
{
  const py::ssize_t count = py::len(points);
  if (sensor == nullptr && py::len(covariances) != static_cast<std::size_t>(count))
    throw py::value_error("covariances: " + std::to_string(py::len(covariances)) +
                          " of them beside " + std::to_string(count) +
                          " arrays of points");
  std::vector<Task> tasks;
  tasks.reserve(static_cast<std::size_t>(count));
  for (py::ssize_t i = 0; i < count; ++i) {
    py::object own = py::none();
    if (sensor == nullptr)
      own = covariances[py::int_(i)];
    try {
      tasks.push_back(taskOf(points[py::int_(i)], own, sensor));
    }
    catch (const py::value_error& error) {
      throw py::value_error("number " + std::to_string(i) + ": " + error.what());
    }
  }
  return tasks;
}

PatchesObject
fitMany(const py::object& points,
        const py::object& covariances,
        const py::object& sensor,
        const py::object& viewpoint,
        const py::object& thread_count,
        const py::kwargs& options)
{
  const SensorNoise* noise = noiseOf(covariances, sensor, viewpoint);
  const std::vector<Task> tasks = tasksOf(points, covariances, noise);
  const Settings settings = settingsOf(viewpoint, options);
  int threads = 0;
  read("threads", thread_count, threads);
  if (threads < 0)
    throw py::value_error("threads: it must not be negative");
  std::vector<ExtractedPatch> patches(tasks.size());
  std::vector<char> all_measured(tasks.size());
  {
    const py::gil_scoped_release release;
    parallelFor(static_cast<int>(tasks.size()), threads, [&](int item, int) {
      const auto i = static_cast<std::size_t>(item);
      all_measured[i] = fitTask(tasks[i], settings, patches[i]) ? 1 : 0;
    });
  }
  for (std::size_t i = 0; i < tasks.size(); ++i)
    try {
      checkTask(tasks[i], all_measured[i] != 0, patches[i].fit);
    }
    catch (const py::value_error& error) {
      throw py::value_error("number " + std::to_string(i) + ": " + error.what());
    }
  return PatchesObject(std::move(patches));
}

std::string
fitHelp()
{
  return documented(
      "fit(points, covariances=None, *, sensor=None, viewpoint=None, " +
          fitKeywords().signature() + ")",
      "Fit one bounded curved patch to points, with the covariance of its state.\n"
      "\n"
      "    >>> import numpy as np, holdfast\n"
      "    >>> rng = np.random.default_rng(1)\n"
      "    >>> xy = rng.uniform(-0.05, 0.05, (200, 2))           # m\n"
      "    >>> z = 1.0 + (xy ** 2).sum(axis=1)                   # rises away from us\n"
      "    >>> points = np.column_stack([xy, z + rng.normal(0, 0.001, 200)])\n"
      "    >>> patch = holdfast.fit(points, np.eye(3) * 0.001 ** 2)\n"
      "    >>> if patch.ok:\n"
      "    ...     print(patch.type, patch.normal, patch.normal_sigma)\n"
      "    ...     sigmas = dict(zip(patch.state_names, patch.covariance.diagonal() ** "
      ".5))\n"
      "\n"
      "Arguments\n"
      "    points: (N, 3) in m. float64 in C order is read where it is; float32, "
      "whole\n"
      "        numbers, Fortran order, slices with steps, and lists are copied.\n"
      "    covariances: of the points' noise, m^2: (N, 3, 3), or (N, 6) with xx xy xz "
      "yy\n"
      "        yz zz, or (3, 3), one for all. Copied as the points are.\n"
      "    sensor: a Sensor in place of covariances: its noise model gives them at "
      "the\n"
      "        surface, with what neighbouring pixels share. The points are then in "
      "the\n"
      "        frame of its camera: x right, y down, z forward.\n"
      "    viewpoint: (3,) in m, where the sensor stood: the normal points to its "
      "side.\n"
      "        None: the origin.\n" +
          fitKeywords().help() +
          "\n"
          "Returns\n"
          "    a Patch. Look at `ok` first: a fit that failed says why in `status`, "
          "and\n"
          "    has None for what there is not.\n"
          "\n"
          "Raises\n"
          "    TypeError: an argument is of another kind, or there is no such option.\n"
          "    ValueError: a shape, a number or a name is wrong; a point is not "
          "finite; a\n"
          "        covariance is not symmetric or has a negative eigenvalue; points "
          "and\n"
          "        covariances, or sensor, do not have one unit.\n"
          "\n"
          "The interpreter's lock is released while it computes. Source: Kanoulas,\n"
          "Tsagarakis and Vona, 2016, with the departures that the options name; "
          "order\n"
          "and meaning of the state: Patch.state.");
}

std::string
fitManyHelp()
{
  return documented(
      "fit_many(points, covariances=None, *, sensor=None, viewpoint=None, threads=0, " +
          fitKeywords().signature() + ")",
      "Fit a patch to each of many arrays of points, on several threads.\n"
      "\n"
      "Arguments\n"
      "    points: a sequence of (N_i, 3), or one array (B, N, 3), in m.\n"
      "    covariances: as many, each as for fit().\n"
      "    threads: 0: one for each core. The result does not depend on it, and is "
      "that\n"
      "        of fit() bit for bit.\n"
      "    All else as for fit().\n"
      "\n"
      "Returns\n"
      "    Patches, one for each; those of failed fits say why in `status`.\n"
      "\n"
      "Raises\n"
      "    as fit(), with the number of the array.");
}

} // namespace

void
bindFit(py::module_& module)
{
  module.def("fit",
             fit,
             py::arg("points"),
             py::arg("covariances") = py::none(),
             py::kw_only(),
             py::arg("sensor") = py::none(),
             py::arg("viewpoint") = py::none(),
             fitHelp().c_str());
  module.def("fit_many",
             fitMany,
             py::arg("points"),
             py::arg("covariances") = py::none(),
             py::kw_only(),
             py::arg("sensor") = py::none(),
             py::arg("viewpoint") = py::none(),
             py::arg("threads") = 0,
             fitManyHelp().c_str());
  module.def("_fit_seconds", fitSeconds);
}

} // namespace holdfast::python
