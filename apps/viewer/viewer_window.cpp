#include "viewer.h"

#include <holdfast/patch/tessellation.h>

#include <Eigen/Eigenvalues>

#include <pcl/visualization/pcl_visualizer.h>

#include <X11/Xlib.h>

#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

namespace holdfast::app { namespace {

using pcl::visualization::PCLVisualizer;
using pcl::visualization::PointPickingEvent;
using Colored = pcl::PointCloud<pcl::PointXYZRGB>;

/// Square root of the 0.95 quantile of chi-square with three degrees of freedom.
constexpr double kSigmas95 = 2.7955;

/// Of the error ellipsoid, which would be too small to see.
constexpr int kEnlargement = 50;

constexpr double kMeshSpacing = 0.01; // m

/// Patches are drawn in front of their points, m.
constexpr double kLift = 0.004;

constexpr const char* kCloudId = "cloud";
constexpr const char* kPatchesId = "patches";
constexpr const char* kEllipsoidId = "ellipsoid";
constexpr const char* kCaptionId = "caption";

/// Makes sure that there is a display: VTK ends the program when there is none. Kept
/// open, since a server may start anew when its last client goes.
class Connection {
public:
  Connection() : display_(::XOpenDisplay(nullptr))
  {
    if (display_ == nullptr)
      throw std::runtime_error("--view: there is no display");
  }
  ~Connection()
  {
    ::XCloseDisplay(display_);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

private:
  Display* display_;
};

/// All patches as one coloured mesh.
struct PatchMesh {
  Colored::Ptr vertices = pcl::make_shared<Colored>();
  std::vector<pcl::Vertices> triangles;

  void add(const ShownPatch& shown)
  {
    const Mesh mesh = tessellate(shown.patch, kMeshSpacing);
    const auto first = static_cast<pcl::index_t>(vertices->size());
    const auto& [red, green, blue] = shown.color;
    const Eigen::Vector3d lift = kLift * shown.patch.normal();
    for (const Eigen::Vector3d& v : mesh.vertices) {
      pcl::PointXYZRGB point(red, green, blue);
      point.getVector3fMap() = (v + lift).cast<float>();
      vertices->push_back(point);
    }
    for (const auto& [a, b, c] : mesh.triangles) {
      pcl::Vertices triangle;
      triangle.vertices = {first + a, first + b, first + c};
      triangles.push_back(triangle);
    }
  }
};

class ViewerWindow : public Viewer {
public:
  explicit ViewerWindow(const std::string& note);

  void show(const RangeFrame& frame, const std::vector<ShownPatch>& patches) override;
  bool update() override;

private:
  void onPicked(const PointPickingEvent& event);
  void showCloud(const RangeFrame& frame);
  void showPatches();
  void showSelected();
  const ShownPatch* selected() const;

  Connection display_; ///< before the window
  PCLVisualizer window_{"holdfast live"};
  std::vector<ShownPatch> patches_;
  std::optional<int> selected_seed_;
};

ViewerWindow::ViewerWindow(const std::string& note)
{
  window_.setSize(1024, 768);
  window_.setBackgroundColor(0.1, 0.1, 0.12);
  // The camera frame: x right, y down, z ahead.
  window_.setCameraPosition(0.0, 0.0, -0.5, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
  window_.addText(note + "; shift and click selects a patch, q closes",
                  10,
                  10,
                  12,
                  0.9,
                  0.9,
                  0.9,
                  "note");
  window_.registerPointPickingCallback(
      [this](const PointPickingEvent& event) { onPicked(event); });
}

void
ViewerWindow::onPicked(const PointPickingEvent& event)
{
  Eigen::Vector3f picked;
  event.getPoint(picked.x(), picked.y(), picked.z());
  double nearest = std::numeric_limits<double>::infinity();
  for (const ShownPatch& shown : patches_) {
    const double distance = (shown.patch.c - picked.cast<double>()).norm();
    if (distance < nearest) {
      nearest = distance;
      selected_seed_ = shown.seed;
    }
  }
  showSelected();
}

void
ViewerWindow::show(const RangeFrame& frame, const std::vector<ShownPatch>& patches)
{
  patches_ = patches;
  showCloud(frame);
  showPatches();
  showSelected();
}

void
ViewerWindow::showCloud(const RangeFrame& frame)
{
  if (frame.colored) {
    if (!window_.updatePointCloud(frame.colored, kCloudId))
      window_.addPointCloud(frame.colored, kCloudId);
  }
  else if (!window_.updatePointCloud(frame.cloud.points, kCloudId))
    window_.addPointCloud(frame.cloud.points, kCloudId);
}

void
ViewerWindow::showPatches()
{
  PatchMesh mesh;
  for (const ShownPatch& shown : patches_)
    mesh.add(shown);
  window_.removePolygonMesh(kPatchesId);
  if (!mesh.triangles.empty())
    window_.addPolygonMesh<pcl::PointXYZRGB>(mesh.vertices, mesh.triangles, kPatchesId);
}

/// The one that was picked, as long as it is there, else the first.
const ShownPatch*
ViewerWindow::selected() const
{
  for (const ShownPatch& shown : patches_)
    if (shown.seed == selected_seed_)
      return &shown;
  return patches_.empty() ? nullptr : &patches_.front();
}

void
ViewerWindow::showSelected()
{
  window_.removeShape(kEllipsoidId);
  window_.removeShape(kCaptionId);
  const ShownPatch* shown = selected();
  if (shown == nullptr)
    return;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(shown->centre_covariance);
  const Eigen::Vector3d radii =
      kEnlargement * kSigmas95 * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = axes.eigenvectors();
  if (pose.linear().determinant() < 0.0)
    pose.linear().col(0) *= -1.0;
  pose.translation() = shown->patch.c;
  window_.addEllipsoid(pose, radii.x(), radii.y(), radii.z(), kEllipsoidId);
  window_.setShapeRenderingProperties(pcl::visualization::PCL_VISUALIZER_COLOR,
                                      1.0,
                                      0.3,
                                      0.2,
                                      kEllipsoidId);
  window_.addText(shown->caption + "\nellipsoid: 95 % of the centre, " +
                      std::to_string(kEnlargement) + " times enlarged",
                  10,
                  30,
                  14,
                  1.0,
                  1.0,
                  1.0,
                  kCaptionId);
}

bool
ViewerWindow::update()
{
  window_.spinOnce(1);
  return !window_.wasStopped();
}

}} // namespace holdfast::app

holdfast::app::Viewer*
holdfastOpenViewer(const std::string& note)
{
  return new holdfast::app::ViewerWindow(note);
}
