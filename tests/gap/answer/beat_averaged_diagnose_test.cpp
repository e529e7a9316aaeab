// A robot that is known by the beat, flown by equations that are written here and nowhere else: what its file lacks is named, with its size;
// what no entry has is unknown; and nothing is named where nothing is missing.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "full.hpp"
#include "gap/answer/verdict.hpp"
#include "gap/diagnose/diagnose.hpp"
#include "gap/question/validation.hpp"
#include "gap/replay/beat_averaged_prediction.hpp"
#include "io/config.hpp"
#include "io/csv.hpp"
#include "refusal.hpp"
#include "rollout/simulated_flight.hpp"
#include "vehicles.hpp"

namespace flappy::gap {
namespace {

using Eigen::Vector3d;
constexpr double kMass_kg = 0.103, kGravity_m_s2 = 9.81, kStep_s = 1e-3;

/// Per mass: m/s^2 for what the file has, and what it may lack.
struct Robot {
  double drag_x = 0, drag_y = 0, heave = 0, dihedral = 0, squared_rate = 0;
};

/// 40 s of a wandering flight, 100 Hz.
flightlog::FlightLog fly(const Robot& r, std::uint64_t seed) {
  flightlog::FlightLog log;
  log.header.vehicle = "flapper_nimble.toml";
  log.header.flapping_Hz = 14.7;
  log.header.gravity_m_s2 = kGravity_m_s2;
  log.header.inputs = {"left_flap", "right_flap", "pitch_servo", "yaw_servo"};
  log.header.mocap = {100, 0, 2e-4, 2e-3};
  log.header.ambient.ground_z_m = -100;
  log.command.declared.resize(4);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 6.28);
  const double p[] = {phase(random), phase(random), phase(random), phase(random), phase(random), phase(random)};
  Vector3d position(0, 0, 2), velocity = Vector3d::Zero();
  for (int i = 0; i < 40000; ++i) {
    const double t = i * kStep_s;
    // its attitude sways so that it stays about where it is
    const double roll = 0.25 * std::sin(1.1 * t + p[0]) + 0.1 * std::sin(2.7 * t + p[1]);
    const double pitch = 0.3 * std::sin(0.9 * t + p[2]) + 0.1 * std::sin(3.1 * t + p[3]);
    const double yaw = 0.5 * std::sin(0.3 * t + p[4]);
    const Eigen::Quaterniond q = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(roll, Vector3d::UnitX());
    const double servo = 0.5 + 0.05 * std::sin(1.7 * t + p[5]) + 0.03 * std::sin(4.1 * t);
    const double wanted = 9.81 + 3 * (2 + 0.5 * std::sin(0.5 * t) - position.z()) - 3 * velocity.z();
    // thrust of the file: 0.0344 N/Hz x 25 Hz x (left + right), over the mass
    const double u = wanted * kMass_kg / (0.0344 * 50), thrust = u * 0.0344 * 50 / kMass_kg;
    const Vector3d v = q.inverse() * velocity;
    const double beat = 25 * u / 14.7;
    const double pitch_rate = 0.27 * std::cos(0.9 * t + p[2]) + 0.31 * std::cos(3.1 * t + p[3]);
    const Vector3d force(-r.drag_x * beat * v.x() + r.dihedral * (servo - 0.5),
                         -r.drag_y * beat * v.y() + r.squared_rate * pitch_rate * pitch_rate,
                         thrust - r.heave * beat * v.z());
    if (i % 10 == 0) {
      flightlog::MocapStream& m = log.mocap;
      m.t_s.push_back(t), log.command.t_s.push_back(t);
      m.x_m.push_back(position.x() + 2e-4 * normal(random));
      m.y_m.push_back(position.y() + 2e-4 * normal(random));
      m.z_m.push_back(position.z() + 2e-4 * normal(random));
      m.qw.push_back(q.w()), m.qx.push_back(q.x()), m.qy.push_back(q.y()), m.qz.push_back(q.z());
      const double columns[] = {u, u, servo, 0.5};
      for (std::size_t k = 0; k < 4; ++k) log.command.declared[k].push_back(columns[k]);
    }
    velocity += kStep_s * (q * force - Vector3d(0, 0, kGravity_m_s2));
    position += kStep_s * velocity;
  }
  return log;
}

model::Vehicle nimble() { return model::read_any_vehicle(test::source_path("configs/vehicles/flapper_nimble.toml")); }

/// The same by its simulator: forces of a thrust that is believed a tenth too small.
model::Vehicle by_simulator() {
  model::Vehicle v = nimble();
  model::BeatAveraged& b = *v.beat_averaged;
  b.predicted = true;
  b.wrenches.clear();
  std::erase_if(b.coefficients, [](const model::BeatAveraged::Coefficient& c) { return !c.name.ends_with("_N"); });
  b.coefficients.push_back({"thrust_N_Hz", 0.0344, 0.02, 0.031});
  return v;
}

void simulate(const flightlog::FlightLog& log, const std::filesystem::path& folder) {
  std::vector<std::vector<double>> columns(6);
  for (std::size_t i = 0; i < log.command.t_s.size(); ++i) {
    const double both_Hz = 25 * (log.command.declared[0][i] + log.command.declared[1][i]);
    const double row[] = {log.command.t_s[i], 0.031 * both_Hz, both_Hz, 1, 1, 1};
    for (std::size_t k = 0; k < columns.size(); ++k) columns[k].push_back(row[k]);
  }
  std::filesystem::create_directories(folder);
  io::write_atomically(folder / "predicted.csv",
                       io::csv_text({"t_s", "force_z_N", "d_thrust_N_Hz_force_z_N", "d_lift_N_force_z_N",
                                     "d_forward_N_force_x_N", "d_left_N_force_y_N"},
                                    columns));
}

Inference diagnose_robot(const Robot& r, std::vector<std::string> withheld = {},
                         const model::Vehicle& vehicle = nimble()) {
  Flights flights;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const std::filesystem::path folder = testing::TempDir() + "/flight_" + std::to_string(seed);
    const flightlog::FlightLog log = fly(r, seed);
    if (vehicle.beat_averaged->predicted) simulate(log, folder);
    flights.tests.push_back(std::make_shared<BeatAveragedPrediction>(folder, log, vehicle));
  }
  const std::string configs = test::source_path("configs/gap/beat_averaged/");
  return infer(flights, sim::read_randomisation(vehicle, io::Config::load(configs + "priors.toml").root()),
               {.max_finalists = 20,
                .max_effects = 4,
                .withheld = std::move(withheld),
                .progress = {},
                .discrepancy = read_model_discrepancy(configs + "model_discrepancy.toml"),
                .rule = read_verdict_rule(configs + "verdict.toml")});
}

/// Whether the 90 % interval of a magnitude holds the truth.
bool holds(const Inference& d, const std::string& name, double truth) {
  const ScoredHypothesis& a = d.conclusion();
  const sim::Randomisation exact(nimble());
  const Hypothesis h(exact, a.effects);
  const Eigen::VectorXd mean = a.fit.mean();
  const Eigen::MatrixXd covariance = a.fit.covariance();
  // its parameters stand before its effects, in order
  for (Eigen::Index k = 0; k < h.size() - h.shared(); ++k) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(h.shared() + k)];
    if (u.name != name) continue;
    const Eigen::Index i = mean.size() - (h.size() - h.shared()) + k;
    const double sd = u.scale * std::sqrt(covariance(i, i));
    EXPECT_NEAR(u.value(mean[i]), truth, 1.645 * sd + 1e-12) << name;
    return std::abs(u.value(mean[i]) - truth) < 1.645 * sd;
  }
  return false;
}

const Robot kLacking{.drag_x = 3, .drag_y = 2, .heave = 1, .dihedral = 20};
const Inference& lacking() {
  static const Inference d = diagnose_robot(kLacking);
  return d;
}

TEST(BeatAveragedDiagnosis, NamesWhatTheFileLacksWithItsSize) {
  const Inference& d = lacking();
  ASSERT_EQ(d.verdict.kind, VerdictKind::effect);
  std::vector<std::string> named = d.verdict.effects;
  std::ranges::sort(named);
  EXPECT_EQ(named, (std::vector<std::string>{"flapping_counter_force", "stroke_plane_actuation"}));
  EXPECT_GT(d.verdict.probability, 0.9);
  EXPECT_TRUE(holds(d, "x_per_s", 3));
  EXPECT_TRUE(holds(d, "y_per_s", 2));
  EXPECT_TRUE(holds(d, "z_per_s", 1));
  EXPECT_TRUE(holds(d, "shift_m_s2", 20));
  // no battery was logged, no moment is modelled, and wings are not: these are not said to be absent
  for (const char* id : {"battery_thrust", "inertia_products", "wing_damage", "gyro_bias"})
    EXPECT_TRUE(std::ranges::count(d.untestable, id)) << id;
  for (const ScoredHypothesis& a : d.hypotheses)
    for (const std::string& e : a.effects) EXPECT_FALSE(std::ranges::count(d.untestable, e)) << e;
  // each rung of the ladder takes something away, and copies at other times take nothing
  ASSERT_TRUE(d.validation);
  ASSERT_EQ(d.validation->ladder.size(), 4U);
  EXPECT_LT(d.validation->ladder[3].errors[0].rms, 0.2 * d.validation->ladder[1].errors[0].rms);
  for (const Validation::Control& c : d.validation->controls) {
    EXPECT_GT(c.gain, 0.3) << c.effect;
    EXPECT_LT(c.best_of_shifted, c.gain / 2) << c.effect;  // its motion repeats
  }
  for (const Validation::Agreement& a : d.validation->agreements) EXPECT_GT(a.p_value, 1e-3) << a.name;
}

/// What an effect may explain, and what it changes, [flight][row]: all of `y` but noise of a tenth is `x`, which has no memory.
std::array<std::vector<std::vector<double>>, 2> explained_by_an_effect(std::size_t flights, std::size_t rows) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::array<std::vector<std::vector<double>>, 2> yx;
  for (auto& all : yx) all.assign(flights, std::vector<double>(rows));
  for (std::size_t f = 0; f < flights; ++f)
    for (std::size_t j = 0; j < rows; ++j) {
      yx[1][f][j] = normal(random);
      yx[0][f][j] = yx[1][f][j] + 0.1 * normal(random);
    }
  return yx;
}

// An effect that explains nine tenths of the rms. Of n rows, a copy's correlation with y has a standard deviation of 1 / sqrt(n), and it
// removes half the square of the correlation: 0.1 of the rms at 0.44, four standard deviations of 80 rows.
TEST(BeatAveragedDiagnosis, ShiftsCopiesInShortFlightsToo) {
  struct Case {
    std::size_t flights, rows;
  };
  for (const Case& c : {Case{2, 60}, Case{2, 99}, Case{3, 130}, Case{40, 3}, Case{1, 80}}) {
    const auto [y, x] = explained_by_an_effect(c.flights, c.rows);
    EXPECT_LT(best_of_shifted(y, x), 0.1) << c.flights << " flights of " << c.rows << " rows";
  }
}

TEST(BeatAveragedDiagnosis, SaysTheSameOfForcesThatItsSimulatorPredicted) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Inference &by_equations = lacking(), d = diagnose_robot(kLacking, {}, by_simulator());
  EXPECT_EQ(d.verdict.kind, by_equations.verdict.kind);
  EXPECT_EQ(d.verdict.effects, by_equations.verdict.effects);
  EXPECT_NEAR(d.verdict.probability, by_equations.verdict.probability, 1e-3);
  const auto magnitudes = [](const Inference& of) {
    const Eigen::VectorXd mean = of.conclusion().fit.mean();
    return Eigen::VectorXd(mean.tail(5));  // of both effects
  };
  EXPECT_LT((magnitudes(d) - magnitudes(by_equations)).cwiseAbs().maxCoeff(), 1e-3);
  for (std::size_t f = 0; f < d.nominal.size(); ++f)
    for (std::size_t i = 0; i < d.nominal[f].size(); i += kRowsPerBeat)
      for (std::size_t k = i + kSpecificForceX * kCoefficients; k <= i + kSpecificForceZ * kCoefficients;
           k += kCoefficients)
        ASSERT_NEAR(d.nominal[f][k], by_equations.nominal[f][k], 1e-9) << f << " " << k;
  // what is between inputs and wings is in the forces already
  for (const char* id : {"command_delay", "driver_bandwidth", "battery_thrust"})
    EXPECT_TRUE(std::ranges::count(d.untestable, id)) << id;
}

TEST(BeatAveragedDiagnosis, NamesNothingWhereNothingIsMissing) {
  const Inference d = diagnose_robot({});
  EXPECT_TRUE(d.verdict.kind == VerdictKind::none || d.verdict.kind == VerdictKind::parameters)
      << name_of(d.verdict.kind);
}

TEST(BeatAveragedDiagnosis, KnowsThatItDoesNotKnow) {
  // a side force by the square of the pitch rate, which no entry has; and one whose entries are withheld
  EXPECT_EQ(diagnose_robot({.drag_x = 0, .squared_rate = 5}).verdict.kind, VerdictKind::unknown);
  EXPECT_EQ(
      diagnose_robot({.drag_x = 3, .drag_y = 2, .heave = 1}, {"flapping_counter_force", "body_drag"}).verdict.kind,
      VerdictKind::unknown);
}

/// What is left of the rms of each channel where a candidate predicts a flight.
std::array<double, 6> left(const BeatAveragedPrediction& flight, const model::Vehicle& vehicle) {
  const VehicleHypothesis candidate{vehicle};
  const Rows rows = flight.predict(std::vector<const VehicleHypothesis*>{&candidate})[0];
  std::array<double, 6> rms{};
  for (int channel = 0; channel < 6; ++channel) {
    double n = 0;
    for (std::size_t j = 0; j < flight.beats(); ++j) {
      if (!flight.covers(j, channel)) continue;
      const std::size_t row = j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients;
      n += 1;
      rms[static_cast<std::size_t>(channel)] += std::pow(flight.measured()[row] - rows[row], 2);
    }
    rms[static_cast<std::size_t>(channel)] = std::sqrt(rms[static_cast<std::size_t>(channel)] / n);
  }
  return rms;
}

// What flies a robot and what predicts its logs are two readings of one file: a flight of the simulator, its sensors nearly ideal, is predicted
// but for what a filter of 3 Hz makes of products of what is faster.
TEST(BeatAveragedDiagnosis, PredictsWhatTheSimulatorFlies) {
  rollout::FlyConfig config = rollout::read_fly_config(
      test::source_path("configs/fly/flapper_nimble.toml"),
      {"flight.duration_s=30", "task.end.time_s=30", "vehicle.beat.compares_moments=true", "vehicle.extent.below_m=0",
       "world.ground_z_m=-50", "sensors.mocap.position_noise_m=1e-6", "sensors.mocap.attitude_noise_rad=1e-6",
       "sensors.mocap.latency_s=0", "sensors.imu.gyro_noise_rad_s=1e-6", "vehicle.torso.com_m.z=-0.02",
       "vehicle.effects.flapping_counter_force.x_per_s=3", "vehicle.effects.flapping_counter_force.y_per_s=2",
       "vehicle.effects.stroke_plane_actuation.shift_m_s2=10", "vehicle.effects.driver_bandwidth.lag_s=0.03"});
  std::string waves;
  for (const char* wave :
       {"difference_V\"\nrms = 0.02", "amplitude_V\"\nrms = 0.04", "bias_V\"\nrms = 0.04", "split_cycle\"\nrms = 0.1"})
    waves += std::string(
                 "[[excitation]]\nkind = \"multisine\"\nfrom_hz = 0.2\nto_hz = 2.0\ncount = 10\nperiod_s = 30.0\ninput "
                 "= \"") +
             wave + "\n";
  config.excitation = flight::read_excitation(io::Config::parse(waves, "waves").root(), 30);
  const auto log = rollout::simulate(config, config.vehicle, 1)[0].log;
  ASSERT_TRUE(log);
  const BeatAveragedPrediction flight("flight", *log, config.vehicle);
  const auto with = left(flight, config.vehicle);
  const auto without = [&](const std::string& effect) {
    model::Vehicle v = config.vehicle;
    v.effects.erase(effect);
    return left(flight, v);
  };
  for (int c = 0; c < 6; ++c) EXPECT_LT(with[static_cast<std::size_t>(c)], c < 3 ? 0.45 : 0.06) << channel_name(c);
  EXPECT_GT(without("flapping_counter_force")[kSpecificForceX], 5 * with[kSpecificForceX]);
  EXPECT_GT(without("flapping_counter_force")[kSpecificForceY], 4 * with[kSpecificForceY]);
  EXPECT_GT(without("stroke_plane_actuation")[kSpecificForceX], 5 * with[kSpecificForceX]);
  for (const int c : {kAngularAccelerationX, kAngularAccelerationY, kAngularAccelerationZ})
    EXPECT_GT(without("driver_bandwidth")[static_cast<std::size_t>(c)], 4 * with[static_cast<std::size_t>(c)]);
}

TEST(BeatAveragedDiagnosis, RefusesLogsOfAnotherRobot) {
  flightlog::FlightLog log = fly({}, 1);
  log.header.inputs[0] = "motor_1";
  EXPECT_EQ(test::refusal([&] { BeatAveragedPrediction("flight", log, nimble()); }),
            "flight/flight.toml: command.inputs: has no \"left_flap\", which the vehicle's file reads; accepted: a log "
            "of this "
            "vehicle, or a vehicle whose inputs are motor_1, right_flap, pitch_servo, yaw_servo");
  log = fly({}, 1);
  log.command.declared[2][6] = 65535;
  EXPECT_EQ(test::refusal([&] { BeatAveragedPrediction("flight", log, nimble()); }),
            "flight/command.csv:8: pitch_servo: 65535 is outside what the vehicle takes; accepted: 0 to 1");
}

}  // namespace
}  // namespace flappy::gap
