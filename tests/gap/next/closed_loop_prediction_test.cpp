// Closed-loop prediction on flights of our own: the vehicle that flew predicts what was recorded, another one does not.
#include "gap/next/closed_loop_prediction.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "gap/replay/reset_prediction.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/simulated_flight.hpp"

namespace flappy::gap {
namespace {

using flight::source_path;

model::Vehicle nominal() { return model::read_vehicle(source_path("configs/vehicles/hummingbird_nominal.toml")); }

rollout::FlyConfig hover(const std::vector<std::string>& more = {}) {
  std::vector<std::string> all = {"vehicle=../vehicles/hummingbird_nominal.toml"};
  all.insert(all.end(), more.begin(), more.end());
  return rollout::read_fly_config(source_path("configs/fly/hover.toml"), all);
}

std::shared_ptr<const PredictedFlight> flown(const rollout::FlyConfig& config, const model::Vehicle& vehicle,
                                             double from_s) {
  std::vector<rollout::SimulatedFlight> flights = simulate(config, vehicle, 1, from_s);
  EXPECT_FALSE(flights[0].lost);
  return std::make_shared<ResetPrediction>(Recording("flight", *flights[0].log, nominal()));
}

std::map<std::string, ClosedLoop> by_quantity(const std::vector<ClosedLoop>& rows) {
  std::map<std::string, ClosedLoop> map;
  for (const ClosedLoop& r : rows) map[r.quantity] = r;
  return map;
}

model::Vehicle heavy_in_front() {
  model::Vehicle v = nominal();
  v.effects["com_offset"] = {{"x_m", 0.004}, {"y_m", 0.0}, {"z_m", 0.0}};
  return v;
}

// Trims are means over some 5 s of inputs that scatter by a tenth of a volt from beat to beat, with a memory of a few beats:
// 0.1 / sqrt(170 / 3) = 0.013 V, and as much for who predicts. A hundredth of that in split cycle.
constexpr double kTrim_V = 0.04, kTrimSplit = 0.002;

TEST(ClosedLoop, TheVehicleThatFlewPredictsItsOwnHover) {
  const model::Vehicle truth = heavy_in_front();
  FlightList flights;
  flights.push_back(flown(hover(), truth, 4));
  const auto list = predict_closed_loop(flights, nominal(), truth, hover());
  EXPECT_EQ(list.front().quantity, "mean_amplitude_V");
  EXPECT_EQ(list.front().flight, "flight");
  auto rows = by_quantity(list);
  ASSERT_EQ(rows.size(), 9u);
  for (const char* q : {"mean_amplitude_V", "mean_difference_V", "mean_bias_V", "amplitude_rise_V"})
    EXPECT_NEAR(rows[q].corrected, rows[q].recorded, kTrim_V) << q;
  EXPECT_NEAR(rows["mean_split_cycle"].corrected, rows["mean_split_cycle"].recorded, kTrimSplit);
  // 4 mm in front of where the thrust is: the bias that holds them is what the nominal vehicle does not know of
  EXPECT_GT(std::abs(rows["mean_bias_V"].nominal - rows["mean_bias_V"].recorded), 0.5);
  // steadiness is that of sensors and controller: of 5 s of motion below 1 Hz, to the half of itself
  for (const char* q : {"rms_roll_rad", "rms_pitch_rad", "rms_off_path_m"}) {
    EXPECT_GT(rows[q].corrected, 0.5 * rows[q].recorded) << q;
    EXPECT_LT(rows[q].corrected, 2 * rows[q].recorded) << q;
  }
  EXPECT_NEAR(rows["yaw_drift_rad"].corrected, rows["yaw_drift_rad"].recorded, 0.02);
}

TEST(ClosedLoop, AVehicleFliesTheRecordedPath) {
  // a square and a turn, logged from mid-flight on
  const rollout::FlyConfig path =
      rollout::read_fly_config(source_path("configs/fly/waypoints.toml"),
                               {"vehicle=../vehicles/hummingbird_nominal.toml", "flight.duration_s=14"});
  const model::Vehicle truth = heavy_in_front();
  FlightList flights;
  flights.push_back(flown(path, truth, 4));
  auto rows = by_quantity(predict_closed_loop(flights, nominal(), truth, hover()));
  EXPECT_NEAR(rows["mean_bias_V"].corrected, rows["mean_bias_V"].recorded, kTrim_V);
  EXPECT_NEAR(rows["mean_amplitude_V"].corrected, rows["mean_amplitude_V"].recorded, kTrim_V);
  EXPECT_GT(std::abs(rows["mean_bias_V"].nominal - rows["mean_bias_V"].recorded), 0.5);
  // a line over 0.12 s takes the edge off accelerations that last for half a second
  for (const char* q : {"rms_roll_rad", "rms_pitch_rad", "rms_off_path_m"}) {
    EXPECT_GT(rows[q].recorded, 0.01) << q;  // as it lay on the path, not in hover
    EXPECT_NEAR(rows[q].corrected, rows[q].recorded, 0.25 * rows[q].recorded) << q;
  }
  EXPECT_NEAR(rows["yaw_drift_rad"].recorded, std::numbers::pi / 2, 0.15);
  EXPECT_NEAR(rows["yaw_drift_rad"].corrected, rows["yaw_drift_rad"].recorded, 0.05);
}

TEST(ClosedLoop, AConfigurationFliesItsOwnPathAndExcitation) {
  rollout::FlyConfig shaken =
      rollout::read_fly_config(source_path("configs/fly/identify_multisine.toml"),
                               {"vehicle=../vehicles/hummingbird_nominal.toml", "flight.duration_s=9"});
  FlightList flights;
  flights.push_back(flown(shaken, nominal(), 0));
  shaken.fleet.seed = 7;  // other noise
  auto own = by_quantity(predict_closed_loop(flights, heavy_in_front(), nominal(), shaken, {.own_path = true}));
  auto calm = by_quantity(predict_closed_loop(flights, heavy_in_front(), nominal(), shaken));
  // shaken alike, it leans alike; without the excitation, far less
  EXPECT_NEAR(own["rms_pitch_rad"].corrected, own["rms_pitch_rad"].recorded, 0.2 * own["rms_pitch_rad"].recorded);
  EXPECT_LT(calm["rms_pitch_rad"].corrected, 0.6 * calm["rms_pitch_rad"].recorded);
  EXPECT_GT(std::abs(own["mean_bias_V"].nominal - own["mean_bias_V"].recorded), 0.5);
}

TEST(ClosedLoop, HeadingCountsWholeTurns) {
  const rollout::FlyConfig turn =
      rollout::read_fly_config(source_path("configs/gap/experiments/yaw_turn.toml"), {"flight.duration_s=5.9"});
  FlightList flights;
  flights.push_back(flown(turn, nominal(), 2));
  auto rows = by_quantity(predict_closed_loop(flights, nominal(), nominal(), hover()));
  // the last second is nearly once round
  EXPECT_GT(std::abs(rows["yaw_drift_rad"].recorded), 5.5);
  EXPECT_NEAR(rows["yaw_drift_rad"].corrected, rows["yaw_drift_rad"].recorded, 0.15);
}

TEST(ClosedLoop, WhatCannotFlyIsNoNumber) {
  rollout::FlyConfig high = hover();  // nothing below: it falls for as long as it is asked to hover
  high.fleet.batch.world.ground_z_m = -1000;
  high.fleet.task.start.kind = sim::Start::flying;
  FlightList flights;
  flights.push_back(flown(high, nominal(), 4));
  model::Vehicle lead = nominal();
  lead.torso.mass_kg *= 3;
  for (const ClosedLoop& r : predict_closed_loop(flights, nominal(), lead, hover())) {
    EXPECT_TRUE(std::isfinite(r.recorded) && std::isfinite(r.nominal)) << r.quantity;
    EXPECT_TRUE(std::isnan(r.corrected)) << r.quantity;
  }
}

TEST(ClosedLoop, IsTheSameForAnyNumberOfThreads) {
  FlightList flights;
  flights.push_back(flown(hover(), nominal(), 5));
  const auto one = predict_closed_loop(flights, nominal(), heavy_in_front(), hover(), {.threads = 1});
  const auto two = predict_closed_loop(flights, nominal(), heavy_in_front(), hover(), {.threads = 2});
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].nominal, two[i].nominal);
    EXPECT_EQ(one[i].corrected, two[i].corrected);
  }
}

}  // namespace
}  // namespace flappy::gap
