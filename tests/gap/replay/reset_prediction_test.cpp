#include "gap/replay/reset_prediction.hpp"

#include <gtest/gtest.h>

#include "gap/flown_flights.hpp"

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
  for (const int channel :
       {kAngularAccelerationX, kAngularAccelerationY, kAngularAccelerationZ, kSpecificForceX, kSpecificForceY,
        kSpecificForceZ, kStrokeLeft, kStrokeRight, kCurrentLeft, kCurrentRight, kBattery, kPathX, kRotateZ})
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

}  // namespace
}  // namespace flappy::gap::reset_prediction_test
