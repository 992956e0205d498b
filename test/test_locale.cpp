// Files are the same whatever the calling program thinks numbers look like.
#include <holdfast/io/atomic_file.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>

#include <clocale>
#include <functional>
#include <locale>
#include <map>
#include <sstream>

namespace holdfast { namespace {

/// 1.234.567,8
class HostileNumbers : public std::numpunct<char> {
protected:
  char do_decimal_point() const override
  {
    return ',';
  }
  char do_thousands_sep() const override
  {
    return '.';
  }
  std::string do_grouping() const override
  {
    return "\3";
  }
};

/// C++ streams write and read numbers otherwise meanwhile, and so do the functions of C
/// where the machine has a locale for that.
class HostileLocale {
public:
  HostileLocale()
  : old_(std::locale::global(std::locale(std::locale(), new HostileNumbers)))
  , old_c_(std::setlocale(LC_ALL, nullptr))
  {
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"})
      has_c_ = has_c_ || std::setlocale(LC_ALL, name) != nullptr;
  }
  ~HostileLocale()
  {
    std::locale::global(old_);
    std::setlocale(LC_ALL, old_c_.c_str());
  }
  HostileLocale(const HostileLocale&) = delete;
  HostileLocale& operator=(const HostileLocale&) = delete;

  bool hasC() const
  {
    return has_c_;
  }

private:
  std::locale old_;
  std::string old_c_;
  bool has_c_ = false;
};

/// Files by name, after everything that can be written was.
std::map<std::string, std::string>
writeEverything(const std::string& name)
{
  const std::string folder = test::freshFolder("locale_" + name);
  RangeCloud cloud = test::bowlCloud(64, 48, {}, true);
  cloud.sensor_pose.c = {-0.786, 1234.5, 0.25};
  saveCloud(folder + "/ascii.pcd", cloud, true);
  saveCloud(folder + "/binary.pcd", cloud, false);

  const Sensor sensor = loadSensor("kinect_v1");
  EXPECT_GT(sensor.camera.fx, 100.0);
  const NoiseParameters noise{{"sigma_disparity_px", 0.1834},
                              {"sigma_point_px", 0.5},
                              {"baseline_m", 0.075},
                              {"focal_px", 1575.8}};
  Sensor stereo = sensor;
  stereo.noise = makeNoiseModel("stereo", noise);
  saveSensor(folder + "/sensor.yaml", stereo, noise, {});
  EXPECT_EQ(loadSensor(folder + "/sensor.yaml").camera.fx, sensor.camera.fx);

  PatchReport report;
  report.cloud = "bowl.pcd";
  report.result.sensor = sensor;
  ExtractionOptions options;
  options.sampler.radius_m = 0.1;
  options.threads = 1;
  report.options = options;
  report.result = extractWhole(test::bowlCloud(64, 48, {}, true), sensor, options);
  EXPECT_FALSE(report.result.patches.empty());
  const auto writeTo = [&](const std::string& file, const auto& writer) {
    std::ostringstream out; // in the locale of the program
    writer(out);
    test::writeFile(folder + "/" + file, out.str());
  };
  const auto& patches = report.result.patches;
  writeTo("ascii.ply", [&](auto& out) { writeMesh(out, patches, true); });
  writeTo("binary.ply", [&](auto& out) { writeMesh(out, patches, false); });
  writeTo("points.pcd", [&](auto& out) { writePatchPoints(out, patches, {}); });
  writeTo("patches.json",
          [&](auto& out) { writeJson(out, report, JsonLayout::PatchPerLine); });

  AtomicFile file(folder + "/numbers");
  file.stream() << 1234567 << ' ' << 0.5;
  file.commit();
  std::map<std::string, std::string> files;
  for (const std::string& written : test::filesIn(folder))
    files[written] = test::readFile(folder + "/" + written);
  return files;
}

class Locale : public testing::Test {
protected:
  const std::map<std::string, std::string> classic = writeEverything("classic");
};

TEST_F(Locale, EveryFileIsWrittenAsInTheClassicOne)
{
  const HostileLocale hostile;
  std::ostringstream proof;
  proof << 1234567 << 0.5;
  ASSERT_EQ(proof.str(), "1.234.5670,5");
  const auto files = writeEverything("hostile");
  ASSERT_EQ(files.size(), classic.size());
  for (const auto& [name, bytes] : files)
    EXPECT_TRUE(bytes == classic.at(name)) << name << ":\n" << bytes.substr(0, 600);
  EXPECT_EQ(files.at("numbers"), "1234567 0.5");
  if (!hostile.hasC())
    std::cout << "no locale with a decimal comma for C's functions on this machine\n";
}

TEST_F(Locale, EveryFileIsReadAsInTheClassicOne)
{
  const std::string folder = std::string(HOLDFAST_SCRATCH_DIR) + "/locale_classic/";
  const RangeCloud ascii = loadCloud(folder + "ascii.pcd");
  const PatchReport report = readJson(classic.at("patches.json"));
  const Sensor sensor = loadSensor(folder + "sensor.yaml");
  const HostileLocale hostile;
  const RangeCloud again = loadCloud(folder + "ascii.pcd");
  ASSERT_EQ(again.points->size(), ascii.points->size());
  for (std::size_t i = 1; i < ascii.points->size(); ++i)
    ASSERT_EQ((*again.points)[i].getVector3fMap(), (*ascii.points)[i].getVector3fMap());
  EXPECT_EQ(again.sensor_pose.c, ascii.sensor_pose.c);
  EXPECT_EQ(pack(readJson(classic.at("patches.json")).result.patches.at(0).fit.patch),
            pack(report.result.patches.at(0).fit.patch));
  const Sensor same = loadSensor(folder + "sensor.yaml");
  EXPECT_EQ(same.camera.fx, sensor.camera.fx);
  EXPECT_EQ(same.max_range_m, sensor.max_range_m);
}

TEST_F(Locale, NumbersOfSensorFiles)
{
  const std::string folder = test::freshFolder("locale_yaml");
  const auto withFx = [&](const std::string& fx) {
    std::string yaml = classic.at("sensor.yaml");
    const std::size_t at = yaml.find("fx: ") + 4;
    yaml.replace(at, yaml.find('\n', at) - at, fx);
    test::writeFile(folder + "/sensor.yaml", yaml);
    return loadSensor(folder + "/sensor.yaml").camera.fx;
  };
  const HostileLocale hostile;
  EXPECT_EQ(withFx("575.8"), 575.8);
  EXPECT_EQ(withFx("+5.758e2"), 575.8);
  EXPECT_EQ(withFx("1234567"), 1234567.0);
  for (const char* wrong : {"575,8", "1.234.567", "1.234,5", ".inf", "nan", "~", "5 7"})
    EXPECT_THROW(withFx(wrong), std::runtime_error) << wrong;
}

}} // namespace holdfast
