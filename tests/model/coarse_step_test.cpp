#include "model/coarse_step.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "jointed_vehicles.hpp"

namespace flappy::model::coarse_step_test {
namespace {

Vehicle shipped(const std::string& name) {
  return read_any_vehicle(test::source_path("configs/vehicles/" + name + ".toml"));
}

/// 0: does; 1: warned of; 2: refused.
int judged(const Vehicle& v, double step_s) {
  const auto coarse = coarse_step(v, step_s);
  return coarse ? 1 + coarse->refused : 0;
}

TEST(CoarseStep, IsNoneOfAShippedVehicle) {
  for (const char* name :
       {"bumblebee", "fruit_fly", "hawkmoth", "hummingbird_driven", "hummingbird_identified", "hummingbird_magnificent",
        "hummingbird_nominal", "hummingbird_ruby_throated", "kubeetle_like", "robobee_like"})
    EXPECT_EQ(judged(shipped(name), 250e-6), 0) << name;
  for (const char* name : {"crazyflie", "flapper_nimble"}) EXPECT_EQ(judged(shipped(name), 1e-3), 0) << name;
}

TEST(CoarseStep, GoesByTheBeatsRates) {
  // motors: k = 2, so 16 steps per beat do, and 8 are too few
  Vehicle v = test::nominal();
  v.driver.flapping_Hz = 100;
  EXPECT_EQ(judged(v, 0.01 / 16), 0);
  EXPECT_EQ(judged(v, 0.01 / 15.9), 1);
  EXPECT_EQ(judged(v, 0.01 / 8.1), 1);
  EXPECT_EQ(judged(v, 0.01 / 7.9), 2);
  EXPECT_DOUBLE_EQ(coarse_step(v, 1e-3)->enough_s, 0.01 / 16);
  EXPECT_EQ(coarse_step(v, 2e-3)->what, "is 5 steps per beat of 100 Hz, whose wings need 16");
  // amplitudes 1 and 1 of the harmonics 1 and 3: k^2 = (1 + 9 9) / (1 + 9) = 8.2
  v = test::driven_hummingbird();
  for (Jointed::Wing* w : {&v.jointed->left, &v.jointed->right})
    for (Jointed::Angle& a : w->angles) a.cos_rad = {}, a.sin_rad = {};
  v.jointed->left.angles[1].cos_rad = {0.6, 0, 0}, v.jointed->left.angles[1].sin_rad = {0.8, 0, 1};
  v.jointed->left.angles[1].cos_rad.resize(3);
  v.jointed->frequency_Hz = 100;
  const double k = std::sqrt(8.2);
  EXPECT_NEAR(coarse_step(v, 1e-3)->enough_s, 0.01 / (8 * k), 1e-12);
  // an input that makes the beat 1.5 times as fast
  v.jointed->inputs[0].frequency = 0.25, v.jointed->inputs[0].low = -4, v.jointed->inputs[0].high = 2;
  EXPECT_NEAR(coarse_step(v, 1e-3)->enough_s, 0.01 / (1.5 * 8 * k), 1e-12);
}

}  // namespace
}  // namespace flappy::model::coarse_step_test
