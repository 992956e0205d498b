// Feet from YAML: what is written is what is read, and nothing else is taken.
#include <holdfast/io/foot_file.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast { namespace {

namespace fs = std::filesystem;

const std::string kGood = "name: mine\n" // 1
                          "sole:\n" // 2
                          "  length_m: 0.2\n" // 3
                          "  width_m: 0.1\n" // 4
                          "curvature:\n" // 5
                          "  x_per_m: -2\n" // 6
                          "  y_per_m: 3.5\n" // 7
                          "ankle: stiff\n" // 8
                          "friction:\n" // 9
                          "  mean: 0.6\n" // 10
                          "  sigma: 0.1\n" // 11
                          "tolerances:\n" // 12
                          "  height_m: 0.02\n" // 13
                          "  tilt_rad: 0.1\n" // 14
                          "  gap_m: 0.008\n" // 15
                          "  contact_m: 0.003\n" // 16
                          "  min_support: 0.8\n"; // 17

class FootFile : public testing::Test {
protected:
  FootFile()
  : folder_(fs::path(HOLDFAST_SCRATCH_DIR) /
            (std::string("foot_") +
             testing::UnitTest::GetInstance()->current_test_info()->name()))
  , file_((folder_ / "foot.yaml").string())
  {
    fs::create_directories(folder_);
  }

  ~FootFile() override
  {
    fs::remove_all(folder_);
  }

  Foot load(const std::string& text) const
  {
    std::ofstream(file_) << text;
    return loadFoot(file_);
  }

  std::string errorOf(const std::string& text) const
  {
    try {
      load(text);
    }
    catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos);
      EXPECT_EQ(message.rfind(file_ + ":", 0), 0u) << message;
      return message.substr(file_.size() + 1);
    }
    return "";
  }

  /// The good text with one piece of it exchanged.
  static std::string with(const std::string& old_text, const std::string& new_text)
  {
    std::string text = kGood;
    const std::size_t at = text.find(old_text);
    EXPECT_NE(at, std::string::npos) << old_text;
    return text.replace(at, old_text.size(), new_text);
  }

private:
  fs::path folder_;
  std::string file_;
};

TEST_F(FootFile, IsReadAsItIsWritten)
{
  const Foot foot = load(kGood);
  EXPECT_EQ(foot.name, "mine");
  ASSERT_EQ(foot.sole.size(), 4u);
  EXPECT_DOUBLE_EQ(soleArea(foot), 0.02);
  EXPECT_DOUBLE_EQ(soleReach(foot), std::hypot(0.1, 0.05));
  EXPECT_EQ(foot.curvature, Eigen::Vector2d(-2.0, 3.5));
  EXPECT_EQ(foot.ankle, Ankle::Stiff);
  EXPECT_EQ(foot.friction.mean, 0.6);
  EXPECT_EQ(foot.friction.sigma, 0.1);
  EXPECT_EQ(foot.tolerances.height_m, 0.02);
  EXPECT_EQ(foot.tolerances.tilt_rad, 0.1);
  EXPECT_EQ(foot.tolerances.gap_m, 0.008);
  EXPECT_EQ(foot.tolerances.contact_m, 0.003);
  EXPECT_EQ(foot.tolerances.min_support, 0.8);
}

TEST_F(FootFile, HasThreeKindsOfSoles)
{
  const std::string rectangle = "  length_m: 0.2\n  width_m: 0.1\n";
  const Foot disc = load(with(rectangle, "  radius_m: 0.02\n"));
  EXPECT_NEAR(soleArea(disc), 3.14159265358979 * 4e-4, 1e-12);
  const Foot corners = load(
      with(rectangle, "  corners_m: [[0.1, 0], [-0.05, +0.04], [-0.05, -4e-2]]\n"));
  ASSERT_EQ(corners.sole.size(), 3u);
  EXPECT_EQ(corners.sole[1], Eigen::Vector2d(-0.05, 0.04));
  const std::string ways = ": a sole is corners_m, radius_m, or length_m and width_m";
  EXPECT_EQ(errorOf(with(rectangle, rectangle + "  radius_m: 0.1\n")),
            "3: sole.length_m goes without radius_m" + ways);
  EXPECT_EQ(errorOf(with(rectangle, "  radius_m: 1\n  corners_m: [[0, 1]]\n")),
            "3: sole.radius_m goes without corners_m" + ways);
}

TEST_F(FootFile, NamesTheLineAndTheKey)
{
  const std::string rectangle = "  length_m: 0.2\n  width_m: 0.1\n";
  const auto corners = [&](const std::string& list) {
    return errorOf(with(rectangle, "  corners_m: " + list + "\n"));
  };
  EXPECT_EQ(errorOf(with("0.2", "-0.2")), "3: sole.length_m must be > 0");
  EXPECT_EQ(errorOf(with("  width_m: 0.1\n", "")), "2: sole.width_m is missing");
  EXPECT_EQ(corners("[[0, 0], [1, 0]]"),
            "2: sole makes no sense: a sole wants at least three corners");
  EXPECT_EQ(corners("[[0, 0], [1, 1], [1, 0], [0, 1]]"),
            "2: sole makes no sense: the edges of a sole must not cross or touch each "
            "other");
  EXPECT_EQ(corners("[[0, 0], [1, nan], [0, 1]]"),
            "3: sole.corners_m[1] must be a pair of finite numbers [x, y]");
  EXPECT_EQ(corners("[[0, 0], [1, 0, 0], [0, 1]]"),
            "3: sole.corners_m[1] must be a pair of finite numbers [x, y]");
  EXPECT_EQ(corners("[[0, 0], [0.2, 0], [0.2, 5e-4]]"),
            "2: sole makes no sense: a sole must be at least 1 mm long and wide");
  EXPECT_EQ(corners("all"), "3: sole.corners_m must be a list of pairs [x, y]");
  EXPECT_EQ(errorOf(with("3.5", ".inf")),
            "7: curvature.y_per_m must be a finite number");
  EXPECT_EQ(errorOf(with("stiff", "limp")),
            "8: ankle must be compliant or stiff, not limp");
  EXPECT_EQ(errorOf(with("mean: 0.6", "mean: -0.6")), "10: friction.mean must be > 0");
  EXPECT_EQ(errorOf(with("sigma: 0.1", "sigma: -0.1")),
            "11: friction.sigma must be >= 0");
  EXPECT_EQ(errorOf(with("sigma: 0.1", "sigma: 0.7")),
            "11: friction.sigma must not be above the mean");
  EXPECT_EQ(errorOf(with("sigma: 0.1", "sigma: .nan")),
            "11: friction.sigma must be a finite number");
  EXPECT_EQ(errorOf(with("  gap_m: 0.008\n", "  gap_m: -0.008\n")),
            "15: tolerances.gap_m must be > 0");
  EXPECT_EQ(
      errorOf(with("0.003", "0.009")),
      "16: tolerances.contact_m must not be above gap_m: what is in contact would "
      "be too far");
  EXPECT_EQ(errorOf(with("0.003", ".nan")),
            "16: tolerances.contact_m must be a finite number");
  EXPECT_EQ(errorOf(with("  tilt_rad: 0.1\n", "")),
            "12: tolerances.tilt_rad is missing");
  EXPECT_EQ(errorOf(with("tilt_rad: 0.1", "tilt_rad: 1.6")),
            "12: tolerances make no sense: the tolerance of tilt must be between 0 and "
            "1.5 rad");
  EXPECT_EQ(errorOf(with("min_support: 0.8", "min_support: 1.2")),
            "17: tolerances.min_support must be a share, at most 1");
  EXPECT_EQ(errorOf(kGood + "toes: 5\n"), "18: toes is not a known key");
  EXPECT_EQ(errorOf(with("name: mine\n", "name: mine\nname: yours\n")),
            "2: name is given twice");
  EXPECT_EQ(errorOf("- 1\n"), "1: file must be a list of `key: value`");
  EXPECT_NE(errorOf("a: [1\n"), "");
}

TEST_F(FootFile, LeavesTheTiltOutWithACompliantAnkle)
{
  std::string text = with("stiff", "compliant");
  EXPECT_EQ(errorOf(text),
            "14: tolerances.tilt_rad goes with ankle: stiff; a compliant one tilts "
            "freely");
  text.erase(text.find("  tilt_rad: 0.1\n"), 16);
  EXPECT_EQ(load(text).ankle, Ankle::Compliant);
  std::string flat = text;
  flat.erase(flat.find("curvature:"), flat.find("ankle:") - flat.find("curvature:"));
  EXPECT_EQ(load(flat).curvature, Eigen::Vector2d(0.0, 0.0));
}

TEST_F(FootFile, ComesWithExamples)
{
  const std::vector<std::string> feet = listFeet();
  for (const std::string name : {"gripper_pad", "humanoid_foot", "point_foot"})
    EXPECT_NE(std::find(feet.begin(), feet.end(), name), feet.end()) << name;
  for (const std::string& name : feet) {
    const Foot foot = loadFoot(name);
    EXPECT_EQ(foot.name, name);
    EXPECT_EQ(validityError(foot), "");
  }
  EXPECT_NEAR(soleArea(loadFoot("humanoid_foot")), 0.02, 1e-12);
  try {
    loadFoot(HOLDFAST_SCRATCH_DIR);
    FAIL();
  }
  catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "foot " HOLDFAST_SCRATCH_DIR ": is a folder, not a file");
  }
  try {
    loadFoot("clown_shoe");
    FAIL();
  }
  catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what())
                  .rfind("foot clown_shoe: no such file, and no "
                         "built-in foot of that name (",
                         0),
              0u);
  }
}

}} // namespace holdfast
