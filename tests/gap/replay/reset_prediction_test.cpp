#include "gap/replay/reset_prediction.hpp"

#include <gtest/gtest.h>

#include "gap/flown_flights.hpp"
#include "gap/replay/residuals.hpp"

namespace flappy::gap::reset_prediction_test {
namespace {

TEST(ResetPrediction, TheVehicleThatFlewLeavesTheNoiseOfTheSensors) {
  const Flights flights = flown("hummingbird_nominal",
                                {"log.power.battery_nominal_V=18", "log.power.rate_hz=500", "log.power.latency_s=0.001",
                                 "log.power.voltage_noise_V=0.02", "log.power.current_noise_A=0.01"});
  const VehicleHypothesis it{nominal_vehicle(), 0};
  const Rows predicted = flights[0]->predict({&it})[0];
  VehicleHypothesis held =
      it;  // by a driver whose updates are no multiple of the steps here: voltages are those of the log
  held.vehicle.driver.hold_s = 5e-4;
  EXPECT_EQ(flights[0]->predict({&held})[0], predicted);
  const Rows noise = flights[0]->declared_noise(1);
  Rows left = flights[0]->measured();
  for (std::size_t i = 0; i < left.size(); ++i) left[i] -= predicted[i];
  // 250 beats: an rms of as many normal numbers varies by 4 %, of neighbours that share samples by 6 %; heavy tails, for
  // now and then a wing's landing comes a little early, add to a few. Mean forces, of which five beats share samples, by 10 %; and
  // to their noise, that of motion capture, comes that of the motion to which the torso is reset.
  for (const int channel : {kAngularAccelerationX, kAngularAccelerationY, kAngularAccelerationZ, kSpecificForceX,
                            kSpecificForceY, kSpecificForceZ, kStrokeLeft, kStrokeRight, kRotationLeft, kRotationRight,
                            kCurrentLeft, kCurrentRight, kBattery, kPathX, kRotateZ})
    for (int c = 0; c < (channel < kPathX ? 3 : 1); ++c) {
      const int g = channel * kCoefficients + c;
      const double ratio = rms(*flights[0], left, g) / rms(*flights[0], noise, g);
      EXPECT_GT(ratio, 0.7) << channel_name(channel) << " " << c;
      EXPECT_LT(ratio, c == 0 && channel >= kSpecificForceX && channel <= kSpecificForceZ ? 1.7 : 1.4)
          << channel_name(channel) << " " << c;
    }
}

// An accelerometer that errs by a constant, on an axis that stays level, moves what it says against motion capture, not the mean force.
TEST(ResetPrediction, MeanForcesAreThoseOfMotionCapture) {
  const Flights flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  flightlog::FlightLog log = flights[0]->recording()->log;
  constexpr double kError_m_s2 = 0.5;
  for (double& z : log.imu.accel_z_m_s2) z += kError_m_s2;
  const auto wrong = flights[0]->with_log(log);
  const auto mean = [](const PredictedFlight& f, int channel) {
    double sum = 0, n = 0;
    for (std::size_t j = 0; j < f.beats(); ++j)
      if (f.covers(j, channel))
        sum += f.measured()[j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients], n += 1;
    return sum / n;
  };
  EXPECT_NEAR(mean(*wrong, kPathZ) - mean(*flights[0], kPathZ), -kError_m_s2, 0.02 * kError_m_s2);
  EXPECT_NEAR(mean(*wrong, kSpecificForceZ) - mean(*flights[0], kSpecificForceZ), 0, 0.02 * kError_m_s2);
}

// Vehicles share blocks and logs are kept; still each is compared with the log in which its own errors are undone, and
// whose grid is its own.
TEST(ResetPrediction, ComparesEachVehicleWithItsOwnLog) {
  const Flights flights = flown("hummingbird_nominal", {"flight.duration_s=2.5"});
  const PredictedFlight& flight = *flights[0];
  const VehicleHypothesis it{nominal_vehicle(), 0};
  VehicleHypothesis heavy = it, windy = it, late = it;
  heavy.vehicle.torso.mass_kg *= 1.1;
  windy.vehicle.effects["wind"] = {{"x_m_s", 0.3}, {"y_m_s", 0}, {"z_m_s", 0}, {"gust_m_s", 0}, {"gust_time_s", 0.5}};
  late.lag_s = 4e-4;
  const EffectValues turned = {{"imu_mounting", {{"x_rad", 0.02}, {"y_rad", 0}, {"z_rad", 0}}}},
                     turned_more = {{"imu_mounting", {{"x_rad", 0.04}, {"y_rad", 0}, {"z_rad", 0}}}},
                     moved = {{"imu_place", {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0}}}},
                     delayed = {{"mocap_delay", {{"delay_s", 0.004}}}}, slowed = {{"imu_clock", {{"rate", 2e-3}}}};
  const std::vector<ComparedVehicle> all = {{&it, {}},        {&it, turned}, {&heavy, turned}, {&it, turned_more},
                                            {&windy, moved},  {&late, {}},   {&it, delayed},   {&it, slowed},
                                            {&heavy, slowed}, {&it, moved},  {&heavy, {}}};
  for (int round = 0; round < 2; ++round) {  // the second time, the last logs are known
    const std::vector<Rows> rows = flight.compare(all);
    ASSERT_EQ(rows.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto own = all[i].undone.empty() ? nullptr : flight.corrected(all[i].undone);
      const PredictedFlight& seen = own ? *own : flight;
      Rows alone = seen.predict({all[i].vehicle})[0];
      for (std::size_t k = 0; k < alone.size(); ++k) alone[k] = seen.measured()[k] - alone[k];
      EXPECT_EQ(rows[i], alone) << i;
      for (std::size_t k = 0; k < i; ++k) EXPECT_NE(rows[i], rows[k]) << i << " " << k;
    }
  }
}

// References remember residuals; two robots of other parameters, lags or errors of sensors have their own.
TEST(ResetPrediction, ReferencesRememberEachRobotsResidualsAlone) {
  const Flights flown_once = flown("hummingbird_nominal", {"flight.duration_s=2.5"});
  const Flights reference{flown_once.tests, {}}, again{{flown_once[0]->with_log(flown_once[0]->recording()->log)}, {}};
  VehicleHypothesis it{nominal_vehicle(), 0};
  it.variates = {0};
  std::vector<VehicleHypothesis> all(5, it);
  all[1].vehicle.torso.mass_kg *= 1.1;
  all[1].variates = {1};
  all[2].lag_s = 4e-4;
  all[3].sensors = {{"imu_place", {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0}}}};
  all[4].vehicle.effects["wind"] = {
      {"x_m_s", 0.3}, {"y_m_s", 0}, {"z_m_s", 0}, {"gust_m_s", 0}, {"gust_time_s", 0.5}};  // not in references
  const std::vector<Residuals> together = residuals(reference, all, 2);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(residuals(reference, {all[i]}, 1).front(), together[i]) << i;
    again[0]->forget();
    EXPECT_EQ(residuals(again, {all[i]}, 1).front(), together[i]) << i;
    for (std::size_t k = 0; k < i; ++k) EXPECT_EQ(together[i] == together[k], k == 0 && i == 4) << i << " " << k;
  }
}

}  // namespace
}  // namespace flappy::gap::reset_prediction_test
