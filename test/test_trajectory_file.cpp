#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/io/trajectory_file.h>

#include "support/random.h"
#include "support/run_program.h"

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast { namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class TrajectoryFile : public testing::Test {
protected:
  TrajectoryFile()
  : folder_(test::freshFolder(
        std::string("trajectory_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  , path_(folder_ + "/poses.txt")
  {}

  std::vector<StampedPose> read(const std::string& text) const
  {
    test::writeFile(path_, text);
    return readTrajectory(path_);
  }

  /// What is wrong with it, behind the name of the file; empty: nothing.
  std::string complaint(const std::string& text) const
  {
    try {
      read(text);
      return "";
    }
    catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_EQ(message.substr(0, path_.size() + 2), path_ + ": ");
      return message.substr(path_.size() + 2);
    }
  }

  std::string folder_;
  std::string path_;
};

StampedPose
at(double stamp_s, double x = 0.0, double turn = 0.0)
{
  return {stamp_s, {expMap({0, 0, turn}), {x, 0, 0}}};
}

TEST_F(TrajectoryFile, GivesBackWhatWasWritten)
{
  for (std::uint64_t c = 0; c < 20; ++c) {
    test::Random random(c);
    std::vector<StampedPose> poses;
    double stamp = 1.3e9 + random.uniform(0.0, 1.0); // seconds of an epoch
    for (int i = 0; i < 30; ++i, stamp += random.uniform(1e-3, 2.0))
      poses.push_back({stamp, {random.rotation(), 100.0 * random.normalVector()}});
    writeTrajectory(path_, poses);
    const std::vector<StampedPose> again = readTrajectory(path_);
    ASSERT_EQ(again.size(), poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(again[i].stamp_s, poses[i].stamp_s);
      EXPECT_EQ(again[i].pose.c, poses[i].pose.c);
      // Matrix to quaternion and back: a few roundings of numbers up to 1.
      EXPECT_LT((again[i].pose.R - poses[i].pose.R).norm(), 1e-14);
    }
  }
}

TEST_F(TrajectoryFile, KeepsRotationsByAHalfTurn)
{
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Matrix3d R = expMap(kPi * Eigen::Vector3d::Unit(axis));
    writeTrajectory(path_, {{0.0, {R, {1, 2, 3}}}});
    EXPECT_LT((readTrajectory(path_).front().pose.R - R).norm(), 1e-14);
  }
}

TEST_F(TrajectoryFile, TakesTheDialectsOfText)
{
  const std::string plain = "1 2 3 4 0 0 0 1\n2.5 2 3 4 0 0 1 0\n";
  const std::vector<std::string> same{
      plain,
      "1 2 3 4 0 0 0 1\r\n2.5 2 3 4 0 0 1 0\r\n",
      "1 2 3 4 0 0 0 1\r2.5 2 3 4 0 0 1 0\r",
      "\xef\xbb\xbf# t tx ty tz qx qy qz qw\n" + plain,
      "\n  # indented\n\t\n1\t2  3   4\t0 0 0 1  \n\n 2.5 2 3 4 0 0 1 0",
      "1.0 +2.0 3e0 4 -0 0 0 1\n25e-1 2 3 4 0 0 -1 0\n",
  };
  for (const std::string& text : same) {
    SCOPED_TRACE(text);
    const std::vector<StampedPose> poses = read(text);
    ASSERT_EQ(poses.size(), 2u);
    EXPECT_EQ(poses[0].stamp_s, 1.0);
    EXPECT_EQ(poses[1].stamp_s, 2.5);
    EXPECT_EQ(poses[0].pose.c, Eigen::Vector3d(2, 3, 4));
    EXPECT_TRUE(poses[0].pose.R.isIdentity(0.0));
    EXPECT_TRUE(poses[1].pose.R.isApprox(
        Eigen::Vector3d(-1, -1, 1).asDiagonal().toDenseMatrix()));
  }
}

TEST_F(TrajectoryFile, OrderOfTheQuaternionIsXyzw)
{
  // A quarter turn about z takes x to y.
  const Pose pose = read("0 0 0 0 0 0 0.70710678 0.70710678\n").front().pose;
  EXPECT_LT((pose.toWorld({1, 0, 0}) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-8);
}

TEST_F(TrajectoryFile, NormalisesWhatWasRounded)
{
  const Pose pose = read("0 0 0 0 0.6570 0.6126 -0.2949 -0.3248\n").front().pose;
  EXPECT_LT((pose.R.transpose() * pose.R - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_EQ(complaint("0 0 0 0 0 0 0 1.0009"), "");
  EXPECT_EQ(complaint("0 0 0 0 0 0 0 1.002"),
            "line 1: the quaternion has the norm 1.002, not 1");
  EXPECT_EQ(complaint("0 0 0 0 0 0 0 0"),
            "line 1: the quaternion has the norm 0, not 1");
}

TEST_F(TrajectoryFile, SaysWhatIsWrongAndWhere)
{
  const std::string good = "# poses\n1 0 0 0 0 0 0 1\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"2 nan 0 0 0 0 0 1", "line 3: tx is not finite: 'nan'"},
      {"2 0 0 -inf 0 0 0 1", "line 3: tz is not finite: '-inf'"},
      {"inf 0 0 0 0 0 0 1", "line 3: t is not finite: 'inf'"},
      {"2 0 0 0 0 0 0 1e999", "line 3: qw is not finite: '1e999'"},
      {"2 0 zero 0 0 0 0 1", "line 3: ty is no number: 'zero'"},
      {"2 0 0x1 0 0 0 0 1", "line 3: ty is no number: '0x1'"},
      {"\n2 0 0 0 0 0 0", "line 4: 7 columns, not 8: t tx ty tz qx qy qz qw"},
      {"2 0 0 0 0 0 0 1 9", "line 3: 9 columns, not 8: t tx ty tz qx qy qz qw"},
      {"2", "line 3: 1 column, not 8: t tx ty tz qx qy qz qw"},
      {"2 0 0 0 0 0 0 1 # here", "line 3: 10 columns, not 8: t tx ty tz qx qy qz qw"},
      {"2,0,0,0,0,0,0,1",
       "line 3: has commas: columns are separated by blanks, and decimals written with "
       "a point"},
      {"2 0,5 0 0 0 0 0 1",
       "line 3: has commas: columns are separated by blanks, and decimals written with "
       "a point"},
      {"1 0 0 0 0 0 0 1", "line 3: the stamp 1 is not later than 1 of line 2"},
      {"\n0.5 0 0 0 0 0 0 1", "line 4: the stamp 0.5 is not later than 1 of line 2"},
      {"2 0 0 0 0.5 0.5 0.5 0.6", "line 3: the quaternion has the norm 1.05357, not 1"},
  };
  for (const auto& [line, expected] : cases)
    EXPECT_EQ(complaint(good + line), expected);
}

TEST_F(TrajectoryFile, RefusesOtherFiles)
{
  using namespace std::string_literals;
  EXPECT_EQ(complaint(""), "is empty");
  EXPECT_EQ(complaint("# nothing\n\n"), "has no pose");
  EXPECT_EQ(complaint("\x7f"
                      "ELF\0\0\0"s),
            "is binary, not a trajectory");
  EXPECT_EQ(complaint("<!DOCTYPE html>\n<p>"), "is a web page, not the file itself");
  EXPECT_EQ(complaint("version https://git-lfs.github.com/spec/v1\n"),
            "is a Git LFS pointer, not the file itself");
  EXPECT_EQ(complaint("\x1f\x8b\b\0"s), "is packed by gzip: unpack it first");
  const auto complaintOf = [](const std::string& path) {
    try {
      readTrajectory(path);
    }
    catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaintOf(folder_), folder_ + ": is a directory, not a trajectory");
  EXPECT_EQ(complaintOf(folder_ + "/none"), folder_ + "/none: no such file");
}

TEST_F(TrajectoryFile, WritesOnlyWhatCanBeRead)
{
  const std::vector<std::vector<StampedPose>> wrong{
      {},
      {at(kNaN)},
      {at(0.0, kInfinity)},
      {at(1.0), at(1.0)},
      {at(1.0), at(0.5)},
      {{0.0, {2.0 * Eigen::Matrix3d::Identity(), {0, 0, 0}}}},
  };
  for (const auto& poses : wrong)
    EXPECT_THROW(writeTrajectory(path_, poses), std::invalid_argument);
  EXPECT_TRUE(test::filesIn(folder_).empty());
  EXPECT_THROW(writeTrajectory(folder_ + "/none/poses.txt", {at(0.0)}),
               std::runtime_error);
}

TEST(Trajectory, PoseBetweenTwoGoesTheShorterWay)
{
  for (std::uint64_t c = 0; c < 50; ++c) {
    test::Random random(c);
    const Pose start{random.rotation(), random.normalVector()};
    const Eigen::Vector3d turn = random.uniform(0.0, 3.1) * random.unitVector();
    const Eigen::Vector3d shift = random.normalVector();
    const std::vector<StampedPose> two{
        {2.0, start},
        {6.0, {start.R * expMap(turn), start.c + shift}}};
    const double s = random.uniform(0.0, 1.0);
    const auto between = poseAt(two, 2.0 + 4.0 * s, 4.0);
    ASSERT_TRUE(between);
    EXPECT_LT((between->R - start.R * expMap(s * turn)).norm(), 1e-13);
    EXPECT_LT((between->c - start.c - s * shift).norm(), 1e-14);
  }
}

TEST(Trajectory, HasNoPoseOutsideAndAcrossGaps)
{
  const std::vector<StampedPose> poses{at(1.0, 1.0), at(2.0, 2.0), at(5.0, 5.0)};
  EXPECT_FALSE(poseAt(poses, 0.999, 10.0));
  EXPECT_FALSE(poseAt(poses, 5.001, 10.0));
  EXPECT_FALSE(poseAt(poses, 3.0, 2.9));
  EXPECT_FALSE(poseAt(poses, kNaN, 10.0));
  EXPECT_FALSE(poseAt({}, 1.0, 10.0));
  EXPECT_DOUBLE_EQ(poseAt(poses, 3.0, 3.0)->c.x(), 3.0);
  EXPECT_DOUBLE_EQ(poseAt(poses, 1.25, 1.0)->c.x(), 1.25);
  // At its ends, and at stamps beside a gap, there is a pose whatever the gap.
  for (const StampedPose& pose : poses) {
    const auto found = poseAt(poses, pose.stamp_s, 0.0);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->c, pose.pose.c);
    EXPECT_EQ(found->R, pose.pose.R);
  }
  EXPECT_THROW(poseAt(poses, 1.0, -1.0), std::invalid_argument);
  EXPECT_THROW(poseAt(poses, 1.0, kNaN), std::invalid_argument);
}

TEST(Trajectory, JumpsAreNamed)
{
  std::vector<StampedPose> walk;
  for (int i = 0; i < 20; ++i)
    walk.push_back(at(i, 0.02 * i, 0.01 * i));
  EXPECT_EQ(doubtAbout(walk), "");
  EXPECT_EQ(doubtAbout({}), "");
  EXPECT_EQ(doubtAbout({at(0.0)}), "");

  std::vector<StampedPose> jumps = walk;
  for (std::size_t i = 12; i < jumps.size(); ++i)
    jumps[i].pose.c.x() += 0.7;
  EXPECT_EQ(doubtAbout(jumps),
            "pose 12 (stamp 12) is 0.72 m from the one before, where the median step "
            "is 0.02 m");

  // 24 times the median, but less than half a metre.
  std::vector<StampedPose> hops = walk;
  for (std::size_t i = 12; i < hops.size(); ++i)
    hops[i].pose.c.x() += 0.46;
  EXPECT_EQ(doubtAbout(hops), "");

  std::vector<StampedPose> turns = walk;
  turns[7].pose.R = expMap({0, 0, 1.07});
  EXPECT_EQ(doubtAbout(turns),
            "pose 7 (stamp 7) is 1.01 rad from the one before, where the median step "
            "is 0.01 rad; 2 such jumps in all");

  // Large steps throughout are no jumps.
  EXPECT_EQ(doubtAbout({at(0, 0.0), at(1, 1.0), at(2, 3.0), at(3, 4.0)}), "");
}

}} // namespace holdfast
