#include "cloud.h"

#include "arrays.h"
#include "bindings.h"

#include "io/cloud_readers.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast::python {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

Numbers
pointsOrImage(py::handle object)
{
  Numbers points = numbers(object, "points");
  if ((points.ndim() != 2 && points.ndim() != 3) ||
      points.shape(points.ndim() - 1) != 3)
    failShape("points", "(N, 3) or (H, W, 3)", points);
  if (points.size() == 0)
    throw py::value_error("points: there are none");
  return points;
}

/// With one row for each point.
py::object
asRows(py::handle covariances, const Numbers& points)
{
  Numbers array = numbers(covariances, "covariances");
  const py::ssize_t inner = points.ndim() - 1;
  const bool per_point =
      array.ndim() > inner &&
      std::equal(points.shape(), points.shape() + inner, array.shape());
  if (!per_point || inner == 1)
    return array;
  std::vector<py::ssize_t> shape{points.size() / 3};
  shape.insert(shape.end(), array.shape() + inner, array.shape() + array.ndim());
  return Numbers(array.reshape(shape));
}

CovariancesConstPtr
covariancesOf(py::handle object, const Numbers& points)
{
  const py::ssize_t count = points.size() / 3;
  const CovarianceRows rows(asRows(object, points), count, "covariances");
  auto covariances = std::make_shared<Covariances>();
  covariances->reserve(static_cast<std::size_t>(count));
  for (py::ssize_t i = 0; i < count; ++i) {
    double s[6];
    rows.get(i, s);
    Eigen::Matrix3d S;
    S << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    if (s[0] < 0.0 || s[3] < 0.0 || s[5] < 0.0)
      throw py::value_error("covariances: row " + std::to_string(i) +
                            " has a negative variance");
    covariances->push_back(S.cast<float>());
  }
  return covariances;
}

} // namespace

RangeCloud
cloudOf(py::handle object, py::handle covariances, py::handle sensor_pose)
{
  const Numbers array = pointsOrImage(object);
  const auto count = static_cast<std::size_t>(array.size() / 3);
  RangeCloud cloud;
  if (!sensor_pose.is_none())
    cloud.sensor_pose = poseOf(sensor_pose, "sensor_pose");
  cloud.sensor_pose_given = true;
  cloud.offset =
      io::offsetOf(std::vector<double>(array.data(), array.data() + array.size()));
  cloud.sensor_pose.c -= cloud.offset;
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  points->resize(count);
  points->width =
      static_cast<std::uint32_t>(array.ndim() == 3 ? array.shape(1) : count);
  points->height = static_cast<std::uint32_t>(array.ndim() == 3 ? array.shape(0) : 1);
  std::size_t finite = 0;
  const double* q = array.data();
  for (std::size_t i = 0; i < count; ++i, q += 3) {
    const bool is_measured =
        std::isfinite(q[0]) && std::isfinite(q[1]) && std::isfinite(q[2]);
    finite += is_measured ? 1U : 0U;
    for (int k = 0; k < 3; ++k)
      (*points)[i].data[k] =
          is_measured ? static_cast<float>(q[k] - cloud.offset[k]) : kNothing;
  }
  if (finite == 0)
    throw py::value_error("points: none is finite");
  points->is_dense = finite == count;
  cloud.points = points;
  if (!covariances.is_none())
    cloud.covariances = covariancesOf(covariances, array);
  return cloud;
}

} // namespace holdfast::python
