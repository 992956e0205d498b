// `holdfast risk`: what it writes, and one clear line for everything that is wrong.
#include "support/run_program.h"

#include <holdfast/contact/risk_grid.h>
#include <holdfast/io/patch_map_file.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <png.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Json = nlohmann::json;

const std::string kRocks = HOLDFAST_SOURCE_DIR "/samples/rocks.pcd";

class RiskProgram : public testing::Test {
protected:
  RiskProgram()
  : folder_(test::freshFolder(
        std::string("risk_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  {}

  test::ProgramRun run(std::vector<std::string> arguments) const
  {
    arguments.insert(arguments.begin(), "risk");
    return test::runProgram(folder_, arguments);
  }

  std::string path(const std::string& name) const
  {
    return folder_ + "/" + name;
  }

  /// The rocks under a ball foot.
  Json rocks(std::vector<std::string> more = {}) const
  {
    std::vector<std::string> arguments{kRocks,
                                       "--foot",
                                       "point_foot",
                                       "-o",
                                       path("risk.json"),
                                       "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const test::ProgramRun result = run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    EXPECT_EQ(result.out, "");
    return Json::parse(test::readFile(path("risk.json")));
  }

  /// One line that says it, and exit code 1.
  void expectError(const std::vector<std::string>& arguments,
                   const std::string& words) const
  {
    const test::ProgramRun result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << words;
    EXPECT_NE(result.err.find(words), std::string::npos)
        << "wanted: " << words << "\ngot: " << result.err;
    EXPECT_EQ(result.errorLines(), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }

  /// A foot file with one piece of the humanoid's exchanged.
  std::string foot(const std::string& old_text, const std::string& new_text) const
  {
    std::string text =
        test::readFile(HOLDFAST_SOURCE_DIR "/config/feet/humanoid_foot.yaml");
    const std::size_t at = text.rfind(old_text);
    EXPECT_NE(at, std::string::npos) << old_text;
    test::writeFile(path("foot.yaml"), text.replace(at, old_text.size(), new_text));
    return path("foot.yaml");
  }

  std::string folder_;
};

void
expectNumbers(const Json& json, int count)
{
  ASSERT_TRUE(json.is_array());
  ASSERT_EQ(static_cast<int>(json.size()), count);
  for (const Json& number : json)
    EXPECT_TRUE(number.is_number());
}

TEST_F(RiskProgram, WritesWhatItsPageSays)
{
  const Json json = rocks();
  EXPECT_EQ(json["source"], kRocks);
  EXPECT_EQ(json["frame"], "cloud");
  EXPECT_GT(json["cloud_points"]["used"], 0);
  EXPECT_EQ(json["sensor"]["viewpoint_credible"], true);
  EXPECT_NE(json["notices"].dump().find("intrinsics recovered"), std::string::npos);
  EXPECT_EQ(json["foot"]["name"], "point_foot");
  expectNumbers(json["load_direction"], 3);
  EXPECT_EQ(json["assumptions"].size(), kRiskAssumptions.size());
  const Json& ranking = json["ranking"];
  int counted = 0;
  for (const char* name : {"footholds",
                           "unseen",
                           "without_support",
                           "not_facing",
                           "too_near",
                           "beyond_limit"})
    counted += ranking[name].get<int>();
  EXPECT_EQ(counted, ranking["candidates"].get<int>());
  EXPECT_EQ(json["patches"].size(), ranking["candidates"].get<std::size_t>());
  ASSERT_EQ(json["footholds"].size(), ranking["footholds"].get<std::size_t>());
  ASSERT_GT(json["footholds"].size(), 3u);
  double last = 0.0;
  for (const Json& foothold : json["footholds"]) {
    expectNumbers(foothold["pose"]["position"], 3);
    expectNumbers(foothold["pose"]["orientation_wxyz"], 4);
    ASSERT_EQ(foothold["pose_covariance"].size(), 6u);
    expectNumbers(foothold["pose_covariance"][0], 6);
    EXPECT_TRUE(foothold["type"].is_string());
    expectNumbers(foothold["kappa"], 2);
    const Json& risk = foothold["risk"];
    double sum = 0.0;
    for (const char* name : {"slip", "height", "tilt", "gap", "support"}) {
      EXPECT_GE(risk[name].get<double>(), 0.0);
      EXPECT_LE(risk[name].get<double>(), 1.0);
      sum += risk[name].get<double>();
    }
    EXPECT_NEAR(risk["total"].get<double>(), std::min(sum, 1.0), 1e-12);
    EXPECT_LE(risk["joint"].get<double>(), risk["total"].get<double>() + 1e-9);
    EXPECT_GE(risk["total"].get<double>(), last - 1e-6);
    last = risk["total"].get<double>();
    for (const char* name : {"cvar_gap_m",
                             "contact_area_m2",
                             "support_share",
                             "yaw_rad",
                             "views",
                             "last_seen"})
      EXPECT_TRUE(foothold[name].is_number()) << name;
  }
  EXPECT_EQ(test::readFile(path("risk.json")).find("nan"), std::string::npos);
}

TEST_F(RiskProgram, WritesPlanarRegionsAsTheMessagesHaveThem)
{
  const Json json = rocks();
  ASSERT_FALSE(json["planar_regions"].empty());
  for (const Json& region : json["planar_regions"]) {
    EXPECT_TRUE(region["plane_parameters"]["position"]["z"].is_number());
    EXPECT_TRUE(region["plane_parameters"]["orientation"]["w"].is_number());
    for (const char* side : {"min_x", "min_y", "max_x", "max_y"})
      EXPECT_TRUE(region["bbox2d"][side].is_number());
    const Json& outer = region["boundary"]["outer_boundary"]["points"];
    ASSERT_GE(outer.size(), 3u);
    EXPECT_TRUE(outer[0]["x"].is_number());
    EXPECT_TRUE(region["boundary"]["holes"].is_array());
    for (const Json& inset : region["insets"])
      EXPECT_GE(inset["outer_boundary"]["points"].size(), 3u);
  }
}

TEST_F(RiskProgram, SaysTheLoadAndWhatIsLeftOut)
{
  const test::ProgramRun result = run({kRocks, "--foot", "point_foot", "--best", "3"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("the load is taken to be along"), std::string::npos);
  EXPECT_NE(result.out.find("3 footholds"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("beyond --best"), std::string::npos) << result.out;
  const test::ProgramRun named =
      run({kRocks, "--foot", "point_foot", "--load-direction", "0", "0", "-1"});
  EXPECT_EQ(named.exit_code, 0) << named.err;
  EXPECT_EQ(named.err.find("the load is taken to be"), std::string::npos);
  const test::ProgramRun piped = run({kRocks, "--foot", "point_foot", "-o", "-"});
  EXPECT_TRUE(Json::parse(piped.out).is_object());
}

TEST_F(RiskProgram, TakesMaps)
{
  const test::ProgramRun made = test::runProgram(
      folder_,
      {"map", kRocks, "-o", path("rocks.map"), "--radius", "0.04", "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  // Down in the frame of its camera, which is that of the map.
  const std::vector<std::string> load{"--load-direction", "0", "0.765", "0.644"};
  std::vector<std::string> arguments{path("rocks.map"),
                                     "--foot",
                                     "point_foot",
                                     "-o",
                                     path("risk.json"),
                                     "--quiet"};
  arguments.insert(arguments.end(), load.begin(), load.end());
  const test::ProgramRun result = run(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(test::readFile(path("risk.json")));
  EXPECT_EQ(json["frame"], "map");
  EXPECT_GT(json["footholds"].size(), 3u);
  // A map whose support grids are empty gives no number at all.
  StoredMap stored = loadPatchMap(path("rocks.map"));
  PatchMap::Snapshot blind = stored.map.snapshot();
  for (MapPatch& patch : blind.patches)
    patch.support = SupportGrid();
  savePatchMap(path("blind.map"), {PatchMap(blind), stored.sensor});
  expectError({path("blind.map"), "--foot", "point_foot"}, "no support grids");
  blind.patches.clear();
  savePatchMap(path("empty.map"), {PatchMap(blind), stored.sensor});
  expectError({path("empty.map"), "--foot", "point_foot", "--quiet"},
              "no patch to step on");
  expectError({path("rocks.map"),
               "--foot",
               "humanoid_foot",
               "--quiet",
               "--load-direction",
               "0",
               "1",
               "0"},
              "make the map with --radius");
}

TEST_F(RiskProgram, WritesLayers)
{
  rocks({"--layers", path("layers.pcd"), "--resolution", "0.03", "--yaws", "4"});
  const std::string pcd = test::readFile(path("layers.pcd"));
  for (const std::string_view layer : kRiskLayerNames)
    EXPECT_NE(pcd.substr(0, 600).find(layer), std::string::npos) << layer;
  rocks({"--layers", path("layers.png"), "--resolution", "0.03", "--yaws", "4"});
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, path("layers.png").c_str()), 0);
  EXPECT_GT(image.width, 100u);
  png_image_free(&image);

  rocks({"--layers", path("layers.tif"), "--resolution", "0.03", "--yaws", "4"});
  const std::string tif = test::readFile(path("layers.tif"));
  const auto number = [&](std::size_t at, int bytes) {
    std::uint32_t value = 0;
    for (int i = bytes - 1; i >= 0; --i)
      value = value << 8 | static_cast<unsigned char>(tif.at(at + i));
    return value;
  };
  ASSERT_EQ(tif.substr(0, 2), "II");
  // From directory to directory: one for each layer, named so, of floats.
  std::vector<std::string> names;
  for (std::uint32_t at = number(4, 4); at != 0;) {
    const std::uint32_t entries = number(at, 2);
    for (std::uint32_t i = 0; i < entries; ++i) {
      const std::size_t entry = at + 2 + 12 * i;
      if (number(entry, 2) == 270)
        names.emplace_back(tif.c_str() + number(entry + 8, 4));
      if (number(entry, 2) == 258) {
        EXPECT_EQ(number(entry + 8, 4), 32u);
      }
    }
    at = number(at + 2 + 12 * entries, 4);
  }
  EXPECT_EQ(names,
            std::vector<std::string>(kRiskLayerNames.begin(), kRiskLayerNames.end()));
}

TEST_F(RiskProgram, IsDrawn)
{
  rocks({"--best", "5"});
  const test::ProgramRun drawn = test::runProgram(folder_,
                                                  {"render",
                                                   path("risk.json"),
                                                   "--color",
                                                   "risk",
                                                   "-o",
                                                   path("risk.png"),
                                                   "--quiet"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_GT(std::filesystem::file_size(path("risk.png")), 10000u);
  const test::ProgramRun other = test::runProgram(
      folder_,
      {"render", path("risk.json"), "-o", path("other.png"), "--quiet"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_EQ(other.errorLines(), 1) << other.err;
  test::writeFile(path("no.json"), "{\"patches\": []}");
  const test::ProgramRun no = test::runProgram(
      folder_,
      {"render", path("no.json"), "--color", "risk", "-o", path("no.png")});
  EXPECT_EQ(no.exit_code, 1);
  EXPECT_NE(no.err.find("no result of 'holdfast risk'"), std::string::npos);
}

TEST_F(RiskProgram, NamesWhatIsWrongWithAFoot)
{
  const auto expectFoot = [&](const std::string& old_text,
                              const std::string& new_text,
                              const std::string& words) {
    expectError({kRocks, "--foot", foot(old_text, new_text)}, words);
  };
  const std::string rectangle = "  length_m: 0.2\n  width_m: 0.1\n";
  expectFoot(rectangle,
             "  corners_m: [[0, 0], [0.1, 0]]\n",
             "a sole wants at least three corners");
  expectFoot(rectangle,
             "  corners_m: [[0, 0], [0.1, 0.1], [0.1, 0], [0, 0.1]]\n",
             "must not cross");
  expectFoot("mean: 0.7", "mean: -0.7", "friction.mean must be > 0");
  expectFoot("sigma: 0.15", "sigma: .nan", "friction.sigma must be a finite number");
  expectFoot("gap_m: 0.008", "gap_m: -0.008", "tolerances.gap_m must be > 0");
  expectFoot("contact_m: 0.003", "contact_m: .nan", "tolerances.contact_m must be");
  expectFoot("ankle: compliant", "ankle: stiff", "tolerances.tilt_rad is missing");
  expectFoot("ankle: compliant", "ankles: 2", "ankle is missing");
  expectFoot("sigma: 0.15", "sigma: 0.8", "friction.sigma must not be above the mean");
  expectFoot("  length_m: 0.2\n", "  length_m: 0.0002\n", "at least 1 mm");
  expectFoot("contact_m: 0.003",
             "contact_m: 0.01",
             "contact_m must not be above gap_m");
  expectFoot("  contact_m: 0.003\n",
             "  contact_m: 0.003\n  tilt_rad: 0.1\n",
             "tilt_rad goes with ankle: stiff");
  expectFoot("  length_m: 0.2\n",
             "  length_m: 0.2\n  radius_m: 0.1\n",
             "length_m goes without radius_m");
  expectError({kRocks, "--foot", folder_}, "is a folder, not a file");
  expectError({kRocks, "--foot", "flipper"}, "no built-in foot of that name");
}

// Of a direction the length does not count, however long or short.
TEST_F(RiskProgram, TakesLoadsOfAnyLength)
{
  const auto pointed = [&](const std::string& y, const std::string& z) {
    return rocks({"--load-direction", "0", y, z})["footholds"];
  };
  const Json footholds = pointed("0.75", "0.5");
  EXPECT_FALSE(footholds.empty());
  EXPECT_EQ(pointed("0.75e-300", "0.5e-300").size(), footholds.size());
  EXPECT_EQ(pointed("0.75e300", "0.5e300").size(), footholds.size());
}

TEST_F(RiskProgram, NamesWhatIsWrongWithTheRest)
{
  const std::vector<std::string> cells{kRocks,
                                       "--foot",
                                       "point_foot",
                                       "--quiet",
                                       "--layers",
                                       path("layers.pcd")};
  std::vector<std::string> fine = cells;
  fine.insert(fine.end(), {"--resolution", "1e-6"});
  expectError(fine, "a --resolution of 1e-06 m makes more than 10 million cells");
  EXPECT_NE(run({kRocks, "--foot", "point_foot", "--spacing", "-1"})
                .err.find("--spacing: -1 is neither 0 nor a positive number"),
            std::string::npos);

  expectError({kRocks, "--foot", "point_foot", "--load-direction", "0", "0", "0"},
              "the direction of the load must be finite and not zero");
  expectError({kRocks, "--foot", "point_foot", "--load-direction", "0", "nan", "0"},
              "the direction of the load must be finite and not zero");
  expectError(
      {kRocks, "--foot", "point_foot", "--load-direction", "0", "0", "1", "--quiet"},
      "--load-direction");
  expectError({path("none.pcd"), "--foot", "point_foot"}, "none.pcd");
  expectError({path("none.map"), "--foot", "point_foot"}, "none.map");
  test::writeFile(path("bad.map"), "no map");
  expectError({path("bad.map"), "--foot", "point_foot"}, "bad.map");
  test::writeFile(path("result.json"), "{}");
  expectError({path("result.json"), "--foot", "point_foot"}, "is a result");
  expectError({kRocks, "--foot", "humanoid_foot", "--radius", "0.03", "--quiet"},
              "the sole reaches 0.112 m");
  expectError({kRocks, "--foot", "point_foot", "--radius", "0.004", "--quiet"},
              "no patch of a radius of 0.004 m fits this cloud");
  for (const std::vector<std::string>& usage : std::vector<std::vector<std::string>>{
           {kRocks},
           {kRocks, "--foot", "point_foot", "--yaws", "0"},
           {kRocks, "--foot", "point_foot", "--best", "0"},
           {kRocks, "--foot", "point_foot", "--spacing", "-1"},
           {kRocks, "--foot", "point_foot", "-o", "risk.txt"},
           {kRocks, "--foot", "point_foot", "--layers", "layers.gif"},
           {kRocks, "--foot", "point_foot", "--resolution", "0.1"},
           {"x.map", "--foot", "point_foot", "--radius", "0.1"}}) {
    const test::ProgramRun result = run(usage);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_EQ(result.errorLines(), 1) << result.err;
  }
}

}} // namespace holdfast
