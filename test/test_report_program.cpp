// `holdfast report`: what is in the page and in the glTF, and what is refused. The page
// itself is tested in a browser: test/report/.
#include <holdfast/io/config.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/io/patch_map_file.h>

#include "support/result_program.h"
#include "support/risk_map.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace holdfast { namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;
using test::Random;

const std::string kRocks = HOLDFAST_SOURCE_DIR "/samples/rocks.pcd";

class ReportProgram : public test::ResultProgram {
protected:
  ReportProgram() : ResultProgram("report", "page.html") {}

  std::string pageOf(Names arguments) const
  {
    arguments.insert(arguments.end(), {"-o", output_});
    EXPECT_EQ(runWell(arguments), "");
    return test::readFile(output_);
  }

  /// Risks of a ball foot. \param source a cloud or a map.
  std::string risk(const std::string& source, const Names& more = {}) const
  {
    const std::string path = folder_ + "/risk.json";
    Names arguments{"risk", source, "--foot", "point_foot", "-o", path, "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const test::ProgramRun run = test::runProgram(folder_, arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return path;
  }

  /// A map of ground as `holdfast map` writes it: walk.map to go on with, walk.json to
  /// look at.
  void writeMap() const
  {
    Random random;
    const PatchMap map = test::roughGround(4, 0.06, random);
    savePatchMap(folder_ + "/walk.map", {map, "kinect_v1"});
    PatchReport report;
    report.cloud = "frames";
    report.map = &map;
    report.result.sensor = loadSensor("kinect_v1");
    report.sensor_pose = map.pose();
    for (const MapPatch& patch : map.patches()) {
      ExtractedPatch& shown = report.result.patches.emplace_back();
      shown.fit = toFitResult(patch);
      shown.radius_m = patch.radius_m;
    }
    std::ofstream file(folder_ + "/walk.json");
    writeJson(file, report, JsonLayout::PatchPerLine);
  }
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

Json
onlyResultOf(const std::string& page)
{
  const Json data = Json::parse(dataOf(page));
  EXPECT_EQ(data.at("results").size(), 1U);
  return data.at("results").at(0);
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
  runWell({folder_ + "/nasty.json", "-o", output_, "--quiet"});
  const std::string page = test::readFile(output_);
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
  const std::string said = runWell({result, "-o", output_});
  EXPECT_NE(said.find("bowl.pcd was neither"), std::string::npos) << said;
  const Json data = Json::parse(dataOf(test::readFile(output_)));
  const std::string note = data.at("results").at(0).at("cloud").at("note");
  EXPECT_NE(note.find("bowl.pcd"), std::string::npos);
  Json none = Json::parse(test::readFile(result));
  none["patches"] = Json::array();
  test::writeFile(folder_ + "/none.json", none.dump());
  runWell({folder_ + "/none.json", "-o", output_, "--quiet"});
  EXPECT_EQ(
      Json::parse(dataOf(test::readFile(output_))).at("results").at(0).at("patches"),
      0);
}

TEST_F(ReportProgram, ARiskIsShownWithItsSoles)
{
  const std::string path = risk(kRocks, {"--best", "5"});
  const Json file = Json::parse(test::readFile(path));
  const Json shown = onlyResultOf(pageOf({path}));
  EXPECT_EQ(shown.at("title"), "rocks.pcd");
  EXPECT_EQ(shown.at("patches"), file.at("patches").size());
  EXPECT_FALSE(shown.at("hasFits"));
  EXPECT_GT(shown.at("cloud").at("of"), 1000);
  const Json& found = shown.at("risk");
  EXPECT_EQ(found.at("footholds"), 5);
  EXPECT_EQ(found.at("rows").at("length"), 5);
  const std::size_t corners = file.at("foot").at("sole_m").size();
  EXPECT_EQ(found.at("corners"), corners);
  EXPECT_EQ(found.at("soles").at("length"), 5 * 3 * (corners + 2));
  EXPECT_EQ(found.at("statuses").at("length"), file.at("patches").size());
  for (const char* member : {"foot", "load_direction", "assumptions", "ranking"})
    EXPECT_EQ(found.at("head").at(member), file.at(member)) << member;
  // What nobody knows of the patches is no column of zeros.
  Names columns;
  for (const auto& [name, ignored] : shown.at("columns").items())
    columns.push_back(name);
  EXPECT_EQ(columns, (Names{"area", "id", "radius", "risk"}));
  EXPECT_LE(test::readFile(output_).size(), 2000000U);
}

TEST_F(ReportProgram, ARiskBecomesPartOfItsMap)
{
  writeMap();
  const std::string map = folder_ + "/walk.json";
  const std::string path =
      risk(folder_ + "/walk.map", {"--load-direction", "0", "0", "-1"});
  const Json shown = onlyResultOf(pageOf({map, path}));
  EXPECT_TRUE(shown.at("hasFits"));
  EXPECT_TRUE(shown.at("columns").contains("risk"));
  EXPECT_TRUE(shown.at("columns").contains("sigma_normal"));
  EXPECT_GT(shown.at("risk").at("footholds"), 0);
  EXPECT_EQ(pageOf({map, path}), pageOf({path, map}));
  // That of other patches is a result of its own.
  Json other = Json::parse(test::readFile(path));
  other["patches"].erase(other["patches"].size() - 1);
  other["footholds"] = Json::array();
  test::writeFile(folder_ + "/other.json", other.dump());
  const Json data = Json::parse(dataOf(pageOf({map, folder_ + "/other.json"})));
  ASSERT_EQ(data.at("results").size(), 2U);
  EXPECT_TRUE(data.at("results").at(0).at("risk").is_null());
  EXPECT_FALSE(data.at("results").at(1).at("hasFits"));
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
  EXPECT_EQ(runWell({result, "--glb", glb}), "");
  const std::string bytes = test::readFile(glb);
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2U);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const Json gltf = Json::parse(bytes.substr(20, word(bytes, 12)));
  EXPECT_EQ(gltf.at("nodes").at(0).at("name"), "bowl.pcd: patches");
  EXPECT_EQ(gltf.at("nodes").at(1).at("name"),
            "bowl.pcd: centres at 3 sigma, 10 times as large as they are");
  EXPECT_FALSE(std::filesystem::exists(output_));
}

TEST_F(ReportProgram, GlTfHasSoles)
{
  const std::string glb = folder_ + "/rocks.glb";
  EXPECT_EQ(runWell({risk(kRocks, {"--best", "3"}), "--glb", glb}), "");
  const std::string bytes = test::readFile(glb);
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  const Json gltf = Json::parse(bytes.substr(20, word(bytes, 12)));
  ASSERT_EQ(gltf.at("nodes").size(), 2U);
  EXPECT_EQ(gltf.at("nodes").at(1).at("name"),
            "rocks.pcd: soles by risk, 5 mm above where they stand");
  const Json& soles = gltf.at("meshes").at(1).at("primitives").at(0);
  const Json& color =
      gltf.at("accessors").at(soles.at("attributes").at("COLOR_0").get<std::size_t>());
  EXPECT_EQ(color.at("count").get<int>() % 3, 0);
}

TEST_F(ReportProgram, BadRisksAreNamed)
{
  const std::string path = risk(kRocks, {"--best", "2"});
  const Json good = Json::parse(test::readFile(path));
  const auto expectBad = [&](const char* pointer, const Json& value, const char* what) {
    Json bad = good;
    bad[Json::json_pointer(pointer)] = value;
    test::writeFile(folder_ + "/bad.json", bad.dump());
    expectError(1, {folder_ + "/bad.json"}, std::string("bad.json: ") + what);
  };
  expectBad("/footholds/0/patch",
            123456,
            "has a foothold on a patch that is not in it");
  expectBad("/foot/sole_m", {{0, 0}, {1, 1}}, "has a sole of fewer than three corners");
  expectBad("/patches", Json::array(), "has no patch");
  expectBad("/patches/0/status", "well", "has a patch of unknown status");
  expectBad("/patches/0/surface", "cone", "has a patch of unknown type");
  expectBad("/patches/0/parameters/0", -1.0, "has an impossible patch");
  expectBad("/footholds/0/pose/position/0", nullptr, "is no result of 'holdfast risk'");
  expectBad("/offset", {1, 2}, "has a vector of another length than 3");
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
  expectError(1,
              {write("turned.json", turned.dump())},
              "turned.json: has a vector of another length than 3");
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
