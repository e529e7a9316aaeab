// How large effects have to be, the robot's reset predictions of its own flights, and true magnitudes.
#include "benchmark/detectability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "benchmark/robot_prediction.hpp"
#include "benchmark/true_values.hpp"
#include "full.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "vehicles.hpp"

namespace flappy::benchmark {
using namespace blind;
namespace {

Case flown(const std::vector<BlindEffect>& effects) {
  Case c{.vehicle = test::identified(), .magnitudes = Magnitudes(effects), .seed = 11};
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  return c;
}

gap::ResetPrediction predicted(const Case& c, std::size_t flight) {
  RobotFlight f = fly(c, flight);
  EXPECT_FALSE(f.crashed) << f.how;
  return gap::ResetPrediction(gap::Recording("flight", std::move(f.log), c.vehicle));
}

/// Rms over beats of the steady turn and force, [channel].
std::array<double, 6> mean_rms(const gap::PredictedFlight& flight, const gap::Rows& rows) {
  std::array<double, 6> rms{};
  for (std::size_t s = 0; s < 6; ++s) {
    double n = 0;
    for (std::size_t j = 0; j < flight.beats(); ++j) {
      if (!flight.covers(j, static_cast<int>(s))) continue;
      n += 1;
      rms[s] += std::pow(rows[j * gap::kRowsPerBeat + s * gap::kCoefficients], 2);
    }
    rms[s] = std::sqrt(rms[s] / n);
  }
  return rms;
}

/// What a perturbed robot leaves of them.
std::array<double, 6> left(const gap::PredictedFlight& flight, const Perturbation& perturbation) {
  gap::Rows rows = predict_perturbed(flight, perturbation, 0);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = flight.measured()[i] - rows[i];
  return mean_rms(flight, rows);
}

// A robot that predicts its own flight leaves the noise of the sensors, and half as much for what the record gets wrong of the torso's motion.
// How it lived before the record is known nearly: a battery is as empty as the first beats of it, repeated, leave it, to some percent.
// Without the effect that it flew with, what is left is several times as much.
TEST(ResetPrediction, KnowsItsOwnFlight) {
  if (!test::full()) GTEST_SKIP() << "takes ten seconds: with --full";
  for (const std::vector<BlindEffect>& effects : {std::vector<BlindEffect>{{"coulomb_friction", 1}, {"body_drag", 1}},
                                                  {{"wind", 2}},            // its gusts come as they came
                                                  {{"battery_sag", 4}}}) {  // empty by as much as the trim took
    const Case c = flown(effects);
    const gap::ResetPrediction flight = predicted(c, 0);
    const auto with = left(flight, {c.vehicle, c.magnitudes, c.seed}), without = left(flight, {c.vehicle, {}, c.seed});
    const auto noise = mean_rms(flight, flight.declared_noise(1));
    double worst = 0;
    for (std::size_t s = 0; s < 6; ++s) {
      EXPECT_LT(with[s], 1.5 * noise[s] + 0.02 * without[s])
          << effects[0].id << ' ' << gap::channel_name(static_cast<int>(s));
      worst = std::max(worst, without[s] / with[s]);
    }
    EXPECT_GT(worst, 2) << effects[0].id;
  }
}

TEST(TrueValues, SensorsDoNotChangeTheFlight) {
  const RobotFlight plain = fly(flown({}), 0);
  std::vector<BlindEffect> all;
  for (std::size_t e = 0; e < kBlindEffects; ++e)
    if (acts_on_sensors(static_cast<Effect>(e))) all.push_back({effect_names()[e], 2});
  const RobotFlight f = fly(flown(all), 0);
  EXPECT_EQ(f.log.command, plain.log.command);
  EXPECT_NE(f.log.imu, plain.log.imu);
  EXPECT_NE(f.log.mocap, plain.log.mocap);
  for (std::size_t k = 0; k < 22; ++k) EXPECT_EQ(f.truth[k], plain.truth[k]) << k;
}

// Effects whose magnitude both sides state in the same units: the entry comes out as what was put in. Poses
// are jittered by as much as a tenth of the delay.
TEST(TrueValues, FindsWhatWasPutIn) {
  const auto uncertain =
      sim::read_randomisation(test::nominal(), io::Config::load(test::source_path("configs/gap/priors.toml")).root());
  if (!test::full()) GTEST_SKIP() << "fits for 15 s: scripts/test --full";
  const std::vector<BlindEffect> put_in{{"mocap_delay", 1}, {"com_offset", 2}, {"mocap_tilt", 2}};
  const auto values = true_values(flown({}), put_in, uncertain, 2);
  const auto at = [&](const char* name) {
    const auto found = values.find(name);
    if (found == values.end() || !found->second) ADD_FAILURE() << name;
    return found == values.end() ? 0 : found->second.value_or(0);
  };
  EXPECT_NEAR(at("mocap_delay.delay_s"), 0.005, 0.0005);
  EXPECT_EQ(values.size(), 6u);
  EXPECT_NEAR(std::hypot(at("mocap_tilt.x_rad"), at("mocap_tilt.y_rad")), 0.02, 0.002);
  EXPECT_NEAR(std::hypot(at("com_offset.x_m"), at("com_offset.y_m")), 0.002, 0.0002);
}

// ---- of families

/// 1,000 beats of a robot that hovers: its weight, and a first harmonic of 10 sqrt 2 m/s^2 along x, so that the three forces have a
/// waveform of sqrt((96.04 + 100)/3) = 8.084 m/s^2.
Changed hovering() {
  Changed c;
  c.flapping_Hz = 34;
  c.change.resize(1000);
  c.signal.resize(1000);
  for (auto& s : c.signal) s[1] = 10 * std::numbers::sqrt2, s[10] = 9.8;
  return c;
}

TEST(FamilyDetectability, MeasuresByTheWeightAndTheWaveform) {
  // up and down from beat to beat, which nothing takes over
  Changed c = hovering();
  for (std::size_t b = 0; b < c.change.size(); ++b) c.change[b][10] = b % 2 == 0 ? 0.49 : -0.49;
  Shown s = shown(c, 1);
  EXPECT_NEAR(s.share, 0.05, 1e-9);
  EXPECT_EQ(s.channel, 2U);
  EXPECT_EQ(s.order, 0U);
  EXPECT_NEAR(detectable_magnitude(c, 2), kShare / 0.05, 1e-6);
  EXPECT_EQ(detectable_magnitude(c, 0.2), std::numeric_limits<double>::infinity());
  // in y, which has no signal of its own, a harmonic is measured by the waveform: (0.4^2 + 0.3^2)/2 has the root 0.35355
  c = hovering();
  for (std::size_t b = 0; b < c.change.size(); ++b) {
    c.change[b][5 + 3] = b % 2 == 0 ? 0.4 : -0.4;
    c.change[b][5 + 4] = b % 2 == 0 ? 0.3 : -0.3;
  }
  s = shown(c, 1);
  EXPECT_NEAR(s.share, 0.35355 / 8.0838, 1e-4);
  EXPECT_EQ(s.channel, 1U);
  EXPECT_EQ(s.order, 2U);
  // a tenth of the beats is enough
  for (std::size_t b = 100; b < c.change.size(); ++b) c.change[b].fill(0);
  EXPECT_NEAR(shown(c, 1).share, s.share, 1e-4);
  EXPECT_EQ(shown(hovering(), 1).share, 0);
  EXPECT_EQ(shown({}, 1).share, 0);
}

TEST(FamilyDetectability, LeavesToFiguresAndLatenessWhatTheyTakeOver) {
  // 8 % more of the wing beat, 0.4 ms late, and a push of 2 % of the weight: all is taken over, of twice as much is not
  Changed c = hovering();
  const double late = 4e-4 * 2 * std::numbers::pi * 34 * 10 * std::numbers::sqrt2;
  for (auto& d : c.change) d[1] = 0.08 * 10 * std::numbers::sqrt2, d[2] = -late, d[10] = 0.02 * 9.8;
  EXPECT_LT(shown(c, 1).share, 1e-6);
  EXPECT_GT(shown(c, 4).share, kShare);
}

TEST(FamilyDetectability, ReadsBeatsFromTheImu) {
  flightlog::FlightLog log;
  log.header.flapping_Hz = 34;
  log.header.imu.latency_s = 2e-3;
  const double w = 2 * std::numbers::pi * 34;
  for (int i = 0; i < 1000; ++i) {
    const double t = 1e-3 * i;
    log.imu.t_s.push_back(t + 2e-3);
    for (flightlog::Column* k :
         {&log.imu.accel_x_m_s2, &log.imu.accel_y_m_s2, &log.imu.gyro_x_rad_s, &log.imu.gyro_y_rad_s})
      k->push_back(0);
    log.imu.accel_z_m_s2.push_back(9.8 + 3 * std::cos(w * t) - 2 * std::sin(2 * w * t));
    log.imu.gyro_z_rad_s.push_back(0.5 * t + 0.1 * std::sin(w * t));
  }
  const Beats beats = beats_of(log, {0, 10 / 34.0, 5});
  ASSERT_TRUE(beats[1]);
  EXPECT_FALSE(beats[2]) << "after the end";
  const auto& b = *beats[1];
  for (const auto& [at, value] :
       {std::pair{10, 9.8}, {11, 3.0}, {12, 0.0}, {13, 0.0}, {14, -2.0}, {25, 0.5}, {26, 0.1 * w}, {27, 0.0}})
    EXPECT_NEAR(b[static_cast<std::size_t>(at)], value, 1e-6) << at;
}

}  // namespace
}  // namespace flappy::benchmark
