// Replays of a clamped robot, against a simulation of another kind: its torso weighs tons and flies freely, so that it
// shows what the wings do to it by Newton's law.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"
#include "flightlog/check/data_faults.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "model/derive.hpp"

namespace flappy::gap {
namespace {

constexpr double kTons = 1e5, kDuration_s = 1.5;
/// Steps of the simulation from one sample of the force sensor to the next: at 1 kHz, one sample fills an interval.
constexpr int kStepsPerSample = 5;

model::Vehicle vehicle() { return model::read_vehicle(FLAPPY_SOURCE_DIR "/configs/vehicles/hummingbird_nominal.toml"); }

/// Strokes of both sides, and a difference, a bias and a split cycle that change.
std::pair<double, double> volts(double t_s, double flapping_Hz) {
  const double phase = 2 * std::numbers::pi * flapping_Hz * t_s, amplitude = 9 + 3 * std::sin(4 * t_s);
  return {(amplitude + 0.5) * std::cos(phase) + 0.3,
          (amplitude - 0.5) * std::cos(phase) + 0.3 + 0.4 * std::sin(2 * phase)};
}

/// `heavy`: simulated in single steps; forces of the wings, from its motion, are means over the samples' intervals.
flightlog::FlightLog clamped_log(const model::Vehicle& nominal, int steps_per_sample = kStepsPerSample) {
  model::Vehicle heavy = nominal;
  heavy.torso.mass_kg *= kTons;
  heavy.torso.com_m = {0, 0, 0};
  const double inertia = kTons * nominal.torso.inertia_kg_m2.xx;
  heavy.torso.inertia_kg_m2 = {inertia, inertia, inertia, 0, 0, 0};
  heavy.driver.hold_s = kPredictionStep_s;
  sim::World world;
  world.gravity_m_s2 = 0;
  sim::Batch<double> batch(1, heavy, {kPredictionStep_s, 1, world, {}});
  batch.reset(0, {});
  flightlog::FlightLog log;
  log.header.vehicle = "hummingbird_nominal.toml";
  log.header.flapping_Hz = nominal.driver.flapping_Hz;
  log.header.gravity_m_s2 = 0;
  log.header.rig = {1 / (steps_per_sample * kPredictionStep_s), 0, {0.01, 0, -0.02}, {0, 1, 0, 0}, 1e-3, 1e-5};
  auto& f = log.forces.emplace();
  sim::FlapperState before = batch.state(0);
  const int steps = static_cast<int>(std::lround(kDuration_s / kPredictionStep_s));
  for (int n = 0; n < steps; ++n) {
    const double t_s = n * kPredictionStep_s;
    const auto [left, right] = volts(t_s, log.header.flapping_Hz);
    log.command.t_s.push_back(t_s), log.command.left_voltage_V.push_back(left),
        log.command.right_voltage_V.push_back(right);
    batch.set_voltages(0, left, right);
    batch.step(1);
    if ((n + 1) % steps_per_sample != 0) continue;
    const sim::FlapperState now = batch.state(0);
    const double dt = steps_per_sample * kPredictionStep_s;
    Eigen::Vector3d force, moment;
    for (int i = 0; i < 3; ++i) {
      force[i] = heavy.torso.mass_kg * (now.velocity_m_s[i] - before.velocity_m_s[i]) / dt;
      moment[i] = inertia * (now.body_rate_rad_s[i] - before.body_rate_rad_s[i]) / dt;
    }
    before = now;
    // the sensor's y and z point to the other side, and it sits off the origin
    const Eigen::Vector3d about = moment - Eigen::Vector3d(log.header.rig->position_m.data()).cross(force);
    f.t_s.push_back(t_s + kPredictionStep_s - dt / 2);
    f.force_x_N.push_back(force.x()), f.force_y_N.push_back(-force.y()), f.force_z_N.push_back(-force.z());
    f.moment_x_Nm.push_back(about.x()), f.moment_y_Nm.push_back(-about.y()), f.moment_z_Nm.push_back(-about.z());
  }
  return log;
}

/// Rms of measured less predicted over rms of measured, of the force or moment for which this is largest.
double left_by(const ResetPrediction& flight, const model::Vehicle& vehicle) {
  const VehicleHypothesis robot{vehicle, 0};
  const Rows predicted = flight.predict({&robot})[0];
  if (predicted.empty()) return 1;
  double worst = 0;
  for (const int channel : {kAngularAccelerationX, kAngularAccelerationY, kAngularAccelerationZ, kSpecificForceX,
                            kSpecificForceY, kSpecificForceZ}) {
    double rest = 0, signal = 0;
    for (std::size_t j = 0; j < flight.beats(); ++j) {
      if (!flight.covers(j, channel)) continue;
      for (std::size_t c = 0; c < kCoefficients; ++c) {
        const std::size_t i = row_of_mean(j, channel) + c;
        rest += std::pow(flight.measured()[i] - predicted[i], 2), signal += std::pow(flight.measured()[i], 2);
      }
    }
    EXPECT_GT(signal, 0) << channel_name(channel);
    worst = std::max(worst, std::sqrt(rest / signal));
  }
  return worst;
}

TEST(Clamped, PredictsWhatTheWingsDoToTheStand) {
  const model::Vehicle nominal = vehicle();
  const ResetPrediction flight(Recording("stand", clamped_log(nominal), nominal));
  EXPECT_GT(flight.beats(), 40u);
  EXPECT_LT(left_by(flight, nominal), 0.01);
  EXPECT_FALSE(flight.covers(30, kPathX));
  EXPECT_FALSE(flight.covers(30, kStrokeLeft)) << "not filmed";
  EXPECT_FALSE(flight.covers(30, kRotationLeft)) << "not filmed";
  EXPECT_TRUE(flight.covers(30, kSpecificForceZ));
}

TEST(Clamped, AveragesAFastSensor) {
  const model::Vehicle nominal = vehicle();
  const ResetPrediction slow(Recording("stand", clamped_log(nominal), nominal)),
      fast(Recording("stand", clamped_log(nominal, 1), nominal));
  ASSERT_EQ(fast.recording()->samples_per_interval, static_cast<std::size_t>(kStepsPerSample));
  EXPECT_EQ(slow.recording()->samples_per_interval, 1u);
  EXPECT_LT(left_by(fast, nominal), 0.01);
  const Rows of_fast = fast.declared_noise(1), of_slow = slow.declared_noise(1);
  double noise = 0, noise_of_slow = 0;
  for (std::size_t j = 0; j < std::min(fast.beats(), slow.beats()); ++j)
    for (std::size_t c = 0; c < kCoefficients; ++c) {
      const std::size_t i = row_of_mean(j, kSpecificForceZ) + c;
      noise += std::pow(of_fast[i], 2), noise_of_slow += std::pow(of_slow[i], 2);
    }
  // some 400 rows each: the ratio of their rms is known to 5 %
  EXPECT_NEAR(std::sqrt(noise_of_slow / noise), std::sqrt(kStepsPerSample), 0.35);
}

// 40 us are 0.034 rad in the fourth harmonic: to first order within 2 % of the change, and what the shifted grid sees.
TEST(Clamped, TurnsItsRowsWhereForcesComeLate) {
  const model::Vehicle nominal = vehicle();
  flightlog::FlightLog late = clamped_log(nominal, 1);
  const ResetPrediction on_time(Recording("stand", late, nominal));
  constexpr double kLate_s = 4e-5;
  for (double& t : late.forces->t_s) t += kLate_s;
  const ResetPrediction flight(Recording("stand", late, nominal));
  ASSERT_EQ(flight.beats(), on_time.beats());
  const Rows said = late_rows(on_time, "forces_delay", "delay_s", kLate_s);
  for (const int channel : {kSpecificForceX, kSpecificForceZ, kAngularAccelerationY}) {
    double missed = 0, change = 0;
    for (std::size_t j = 1; j + 1 < flight.beats(); ++j)
      for (std::size_t c = 1; c < kCoefficients; ++c) {
        const std::size_t i = row_of_mean(j, channel) + c;
        change += std::pow(flight.measured()[i] - on_time.measured()[i], 2);
        missed += std::pow(flight.measured()[i] - on_time.measured()[i] - said[i], 2);
      }
    EXPECT_GT(change, 0);
    EXPECT_LT(std::sqrt(missed / change), 0.1) << channel_name(channel);
  }
  const Rows slow = late_rows(on_time, "forces_clock", "rate", 1e-4);
  const std::size_t beat = 8, i = row_of_mean(beat, kSpecificForceX) + 1;
  EXPECT_NEAR(slow[i] / late_rows(on_time, "forces_delay", "delay_s", 1e-4)[i],
              (static_cast<double>(beat) - (static_cast<double>(flight.beats()) - 1) / 2) / flight.beats_Hz(), 1e-9);
  EXPECT_EQ(late_rows(on_time, "imu_clock", "rate", 1), Rows(said.size(), 0.0));
}

TEST(Clamped, IsCheckedByItsForces) {
  const flightlog::FlightLog log = clamped_log(vehicle()), fast = clamped_log(vehicle(), 1);
  EXPECT_EQ(flightlog::data_faults(log, "stand").size(), 1u) << "1.5 s are too short, and nothing else is wrong";
  const auto warns = [&](const std::string& check, const std::function<void(flightlog::FlightLog&)>& spoil,
                         bool faster = false) {
    flightlog::FlightLog spoilt = faster ? fast : log;
    spoil(spoilt);
    for (const flightlog::Finding& f : flightlog::check_flight(spoilt).findings)
      if (f.check == check) return f.verdict == flightlog::Verdict::warning ? f.text : std::string();
    return std::string("no such check");
  };
  const auto nothing = [](flightlog::FlightLog& /*log*/) {};
  for (const char* check : {"rig axes", "rig resonance", "forces beat"}) EXPECT_EQ(warns(check, nothing), "") << check;
  EXPECT_NE(warns("rig axes",
                  [](flightlog::FlightLog& l) {
                    for (auto* c : {&l.forces->force_x_N, &l.forces->force_y_N, &l.forces->force_z_N})
                      for (double& v : *c) v = -v;
                  })
                .find("the force of the sensor on the robot"),
            std::string::npos);
  EXPECT_NE(warns("rig axes",
                  [](flightlog::FlightLog& l) {
                    l.header.rig->attitude = {0.5, 0.5, 0.5, 0.5};
                  })
                .find("another rig.attitude"),
            std::string::npos);
  EXPECT_NE(warns("rig resonance", [](flightlog::FlightLog& l) { l.header.rig->resonance_hz = 120; })
                .find("it magnifies them"),
            std::string::npos);
  EXPECT_NE(warns("rig resonance", [](flightlog::FlightLog& l) { l.header.rig->resonance_hz = 690; })
                .find("1000 samples/s fold what rings above 500 Hz into these"),
            std::string::npos);
  EXPECT_NE(warns("latencies", [](flightlog::FlightLog& l) { l.header.rig->latency_s = 2; }).find("rig.latency_s = 2"),
            std::string::npos);
  EXPECT_EQ(warns("rig resonance", [](flightlog::FlightLog& l) { l.header.rig->resonance_hz = 400; }), "");
  for (const bool faster : {false, true}) {
    EXPECT_EQ(warns("forces beat", nothing, faster), "");
    EXPECT_NE(warns(
                  "forces beat",
                  [](flightlog::FlightLog& l) {
                    for (double& t : l.forces->t_s) t *= 1.012;
                  },
                  faster)
                  .find("another clock"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace flappy::gap
