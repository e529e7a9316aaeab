// Flights that others measured, where FLAPPY_REAL_DATA names the folder that has them: flapper/*.csv.gz of federicoangioni/flappingModel,
// nanobench/*.csv.gz of syediu/nanobench-iros2026. docs/results/real_flights.md says what is found in them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "flightlog/check/check.hpp"
#include "flightlog/check/data_faults.hpp"
#include "flightlog/import/assemble.hpp"
#include "flightlog/import/sources.hpp"
#include "flightlog/readings.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;

class RealFlights : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("FLAPPY_REAL_DATA") == nullptr) GTEST_SKIP() << "FLAPPY_REAL_DATA names no folder";
  }

  static std::vector<fs::path> tables(const std::string& set) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(fs::path(std::getenv("FLAPPY_REAL_DATA")) / set))
      if (entry.path().string().ends_with(".csv.gz")) files.push_back(entry.path());
    std::ranges::sort(files);
    EXPECT_GE(files.size(), 3u) << set;
    return files;
  }

  static FlightLog imported(const fs::path& file, const std::string& mapping,
                            const std::vector<std::string>& overrides = {}) {
    const Mapping read = read_mapping(fs::path(FLAPPY_SOURCE_DIR) / "configs" / "mapping" / mapping, overrides);
    Channels channels(read.wanted());
    std::vector<std::string> warnings;
    read_source(file, channels, warnings);
    return assemble(channels, read).log;
  }

  static std::vector<FlightLog> all(const std::string& set, const std::string& mapping) {
    std::vector<FlightLog> logs;
    for (const fs::path& file : tables(set)) logs.push_back(imported(file, mapping));
    return logs;
  }

  static std::string warned(const CheckReport& report, const std::string& check) {
    for (const Finding& f : report.findings)
      if (f.check == check && f.verdict == Verdict::warning) return f.text;
    return "";
  }
};

TEST_F(RealFlights, CanBeDiagnosed) {
  for (const auto& [set, mapping] :
       {std::pair("flapper", "flapper_nimble.toml"), std::pair("nanobench", "crazyflie.toml")}) {
    const std::vector<FlightLog> logs = all(set, mapping);
    const std::vector<std::string> names(logs.size(), set);
    for (const DataFault& fault : data_faults(logs, names)) ADD_FAILURE() << fault.file << ": " << fault.what;
    for (const FlightLog& log : logs) {
      const std::vector<char> swapped = swapped_poses(log);
      const double share = static_cast<double>(std::ranges::count(swapped, 1)) / static_cast<double>(swapped.size());
      EXPECT_TRUE(std::string(set) == "flapper" ? share > 0.001 && share < 0.03 : share == 0) << share;
    }
  }
}

TEST_F(RealFlights, ShowMistakesThatArePutIn) {
  const std::string inverted = "mocap.scale.pitch_rad=0.017453292519943295";
  for (const fs::path& file : tables("flapper")) {
    const CheckReport pitch = check_flight(imported(file, "flapper_nimble.toml", {inverted}));
    EXPECT_TRUE(warned(pitch, "axes").ends_with("pitch is inverted")) << file << warned(pitch, "axes");
    const CheckReport swapped = check_flight(
        imported(file, "flapper_nimble.toml", {"imu.columns.accel_x_m_s2=accY", "imu.columns.accel_y_m_s2=accX"}));
    EXPECT_NE(warned(swapped, "axes").find("accel_x is the body's +y, accel_y is the body's +x"), std::string::npos);
  }
  for (const fs::path& file : tables("nanobench")) {
    const CheckReport roll = check_flight(imported(file, "crazyflie.toml", {"mocap.scale.qx=-1"}));
    EXPECT_TRUE(warned(roll, "axes").ends_with("roll is inverted")) << file << warned(roll, "axes");
  }
}

TEST_F(RealFlights, ShowASpoiltColumn) {
  std::vector<FlightLog> logs = all("nanobench", "crazyflie.toml");
  logs[1] = imported(tables("nanobench")[1], "crazyflie.toml", {"command.scale.motor_3=1"});
  std::vector<std::string> names;
  for (std::size_t i = 0; i < logs.size(); ++i) names.push_back(std::to_string(i));
  const std::vector<DataFault> faults = data_faults(logs, names);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].file, "1/command.csv");
  EXPECT_EQ(faults[0].what.substr(0, 14), "input motor_3:");
}

}  // namespace
}  // namespace flappy::flightlog
