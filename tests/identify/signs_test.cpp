#include "identify/signs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "identify/fit_config.hpp"
#include "identify/force_sensor.hpp"
#include "identify/units.hpp"
#include "model/derive.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::identify::signs_test {
namespace {

std::vector<Wrench> nominal_map(const std::vector<sim::Input>& inputs) {
  const model::Vehicle start = test::nominal();
  return force_map<double>(std::span(&start, 1), inputs);
}

std::string refusal_of(const MeasuredMap& map, const std::vector<Wrench>& simulated) {
  return test::refusal([&] { check_signs(map, simulated); });
}
std::string refusal_of(const MeasuredMap& map) { return refusal_of(map, nominal_map(map.inputs)); }

MeasuredMap measured(const std::vector<sim::Input>& inputs) {
  MeasuredMap map = simulate_forces(test::identified(), inputs, {}, 3);
  map.name = "m.csv";
  return map;
}

TEST(Signs, SlopesAreThoseOfAPlane) {
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

TEST(Signs, OppositeSignsAreRefused) {
  const MeasuredMap good = measured(default_inputs());
  const std::vector<Wrench> simulated = nominal_map(good.inputs);
  const auto refused = [&](const std::function<void(Wrench&)>& change) {
    MeasuredMap bad = good;
    for (Wrench& w : bad.wrenches) change(w);
    return refusal_of(bad, simulated);
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

TEST(Signs, SideForcesHaveThemToo) {
  const MeasuredMap good = measured(default_inputs());
  const std::array<std::string, 2> starts = {"m.csv:1: force_x_N: force x against bias_V has slope -0.000",
                                             "m.csv:1: force_y_N: force y against difference_V has slope 0.000"};
  for (std::size_t k = 0; k < 2; ++k) {
    MeasuredMap bad = good;
    for (Wrench& w : bad.wrenches) w[k] = -w[k];
    EXPECT_TRUE(refusal_of(bad).starts_with(starts[k])) << refusal_of(bad);
  }
}

TEST(Signs, OneRowIsRefused) {
  const MeasuredMap good = measured(default_inputs());
  const std::vector<Wrench> simulated = nominal_map(good.inputs);
  const auto refused = [&](std::size_t row, std::size_t channel) {
    MeasuredMap bad = good;
    bad.wrenches[row][channel] *= -1;
    return refusal_of(bad, simulated);
  };
  for (std::size_t row = 0; row < good.size(); ++row)
    EXPECT_TRUE(refused(row, 2).starts_with("m.csv:" + std::to_string(row + 2) + ": force_z_N: thrust is -")) << row;
  // rows of -2 V, -3 V and -0.12: offsets add to them
  EXPECT_EQ(refused(22, 3),
            "m.csv:24: torque_x_Nm: roll is 0.00235, the vehicle's with the offset of all rows -0.00242; likely a "
            "flipped axis; accepted: frame B, x forward, y left, z up");
  EXPECT_TRUE(refused(35, 4).starts_with("m.csv:37: torque_y_Nm: pitch is -0.0016")) << refused(35, 4);
  EXPECT_TRUE(refused(36, 5).starts_with("m.csv:38: torque_z_Nm: yaw is -0.0005")) << refused(36, 5);
  // a row whose offset is as large as its answer says nothing
  EXPECT_EQ(refused(25, 3), "accepted");
  // lines are those of the file, whatever was held out of it
  MeasuredMap part = good;
  (void)hold_out(part, 10);
  part.wrenches.back()[2] *= -1;
  EXPECT_TRUE(refusal_of(part).starts_with("m.csv:" + std::to_string(part.lines.back()) + ": force_z_N"))
      << part.size();
}

/// What is said of a map whose wrenches are changed.
std::string unit_refusal(const MeasuredMap& good, const std::function<void(Wrench&)>& change) {
  MeasuredMap map = good;
  for (Wrench& w : map.wrenches) change(w);
  return test::refusal([&] { check_units(map, nominal_map(map.inputs), test::nominal()); });
}

TEST(Units, AreKnownByTheSizeOfForcesAndTorques) {
  const MeasuredMap good = measured(default_inputs());
  EXPECT_EQ(unit_refusal(good, [](Wrench&) {}), "accepted");
  for (const auto& [factor, unit] :
       {std::pair(1e3, "mN"), {101.97, "gf"}, {0.2248, "lbf"}, {0.10197, "kgf"}, {3.597, "ozf"}}) {
    const std::string line = unit_refusal(good, [&](Wrench& w) { w[0] *= factor, w[1] *= factor, w[2] *= factor; });
    EXPECT_TRUE(line.starts_with("m.csv:1: force_z_N: thrust against amplitude_V has slope ")) << line;
    EXPECT_TRUE(line.ends_with(std::string(" times the vehicle's; likely in ") + unit + ", not N; accepted: N"))
        << line;
    // the side forces of another robot may be anything
    EXPECT_EQ(unit_refusal(good, [&](Wrench& w) { w[2] *= factor; }), "accepted") << unit;
  }
  const std::string other = unit_refusal(good, [&](Wrench& w) { w[0] *= 30, w[1] *= 30, w[2] *= 30; });
  EXPECT_TRUE(other.ends_with("; another unit, or a wrong scale; accepted: N")) << other;
  const std::string torques = unit_refusal(good, [](Wrench& w) { w[3] *= 1e3, w[4] *= 1e3, w[5] *= 1e3; });
  EXPECT_TRUE(torques.starts_with("m.csv:1: torque_x_Nm: torques against their inputs have slopes of ")) << torques;
  EXPECT_TRUE(torques.ends_with(" times the vehicle's; likely in mN m or N mm, not N m; accepted: N m")) << torques;
  // too few rows for slopes
  const std::string few = unit_refusal(measured({{10, 0, 0, 0}, {10, 2, 0, 0}}), [](Wrench& w) {
    for (double& x : w) x *= 1e3;
  });
  EXPECT_TRUE(few.ends_with(" times the vehicle's; likely in mN, not N; accepted: N")) << few;
}

TEST(Units, OfABalanceThatWasNotTared) {
  const double weight_N = 9.81 * model::total_mass_kg(test::nominal());
  const std::string line = unit_refusal(measured(default_inputs()), [&](Wrench& w) { w[2] -= weight_N; });
  EXPECT_TRUE(line.starts_with("m.csv:1: force_z_N: thrust is 0.")) << line;
  EXPECT_TRUE(
      line.ends_with("; likely a balance that was not tared; accepted: forces of the air alone, 0 while the "
                     "wings are at rest"))
      << line;
}

TEST(Units, OfInputsThatAreDutyCycles) {
  MeasuredMap map = measured(default_inputs());
  for (sim::Input& u : map.inputs) u.amplitude_V /= 18, u.difference_V /= 18, u.bias_V /= 18;
  const std::string line = test::refusal([&] { check_units(map, nominal_map(map.inputs), test::nominal()); });
  EXPECT_TRUE(line.starts_with("m.csv:1: amplitude_V: at most 0.")) << line;
  EXPECT_TRUE(
      line.ends_with("; likely duty cycles, not volts; accepted: volts: a duty cycle times the battery's "
                     "voltage"))
      << line;
}

TEST(Signs, SmallMapsHaveThemToo) {
  // too few rows for slopes
  const MeasuredMap good = measured({{10, 0, 0, 0}, {10, 2, 0, 0}, {10, 0, 3, 0}, {10, 0, 0, 0.12}});
  EXPECT_EQ(refusal_of(good), "accepted");
  const std::array<std::string, kChannels> starts = {
      "m.csv:4: force_x_N: force x changes by -0.002", "m.csv:3: force_y_N: force y changes by 0.001",
      "m.csv:2: force_z_N: thrust is -0.11",           "m.csv:3: torque_x_Nm: roll changes by -0.002",
      "m.csv:4: torque_y_Nm: pitch changes by -0.001", "m.csv:5: torque_z_Nm: yaw changes by -0.000"};
  for (std::size_t k = 0; k < kChannels; ++k) {
    MeasuredMap bad = good;
    for (Wrench& w : bad.wrenches) w[k] = -w[k];
    EXPECT_TRUE(refusal_of(bad).starts_with(starts[k])) << refusal_of(bad);
  }
  // noise that is not declared may be a fiftieth of all forces: more than these side forces answer
  MeasuredMap plain = good;
  plain.sd.clear();
  EXPECT_EQ(check_signs(plain, nominal_map(plain.inputs)), (std::vector<std::string>{"force_x_N", "force_y_N"}));
  // where no input moves a torque, that is said
  const std::vector<sim::Input> inputs = {{10, 0, 0, 0}, {10, 2, 0, 0}};
  EXPECT_EQ(check_signs(measured(inputs), nominal_map(inputs)),
            (std::vector<std::string>{"torque_y_Nm", "torque_z_Nm", "force_x_N"}));
}

TEST(Signs, GoodMapsAreNeverRefused) {
  // vehicles from all of a fit's bounds, noise up to twenty times the sensor's, torques about a point up to 10 mm off
  const model::Vehicle start = test::nominal();
  const FitConfig config = read_fit_config(test::source_path("configs/identify/forces.toml"), start);
  std::mt19937 generator(1);  // NOLINT(bugprone-random-generator-seed,cert-msc51-cpp): the same maps every time
  const auto uniform = [&] { return static_cast<double>(generator()) * 0x1p-32; };
  std::vector<sim::Input> mixed = read_inputs(test::source_path("configs/identify/held_out_inputs.csv"), start.driver);
  std::vector<sim::Input> amplitudes = default_inputs(), few = {{9, 0, 0, 0}, {9, 0.5, 0, 0}, {9, 0, 0.5, 0}};
  amplitudes.resize(13);
  for (const std::vector<sim::Input>& inputs : {default_inputs(), mixed, amplitudes, few})
    for (const double off : {-0.01, 0.0, 0.01}) {
      std::vector<model::Vehicle> vehicles(16, start);
      for (model::Vehicle& v : vehicles) {
        const std::vector<double*> values = fitted_values(config, v);
        for (std::size_t k = 0; k < values.size(); ++k) {
          const FitParameter& p = config.parameters[k];
          *values[k] = p.low + (p.high - p.low) * uniform();
        }
      }
      const std::vector<Wrench> simulated = nominal_map(inputs);
      const std::vector<Wrench> maps = force_map<double>(vehicles, inputs, {.moment_point_m = {off, -off, off}});
      for (auto at = maps.begin(); at != maps.end(); at += static_cast<std::ptrdiff_t>(inputs.size())) {
        const double noise = 20 * uniform();
        MeasuredMap map{"m.csv", inputs, {at, at + static_cast<std::ptrdiff_t>(inputs.size())}};
        for (Wrench& w : map.wrenches) {
          map.sd.push_back({});
          for (std::size_t k = 0; k < kChannels; ++k) {
            map.sd.back()[k] = noise * (k < 3 ? 6e-5 : 3e-7);
            w[k] += map.sd.back()[k] * 2 * (uniform() + uniform() + uniform() - 1.5);  // of that sd
          }
        }
        EXPECT_EQ(refusal_of(map, simulated), "accepted") << inputs.size();
        EXPECT_EQ(test::refusal([&] { check_units(map, simulated, start); }), "accepted") << inputs.size();
        map.sd.clear();
        EXPECT_EQ(refusal_of(map, simulated), "accepted") << inputs.size();
      }
    }
}

TEST(Signs, ARowIsNotRefusedForAModelThatFitsNoRow) {
  const std::vector<sim::Input> inputs = default_inputs();
  const std::vector<Wrench> simulated = nominal_map(inputs);
  MeasuredMap rough{"m.csv", inputs, simulated};
  for (std::size_t i = 0; i < rough.size(); ++i) {
    constexpr std::array<double, 3> kErrors = {0, 3.2e-3, -3.2e-3};  // roll is 2.1e-3 at most
    rough.wrenches[i][3] += kErrors[i / 3 % 3];
  }
  ASSERT_LT(rough.wrenches[34][3], -0.5 * simulated[34][3]);
  EXPECT_EQ(refusal_of(rough, simulated), "accepted");
  // a torque that no input of the map moves has the sign of its offset, and that may change
  MeasuredMap amplitudes{"m.csv", {inputs.begin(), inputs.begin() + 13}, {simulated.begin(), simulated.begin() + 13}};
  for (std::size_t i = 0; i < amplitudes.size(); ++i) amplitudes.wrenches[i][5] = i < 10 ? 1e-4 : -2e-4;
  EXPECT_EQ(refusal_of(amplitudes), "accepted");
}

}  // namespace
}  // namespace flappy::identify::signs_test
