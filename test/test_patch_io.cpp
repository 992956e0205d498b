#include <holdfast/io/atomic_file.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/point_types.h>

#include "support/random.h"
#include "support/run_program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

namespace holdfast { namespace {

Patch
somePatch(PatchType type, test::Random& random)
{
  Patch patch;
  patch.type = type;
  for (int i = 0; i < 4; ++i)
    patch.d(i) =
        i < boundaryParameterCount(type.boundary) ? random.uniform(0.05, 0.1) : 0;
  if (type.boundary == BoundaryType::Quad)
    patch.d(4) = random.uniform(0.6, 0.9);
  const double sign = type.surface == SurfaceType::HyperbolicParaboloid ? -1.0 : 1.0;
  if (curvatureParameterCount(type.surface) > 0)
    patch.kappa.x() = random.uniform(1.0, 3.0);
  if (curvatureParameterCount(type.surface) > 1)
    patch.kappa.y() = sign * random.uniform(4.0, 6.0);
  patch.r = Eigen::Vector3d(random.normal(), random.normal(), 0.0) / 3.0;
  patch.c = Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  return patch;
}

/// One patch of every type with numbers that have no short decimal form.
PatchReport
someReport()
{
  test::Random random;
  PatchReport report;
  report.cloud = "folder/a \"cloud\".pcd";
  report.result.sensor.name = "kinect_v1";
  report.load_ms = 1.0 / 3.0;
  report.fit_ms = 2.0;
  report.result.rejected = {{FitStatus::TooFewPoints, 3}, {FitStatus::Degenerate, 1}};
  report.result.turned_down = {{PatchVerdict::CoverageTooLow, 2}};
  for (const PatchType type : kPatchTypes) {
    ExtractedPatch extracted;
    FitResult& fit = extracted.fit;
    fit.status = FitStatus::Converged;
    fit.patch = somePatch(type, random);
    const int n = degreesOfFreedom(type);
    fit.covariance.resize(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j)
        fit.covariance(i, j) = fit.covariance(j, i) = 1e-5 * random.normal();
    fit.state = toState(fit.patch, FitOptions{}.containment);
    const int m = stateLayoutOf(type).size();
    fit.state_covariance.resize(m, m);
    for (int i = 0; i < m; ++i)
      for (int j = 0; j <= i; ++j)
        fit.state_covariance(i, j) = fit.state_covariance(j, i) =
            1e-5 * random.normal();
    fit.nonlinearity = random.uniform(0.0, 0.1);
    fit.chi2 = random.uniform(0.0, 100.0);
    fit.chi2_dof = 94;
    fit.chi2_expected = random.uniform(80.0, 94.0);
    fit.points = 100;
    fit.iterations = 5;
    extracted.seed_index = 17;
    extracted.seed = Eigen::Vector3d(0.1, 0.2, 1.0 / 3.0);
    extracted.radius_m = 0.05;
    Validation& validation = extracted.validation.emplace();
    validation.verdict = PatchVerdict::Accepted;
    validation.residual.rms_m = random.uniform(0.0, 0.01);
    validation.residual.largest_m = random.uniform(0.01, 0.02);
    validation.coverage.share = random.uniform(0.0, 1.0);
    validation.extent_m = random.uniform(0.0, 0.1);
    validation.noise_m = random.uniform(0.0, 0.1);
    validation.residual.unexplained_m = random.uniform(0.0, 0.01);
    validation.sagitta_m = random.uniform(0.0, 0.1);
    validation.curvature_per_m = random.uniform(0.0, 10.0);
    validation.view_angle_rad = random.uniform(0.0, 1.5);
    validation.chi2_per_dof = chi2PerDof(fit);
    report.result.patches.push_back(extracted);
  }
  return report;
}

std::string
jsonText(const PatchReport& report, JsonLayout layout)
{
  std::ostringstream out;
  writeJson(out, report, layout);
  return out.str();
}

TEST(PatchIo, JsonComesBackBitForBit)
{
  const PatchReport report = someReport();
  for (const JsonLayout layout : {JsonLayout::OneLine, JsonLayout::PatchPerLine}) {
    const PatchReport read = readJson(jsonText(report, layout));
    EXPECT_EQ(read.cloud, report.cloud);
    EXPECT_EQ(read.result.rejected, report.result.rejected);
    EXPECT_EQ(read.result.turned_down, report.result.turned_down);
    ASSERT_EQ(read.result.patches.size(), report.result.patches.size());
    for (std::size_t i = 0; i < read.result.patches.size(); ++i) {
      const ExtractedPatch& a = report.result.patches[i];
      const ExtractedPatch& b = read.result.patches[i];
      EXPECT_EQ(a.fit.patch.type, b.fit.patch.type);
      EXPECT_EQ(pack(a.fit.patch), pack(b.fit.patch));
      EXPECT_EQ(a.fit.covariance, b.fit.covariance);
      EXPECT_EQ(pack(a.fit.state), pack(b.fit.state));
      EXPECT_LT((a.fit.state.normal - b.fit.state.normal).norm(), 1e-15);
      EXPECT_EQ(a.fit.state_covariance, b.fit.state_covariance);
      EXPECT_EQ(a.fit.flags.axis_not_observable, b.fit.flags.axis_not_observable);
      EXPECT_EQ(a.fit.nonlinearity, b.fit.nonlinearity);
      EXPECT_EQ(a.fit.chi2_expected, b.fit.chi2_expected);
      EXPECT_EQ(a.fit.chi2, b.fit.chi2);
      EXPECT_EQ(a.fit.points, b.fit.points);
      EXPECT_EQ(a.fit.status, b.fit.status);
      EXPECT_EQ(a.seed_index, b.seed_index);
      EXPECT_EQ(a.seed, b.seed);
      EXPECT_EQ(a.radius_m, b.radius_m);
      ASSERT_TRUE(b.validation);
      EXPECT_EQ(b.validation->verdict, PatchVerdict::Accepted);
      EXPECT_EQ(a.validation->residual.rms_m, b.validation->residual.rms_m);
      EXPECT_EQ(a.validation->residual.largest_m, b.validation->residual.largest_m);
      EXPECT_EQ(a.validation->coverage.share, b.validation->coverage.share);
      EXPECT_EQ(a.validation->extent_m, b.validation->extent_m);
      EXPECT_EQ(a.validation->noise_m, b.validation->noise_m);
      EXPECT_EQ(a.validation->residual.unexplained_m,
                b.validation->residual.unexplained_m);
      EXPECT_EQ(a.validation->sagitta_m, b.validation->sagitta_m);
      EXPECT_EQ(a.validation->curvature_per_m, b.validation->curvature_per_m);
      EXPECT_EQ(a.validation->view_angle_rad, b.validation->view_angle_rad);
      EXPECT_EQ(a.validation->stray_share, b.validation->stray_share);
      EXPECT_EQ(a.validation->chi2_per_dof, b.validation->chi2_per_dof);
    }
  }
}

TEST(PatchIo, FilesOfALaterSchemaAreRefused)
{
  auto json =
      nlohmann::ordered_json::parse(jsonText(someReport(), JsonLayout::PatchPerLine));
  json.erase("schema"); // as files of the first version
  EXPECT_NO_THROW(readJson(json.dump()));
  for (const nlohmann::ordered_json& other :
       {nlohmann::ordered_json(0), nlohmann::ordered_json(1000)}) {
    json["schema"] = other;
    EXPECT_THROW(readJson(json.dump()), std::runtime_error) << other;
  }
}

std::vector<std::string>
membersOf(const nlohmann::ordered_json& json)
{
  std::vector<std::string> members;
  for (const auto& item : json.items())
    members.push_back(item.key());
  return members;
}

TEST(PatchIo, JsonHasTheDocumentedMembers)
{
  const auto json =
      nlohmann::ordered_json::parse(jsonText(someReport(), JsonLayout::PatchPerLine));
  EXPECT_EQ(membersOf(json),
            (std::vector<std::string>{"holdfast",
                                      "schema",
                                      "cloud",
                                      "sensor",
                                      "offset",
                                      "cloud_points",
                                      "notices",
                                      "options",
                                      "patches",
                                      "rejected",
                                      "timing"}));
  EXPECT_EQ(json["rejected"]["too_few_points"], 3);
  EXPECT_EQ(json["rejected"]["coverage_too_low"], 2);
  EXPECT_EQ(json["timing"]["patches_per_second"], 5000.0); // 10 patches in 2 ms
}

TEST(PatchIo, PatchesHaveTheDocumentedMembers)
{
  const auto json =
      nlohmann::ordered_json::parse(jsonText(someReport(), JsonLayout::PatchPerLine));
  const auto& patch = json["patches"][0];
  EXPECT_EQ(membersOf(patch),
            (std::vector<std::string>{"surface",
                                      "boundary",
                                      "dof",
                                      "names",
                                      "parameters",
                                      "covariance",
                                      "flags",
                                      "nonlinearity",
                                      "state",
                                      "state_names",
                                      "state_covariance",
                                      "state_frame",
                                      "covariance_mode",
                                      "status",
                                      "points",
                                      "uninformative_points",
                                      "chi2",
                                      "chi2_dof",
                                      "chi2_expected",
                                      "iterations",
                                      "verdict",
                                      "residual",
                                      "coverage",
                                      "measured",
                                      "second_attempt",
                                      "seed",
                                      "radius"}));
  EXPECT_EQ(patch["surface"], "elliptic_paraboloid");
  EXPECT_EQ(patch["boundary"], "ellipse");
  EXPECT_EQ(patch["dof"], 10);
  EXPECT_EQ(patch["names"].size(), 10U);
  EXPECT_EQ(patch["names"][3], "kappa_y");
  EXPECT_EQ(patch["covariance"].size(), 10U);
  EXPECT_EQ(patch["covariance"][9].size(), 10U);
  EXPECT_EQ(patch["covariance_mode"], "exact");
  EXPECT_EQ(patch["seed"]["index"], 17);
}

// Enough patches for several threads to print and one to write.
TEST(PatchIo, TextIsTheSameForAnyNumberOfThreads)
{
  PatchReport report = someReport();
  auto& patches = report.result.patches;
  const std::size_t types = patches.size();
  while (patches.size() < 3000) {
    patches.push_back(patches[patches.size() % types]);
    patches.back().fit.patch.c.x() += static_cast<double>(patches.size());
  }
  report.options.threads = 1;
  const std::string text = jsonText(report, JsonLayout::OneLine);
  report.options.threads = 3;
  EXPECT_EQ(jsonText(report, JsonLayout::OneLine), text);
  const auto json = nlohmann::json::parse(text);
  ASSERT_EQ(json["patches"].size(), 3000U);
  for (std::size_t i = 0; i < 3000; ++i)
    EXPECT_EQ(json["patches"][i]["state"].back(),
              pack(patches[i].fit.state).tail<1>()[0]);
}

// A text that some other program has put in order: blanks, brackets in strings, members
// in another order.
TEST(PatchIo, ForeignLayoutsAreRead)
{
  const PatchReport report = someReport();
  nlohmann::json json = nlohmann::json::parse(jsonText(report, JsonLayout::OneLine));
  json["cloud"] = "a \"patches\":[{ ]} \\";
  json["aaa"] = {{"patches", {1, 2, "]"}}};
  for (const int indent : {-1, 0, 2}) {
    const PatchReport read = readJson(json.dump(indent));
    EXPECT_EQ(read.cloud, json["cloud"]);
    ASSERT_EQ(read.result.patches.size(), report.result.patches.size());
    EXPECT_EQ(pack(read.result.patches.back().fit.patch),
              pack(report.result.patches.back().fit.patch));
  }
}

TEST(PatchIo, BrokenJsonIsAnErrorWhereverItBreaks)
{
  const std::string text = jsonText(someReport(), JsonLayout::PatchPerLine);
  for (std::size_t n = 0; n + 3 < text.size(); n += 1 + text.size() / 500)
    EXPECT_THROW(readJson(text.substr(0, n)), std::runtime_error) << n;
  const std::size_t first = text.find("\"patches\":[");
  for (const std::string wrong : {",", "[", "]", "}", "1 2", "nul", "\""})
    EXPECT_THROW(readJson(std::string(text).insert(first + 11, wrong)),
                 std::runtime_error)
        << wrong;
}

TEST(PatchIo, NumbersKeepTheirKindAndSymmetryItsDigits)
{
  PatchReport report = someReport();
  FitResult& fit = report.result.patches[0].fit;
  fit.chi2 = 3.0;
  fit.covariance(0, 1) = 1.0 / 3.0;
  fit.covariance(1, 0) = 2.0 / 3.0; // nobody makes it symmetric
  const auto json = nlohmann::json::parse(jsonText(report, JsonLayout::OneLine));
  const auto& patch = json["patches"][0];
  EXPECT_TRUE(patch["chi2"].is_number_float());
  EXPECT_TRUE(patch["points"].is_number_integer());
  EXPECT_EQ(patch["covariance"][0][1], 1.0 / 3.0);
  EXPECT_EQ(patch["covariance"][1][0], 2.0 / 3.0);
}

TEST(PatchIo, OneLineIsOneLine)
{
  const std::string text = jsonText(someReport(), JsonLayout::OneLine);
  EXPECT_EQ(text.find('\n'), text.size() - 1);
}

TEST(PatchIo, WholeFitsHaveNoSeedAndInfinityIsNull)
{
  PatchReport report = someReport();
  report.whole = true;
  report.result.patches[0].seed_index.reset();
  report.result.patches[0].radius_m = 0.0;
  report.result.patches[0].validation.reset();
  report.result.patches[0].fit.chi2 = std::numeric_limits<double>::infinity();
  report.result.patches[0].fit.covariance(1, 1) = std::nan("");
  const auto json = nlohmann::json::parse(jsonText(report, JsonLayout::OneLine));
  EXPECT_TRUE(json["patches"][0]["seed"].is_null());
  EXPECT_TRUE(json["patches"][0]["radius"].is_null());
  EXPECT_TRUE(json["patches"][0]["residual"].is_null());
  EXPECT_TRUE(json["patches"][0]["coverage"].is_null());
  EXPECT_TRUE(json["patches"][0]["chi2"].is_null());
  EXPECT_TRUE(json["patches"][0]["covariance"][1][1].is_null());
  EXPECT_TRUE(json["options"]["sampler"].is_null());
}

TEST(PatchIo, FileNamesThatAreNoUtf8)
{
  PatchReport report;
  report.cloud = "\xff\xfe.pcd";
  EXPECT_TRUE(nlohmann::json::accept(jsonText(report, JsonLayout::OneLine)));
}

TEST(PatchIo, ForeignJsonIsAnError)
{
  EXPECT_THROW(readJson(""), std::runtime_error);
  EXPECT_THROW(readJson("[1,2"), std::runtime_error);
  EXPECT_THROW(readJson("{\"patches\":[]}"), std::runtime_error);
  std::string text = jsonText(someReport(), JsonLayout::OneLine);
  text.replace(text.find("\"converged\""), 11, "\"confused!\"");
  EXPECT_THROW(readJson(text), std::runtime_error);
}

TEST(PatchIo, CountsThatAreNoneAreAnError)
{
  const auto json = nlohmann::json::parse(jsonText(someReport(), JsonLayout::OneLine));
  const auto expectError = [&](const std::string& path, const std::string& name) {
    // As double or modulo 2^32 most of them would be some int.
    for (const char* count : {"1.5", "1e300", "2147483648", "-2147483649", "\"3\""}) {
      auto changed = json;
      changed[nlohmann::json::json_pointer(path)][name] = nlohmann::json::parse(count);
      SCOPED_TRACE(path + ' ' + name + ": " + count);
      EXPECT_THROW(readJson(changed.dump()), std::runtime_error);
    }
  };
  for (const char* name : {"points", "uninformative_points", "chi2_dof", "iterations"})
    expectError("/patches/0", name);
  expectError("/patches/0/seed", "index");
  for (const auto& [name, count] : json.at("rejected").items())
    expectError("/rejected", name);
}

/// Vertex and face counts announced by a PLY header.
std::pair<int, int>
meshCounts(const std::string& ply)
{
  const auto count = [&ply](const std::string& element) {
    const std::string entry = "element " + element + " ";
    return std::stoi(ply.substr(ply.find(entry) + entry.size()));
  };
  return {count("vertex"), count("face")};
}

// What else PatchPoint holds, test_point_types and test_conversions ask.
TEST(PatchIo, PclReadsPatchPoints)
{
  const PatchReport report = someReport();
  const Eigen::Vector3d offset(1000.0, -2000.0, 3.5);
  const std::string path = test::freshFolder("patch_points") + "/patches.pcd";
  {
    std::ofstream file(path, std::ios::binary);
    writePatchPoints(file, report.result.patches, report.sensor_pose, offset);
  }
  pcl::PointCloud<PatchPoint> read;
  ASSERT_EQ(pcl::io::loadPCDFile(path, read), 0);
  const auto expected = toPatchCloud(report.result.patches, report.sensor_pose);
  ASSERT_EQ(read.size(), expected.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].getVector3fMap(), expected[i].getVector3fMap());
    EXPECT_EQ(read[i].getNormalVector3fMap(), expected[i].getNormalVector3fMap());
    EXPECT_EQ(std::memcmp(read[i].state, expected[i].state, sizeof read[i].state), 0);
    EXPECT_EQ(read[i].seed, expected[i].seed);
    EXPECT_EQ(read[i].boundary, expected[i].boundary);
    EXPECT_EQ(read[i].verdict, expected[i].verdict);
  }
  EXPECT_EQ(read.sensor_origin_.head<3>(), expected.sensor_origin_.head<3>());
  EXPECT_EQ(read.sensor_orientation_.coeffs(), expected.sensor_orientation_.coeffs());
  EXPECT_EQ(test::readFile(path).substr(0, 25), "# add 1000 -2000 3.5 m to");
}

TEST(PatchIo, MeshIsWhatItsHeaderSays)
{
  const PatchReport report = someReport();
  std::ostringstream binary;
  std::ostringstream text;
  writeMesh(binary, report.result.patches, false);
  writeMesh(text, report.result.patches, true);
  const auto [vertices, faces] = meshCounts(binary.str());
  EXPECT_EQ(meshCounts(text.str()), std::make_pair(vertices, faces));
  EXPECT_GT(vertices, 10 * 20); // ten patches, edges an eighth of their length
  const std::string end = "end_header\n";
  const std::string data = binary.str().substr(binary.str().find(end) + end.size());
  // Vertices: three floats and three bytes; faces: a byte and three integers.
  EXPECT_EQ(data.size(), static_cast<std::size_t>(15 * vertices + 13 * faces));

  std::istringstream rows(text.str().substr(text.str().find(end) + end.size()));
  for (int i = 0; i < vertices; ++i) {
    double x, y, z;
    int red, green, blue;
    ASSERT_TRUE(rows >> x >> y >> z >> red >> green >> blue);
    EXPECT_TRUE(std::isfinite(x) && std::isfinite(y) && std::isfinite(z));
    EXPECT_LE(std::max({red, green, blue}), 255);
  }
  for (int i = 0; i < faces; ++i) {
    int n, a, b, c;
    ASSERT_TRUE(rows >> n >> a >> b >> c);
    EXPECT_EQ(n, 3);
    EXPECT_TRUE(std::min({a, b, c}) >= 0 && std::max({a, b, c}) < vertices);
  }
  std::string more;
  EXPECT_FALSE(rows >> more);
}

TEST(PatchIo, MeshIsDarkerWhereFewPointsSupportAPatch)
{
  PatchReport report = someReport();
  ExtractedPatch plane = report.result.patches[4];
  ASSERT_EQ(plane.fit.patch.type.surface, SurfaceType::Plane);
  const auto firstColor = [&plane] {
    std::ostringstream text;
    writeMesh(text, {plane}, true);
    std::istringstream rows(text.str().substr(text.str().find("end_header") + 10));
    double x, y, z;
    int red;
    rows >> x >> y >> z >> red;
    return red;
  };
  const int full = surfaceColor(SurfaceType::Plane)[0];
  plane.validation->coverage.share = 0.0;
  EXPECT_EQ(firstColor(), full / 2);
  plane.validation->coverage.share = 1.0;
  EXPECT_EQ(firstColor(), full);
  plane.validation.reset(); // not measured
  EXPECT_EQ(firstColor(), full);
}

TEST(PatchIo, SurfaceColorsDiffer)
{
  std::vector<std::array<std::uint8_t, 3>> colors;
  for (int i = 0; i <= static_cast<int>(SurfaceType::CircularParaboloid); ++i)
    colors.push_back(surfaceColor(static_cast<SurfaceType>(i)));
  std::sort(colors.begin(), colors.end());
  EXPECT_EQ(std::unique(colors.begin(), colors.end()), colors.end());
}

TEST(AtomicFile, AppearsWholeOrNotAtAll)
{
  const std::string folder = test::freshFolder("atomic_file");
  const std::string path = folder + "/result.txt";
  {
    AtomicFile file(path);
    file.stream() << "half";
  }
  EXPECT_TRUE(test::filesIn(folder).empty());
  {
    AtomicFile file(path);
    file.stream() << "whole";
    file.commit();
  }
  EXPECT_EQ(test::filesIn(folder), std::vector<std::string>{"result.txt"});
  {
    AtomicFile file(path);
    file.stream() << "never finished";
  }
  EXPECT_EQ(test::readFile(path), "whole");
}

TEST(AtomicFile, DevicesStayDevices)
{
  AtomicFile null("/dev/null");
  null.stream() << "gone";
  null.commit();
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  AtomicFile full("/dev/full");
  full.stream() << "too much";
  EXPECT_THROW(full.commit(), std::runtime_error);
}

TEST(AtomicFile, ErrorsNameFileAndCause)
{
  const std::string folder = test::freshFolder("atomic_file_errors");
  try {
    AtomicFile file(folder + "/none/result.txt");
    FAIL() << "wrote into a folder that is not there";
  }
  catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message,
              folder +
                  "/none/result.txt: cannot be written: No such file or directory");
  }
  EXPECT_THROW(AtomicFile{folder}, std::runtime_error);
}

}} // namespace holdfast
