#include <holdfast/io/atomic_folder.h>

#include "support/run_program.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast { namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class AtomicFolders : public testing::Test {
protected:
  AtomicFolders()
  : folder_(test::freshFolder(
        std::string("atomic_folder_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  , path_(folder_ + "/out")
  {}

  std::string complaintAbout(const std::string& path) const
  {
    try {
      AtomicFolder{path};
      return "";
    }
    catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  std::string folder_;
  std::string path_;
};

TEST_F(AtomicFolders, AppearWithAllTheirFiles)
{
  AtomicFolder out(path_ + "/"); // a slash at its end means nothing
  test::writeFile(out.temporaryPath() + "/a", "1");
  EXPECT_FALSE(fs::exists(path_));
  test::writeFile(out.temporaryPath() + "/b", "2");
  out.commit();
  EXPECT_EQ(test::filesIn(path_), (Names{"a", "b"}));
  EXPECT_EQ(test::filesIn(folder_), Names{"out"});
}

TEST_F(AtomicFolders, LeaveNothingWithoutCommit)
{
  {
    AtomicFolder out(path_);
    test::writeFile(out.temporaryPath() + "/a", "1");
  }
  EXPECT_EQ(test::filesIn(folder_), Names{});
}

TEST_F(AtomicFolders, TakeThePlaceOfEmptyOnes)
{
  fs::create_directory(path_);
  fs::create_directory_symlink("out", folder_ + "/link");
  AtomicFolder out(folder_ + "/link");
  test::writeFile(out.temporaryPath() + "/a", "1");
  out.commit();
  EXPECT_TRUE(fs::is_symlink(folder_ + "/link"));
  EXPECT_EQ(test::filesIn(path_), Names{"a"});
}

TEST_F(AtomicFolders, DoNotTouchWhatIsThere)
{
  fs::create_directory(path_);
  test::writeFile(path_ + "/mine", "1");
  test::writeFile(folder_ + "/file", "1");
  EXPECT_EQ(complaintAbout(path_),
            path_ + ": is a folder with files in it: name a new one");
  EXPECT_EQ(complaintAbout(folder_ + "/file"),
            folder_ + "/file: is there already, and no folder");
  EXPECT_EQ(complaintAbout(folder_ + "/none/out"),
            folder_ + "/none/out: cannot be written: No such file or directory");
  EXPECT_EQ(complaintAbout(""), ": cannot be written: No such file or directory");
  EXPECT_EQ(test::filesIn(folder_), (Names{"file", "out"}));

  // Put there while ours was filled.
  AtomicFolder out(folder_ + "/other");
  fs::create_directory(folder_ + "/other");
  test::writeFile(folder_ + "/other/theirs", "1");
  EXPECT_THROW(out.commit(), std::runtime_error);
  EXPECT_EQ(test::filesIn(folder_ + "/other"), Names{"theirs"});
}

TEST_F(AtomicFolders, RemoveWhatKilledWritersHaveLeft)
{
  fs::create_directory(path_ + ".holdfast-partial-0");
  test::writeFile(path_ + ".holdfast-partial-0/a", "1");
  {
    AtomicFolder first(path_), second(path_); // both at work: no leftovers
    EXPECT_NE(first.temporaryPath(), second.temporaryPath());
    EXPECT_EQ(test::filesIn(first.temporaryPath()), Names{});
    first.commit();
    second.commit(); // of two empty ones the last wins
  }
  EXPECT_EQ(test::filesIn(folder_), Names{"out"});
}

}} // namespace holdfast
