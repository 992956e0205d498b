// `holdfast report`: what is in the page and in the glTF, and what is refused. The page
// itself is tested in a browser: test/report/.
#include <holdfast/io/patch_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;

class ReportProgram : public testing::Test {
protected:
  ReportProgram()
  : folder_(test::freshFolder(
        std::string("report_") +
        testing::UnitTest::GetInstance()->current_test_info()->name()))
  , page_(folder_ + "/page.html")
  {}

  /// Fits a bowl whose cloud lies beside its result and is named without a folder.
  std::string fitBowl(const std::string& name) const
  {
    saveCloud(folder_ + "/" + name + ".pcd",
              test::bowlCloud(40, 30, test::tiltedPose(), true));
    const test::ProgramRun run = test::runProgram(
        folder_,
        {"fit", folder_ + "/" + name + ".pcd", "-o", folder_, "--quiet"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const std::string result = folder_ + "/" + name + ".patches.json";
    Json json = Json::parse(test::readFile(result));
    json["cloud"] = name + ".pcd";
    test::writeFile(result, json.dump());
    return result;
  }

  /// \return what the program said on standard error.
  std::string report(Names arguments) const
  {
    arguments.insert(arguments.begin(), "report");
    const test::ProgramRun run = test::runProgram(folder_, arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, "");
    return run.err;
  }

  std::string pageOf(Names arguments) const
  {
    arguments.insert(arguments.end(), {"-o", page_});
    EXPECT_EQ(report(arguments), "");
    return test::readFile(page_);
  }

  /// Expects this exit code, one line that says `what`, and no page.
  void expectError(int exit_code, Names arguments, const std::string& what) const
  {
    arguments.insert(arguments.begin(), "report");
    arguments.insert(arguments.end(), {"-o", page_});
    const test::ProgramRun run = test::runProgram(folder_, arguments);
    EXPECT_EQ(run.exit_code, exit_code) << what << '\n' << run.err;
    EXPECT_EQ(run.errorLines(), 1) << run.err;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(page_)) << what;
  }

  std::string folder_;
  std::string page_;
};

/// The text between the first `begin` and the next `end`.
std::string
between(const std::string& text, const std::string& begin, const std::string& end)
{
  const std::size_t at = text.find(begin);
  if (at == std::string::npos)
    return "";
  const std::size_t from = at + begin.size();
  return text.substr(from, text.find(end, from) - from);
}

/// What the page's script reads.
std::string
dataOf(const std::string& page)
{
  return between(page, "<script type=\"application/json\" id=\"data\">", "</script>");
}

std::size_t
count(const std::string& text, const std::string& word)
{
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos;
       at = text.find(word, at + 1))
    ++n;
  return n;
}

TEST_F(ReportProgram, ThePageForbidsEveryRequest)
{
  const std::string page = pageOf({fitBowl("bowl")});
  const std::string policy =
      between(page, "http-equiv=\"Content-Security-Policy\" content=\"", "\"");
  EXPECT_EQ(policy.find("default-src 'none'; script-src 'sha256-"), 0U) << policy;
  EXPECT_EQ(policy.find("unsafe"), std::string::npos) << policy;
  EXPECT_EQ(policy.find("http"), std::string::npos) << policy;
  EXPECT_EQ(count(page, "<link"), 0U);
  EXPECT_EQ(count(page, " src=\""), 0U);
  // The policy comes before what it is about.
  EXPECT_LT(page.find("Content-Security-Policy"), page.find("<style"));
}

TEST_F(ReportProgram, TheDataHoldTheResult)
{
  const std::string result = fitBowl("bowl");
  const Json file = Json::parse(test::readFile(result));
  const Json data = Json::parse(dataOf(pageOf({result})));
  ASSERT_EQ(data.at("results").size(), 1U);
  const Json& shown = data.at("results").at(0);
  EXPECT_EQ(shown.at("title"), "bowl.pcd");
  EXPECT_EQ(shown.at("patches"), file.at("patches").size());
  for (const char* member : {"options", "sensor", "rejected", "notices", "holdfast"})
    EXPECT_EQ(shown.at("head").at(member), file.at(member)) << member;
  EXPECT_EQ(shown.at("cloud").at("of"), 1199);
  EXPECT_EQ(shown.at("cloud").at("positions").at("length"), 3 * 1199);
  EXPECT_TRUE(shown.at("view").at("seen"));
}

TEST_F(ReportProgram, NamesCannotEndTheData)
{
  const std::string result = fitBowl("bowl");
  const std::string nasty = "</script><script>alert(1)</script><!-- \" \xc3\xbc \xff";
  std::string text = test::readFile(result);
  const std::string name = "\"bowl.pcd\"";
  std::string quoted = nasty;
  quoted.replace(quoted.find('"'), 1, "\\\"");
  text.replace(text.find(name), name.size(), "\"" + quoted + "\"");
  // A byte that is no UTF-8 makes a file no JSON; the name itself may well be one.
  test::writeFile(folder_ + "/bytes.json", text);
  expectError(1, {folder_ + "/bytes.json"}, "bytes.json: no result");
  text.erase(text.find('\xff'), 1);
  test::writeFile(folder_ + "/nasty.json", text);
  report({folder_ + "/nasty.json", "-o", page_, "--quiet"});
  const std::string page = test::readFile(page_);
  const std::string data = dataOf(page);
  EXPECT_EQ(data.find('<'), std::string::npos);
  EXPECT_EQ(count(page, "</script"), 2U);
  EXPECT_EQ(count(page, "<script>alert"), 0U);
  EXPECT_EQ(Json::parse(data).at("results").at(0).at("head").at("cloud"),
            nasty.substr(0, nasty.size() - 1));
}

TEST_F(ReportProgram, SameInputSamePage)
{
  const std::string result = fitBowl("bowl");
  EXPECT_EQ(pageOf({result}), pageOf({result}));
}

TEST_F(ReportProgram, CloudsAreThinnedToTheSizeAskedFor)
{
  const std::string cloud = folder_ + "/large.pcd";
  saveCloud(cloud, test::bowlCloud(400, 300, test::tiltedPose(), true));
  const test::ProgramRun fit = test::runProgram(
      folder_,
      {"fit", cloud, "--whole", "--accept", "all", "-o", folder_, "--quiet"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  const std::string result = folder_ + "/large.patches.json";
  const auto points = [](const std::string& page) {
    const Json data = Json::parse(dataOf(page));
    return data.at("results").at(0).at("cloud").at("positions").at("length").get<int>();
  };
  const std::string small = pageOf({result, "--max-size", "1"});
  EXPECT_LE(small.size(), 1000000U);
  const std::string large = pageOf({result, "--max-size", "3"});
  EXPECT_LE(large.size(), 3000000U);
  EXPECT_GE(points(small), 3 * 5000);
  EXPECT_LT(points(small), points(large));
  EXPECT_EQ(points(large), 3 * 50000);
}

TEST_F(ReportProgram, LinesOfObjectsAreSeveralResults)
{
  const std::string a = test::readFile(fitBowl("a"));
  const std::string b = test::readFile(fitBowl("b"));
  test::writeFile(folder_ + "/lines.json", a + "\n" + b + "\n");
  const Json data = Json::parse(dataOf(pageOf({folder_ + "/lines.json"})));
  ASSERT_EQ(data.at("results").size(), 2U);
  EXPECT_EQ(data.at("results").at(0).at("title"), "a.pcd");
  EXPECT_EQ(data.at("results").at(1).at("title"), "b.pcd");
}

TEST_F(ReportProgram, AResultWithoutItsCloudOrAPatchIsShown)
{
  const std::string result = fitBowl("bowl");
  std::filesystem::remove(folder_ + "/bowl.pcd");
  const std::string said = report({result, "-o", page_});
  EXPECT_NE(said.find("bowl.pcd was neither"), std::string::npos) << said;
  const Json data = Json::parse(dataOf(test::readFile(page_)));
  const std::string note = data.at("results").at(0).at("cloud").at("note");
  EXPECT_NE(note.find("bowl.pcd"), std::string::npos);
  Json none = Json::parse(test::readFile(result));
  none["patches"] = Json::array();
  test::writeFile(folder_ + "/none.json", none.dump());
  report({folder_ + "/none.json", "-o", page_, "--quiet"});
  EXPECT_EQ(
      Json::parse(dataOf(test::readFile(page_))).at("results").at(0).at("patches"),
      0);
}

/// A little-endian number in a file.
std::uint32_t
word(const std::string& bytes, std::size_t at)
{
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

TEST_F(ReportProgram, GlTfHasPatchesAndEllipsoids)
{
  const std::string result = fitBowl("bowl");
  const std::string glb = folder_ + "/bowl.glb";
  EXPECT_EQ(report({result, "--glb", glb}), "");
  const std::string bytes = test::readFile(glb);
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2U);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const Json gltf = Json::parse(bytes.substr(20, word(bytes, 12)));
  EXPECT_EQ(gltf.at("nodes").at(0).at("name"), "bowl.pcd: patches");
  EXPECT_EQ(gltf.at("nodes").at(1).at("name"),
            "bowl.pcd: centres at 3 sigma, 10 times as large as they are");
  EXPECT_FALSE(std::filesystem::exists(page_));
}

TEST_F(ReportProgram, BadResultsAreNamed)
{
  const std::string result = fitBowl("bowl");
  const std::string text = test::readFile(result);
  const auto write = [&](const std::string& name, const std::string& bytes) {
    test::writeFile(folder_ + "/" + name, bytes);
    return folder_ + "/" + name;
  };
  Json impossible = Json::parse(text), turned = impossible;
  impossible["patches"][0]["parameters"][0] = -1.0;
  turned["sensor"]["position"] = {1, "two"};
  expectError(1, {folder_ + "/missing.json"}, "missing.json: cannot be read");
  expectError(1, {folder_}, ": is a directory");
  expectError(1, {write("empty.json", "")}, "empty.json: no result");
  expectError(1, {write("cut.json", text.substr(0, 700))}, "cut.json: no result");
  expectError(1, {write("other.json", "{}")}, "other.json: no result");
  expectError(1, {write("line.json", text + "\n{\"a\":1}\n")}, "line.json: no result");
  expectError(1,
              {write("bad.json", impossible.dump())},
              "bad.json: has an impossible patch");
  expectError(1, {write("turned.json", turned.dump())}, "turned.json: no result");
  expectError(1, {result, "--cloud", result}, "bowl.patches.json: is neither PCD");
  expectError(1, {result, "--cloud", folder_ + "/no.pcd"}, "no.pcd: no such file");
}

TEST_F(ReportProgram, NonsenseOptionsAreRefused)
{
  const std::string result = fitBowl("bowl");
  expectError(2, {}, "RESULT");
  expectError(2, {result, result, "--cloud", folder_ + "/bowl.pcd"}, "single result");
  expectError(2, {result, "--max-size", "0"}, "--max-size");
  expectError(2, {result, "--magnification", "0.5"}, "--magnification");
  expectError(2, {result, "--glb", folder_ + "/a.gltf"}, "name it *.glb");
  const test::ProgramRun nothing = test::runProgram(folder_, {"report", result});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_NE(nothing.err.find("--output"), std::string::npos) << nothing.err;
  const test::ProgramRun named =
      test::runProgram(folder_, {"report", result, "-o", folder_ + "/a.pdf"});
  EXPECT_EQ(named.exit_code, 2);
  EXPECT_NE(named.err.find("name it *.html"), std::string::npos) << named.err;
}

TEST_F(ReportProgram, UnwritableOutput)
{
  const std::string path = folder_ + "/no/page.html";
  const test::ProgramRun run =
      test::runProgram(folder_, {"report", fitBowl("bowl"), "-o", path});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.errorLines(), 1) << run.err;
  EXPECT_NE(run.err.find(path), std::string::npos) << run.err;
}

TEST_F(ReportProgram, HelpTeaches)
{
  const test::ProgramRun run = test::runProgram(folder_, {"report", "--help"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.out.find("Examples:"), std::string::npos);
}

}} // namespace holdfast
