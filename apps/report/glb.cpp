#include "report/glb.h"

#include "render/risk_colors.h"

#include <holdfast/patch/tessellation.h>
#include <holdfast/version.h>

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>

namespace holdfast::app {
namespace {

using Json = nlohmann::json;

constexpr double kSigmas = 3.0;
constexpr double kSoleAbove = 0.005; // m: not hidden by a bent surface

/// Numbers that glTF knows by these.
enum : int {
  kUnsignedInt = 5125,
  kFloat = 5126,
  kArrayBuffer = 34962,
  kIndices = 34963
};

/// Triangles with a normal in every corner.
struct Surface {
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<Eigen::Vector3f> colors; ///< linear; empty: those of the material
  std::vector<std::uint32_t> corners;
};

/// The arrays of a file, and where they are.
class GlbBuffer {
public:
  /// \return the index of its accessor.
  template <typename Number>
  std::size_t add(const std::vector<Number>& values, Json accessor, int target)
  {
    const std::size_t size = values.size() * sizeof(Number);
    views_.push_back({{"buffer", 0},
                      {"byteOffset", bytes_.size()},
                      {"byteLength", size},
                      {"target", target}});
    bytes_.append(reinterpret_cast<const char*>(values.data()), size);
    accessor["bufferView"] = views_.size() - 1;
    accessor["count"] = values.size();
    accessors_.push_back(std::move(accessor));
    return accessors_.size() - 1;
  }

  const std::string& bytes() const
  {
    return bytes_;
  }

  void describe(Json& gltf) const
  {
    gltf["buffers"] = {{{"byteLength", bytes_.size()}}};
    gltf["bufferViews"] = views_;
    gltf["accessors"] = accessors_;
  }

private:
  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

Json
bounds(const std::vector<Eigen::Vector3f>& positions)
{
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& position : positions)
    box.extend(position);
  const auto array = [](const Eigen::Vector3f& v) { return Json{v.x(), v.y(), v.z()}; };
  return {{"componentType", kFloat},
          {"type", "VEC3"},
          {"min", array(box.min())},
          {"max", array(box.max())}};
}

Json
primitive(const Surface& surface, std::size_t material, GlbBuffer& buffer)
{
  const Json vectors = {{"componentType", kFloat}, {"type", "VEC3"}};
  const Json scalars = {{"componentType", kUnsignedInt}, {"type", "SCALAR"}};
  Json attributes = {
      {"POSITION",
       buffer.add(surface.positions, bounds(surface.positions), kArrayBuffer)},
      {"NORMAL", buffer.add(surface.normals, vectors, kArrayBuffer)}};
  if (!surface.colors.empty())
    attributes["COLOR_0"] = buffer.add(surface.colors, vectors, kArrayBuffer);
  return {{"attributes", attributes},
          {"indices", buffer.add(surface.corners, scalars, kIndices)},
          {"material", material}};
}

/// Turns a frame with this direction up into one with y up.
Eigen::Matrix3f
turnUp(const Eigen::Vector3d& up)
{
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitY())
      .toRotationMatrix()
      .cast<float>();
}

void
appendPatch(Surface& surface, const Patch& patch)
{
  const Mesh mesh = tessellate(patch, patch.d.head<4>().maxCoeff() / 4.0);
  const std::size_t first = surface.positions.size();
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  const auto vertex = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d normal =
        (vertex(t[1]) - vertex(t[0])).cross(vertex(t[2]) - vertex(t[0]));
    for (const int corner : t) {
      normals[static_cast<std::size_t>(corner)] += normal;
      surface.corners.push_back(
          static_cast<std::uint32_t>(first + static_cast<std::size_t>(corner)));
    }
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    surface.positions.emplace_back(mesh.vertices[i].cast<float>());
    const bool has_normal = normals[i].norm() > std::numeric_limits<double>::min();
    surface.normals.emplace_back(
        (has_normal ? normals[i].normalized() : patch.normal()).cast<float>());
  }
}

/// A unit sphere from the faces of an octahedron, each cut into 16 triangles.
class Sphere {
public:
  Sphere()
  {
    for (unsigned octant = 0; octant < 8; ++octant)
      addFace({(octant & 1U) != 0 ? -1 : 1,
               (octant & 2U) != 0 ? -1 : 1,
               (octant & 4U) != 0 ? -1 : 1});
    surface_.normals = surface_.positions;
  }

  const Surface& surface() const
  {
    return surface_;
  }

private:
  static constexpr int kCuts = 4; // of every edge

  void addFace(const Eigen::Vector3i& sign)
  {
    const auto corner = [&](int i, int j) {
      return sign.cwiseProduct(Eigen::Vector3i(i, j, kCuts - i - j)).eval();
    };
    const bool mirrored = sign.prod() < 0;
    const auto triangle = [&](const auto& a, const auto& b, const auto& c) {
      for (const Eigen::Vector3i& at : {a, mirrored ? c : b, mirrored ? b : c})
        addCorner(at);
    };
    for (int i = 0; i < kCuts; ++i)
      for (int j = 0; i + j < kCuts; ++j) {
        triangle(corner(i, j), corner(i + 1, j), corner(i, j + 1));
        if (i + j + 1 < kCuts)
          triangle(corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
      }
  }

  /// Faces share the corners on their edges.
  void addCorner(const Eigen::Vector3i& at)
  {
    const auto next = static_cast<std::uint32_t>(known_.size());
    const auto [entry, is_new] = known_.insert({{at.x(), at.y(), at.z()}, next});
    if (is_new)
      surface_.positions.emplace_back(at.cast<float>().normalized());
    surface_.corners.push_back(entry->second);
  }

  Surface surface_;
  std::map<std::array<int, 3>, std::uint32_t> known_;
};

/// Nothing for a patch whose centre has no finite covariance.
void
appendEllipsoid(Surface& surface, const FitResult& fit, double magnification)
{
  if (fit.state_covariance.rows() == 0)
    return;
  const Eigen::Matrix3d covariance = fit.state_covariance.bottomRightCorner<3, 3>();
  if (!covariance.allFinite())
    return;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0.0)
    axes.col(0) *= -1.0;
  // A sheet has no normals.
  const Eigen::Vector3d radii =
      (kSigmas * magnification * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt())
          .cwiseMax(1e-7);
  static const Sphere kSphere;
  const Surface& sphere = kSphere.surface();
  const auto first = static_cast<std::uint32_t>(surface.positions.size());
  for (const Eigen::Vector3f& p : sphere.positions) {
    const Eigen::Vector3d unit = p.cast<double>();
    surface.positions.emplace_back(
        (fit.patch.c + axes * radii.cwiseProduct(unit)).cast<float>());
    surface.normals.emplace_back(
        (axes * unit.cwiseQuotient(radii)).normalized().cast<float>());
  }
  for (const std::uint32_t corner : sphere.corners)
    surface.corners.push_back(first + corner);
}

void
turn(Surface& surface, const Eigen::Matrix3f& rotation)
{
  for (auto* vectors : {&surface.positions, &surface.normals})
    for (Eigen::Vector3f& v : *vectors)
      v = rotation * v;
}

double
linear(std::uint8_t srgb)
{
  const double value = srgb / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

Json
material(const std::string& name, const std::array<std::uint8_t, 3>& color)
{
  const Json::array_t base{linear(color[0]), linear(color[1]), linear(color[2]), 1.0};
  const Json roughness = {{"baseColorFactor", base},
                          {"metallicFactor", 0.0},
                          {"roughnessFactor", 0.8}};
  return {{"name", name}, {"doubleSided", true}, {"pbrMetallicRoughness", roughness}};
}

/// A plate just above the surface it stands on, in the colour of its risk.
void
appendSole(Surface& surface, const PictureSole& sole)
{
  const Rgb srgb = riskColor(sole.total);
  const Eigen::Vector3f color =
      Eigen::Vector3d(linear(srgb[0]), linear(srgb[1]), linear(srgb[2])).cast<float>();
  const auto first = static_cast<std::uint32_t>(surface.positions.size());
  const auto add = [&](const Eigen::Vector3d& point) {
    surface.positions.emplace_back((point + kSoleAbove * sole.normal).cast<float>());
    surface.normals.emplace_back(sole.normal.cast<float>());
    surface.colors.push_back(color);
  };
  add(sole.middle);
  for (const Eigen::Vector3d& corner : sole.corners)
    add(corner);
  const auto count = static_cast<std::uint32_t>(sole.corners.size());
  for (std::uint32_t i = 0; i < count; ++i)
    for (const std::uint32_t corner : {0U, 1 + i, 1 + (i + 1) % count})
      surface.corners.push_back(first + corner);
}

/// The materials of the surfaces in their order, then those of ellipsoids and soles.
Json
materials()
{
  Json list = Json::array();
  for (std::size_t i = 0; i < kSurfaceTraits.size(); ++i) {
    const auto surface = static_cast<SurfaceType>(i);
    list.push_back(material(std::string(surfaceName(surface)), surfaceColor(surface)));
  }
  list.push_back(material("sigma of the centre", {60, 60, 70}));
  list.push_back(material("sole", {255, 255, 255}));
  return list;
}

void
addNode(Json& gltf, const std::string& name, Json primitives)
{
  gltf["meshes"].push_back({{"name", name}, {"primitives", std::move(primitives)}});
  gltf["nodes"].push_back({{"name", name}, {"mesh", gltf["meshes"].size() - 1}});
  gltf["scenes"][0]["nodes"].push_back(gltf["nodes"].size() - 1);
}

void
addSoles(Json& gltf,
         const ReportResult& result,
         const Eigen::Matrix3f& up,
         GlbBuffer& buffer)
{
  Surface soles;
  for (const PictureSole& sole : result.risk->soles)
    appendSole(soles, sole);
  if (soles.positions.empty())
    return;
  turn(soles, up);
  addNode(gltf,
          fmt::format("{}: soles by risk, {:g} mm above where they stand",
                      titleOf(result),
                      1e3 * kSoleAbove),
          Json::array({primitive(soles, kSurfaceTraits.size() + 1, buffer)}));
}

void
addResult(Json& gltf,
          const ReportResult& result,
          double magnification,
          GlbBuffer& buffer)
{
  std::map<SurfaceType, Surface> surfaces;
  Surface ellipsoids;
  for (const ExtractedPatch& patch : result.report.result.patches)
    if (hasShape(patch)) {
      appendPatch(surfaces[patch.fit.patch.type.surface], patch.fit.patch);
      appendEllipsoid(ellipsoids, patch.fit, magnification);
    }
  const Eigen::Matrix3f up = turnUp(standpointOf(seenOf(result)).up);
  Json primitives = Json::array();
  for (auto& [type, surface] : surfaces) {
    turn(surface, up);
    primitives.push_back(primitive(surface, static_cast<std::size_t>(type), buffer));
  }
  if (primitives.empty())
    return;
  addNode(gltf, titleOf(result) + ": patches", std::move(primitives));
  if (result.risk)
    addSoles(gltf, result, up, buffer);
  if (ellipsoids.positions.empty())
    return;
  turn(ellipsoids, up);
  addNode(gltf,
          fmt::format("{}: centres at {:g} sigma, {:g} times as large as they are",
                      titleOf(result),
                      kSigmas,
                      magnification),
          Json::array({primitive(ellipsoids, kSurfaceTraits.size(), buffer)}));
}

void
appendChunk(std::string& file, const char* type, std::string bytes, char padding)
{
  bytes.resize((bytes.size() + 3) / 4 * 4, padding);
  const auto size = static_cast<std::uint32_t>(bytes.size());
  file.append(reinterpret_cast<const char*>(&size), 4);
  file.append(type, 4);
  file += bytes;
}

} // namespace

std::string
toGlb(const std::vector<ReportResult>& results, double magnification)
{
  Json gltf = {
      {"asset", {{"version", "2.0"}, {"generator", "Holdfast " HOLDFAST_VERSION}}},
      {"scene", 0},
      {"scenes", {{{"nodes", Json::array()}}}},
      {"nodes", Json::array()},
      {"meshes", Json::array()},
      {"materials", materials()}};
  GlbBuffer buffer;
  for (const ReportResult& result : results)
    addResult(gltf, result, magnification, buffer);
  if (gltf["nodes"].empty())
    throw std::runtime_error("no patch that glTF could show");
  buffer.describe(gltf);
  std::string chunks;
  appendChunk(chunks,
              "JSON",
              gltf.dump(-1, ' ', false, Json::error_handler_t::replace),
              ' ');
  appendChunk(chunks, "BIN\0", buffer.bytes(), '\0');
  const std::array<std::uint32_t, 2> header{
      2,
      static_cast<std::uint32_t>(12 + chunks.size())};
  return "glTF" + std::string(reinterpret_cast<const char*>(header.data()), 8) + chunks;
}

} // namespace holdfast::app
