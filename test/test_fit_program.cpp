#include <holdfast/io/cloud_io.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/patch/surface.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <utility>

namespace holdfast { namespace {

using test::freshFolder;
using test::runProgram;
using Json = nlohmann::json;

/// The tests' clouds have their own small camera, so covariances come with them.
std::string
saveBowl(const std::string& folder, const std::string& name)
{
  saveCloud(folder + "/" + name, test::bowlCloud(40, 30, test::tiltedPose(), true));
  return folder + "/" + name;
}

std::vector<Json>
jsonLines(const std::string& text)
{
  std::vector<Json> objects;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    objects.push_back(Json::parse(line));
  return objects;
}

TEST(FitProgram, JsonOnStandardOutputIsPure)
{
  const std::string folder = freshFolder("fit_json");
  const auto run =
      runProgram(folder, {"fit", saveBowl(folder, "bowl.pcd"), "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["cloud"], folder + "/bowl.pcd");
  ASSERT_GT(json["patches"].size(), 10U);
  for (const auto& patch : json["patches"]) {
    const std::size_t dof = patch["dof"];
    EXPECT_EQ(patch["names"].size(), dof);
    EXPECT_EQ(patch["parameters"].size(), dof);
    EXPECT_EQ(patch["covariance"].size(), dof);
    EXPECT_EQ(patch["seed"]["point"].size(), 3U);
    EXPECT_EQ(patch["radius"], 0.05);
  }
  EXPECT_EQ(test::filesIn(folder), std::vector<std::string>{"bowl.pcd"});
}

TEST(FitProgram, WholeFindsTheBowl)
{
  const std::string folder = freshFolder("fit_whole");
  const std::string cloud = saveBowl(folder, "bowl.pcd");
  const auto run = runProgram(folder, {"fit", cloud, "--whole", "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const PatchReport report = readJson(run.out);
  ASSERT_EQ(report.result.patches.size(), 1U);
  const FitResult& fit = report.result.patches[0].fit;
  EXPECT_EQ(fit.points, 40 * 30 - 1);
  EXPECT_FALSE(report.result.patches[0].seed_index.has_value());
  EXPECT_EQ(fit.patch.type.surface, SurfaceType::EllipticParaboloid);
  // A ripple of 1 mm over 0.25 m bends by 0.03 per metre; ten times that.
  EXPECT_NEAR(fit.patch.kappa.x(), 2.0, 0.3);
  EXPECT_NEAR(fit.patch.kappa.y(), 4.0, 0.3);
  // The normal points back at the sensor.
  EXPECT_GT(fit.patch.normal().dot(test::tiltedPose().c - fit.patch.c), 0.0);
}

TEST(FitProgram, FolderWritesJsonPointsAndMeshOfEveryCloud)
{
  const std::string folder = freshFolder("fit_folder");
  const std::string out = folder + "/out/deep";
  saveBowl(folder, "b.pcd");
  saveBowl(folder, "a.pcd");
  test::writeFile(folder + "/old.patches.ply", "not to be read");
  test::writeFile(folder + "/notes.txt", "not a cloud");
  const auto run = runProgram(folder, {"fit", folder, "-o", out, "--threads", "2"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(test::filesIn(out),
            (std::vector<std::string>{"a.patches.json",
                                      "a.patches.pcd",
                                      "a.patches.ply",
                                      "b.patches.json",
                                      "b.patches.pcd",
                                      "b.patches.ply"}));
  const PatchReport report = readJson(test::readFile(out + "/a.patches.json"));
  EXPECT_GT(report.result.patches.size(), 10U);
  EXPECT_EQ(test::readFile(out + "/a.patches.ply").substr(0, 4), "ply\n");
  // The points lie where the centres are.
  const RangeCloud points = loadCloud(out + "/a.patches.pcd");
  ASSERT_EQ(points.points->size(), report.result.patches.size());
  for (std::size_t i = 0; i < points.points->size(); ++i)
    EXPECT_EQ((*points.points)[i].getVector3fMap(),
              report.result.patches[i].fit.patch.c.cast<float>());
  EXPECT_LT(run.out.find("a.pcd: "), run.out.find("b.pcd: ")); // sorted, in the table
}

/// The numbers of a portable float map, row by row from the top.
std::vector<float>
readPfm(const std::string& path, int width, int height, int channels)
{
  const std::string bytes = test::readFile(path);
  std::istringstream text(bytes);
  std::string kind;
  int columns = 0, rows = 0;
  double order = 0.0;
  text >> kind >> columns >> rows >> order;
  EXPECT_EQ(kind, channels == 3 ? "PF" : "Pf");
  EXPECT_EQ(columns, width);
  EXPECT_EQ(rows, height);
  const auto row = static_cast<std::size_t>(width * channels);
  std::vector<float> values(row * static_cast<std::size_t>(height));
  const auto first = static_cast<std::size_t>(text.tellg()) + 1;
  EXPECT_EQ(bytes.size() - first, values.size() * sizeof(float));
  for (std::size_t v = 0; v < static_cast<std::size_t>(height); ++v)
    std::memcpy(values.data() + (static_cast<std::size_t>(height) - 1 - v) * row,
                bytes.data() + first + v * row * sizeof(float),
                row * sizeof(float));
  return values;
}

const std::vector<std::string> kDenseFiles{"bowl.chi2_ratio.pfm",
                                           "bowl.chi2_ratio.png",
                                           "bowl.dense.pcd",
                                           "bowl.kappa_max.pfm",
                                           "bowl.kappa_max.png",
                                           "bowl.kappa_min.pfm",
                                           "bowl.kappa_min.png",
                                           "bowl.normal.pfm",
                                           "bowl.normal.png",
                                           "bowl.sigma_normal.pfm",
                                           "bowl.sigma_normal.png"};

TEST(FitProgram, DenseWritesAnOrganizedCloudAndLayers)
{
  const std::string folder = freshFolder("fit_dense");
  const std::string out = folder + "/out";
  const auto run =
      runProgram(folder,
                 {"fit", saveBowl(folder, "bowl.pcd"), "--dense", "3", "-o", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("13 x 10 attempts, every 3 pixels"), std::string::npos);
  EXPECT_EQ(test::filesIn(out), kDenseFiles);
  const RangeCloud points = loadCloud(out + "/bowl.dense.pcd");
  ASSERT_EQ(points.points->width, 13U);
  ASSERT_EQ(points.points->height, 10U);
  const auto normal = readPfm(out + "/bowl.normal.pfm", 13, 10, 3);
  const auto low = readPfm(out + "/bowl.kappa_min.pfm", 13, 10, 1);
  const auto high = readPfm(out + "/bowl.kappa_max.pfm", 13, 10, 1);
  const auto sigma = readPfm(out + "/bowl.sigma_normal.pfm", 13, 10, 1);
  const auto chi2 = readPfm(out + "/bowl.chi2_ratio.pfm", 13, 10, 1);
  int patches = 0;
  for (std::size_t i = 0; i < low.size(); ++i) {
    const bool is_patch = !std::isnan((*points.points)[i].x);
    patches += is_patch;
    for (const float value : {normal[3 * i], low[i], high[i], sigma[i], chi2[i]})
      EXPECT_EQ(std::isnan(value), !is_patch);
    if (!is_patch)
      continue;
    EXPECT_LE(low[i], high[i]);
    EXPECT_GT(sigma[i], 0.0F);
    const Eigen::Vector3f n(normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]);
    EXPECT_NEAR(n.norm(), 1.0, 1e-5);
    EXPECT_GT(n.dot(test::tiltedPose().c.cast<float>() -
                    (*points.points)[i].getVector3fMap()),
              0.0F);
  }
  EXPECT_GT(patches, 50);
  EXPECT_EQ(test::readFile(out + "/bowl.normal.png").substr(1, 3), "PNG");
}

TEST(FitProgram, DenseIsRefusedWhereItMakesNoSense)
{
  const std::string folder = freshFolder("fit_dense_refused");
  const std::string bowl = saveBowl(folder, "bowl.pcd");
  const auto run = [&](const std::string& cloud, std::vector<std::string> more) {
    std::vector<std::string> arguments{"fit", cloud, "-o", folder + "/out", "--dense"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(folder, arguments);
  };
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"0"},
                                                {"-3"},
                                                {"some"},
                                                {"3", "--whole"},
                                                {"3", "--max-patches", "5"},
                                                {"3", "--max-time", "1"},
                                                {"3", "--seeds", "5"},
                                                {"3", "--spacing", "0.1"},
                                                {"3", "--no-overlap", "0.5"},
                                                {"3", "--json", "-"}}) {
    const auto refused = run(bowl, wrong);
    EXPECT_EQ(refused.exit_code, 2) << wrong.back();
  }
  // Without an image, and with a stride beyond it.
  RangeCloud cloud = loadCloud(bowl);
  auto row = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  row->width *= row->height;
  row->height = 1;
  cloud.points = row;
  saveCloud(folder + "/row.pcd", cloud);
  for (const auto& [path, stride] :
       {std::pair<std::string, std::string>{folder + "/row.pcd", "3"}, {bowl, "500"}}) {
    const auto refused = run(path, {stride});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_EQ(refused.errorLines(), 1) << refused.err;
    EXPECT_NE(refused.err.find(path), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(folder + "/out"));
}

TEST(FitProgram, DenseFilesAppearTogetherOrNotAtAll)
{
  const std::string folder = freshFolder("fit_dense_atomic");
  const std::string out = folder + "/out";
  // A folder stands where a layer is to go.
  std::filesystem::create_directories(out + "/bowl.sigma_normal.pfm");
  const auto run =
      runProgram(folder,
                 {"fit", saveBowl(folder, "bowl.pcd"), "--dense", "5", "-o", out});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("bowl.sigma_normal.pfm"), std::string::npos) << run.err;
  EXPECT_EQ(test::filesIn(out), std::vector<std::string>{"bowl.sigma_normal.pfm"});
}

TEST(FitProgram, OneJsonObjectPerLineForSeveralClouds)
{
  const std::string folder = freshFolder("fit_json_lines");
  const std::vector<std::string> arguments{"fit",
                                           saveBowl(folder, "one.pcd"),
                                           saveBowl(folder, "two.pcd"),
                                           "--json"};
  auto to_output = arguments;
  to_output.emplace_back("-");
  const auto lines = jsonLines(runProgram(folder, to_output).out);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[1]["cloud"], folder + "/two.pcd");
  auto to_file = arguments;
  to_file.push_back(folder + "/patches.json");
  EXPECT_EQ(runProgram(folder, to_file).exit_code, 0);
  EXPECT_EQ(jsonLines(test::readFile(folder + "/patches.json")).size(), 2U);
}

TEST(FitProgram, ValidationTurnsPatchesDownAndCountsThem)
{
  const std::string folder = freshFolder("fit_validation");
  const std::string cloud = saveBowl(folder, "bowl.pcd");
  const auto fit = [&](const std::vector<std::string>& limits) {
    std::vector<std::string> arguments{"fit", cloud, "--json", "-"};
    arguments.insert(arguments.end(), limits.begin(), limits.end());
    const auto run = runProgram(folder, arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return readJson(run.out).result;
  };
  // Of usable fits, whatever became of them.
  const auto fits = [](const ExtractionResult& result) {
    std::size_t count = result.patches.size();
    for (const auto& [verdict, turned_down] : result.turned_down)
      count += static_cast<std::size_t>(turned_down);
    return count;
  };
  const ExtractionResult all = fit({});
  std::vector<double> residual;
  for (const ExtractedPatch& patch : all.patches) {
    ASSERT_TRUE(patch.validation);
    residual.push_back(patch.validation->residual.rms_m);
  }
  // In the middle of what was measured.
  std::sort(residual.begin(), residual.end());
  const double limit = residual[residual.size() / 2];
  const ExtractionResult some = fit({"--max-residual", std::to_string(limit)});
  const auto down = some.turned_down.find(PatchVerdict::ResidualTooLarge);
  ASSERT_NE(down, some.turned_down.end());
  EXPECT_GT(down->second, 0);
  EXPECT_EQ(fits(some), fits(all));
  for (const ExtractedPatch& patch : some.patches)
    EXPECT_LE(patch.validation->residual.rms_m, limit + 1e-6); // 6 decimals

  const auto none = runProgram(folder, {"fit", cloud, "--max-residual", "1e-9"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("residual_too_large"), std::string::npos);
  EXPECT_EQ(runProgram(folder, {"fit", cloud, "--min-coverage", "1.5"}).exit_code, 2);
}

TEST(FitProgram, TableAndQuiet)
{
  const std::string folder = freshFolder("fit_table");
  const std::string cloud = saveBowl(folder, "bowl.pcd");
  const auto table = runProgram(folder, {"fit", cloud});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_NE(table.out.find("chi2/dof"), std::string::npos);
  EXPECT_NE(table.out.find("paraboloid"), std::string::npos);
  EXPECT_NE(table.err.find("note: "), std::string::npos); // other intrinsics
  const auto quiet = runProgram(folder, {"fit", cloud, "--quiet"});
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.out, "");
  EXPECT_EQ(quiet.err, "");
}

TEST(FitProgram, ThreadsDoNotChangeTheResult)
{
  const std::string folder = freshFolder("fit_threads");
  const std::string cloud = saveBowl(folder, "bowl.pcd");
  std::string first;
  for (const std::string threads : {"1", "2", "5"}) {
    Json json = Json::parse(
        runProgram(folder, {"fit", cloud, "--json", "-", "--threads", threads}).out);
    const std::string patches = json["patches"].dump();
    if (first.empty())
      first = patches;
    EXPECT_EQ(patches, first) << threads;
  }
}

TEST(FitProgram, OptionsReachTheFit)
{
  const std::string folder = freshFolder("fit_options");
  const std::string cloud = saveBowl(folder, "bowl.pcd");
  const auto fit = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"fit", cloud, "--json", "-"});
    const auto run = runProgram(folder, options);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Json::parse(run.out);
  };
  const Json planes = fit({"--surface", "plane", "--boundary", "quad"});
  EXPECT_EQ(planes["patches"][0]["surface"], "plane");
  EXPECT_EQ(planes["patches"][0]["boundary"], "quad");
  EXPECT_LE(fit({"--seeds", "5"})["patches"].size(), 5U);
  EXPECT_EQ(fit({"--max-patches", "3"})["patches"].size(), 3U);
  const Json covering = fit({"--max-area", "0.004", "--max-time", "1000"});
  EXPECT_LT(covering["patches"].size(), fit({})["patches"].size());
  EXPECT_EQ(covering["options"]["sampler"]["max_area"], 0.004);
  EXPECT_EQ(fit({"--radius", "0.07"})["patches"][0]["radius"], 0.07);
  const Json knn = fit({"--neighborhood", "knn", "--k", "50"});
  EXPECT_EQ(knn["patches"][0]["points"], 50);
  EXPECT_GT(fit({"--spacing", "0.02"})["patches"].size(),
            fit({"--spacing", "0.06"})["patches"].size());
  EXPECT_EQ(fit({"--covariance", "gauss-newton"})["patches"][0]["covariance_mode"],
            "gauss_newton");
  const Json paper = fit({"--paper", "--containment", "0.9"});
  EXPECT_EQ(paper["options"]["debias_scatter"], false);
  EXPECT_EQ(paper["options"]["containment"], 0.9);
  const auto random = [&](const std::string& seed) {
    return fit({"--seed-strategy",
                "random",
                "--seeds",
                "6",
                "--random-seed",
                seed})["patches"][0]["seed"]["index"];
  };
  EXPECT_EQ(random("3"), random("3"));
  EXPECT_NE(random("3"), random("4"));
}

TEST(FitProgram, DepthImage)
{
  const std::string folder = freshFolder("fit_depth");
  test::writeFile(folder + "/depth.pgm", test::pgmBytes(test::bowlCloud(40, 30), 1000));
  const auto run = runProgram(folder, {"fit", folder + "/depth.pgm", "--json", "-"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("intrinsics scaled from 640 to 40"), std::string::npos)
      << run.err;
  EXPECT_GT(Json::parse(run.out)["patches"].size(), 1U);
}

TEST(FitProgram, RecordedCloudsRunClean)
{
  const std::string folder = freshFolder("fit_recorded");
  for (const std::string name : {"gpd_krylon_can.pcd",
                                 "mosd_cyl_learn44.pcd",
                                 "pcl_milk_clorox_carpet.pcd",
                                 "pcl_table_mug_stereo.pcd",
                                 "rosind_table_boxes.pcd"}) {
    const std::string path = test::recordedCloud(name);
    if (path.empty())
      GTEST_SKIP() << "no recorded clouds: set HOLDFAST_DATA_DIR";
    const auto run = runProgram(folder,
                                {"fit",
                                 path,
                                 "--seeds",
                                 "300",
                                 "--radius",
                                 "0.02",
                                 "--accept",
                                 "all",
                                 "--json",
                                 "-"});
    EXPECT_EQ(run.exit_code, 0) << name << run.err;
    EXPECT_GT(Json::parse(run.out)["patches"].size(), 10U) << name;
  }
}

}} // namespace holdfast
