// The parts of a diagnosis on simulated flights: what reset predictions, rows, noise and fit find where the truth is known.
#include "gap/diagnose/diagnose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>

#include "full.hpp"
#include "gap/evidence/robot_fit.hpp"
#include "gap/replay/sensor_correction.hpp"
#include "gap/replay/stream_rows.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "model/effects/registry.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;

const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";

model::Vehicle nominal() { return model::read_vehicle(kConfigs + "vehicles/hummingbird_nominal.toml"); }

sim::Randomisation uncertain() {
  return sim::read_randomisation(nominal(), io::Config::load(kConfigs + "gap/priors.toml", {}).root());
}

/// Eight seconds: take-off and hover, the last five under multisines.
std::vector<PredictedFlight> flown(const std::string& vehicle, const std::vector<std::string>& overrides = {}) {
  flight::Folder folder;
  rollout::FlyOptions options;
  options.log_folder = folder / "flight";
  std::vector<std::string> all = {"vehicle=../vehicles/" + vehicle + ".toml", "flight.duration_s=8"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  rollout::fly(rollout::read_fly_config(kConfigs + "fly/identify_multisine.toml", all), options);
  std::vector<PredictedFlight> flights;
  flights.emplace_back(Recording(options.log_folder, flightlog::read_flight_log(options.log_folder), nominal()));
  return flights;
}

double rms(const PredictedFlight& f, const Rows& rows, int group) {
  double sum = 0, n = 0;
  for (std::size_t j = 0; j < f.beats(); ++j)
    if (f.covers(j, group / kCoefficients)) {
      const double x = rows[j * kRowsPerBeat + static_cast<std::size_t>(group)];
      sum += x * x, n += 1;
    }
  return std::sqrt(sum / n);
}

TEST(BeatRows, ProjectAConstantAndItsHarmonics) {
  constexpr std::size_t kBeats = 8, kPerBeat = 15;
  std::vector<double> beat, samples;
  for (std::size_t i = 0; i < kBeats * kPerBeat; ++i) {
    const double b = (static_cast<double>(i) + 0.5) / kPerBeat, a = 2 * std::numbers::pi * b;
    beat.push_back(b);
    samples.push_back(3 + 2 * std::cos(a) - 0.5 * std::sin(3 * a));
  }
  std::vector<char> valid(beat.size(), 1);
  valid[5 * kPerBeat + 7] = 0;
  valid[5 * kPerBeat + 8] = 0;
  const BeatProjection projection(beat, valid, kBeats, 1);
  std::vector<double> rows(kBeats * kCoefficients, 0);
  projection.project(samples.data(), 1, rows.data());
  EXPECT_FALSE(projection.covers(0)) << "left out";
  EXPECT_FALSE(projection.covers(5)) << "two samples of the middle are more than a tenth of its weight";
  ASSERT_TRUE(projection.covers(3));
  const double* r = &rows[std::size_t{3} * kCoefficients];
  const double expected[kCoefficients] = {3, 2, 0, 0, 0, 0, -0.5, 0, 0};
  // over whole samples of a hat, harmonics leak into each other by the square of 1/(2 x 15)
  for (int c = 0; c < kCoefficients; ++c) EXPECT_NEAR(r[c], expected[c], 5e-3) << c;
}

TEST(ResetPrediction, TheVehicleThatFlewLeavesTheNoiseOfTheSensors) {
  const std::vector<PredictedFlight> flights = flown(
      "hummingbird_nominal", {"log.power.battery_nominal_V=18", "log.power.rate_hz=500", "log.power.latency_s=0.001",
                              "log.power.voltage_noise_V=0.02", "log.power.current_noise_A=0.01"});
  const Candidate it{nominal(), 0};
  const Rows predicted = flights[0].predict({&it})[0];
  Candidate held = it;  // by a driver whose updates are no multiple of the steps here: voltages are those of the log
  held.vehicle.driver.hold_s = 5e-4;
  EXPECT_EQ(flights[0].predict({&held})[0], predicted);
  const Rows noise = flights[0].declared_noise(1);
  Rows left = flights[0].measured();
  for (std::size_t i = 0; i < left.size(); ++i) left[i] -= predicted[i];
  // 250 beats: an rms of as many normal numbers varies by 4 %, of neighbours that share samples by 6 %; heavy tails, for
  // now and then a wing's landing comes a little early, add to a few. Mean forces, of which five beats share samples, by 10 %; and
  // to their noise, that of motion capture, comes that of the motion to which the torso is reset.
  for (const int channel : {kTorqueX, kTorqueY, kTorqueZ, kForceX, kForceY, kForceZ, kStrokeLeft, kStrokeRight,
                            kCurrentLeft, kCurrentRight, kBattery, kPathX, kTurnZ})
    for (int c = 0; c < (channel < kPathX ? 3 : 1); ++c) {
      const int g = channel * kCoefficients + c;
      const double ratio = rms(flights[0], left, g) / rms(flights[0], noise, g);
      EXPECT_GT(ratio, 0.7) << channel_name(channel) << " " << c;
      EXPECT_LT(ratio, c == 0 && channel >= kForceX && channel <= kForceZ ? 1.7 : 1.4)
          << channel_name(channel) << " " << c;
    }
}

// An accelerometer that errs by a constant, on an axis that stays level, moves what it says against motion capture, not the mean force.
TEST(ResetPrediction, MeanForcesAreThoseOfMotionCapture) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  flightlog::FlightLog log = flights[0].recording().log;
  constexpr double kError_m_s2 = 0.5;
  for (double& z : log.imu.accel_z_m_s2) z += kError_m_s2;
  const PredictedFlight wrong = flights[0].with_log(log);
  const auto mean = [](const PredictedFlight& f, int channel) {
    double sum = 0, n = 0;
    for (std::size_t j = 0; j < f.beats(); ++j)
      if (f.covers(j, channel))
        sum += f.measured()[j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients], n += 1;
    return sum / n;
  };
  EXPECT_NEAR(mean(wrong, kPathZ) - mean(flights[0], kPathZ), -kError_m_s2, 0.02 * kError_m_s2);
  EXPECT_NEAR(mean(wrong, kForceZ) - mean(flights[0], kForceZ), 0, 0.02 * kError_m_s2);
}

TEST(Recording, FliesWhatWasDriven) {
  const std::vector<PredictedFlight> flights = flown(
      "hummingbird_nominal", {"log.power.battery_nominal_V=18", "log.power.rate_hz=500", "log.power.latency_s=0.001",
                              "log.power.voltage_noise_V=0.02", "log.power.current_noise_A=0.01"});
  const Recording& whole = flights[0].recording();
  flightlog::FlightLog log = whole.log;
  flightlog::CommandStream& c = log.command;
  const double start_s = c.t_s.front(), from_s = start_s + 3, to_s = start_s + 3.5, end_s = start_s + 6;
  const flightlog::Column t_s = c.t_s;
  for (flightlog::Column* column :
       {&c.t_s, &c.left_voltage_V, &c.right_voltage_V, &*c.phase_rad, &c.inputs->amplitude_V, &c.inputs->difference_V,
        &c.inputs->bias_V, &c.inputs->split_cycle}) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < t_s.size(); ++i)
      if ((t_s[i] < from_s || t_s[i] > to_s) && t_s[i] < end_s) (*column)[kept++] = (*column)[i];
    column->resize(kept);
  }
  for (double& v : log.power->battery_V) v *= 1.1;
  const Recording r("flight", log, nominal());
  EXPECT_LT(r.end_s.back(), end_s);
  EXPECT_GT(r.end_s.back(), end_s - 0.1);
  // until the wings have forgotten: six beats of 34 Hz
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    const double begin_s = r.end_s[k] - r.interval_s(k);
    if (begin_s > from_s + 0.006 && r.end_s[k] < to_s + 6.0 / 34) EXPECT_FALSE(r.valid[k]) << begin_s - start_s;
    else if (r.end_s[k] < from_s || begin_s > to_s + 6.1 / 34)
      EXPECT_EQ(r.valid[k], whole.valid[k]) << begin_s - start_s;
  }
  // a battery fuller than nominal drives that much harder; 0.02 V of noise in each of twenty samples of 18 V
  EXPECT_NEAR(r.full, 1.1, 5 * 0.02 / 18 / std::sqrt(20));
  EXPECT_DOUBLE_EQ(r.left_V[1000], r.full * whole.left_V[1000]);
  EXPECT_EQ(whole.full, 1);
}

// Another delay of motion capture moves all poses: a grid that begins before the first of them, or ends after the last, says nothing there.
TEST(Recording, KnowsNoMotionWhereThereIsNoPose) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  const Recording& whole = flights[0].recording();
  for (const double moved_s : {0.1, -0.1}) {
    flightlog::FlightLog log = whole.log;
    log.header.mocap.latency_s -= moved_s;
    const Recording r(whole, log);
    ASSERT_EQ(r.intervals(), whole.intervals());
    int unknown = 0;
    for (std::size_t k = 0; k < r.intervals(); ++k) {
      const bool known = r.end_s[k] > r.smoother.begin_s() && r.end_s[k] - r.interval_s(k) < r.smoother.end_s();
      unknown += known ? 0 : 1;
      if (!known) EXPECT_FALSE(r.valid[k]) << moved_s << " s: " << r.end_s[k];
    }
    // 0.05 s of them, at 500 Hz, but for one that a pose halves
    EXPECT_NEAR(unknown, 25, 5) << moved_s;
    for (const StreamRow& row : stream_rows(r)) EXPECT_TRUE(row.path_m_s2.allFinite()) << moved_s;
  }
}

// What acts by the place may act by another law: along the functions that its own change follows, every load of the body may have as much as the
// loads have on average, those that it follows most as often as its shape says, and no other function or channel any. An effect that follows the
// inputs has no such shape.
TEST(Fit, WhatActsByThePlaceHasAShape) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  const Evidence evidence(flights, read_model_discrepancy(), 2);
  const Fitter fitter(flights, evidence, 2);
  const sim::Randomisation prior = uncertain();
  const Hypothesis h(prior, {"ground_effect"});
  const RegimeBasis& basis = evidence.basis();
  const auto index = [&](const char* name) {
    for (int i = 0; i < basis.size(); ++i)
      if (basis.name(i) == name) return i;
    ADD_FAILURE() << "no " << name;
    return 0;
  };
  const auto with = [&](int function) {
    Linearised l{Eigen::VectorXd::Zero(h.size()), Fitter::axes(h), {}, {}, {}};
    for (Index i = 0; i < h.size(); ++i) l.columns.push_back(BasisCoefficients::Zero(kGroups, basis.size()));
    const int lift = kForceZ * kCoefficients;
    l.at[h.shared()] = 2;
    l.columns[static_cast<std::size_t>(h.shared())](lift, function) = 0.3 * evidence.signal(lift);
    return l;
  };
  const int near = index("near ground"), height = index("height"), amplitude = index("amplitude");
  Linearised l = with(near);
  // a twenty-fifth of the square: as gusts happen to do, not as the law says
  l.columns[static_cast<std::size_t>(h.shared())](kForceZ * kCoefficients, height) =
      0.2 * 0.3 * evidence.signal(kForceZ * kCoefficients);
  ASSERT_TRUE(fitter.has_shape(h, l));
  const double loads = 6 * kCoefficients, rms = 2 * 0.3 / std::sqrt(loads);
  for (const double shape : {1.0, 4.0}) {
    l.shape = shape;
    const BasisCoefficients sd = fitter.shape_error(h, l);
    for (const int g : {kTorqueX * kCoefficients, kForceX * kCoefficients + 3, kForceZ * kCoefficients})
      EXPECT_NEAR(sd(g, near), shape * rms * evidence.signal(g), 1e-9 * evidence.signal(g)) << g;
    EXPECT_NEAR(sd(kForceX * kCoefficients, height), 0.2 * rms * evidence.signal(kForceX * kCoefficients), 1e-9);
    EXPECT_EQ(sd.col(index("time")).maxCoeff(), 0);
    EXPECT_EQ(sd.col(amplitude).maxCoeff(), 0);
    EXPECT_EQ(sd.bottomRows(kGroups - static_cast<int>(loads)).maxCoeff(), 0) << "strokes, currents, motion capture";
  }
  EXPECT_FALSE(fitter.has_shape(h, with(amplitude)));
  const Hypothesis tilt(prior, {"mocap_tilt"});
  Linearised turned{Eigen::VectorXd::Ones(tilt.size()), Fitter::axes(tilt), {}, {}, {}};
  turned.columns.assign(static_cast<std::size_t>(tilt.size()), l.columns[static_cast<std::size_t>(h.shared())]);
  EXPECT_FALSE(fitter.has_shape(tilt, turned)) << "of a sensor";
  EXPECT_FALSE(fitter.shape_error(tilt, turned).any());
}

TEST(Fit, FindsTheIdentifiedVehicleFromTheNominalOne) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_identified");
  const sim::Randomisation prior = uncertain();
  const Hypothesis plain(prior, {});
  Evidence evidence(flights, read_model_discrepancy(), 2);
  Fitter fitter(flights, evidence, 2);
  const Linearised start =
      fitter.linearise(plain, plain.start(), {Eigen::MatrixXd(plain.size(), 0), Eigen::VectorXd(0)});
  evidence.learn_weights(start.residual);
  Fit fit = fitter.fit(plain, plain.start(), 4);
  evidence.learn_weights(fit.point.residual);
  fit = fitter.refit(plain, fit, 3);
  const int groups[] = {kTorqueX * kCoefficients, kTorqueZ * kCoefficients + 1, kForceY * kCoefficients,
                        kStrokeLeft * kCoefficients};
  std::vector<double> declared;
  const Rows noise = flights[0].declared_noise(1);
  for (const int g : groups) {
    declared.push_back(evidence.noise_sd(g));
    // of one course of the noise, whose innovations are found with its memory
    EXPECT_LT(declared.back(), 1.2 * rms(flights[0], noise, g)) << g;
    EXPECT_GT(declared.back(), 0.4 * rms(flights[0], noise, g)) << g;
  }
  evidence.learn_noise(fit.point.residual);
  // what a right model leaves is noise as declared, to the 8 % of a median of 200, and no less by definition; of the mean force also
  // that of the motion to which the torso is reset
  for (std::size_t i = 0; i < declared.size(); ++i)
    EXPECT_LT(evidence.noise_sd(groups[i]), (groups[i] == kForceY * kCoefficients ? 1.7 : 1.35) * declared[i])
        << groups[i];
  fit = fitter.refit(plain, fit, 3);
  const model::Vehicle truth = model::read_vehicle(kConfigs + "vehicles/hummingbird_identified.toml");
  const Eigen::VectorXd mean = fit.mean();
  const Eigen::MatrixXd covariance = fit.covariance();
  const auto off = [&](const std::string& path, double coordinate) {
    for (Index i = 0; i < plain.shared(); ++i)
      if (plain.unknowns()[static_cast<std::size_t>(i)].name == path)
        return (mean[i] - coordinate) / std::sqrt(covariance(i, i));
    ADD_FAILURE() << path;
    return 0.0;
  };
  // of its own prior, in standard deviations of what the flight tells; 4 of them hold for all of eight
  EXPECT_LT(std::abs(off("left.motor.resistance_ohm", (truth.left.motor.resistance_ohm / 12.4 - 1) / 0.1)), 4);
  EXPECT_LT(std::abs(off("right.motor.resistance_ohm", (truth.right.motor.resistance_ohm / 12.4 - 1) / 0.1)), 4);
  EXPECT_LT(std::abs(off("left.spring.rest_angle_rad", truth.left.spring.rest_angle_rad / 0.05)), 4);
  EXPECT_LT(std::abs(off("right.spring.rest_angle_rad", truth.right.spring.rest_angle_rad / 0.05)), 4);
  EXPECT_LT(std::abs(off("left.rotation.lower_rad", (truth.left.rotation.lower_rad / -0.7854 - 1) / 0.07)), 4);
  EXPECT_LT(std::abs(off("right.rotation.upper_rad", (truth.right.rotation.upper_rad / 0.7854 - 1) / 0.07)), 4);
  EXPECT_LT(std::abs(off("air.density_kg_m3", 0)), 4);
  EXPECT_LT(std::abs(off("torso.mass_kg", 0)), 4);
  // and it does tell: rest angles and stops to a tenth of their prior
  for (Index i = 0; i < plain.shared(); ++i)
    if (plain.unknowns()[static_cast<std::size_t>(i)].name.find("rest_angle") != std::string::npos)
      EXPECT_LT(std::sqrt(covariance(i, i)), 0.1);
  // an effect that changes nothing, here a wall where there is none, explains just as much beside the same parameters
  const Hypothesis wall(prior, {"wall_effect"});
  Eigen::VectorXd at = wall.start();
  at[wall.shared()] = 1;
  const Fit beside = fitter.fit_beside(wall, at, fit);
  EXPECT_EQ(beside.point.at.head(plain.size()), fit.point.at);
  EXPECT_NEAR(beside.posterior.log_evidence, fit.posterior.log_evidence, 1);
  // what a line says of a size is not flown
  const BasisCoefficients line = BasisCoefficients::Constant(kGroups, evidence.basis().size(), 0.5);
  fitter.set_lines({{{"mocap_tilt", "x_rad"}, line}});
  const Hypothesis tilt(prior, {"mocap_tilt"});
  const Linearised l = fitter.fit_beside(tilt, tilt.start(), fit).point;
  EXPECT_EQ(l.columns[static_cast<std::size_t>(tilt.shared())], line);
  EXPECT_NE(l.columns[static_cast<std::size_t>(tilt.shared() + 1)], line);
}

TEST(SensorEffects, AreTakenBack) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal");
  const flightlog::FlightLog& log = flights[0].recording().log;
  const auto mean_path = [](const PredictedFlight& f) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double n = 0;
    for (std::size_t j = 0; j < f.beats(); ++j)
      if (f.covers(j, kPathX)) {
        for (std::size_t i = 0; i < 3; ++i)
          sum[static_cast<Index>(i)] += f.measured()[j * kRowsPerBeat + (kPathX + i) * kCoefficients];
        n += 1;
      }
    return Eigen::Vector3d(sum / n);
  };
  // a world that leans by e sees gravity lean: its path bends by -g e x z beyond what the accelerometer says
  const double e = 0.02, g = 9.81;
  const PredictedFlight tilted = flights[0].with_log(without({{"mocap_tilt", {{"x_rad", -e}, {"y_rad", 0}}}}, log));
  const Eigen::Vector3d bend = mean_path(tilted) - mean_path(flights[0]);
  EXPECT_NEAR(bend.y(), g * e, 0.05 * g * e);
  EXPECT_NEAR(bend.x(), 0, 0.05 * g * e);
  // and comes back
  const flightlog::FlightLog back = without({{"mocap_tilt", {{"x_rad", e}, {"y_rad", 0}}}}, tilted.recording().log);
  EXPECT_NEAR(back.mocap.y_m[100], log.mocap.y_m[100], 1e-12);
  // an offset moves the point, a delay the clock
  const auto moved = without({{"marker_offset", {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0}}}}, log);
  EXPECT_NEAR(std::hypot(moved.mocap.x_m[100] - log.mocap.x_m[100], moved.mocap.y_m[100] - log.mocap.y_m[100],
                         moved.mocap.z_m[100] - log.mocap.z_m[100]),
              0.01, 1e-12);
  EXPECT_EQ(without({{"mocap_delay", {{"delay_s", 0.004}}}}, log).header.mocap.latency_s,
            log.header.mocap.latency_s + 0.004);
  // a turned accelerometer keeps its length
  const auto turned = without({{"accelerometer_misalignment", {{"x_rad", 0.1}, {"y_rad", 0}, {"z_rad", 0}}}}, log);
  EXPECT_NEAR(turned.imu.accel_x_m_s2[50], log.imu.accel_x_m_s2[50], 1e-12);
  EXPECT_NEAR(turned.imu.accel_y_m_s2[50],
              std::cos(0.1) * log.imu.accel_y_m_s2[50] + std::sin(0.1) * log.imu.accel_z_m_s2[50], 1e-12);
  // a shaking of amplitude A rectifies to gain A^2 / 2; over 14 of 14.7 samples of a beat to 1 %
  flightlog::FlightLog shaking = log;
  flightlog::Column& x = shaking.imu.accel_x_m_s2;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = 3 + 10 * std::sin(2 * std::numbers::pi * 34 * (shaking.imu.t_s[i] - shaking.imu.t_s[0]));
  const auto mean = [](const flightlog::Column& c) {
    return std::accumulate(c.begin() + 100, c.end() - 100, 0.0) / static_cast<double>(c.size() - 200);
  };
  const auto calmed = without({{"vibration_rectification", {{"gain_s2_m", 1e-3}}}}, shaking);
  EXPECT_NEAR(mean(x) - mean(calmed.imu.accel_x_m_s2), 1e-3 * 100 / 2, 0.01 * 0.05);
  EXPECT_EQ(without({{"vibration_rectification", {{"gain_s2_m", 0}}}}, shaking).imu, shaking.imu);
  // how laboratories depart from their headers
  const auto mounted = without({{"imu_mounting", {{"x_rad", 0.1}, {"y_rad", 0}, {"z_rad", 0}}}}, log);
  EXPECT_NEAR(mounted.imu.gyro_y_rad_s[50],
              std::cos(0.1) * log.imu.gyro_y_rad_s[50] + std::sin(0.1) * log.imu.gyro_z_rad_s[50], 1e-12);
  EXPECT_NEAR(mounted.imu.accel_y_m_s2[50], turned.imu.accel_y_m_s2[50], 1e-12);
  EXPECT_EQ(without({{"imu_place", {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0}}}}, log).header.imu.position_m[0],
            log.header.imu.position_m[0] + 0.01);
  // a clock that runs fast is right in the middle, and beats stay where they were
  const auto slowed = without({{"imu_clock", {{"rate", 1e-4}}}}, log);
  EXPECT_NEAR(log.imu.t_s.back() - slowed.imu.t_s.back(), 0.5e-4 * (log.imu.t_s.back() - log.imu.t_s.front()), 1e-12);
  EXPECT_NEAR(slowed.imu.t_s.back() + slowed.imu.t_s.front(), log.imu.t_s.back() + log.imu.t_s.front(), 1e-9);
  EXPECT_EQ(slowed.mocap, log.mocap);
  EXPECT_EQ(flights[0].with_log(slowed).beats(), flights[0].beats());
  EXPECT_TRUE(sensor_effects({{"wind", {}}, {"mocap_tilt", {}}}).count("mocap_tilt"));
  EXPECT_FALSE(sensor_effects({{"wind", {}}, {"mocap_tilt", {}}}).count("wind"));
}

TEST(Diagnose, StopsWithWhatItHas) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal");
  DiagnoseOptions options;
  options.threads = 2;
  options.progress = [](double, const std::string&) { return false; };
  const Diagnosis d = diagnose(flights, uncertain(), options);
  EXPECT_FALSE(d.complete);
  ASSERT_EQ(d.hypotheses.size(), 3 + model::effects().size());
  double sum = 0;
  for (const ScoredHypothesis& a : d.hypotheses) {
    EXPECT_TRUE(a.left.empty());
    sum += a.probability;
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_EQ(d.hypotheses[0].kind, ScoredHypothesis::Kind::none);
}

// Figures that priors call minor: a wing's centre of mass, a spring that is stiffer one way, an inertia about one axis.
TEST(RobotFit, FliesMinorFigures) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::vector<PredictedFlight> flights =
      flown("hummingbird_nominal",
            {"vehicle.left.wing.com_m.x=0.0006", "vehicle.right.spring.stiffness_positive_Nm_rad=0.0147",
             "vehicle.right.leading_edge.inertia_kg_m2.zz=1.0e-7",
             "vehicle.right.leading_edge.inertia_kg_m2.xx=1.422e-7", "flight.duration_s=5"});
  const std::string text = io::read_text(kConfigs + "gap/priors.toml");
  const auto fitted = [&](const std::string& priors) {
    const sim::Randomisation prior =
        sim::read_randomisation(nominal(), io::Config::parse(priors, "priors.toml").root());
    auto robot = std::make_unique<RobotFit>(flights, prior, read_model_discrepancy(), std::vector<std::string>{}, 2);
    robot->fit_parameters();
    robot->refit_beside_background();
    return robot;
  };
  const auto robot = fitted(text), without = fitted(text.substr(0, text.find("# Figures that change little")));
  EXPECT_GT(without->evidence().scales().robot, 1.5 * robot->evidence().scales().robot) << "errors of the model else";
  const sim::Randomisation& found = robot->uncertain();
  std::map<std::string, double> minors;
  for (std::size_t d = found.majors(); d < found.draws(); ++d)
    minors.try_emplace(found.name(d), found.minors()[d - found.majors()]);
  EXPECT_NEAR(minors.at("left.wing.com_m.x"), 0.0006 / 0.0003, 1) << "in units of what is believed";
}

// The same by looking for the factor t that makes sizes most probable as background: -log N(0, (t sd)^2), and what t costs.
TEST(RobotFit, SaysHowMuchMoreProbableSizesAreOfAnEffect) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  const ModelDiscrepancy discrepancy = read_model_discrepancy();
  const RobotFit robot(flights, uncertain(), discrepancy, {}, 2);
  const auto background = [&](const std::string& entry, const Eigen::VectorXd& sizes) {
    double least = 1e300;
    for (double log_t = -3; log_t < 6; log_t += 1e-3) {
      const double sd = std::exp(log_t) * discrepancy.background_sd(entry);
      least = std::min(least, 0.5 * sizes.squaredNorm() / (sd * sd) + static_cast<double>(sizes.size()) * std::log(sd) +
                                  robot.evidence().price_of(std::exp(log_t), discrepancy.tail_of(entry)));
    }
    return least;
  };
  const Eigen::Vector3d offset(0.4, -0.1, 1.2);
  EXPECT_NEAR(robot.beyond_background("com_offset", offset),
              background("com_offset", offset) - 0.5 * offset.squaredNorm(), 1e-5);
  const Eigen::Vector2d one(0.5, 0), both(0.5, 0.5);
  const auto sides = [&](double apart, double alike) {
    return background("wing_damage", Eigen::VectorXd::Constant(1, apart)) +
           background("wing_damage_of_both", Eigen::VectorXd::Constant(1, alike));
  };
  EXPECT_NEAR(robot.beyond_background("wing_damage", one), sides(0.5 / std::sqrt(2), 0.5 / std::sqrt(2)) - 0.125, 1e-5);
  EXPECT_NEAR(robot.beyond_background("wing_damage", both), sides(0, std::sqrt(0.5)) - 0.25, 1e-5);
}

// How a wing lands on its stop turns with its spring: a line from where an effect is large is none of what a robot has anyway.
// So is a clock that runs 60 ppm fast: over 5 s it turns the fourth harmonic by 0.13 rad at either end.
TEST(Diagnose, NamesNoEffectForWhatAnyRobotMayHave) {
  std::vector<PredictedFlight> flights =
      flown("hummingbird_nominal", {"vehicle.effects.spring_hardening.per_rad2=-0.015", "flight.duration_s=5"});
  flights[0] = flights[0].with_log(without({{"imu_clock", {{"rate", -6e-5}}}}, flights[0].recording().log));
  DiagnoseOptions options;
  options.threads = 2;
  options.discrepancy.background["spring_hardening"] = 0.08;
  const Diagnosis d = diagnose(flights, uncertain(), options);
  EXPECT_TRUE(d.conclusion.effects.empty()) << d.conclusion.effects[0];
  const auto clock = std::ranges::find(d.sensors, "imu_clock.rate", &SensorFinding::name);
  ASSERT_NE(clock, d.sensors.end());
  EXPECT_NEAR(clock->value, 6e-5, 4 * clock->sd);
  EXPECT_LT(clock->sd, 1e-5);
  // what stands beside the parameters belongs to their prediction, which is better than the file's, to 1.5 sd of noise
  const auto left = [&](const Residuals& residual) {
    double sum = 0, n = 0;
    for (std::size_t j = 0; j < flights[0].beats(); ++j)
      for (int g = kTorqueX * kCoefficients; g < (kForceZ + 1) * kCoefficients; ++g)
        if (flights[0].covers(j, g / kCoefficients)) {
          const auto row = static_cast<std::size_t>(g);
          sum += std::pow(residual[0][j * kRowsPerBeat + row] / d.noise_sd[row], 2);
          n += 1;
        }
    return sum / n;
  };
  EXPECT_LT(left(d.refit), left(d.nominal));
  EXPECT_LT(left(d.refit), 1.5 * 1.5);
}

TEST(Screening, StepsAsFarAsRobotsGoAnyway) {
  ModelDiscrepancy usual = read_model_discrepancy();
  usual.background = {{"other", 0.001}, {"spring_hardening", 0.06}, {"ground_effect", 1}};
  const sim::Randomisation prior = uncertain();
  const Eigen::VectorXd at = Hypothesis(prior, {}).start();
  for (const SizeStep& s : size_steps(prior, at, {}, &usual)) {
    const auto near = [&](std::size_t i, const char* size) {
      return s.near.at(i).vehicle.effects.at(s.effect).at(size);
    };
    if (s.effect == "spring_hardening") {
      ASSERT_EQ(s.near.size(), 2u);
      EXPECT_NEAR(near(0, "per_rad2"), 2 * 0.06 * unknowns_of(s.effect)[0].scale, 1e-12);
      EXPECT_NEAR(near(1, "per_rad2"), -near(0, "per_rad2"), 1e-12);
    } else if (s.effect == "ground_effect") {
      ASSERT_EQ(s.near.size(), 1u) << "of one sign";
      EXPECT_NEAR(near(0, "gain"), kSizeReach * unknowns_of(s.effect)[0].scale, 1e-12) << "no farther than far";
    } else {
      EXPECT_EQ(s.reach, 0.05) << s.effect << ": nearer, differences are rough";
    }
  }
  EXPECT_TRUE(size_steps(prior, at, {})[0].near.empty());
}

// A third of a beat and more: near 0 its derivative shows nothing of it.
TEST(Screening, FindsALongDelayAndFliesWhatIsLeftWithoutIt) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::vector<PredictedFlight> flights =
      flown("hummingbird_nominal", {"vehicle.effects.command_delay.delay_s=0.013", "flight.duration_s=5"});
  const sim::Randomisation prior = uncertain();
  RobotFit robot(flights, prior, read_model_discrepancy(), {}, 2);
  robot.fit_parameters();
  robot.refit_beside_background();
  const Screened first = screen(robot.evidence(), robot.fitter(), robot.parameters(), robot.sizes()).front();
  EXPECT_EQ(first.effect, "command_delay");
  EXPECT_GT(first.gain, 50);
  const Unknown delay = unknowns_of("command_delay").front();
  EXPECT_NEAR(delay.value(first.coordinates[0]), 0.013, 0.002) << "steps are 0.0036 s";

  // beside what every robot has of the entries the parameters leave to that what it takes; of a vehicle that has nothing else they are flown
  const Fit& beside = robot.parameters();
  const Fit alone = robot.fitter().alone(robot.plain(), beside);
  EXPECT_GT((alone.point.at - beside.point.at).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_EQ(robot.plain().bounded(alone.point.at), alone.point.at);
  EXPECT_EQ(residuals(flights, {robot.plain().candidate(alone.point.at)}, 2)[0], alone.point.residual);
}

// Of one coefficient of the basis in one group: log p by hand, where it is a column, or a floor.
TEST(Evidence, IntegratesOutInClosedForm) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  const Evidence evidence(flights, read_model_discrepancy(), 2);
  const Candidate it{nominal(), 0};
  Rows residual = flights[0].measured();
  const Rows predicted = flights[0].predict({&it})[0];
  for (std::size_t i = 0; i < residual.size(); ++i) residual[i] -= predicted[i];
  const SufficientStatistics s = evidence.statistics({residual}),
                             zero = evidence.statistics({Rows(residual.size(), 0)});
  constexpr int kGroup = kForceX * kCoefficients + 1, kFunction = 2;
  const BasisCoefficients none = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  BasisCoefficients unit = none;
  unit(kGroup, kFunction) = 1;
  SufficientStatistics of_unit = zero;
  evidence.add(1, unit, of_unit);
  const double a = of_unit.sums[0][kGroup][kFunction], b = s.sums[0][kGroup][kFunction];
  const double sd = 2 / std::sqrt(a), m = 0.7;
  const auto log_p = [&](const BasisCoefficients& discrepancy_sd, bool column) {
    const std::vector<const BasisCoefficients*> columns(column ? 1 : 0, &unit);
    return Evidence::posterior(evidence.reduce(s, columns, {1}, discrepancy_sd), std::vector<int>(column ? 1 : 0, 0),
                               Eigen::VectorXd::Constant(column ? 1 : 0, m))
        .log_evidence;
  };
  const double plain = log_p(none, false);
  const double by_eta = 0.5 * b * b / (a + 1 / (sd * sd)) - 0.5 * std::log1p(a * sd * sd);
  const double by_column = -0.5 * (m * m - (b + m) * (b + m) / (a + 1)) - 0.5 * std::log1p(a);
  // sums of squares of some thousand rows, less each other
  const double error = 1e-12 * std::abs(plain);
  EXPECT_NEAR(log_p(sd * unit, false) - plain, by_eta, error);
  EXPECT_NEAR(log_p(none, true) - plain, by_column, error);
  // with all scales 1 nothing else is weighed, and what is thought of them costs nothing
  const BasisCoefficients usual = evidence.discrepancy_sd();
  Columns one;
  one.add(unit, m);
  const Weighed once = evidence.weigh(s, one, {1}, {}, Scales{}, {}, 1);
  EXPECT_NEAR(once.posterior.log_evidence, log_p(usual, true), error);
  EXPECT_EQ(evidence.reduce(s, {&unit}, {0}, none).sums.norm(), 0) << "a flight that is left out";
}

/// Sums of a residual that is nothing but a smooth function.
SufficientStatistics sums_of(const Evidence& evidence, const PredictedFlight& flight, const BasisCoefficients& delta) {
  SufficientStatistics s = evidence.statistics({Rows(flight.beats() * kRowsPerBeat, 0)});
  evidence.add(1, delta, s);
  return s;
}

// Deltas drawn at three times their sd in all blocks, and at ninety times in one: the robot's scale is three, and the block is free where
// that is allowed, for its scale costs more than the 10 nats of that: nu / 2 (2 log 30 - 1), nu = 4. A sum of squares of n normal numbers is n (1 +- sqrt(2 / n)); heavy tails of the law draw a robot's scale in.
TEST(Evidence, FindsHowFarModelsOfARobotAreOff) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  ModelDiscrepancy discrepancy = read_model_discrepancy();
  discrepancy.spread.place_freedom = discrepancy.spread.block_freedom;
  const Evidence evidence(flights, discrepancy, 2);
  const BasisCoefficients sd = evidence.discrepancy_sd();
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const int freed = Evidence::block_of(kForceZ * kCoefficients, BasisFunction::input);
  BasisCoefficients delta = sd;
  for (int g = 0; g < kGroups; ++g)
    for (int i = 0; i < evidence.basis().size(); ++i)
      delta(g, i) *= (Evidence::block_of(g, evidence.basis().kind(i)) == freed ? 90 : 3) * normal(random);
  const SufficientStatistics s = sums_of(evidence, flights[0], delta);
  const auto weigh = [&](std::optional<double> nats, int iterations) {
    return evidence.weigh(s, {}, {1}, {}, Scales{}, nats, iterations);
  };
  const Weighed w = weigh({}, Evidence::kMostIterations);
  EXPECT_NEAR(std::log(w.scales.robot), std::log(3), 0.25);
  EXPECT_GT(w.scales.blocks[static_cast<std::size_t>(freed)], 4 * w.scales.robot);
  // every iteration makes the flights more probable, and none loses what was found
  double before = -1e300;
  for (const int n : {1, 2, 4, Evidence::kMostIterations}) {
    const double now = weigh({}, n).posterior.log_evidence;
    EXPECT_GE(now, before) << n;
    before = now;
  }
  const Weighed freer = weigh(10, Evidence::kMostIterations);
  EXPECT_EQ(std::count(freer.scales.free.begin(), freer.scales.free.end(), 1), 1);
  EXPECT_TRUE(freer.scales.free[static_cast<std::size_t>(freed)]);
  EXPECT_GT(freer.posterior.log_evidence, w.posterior.log_evidence);
  // where blocks of the place have lighter tails, this one's hold it already
  discrepancy.spread.place_freedom = 2 * discrepancy.spread.block_freedom;
  const Evidence lighter(flights, discrepancy, 2);
  const Weighed held = lighter.weigh(sums_of(lighter, flights[0], delta), {}, {1}, {}, Scales{}, 10);
  EXPECT_EQ(std::count(held.scales.free.begin(), held.scales.free.end(), 1), 0);
}

// A robot that has twenty times what is usual of an entry, and rows that say so to a hundredth of that: its factor t has most of
// log N(20; 0, t^2) + nu / 2 (2 log(f / t) + 1 - f^2 / t^2) at t^2 = (20^2 + nu f^2) / (1 + nu), and costs the last of these.
TEST(Evidence, FindsHowMuchARobotHasOfAnEntry) {
  const std::vector<PredictedFlight> flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  const ModelDiscrepancy discrepancy = read_model_discrepancy();
  const Evidence evidence(flights, discrepancy, 2);
  BasisCoefficients column = BasisCoefficients::Zero(kGroups, evidence.basis().size());
  constexpr int kGroup = kForceX * kCoefficients, kFunction = 0;
  SufficientStatistics of_unit =
      sums_of(evidence, flights[0], BasisCoefficients::Zero(kGroups, evidence.basis().size()));
  column(kGroup, kFunction) = 1;
  evidence.add(1, column, of_unit);
  // large beside noise and discrepancy
  column *=
      100 * std::hypot(evidence.discrepancy_sd()(kGroup, kFunction), 1 / std::sqrt(of_unit.sums[0][kGroup][kFunction]));
  constexpr double kTimes = 20;
  const SufficientStatistics s = sums_of(evidence, flights[0], kTimes * column);
  Columns usual, alone;
  constexpr double nu = 7;
  const Tail of_model{nu, true}, of_its_own{nu, false};
  usual.add(column, 0, 0, of_model);
  alone.add(column, 0);
  const Weighed w = evidence.weigh(s, usual, {1}, {}, Scales{});
  const double f = w.scales.robot;
  ASSERT_EQ(w.scales.entries.size(), 1u);
  const double t2 = (kTimes * kTimes + nu * f * f) / (1 + nu);
  EXPECT_NEAR(w.scales.entries[0] / std::sqrt(t2), 1, 0.03);
  // a column of no entry has sd 1, whatever the robot: twenty of these are improbable by 200 nats, twenty of what is usual by some
  const Weighed fixed = evidence.weigh(s, alone, {1}, {}, Scales{});
  const double by_entry =
      -0.5 * kTimes * kTimes / t2 - 0.5 * std::log(t2) + nu / 2 * (std::log(f * f / t2) + 1 - f * f / t2);
  const double gain = by_entry + 0.5 * kTimes * kTimes;
  EXPECT_NEAR((w.posterior.log_evidence - fixed.posterior.log_evidence) / gain, 1, 0.1)
      << "the robot's own factor, and its blocks, move along";
  EXPECT_NEAR(evidence.price_of(10, of_model), nu / 2 * (2 * std::log(10) - 1 + 0.01), 1e-12);
  // of what no model of a wing describes that is about 1, however far models of this robot are off
  Evidence far(flights, discrepancy, 2);
  far.set_scales({5, {}, std::vector<double>(kBlocks, 5), std::vector<char>(kBlocks, 0)});
  EXPECT_EQ(far.price_of(5, of_model), 0);
  EXPECT_EQ(far.price_of(1, of_its_own), 0);
}

// Three flights, of which the second is higher and shows 10 % more of a harmonic, as a sensor does that is warm: that is of the
// flight, and no cause that acts by the height. It is ten times what flights usually differ by, and a block may be free for 10 nats.
TEST(Evidence, WhatChangesFromFlightToFlightIsOfNoPlace) {
  const std::vector<PredictedFlight> one = flown("hummingbird_nominal", {"flight.duration_s=4"});
  flightlog::FlightLog higher = one[0].recording().log;
  for (double& z : higher.mocap.z_m) z += 3;
  const std::vector<PredictedFlight> flights = {one[0], one[0].with_log(higher), one[0]};
  const Evidence evidence(flights, read_model_discrepancy(), 2);
  const RegimeBasis& basis = evidence.basis();
  std::vector<int> of_flights;
  for (int i = 0; i < basis.size(); ++i)
    if (basis.kind(i) == BasisFunction::flight) of_flights.push_back(i);
  ASSERT_EQ(of_flights.size(), 2u) << "of the others than the first";
  EXPECT_EQ(RegimeBasis(one).size(), basis.size() - 2) << "a flight alone has none";
  const auto column = [&](std::size_t f) { return basis.values(f).col(of_flights[0]); };
  EXPECT_NEAR((column(1).array() - column(1)[0]).abs().maxCoeff(), 0, 1e-12);
  EXPECT_GT(column(1)[0], 0);
  EXPECT_LT(column(0)[0], 0);
  EXPECT_DOUBLE_EQ(column(0)[0], column(2)[0]);
  constexpr int kGroup = kForceX * kCoefficients + 1;
  Residuals residual;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    Rows rows(flights[f].beats() * kRowsPerBeat, 0);
    for (std::size_t j = 0; f == 1 && j < flights[f].beats(); ++j)
      rows[j * kRowsPerBeat + kGroup] = 0.1 * evidence.signal(kGroup);
    residual.push_back(std::move(rows));
  }
  // beside what models of a usual robot get wrong
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  BasisCoefficients delta = evidence.discrepancy_sd();
  for (double& d : delta.reshaped()) d *= normal(random);
  SufficientStatistics s = evidence.statistics(residual);
  evidence.add(1, delta, s);
  const Weighed w = evidence.weigh(s, {}, {1, 1, 1}, {}, Scales{}, 10);
  const auto free_of_place = [&] {
    int n = 0;
    for (std::size_t b = 0; b < kBlocks; ++b)
      n += w.scales.free[b] && b % kClasses == static_cast<std::size_t>(Regimes::place) ? 1 : 0;
    return n;
  };
  EXPECT_EQ(free_of_place(), 0);
}

}  // namespace
}  // namespace flappy::gap
