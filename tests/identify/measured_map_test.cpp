#include "identify/measured_map.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "identify/force_sensor.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::identify {
namespace {

const std::string kHeader =
    "amplitude_V,difference_V,bias_V,split_cycle,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm";
const std::string kSd = ",force_x_sd_N,force_y_sd_N,force_z_sd_N,torque_x_sd_Nm,torque_y_sd_Nm,torque_z_sd_Nm";

MeasuredMap parse(const std::string& text) { return parse_measured_map(text, "m.csv", test::nominal().driver); }
std::string refused(const std::string& text) {
  return test::refusal([&] { parse(text); });
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(MeasuredMap, ReadsWhatItWrites) {
  const MeasuredMap plain = parse(kHeader + "\n10,1,-2,0.1,1,2,3,4,5,6\n");
  EXPECT_EQ(plain.inputs[0].bias_V, -2);
  EXPECT_EQ(plain.wrenches[0], (Wrench{1, 2, 3, 4, 5, 6}));
  EXPECT_TRUE(plain.sd.empty());
  MeasuredMap full = parse(kHeader + kSd + "\n10,1,-2,0.1,1,2,3,4,5,6,.1,.2,.3,.4,.5,.6\n");
  EXPECT_EQ(full.sd[0], (Wrench{.1, .2, .3, .4, .5, .6}));
  const auto path = std::filesystem::temp_directory_path() / "measured_map_test.csv";
  write_measured_map(path, full);
  const MeasuredMap back = read_measured_map(path, test::nominal().driver);
  EXPECT_EQ(back.wrenches, full.wrenches);
  EXPECT_EQ(back.sd, full.sd);
  EXPECT_EQ(back.inputs[0].split_cycle, 0.1);
  std::filesystem::remove(path);
}

TEST(MeasuredMap, SaysWhatIsWrongAndWhere) {
  const std::string row = "\n10,1,-2,0.1,1,2,3,4,5,6\n", list = replaced(kHeader, ",", ", ");
  EXPECT_EQ(refused(replaced(kHeader, ",torque_z_Nm", "") + "\n10,1,-2,0.1,1,2,3,4,5\n").substr(0, 45),
            "m.csv:1: torque_z_Nm: column is missing; acce");
  EXPECT_EQ(refused(replaced(kHeader, "torque_x_Nm", "torque_x_mNm") + row),
            "m.csv:1: torque_x_mNm: wrong unit; accepted: torque_x_Nm");
  const std::string unknown = refused(replaced(kHeader, "force_z_N", "force_zz_N") + row);
  EXPECT_TRUE(unknown.starts_with("m.csv:1: force_zz_N: unknown column; accepted: amplitude_V, ")) << unknown;
  EXPECT_TRUE(unknown.ends_with("; did you mean \"force_z_N\"?")) << unknown;
  EXPECT_EQ(refused(kHeader + "\n10,1,-2,0.1,1,2,nan,4,5,6\n"),
            "m.csv:2:17: force_z_N: nan is not finite; accepted: a number");
  EXPECT_EQ(refused(kHeader + "\n10,1,-2,0.1,1,2,3,4,5,6\n10,1,-2,0.1,1,2,-inf,4,5,6\n"),
            "m.csv:3:17: force_z_N: -inf is not finite; accepted: a number");
  EXPECT_EQ(refused(kHeader + "\n10,1,-2,0.1,1,2,3,4,5\n"),
            "m.csv:2:22: row has 9 cells; accepted: 10, as in the header");
  EXPECT_EQ(refused(kHeader + row + "10,1,-4,0.1,1,2,3,4,5,6\n"),
            "m.csv:3: bias_V: -4 is beyond the vehicle's limits; accepted: -3.5 to 3.5");
  EXPECT_EQ(refused(kHeader + "\n-1,1,-2,0.1,1,2,3,4,5,6\n"),
            "m.csv:2: amplitude_V: -1 is beyond the vehicle's limits; accepted: 0 to 18");
  EXPECT_EQ(refused(kHeader + "\n"), "m.csv:1: has no rows; accepted: a row for each input");
  EXPECT_EQ(refused(kHeader + kSd + "\n10,1,-2,0.1,1,2,3,4,5,6,.1,.2,0,.4,.5,.6\n"),
            "m.csv:2: force_z_sd_N: 0 is no standard deviation; accepted: a number above 0");
  EXPECT_EQ(refused(kHeader + ",force_x_sd_N\n10,1,-2,0.1,1,2,3,4,5,6,.1\n").substr(0, 45),
            "m.csv:1: force_y_sd_N: column is missing; acc");
}

TEST(MeasuredMap, SlopesAreThoseOfAPlane) {
  std::vector<sim::Input> inputs;
  std::vector<Wrench> wrenches;
  for (const auto& u : default_inputs()) {
    inputs.push_back({u.amplitude_V, u.difference_V, 0, u.split_cycle});
    wrenches.push_back({0, 0, 1 + 2 * u.amplitude_V, 3 * u.difference_V - 4 * u.split_cycle, 0, 0});
  }
  const auto s = slopes(inputs, wrenches);
  EXPECT_NEAR(s[0][2].value, 2, 1e-12);
  EXPECT_NEAR(s[1][3].value, 3, 1e-12);
  EXPECT_NEAR(s[3][3].value, -4, 1e-10);
  EXPECT_EQ(s[2][4].value, 0);  // the bias never moved
  EXPECT_LT(s[1][3].sd, 1e-12);
}

TEST(MeasuredMap, OppositeSignsAreRefused) {
  const model::Vehicle v = test::identified(), start = test::nominal();
  const std::vector<sim::Input> inputs = default_inputs();
  const MeasuredMap good = simulate_forces(v, inputs, {}, 3);
  const auto simulated = force_map<double>(std::span(&start, 1), inputs);
  const auto refused = [&](const std::function<void(Wrench&)>& change) {
    MeasuredMap bad = good;
    bad.name = "m.csv";
    for (Wrench& w : bad.wrenches) change(w);
    return test::refusal([&] { check_signs(bad, simulated); });
  };
  EXPECT_EQ(refused([](Wrench&) {}), "accepted");
  const std::array<std::string, 4> starts = {"m.csv:1: force_z_N: thrust against amplitude_V has slope -0.01",
                                             "m.csv:1: torque_x_Nm: roll against difference_V has slope -0.001",
                                             "m.csv:1: torque_y_Nm: pitch against bias_V has slope -0.0004",
                                             "m.csv:1: torque_z_Nm: yaw against split_cycle has slope -0.003"};
  for (std::size_t k = 2; k < kChannels; ++k) {
    const std::string line = refused([&](Wrench& w) { w[k] = -w[k]; });
    EXPECT_TRUE(line.starts_with(starts[k - 2])) << line;
    EXPECT_TRUE(line.ends_with("; likely a flipped axis; accepted: frame B, x forward, y left, z up")) << line;
  }
  // turned by a quarter about z, and two columns swapped
  for (const double sign : {-1.0, 1.0}) {
    const std::string line = refused([&](Wrench& w) { w = {w[1], sign * w[0], w[2], w[4], sign * w[3], w[5]}; });
    EXPECT_TRUE(line.starts_with("m.csv:1: torque_x_Nm: roll against difference_V has slope ")) << line;
    EXPECT_NE(line.find("; columns torque_x_Nm and torque_y_Nm look swapped; "), std::string::npos) << line;
  }
}

TEST(MeasuredMap, HoldsOutEvenly) {
  MeasuredMap map{"m", {}, {}, {}};
  for (int i = 0; i < 10; ++i) map.inputs.push_back({static_cast<double>(i), 0, 0, 0}), map.wrenches.push_back({});
  const MeasuredMap held = hold_out(map, 3);
  EXPECT_EQ(held.size(), 3u);
  EXPECT_EQ(map.size(), 7u);
  EXPECT_EQ(held.inputs[0].amplitude_V, 3);
  EXPECT_EQ(held.inputs[2].amplitude_V, 9);
}

}  // namespace
}  // namespace flappy::identify
