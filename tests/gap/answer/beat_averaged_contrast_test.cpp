// What changed at a quadrotor whose firmware holds its attitude, flown by equations that are written here and nowhere else: its log has no gyro, and
// commands follow what disturbs it; on the mean they tell which motor works harder.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "full.hpp"
#include "gap/diagnose/diagnose.hpp"
#include "gap/replay/beat_averaged_prediction.hpp"
#include "io/config.hpp"
#include "rollout/fly_fixture.hpp"
#include "vehicles.hpp"

namespace flappy::gap::beat_averaged_contrast_test {
namespace {

using Eigen::Matrix4d, Eigen::Vector3d, Eigen::Vector4d;
constexpr double kGravity_m_s2 = 9.81, kStep_s = 1e-3, kDuration_s = 14, kArm_m = 0.0325, kReaction_m = 0.006;

struct Robot {
  double mass_kg = 0.037;
  Vector3d com_m = {-0.001, 0.0005, 0};
  Vector4d thrust_N = {0.150, 0.144, 0.141, 0.152};
  double breaks_s = 1e9;  ///< from then on motor 3 has three quarters of its thrust
};

/// 14 s of hover that sways, 100 Hz.
flightlog::FlightLog fly(const Robot& r, std::uint64_t seed) {
  flightlog::FlightLog log;
  flightlog::FlightHeader& h = log.header;
  h.vehicle = "crazyflie_sd.toml";
  h.gravity_m_s2 = kGravity_m_s2;
  h.inputs = {"motor_1", "motor_2", "motor_3", "motor_4"};
  h.mocap = {100, 0, 1e-3, 1e-3, flightlog::PoseSource::estimate};
  h.ambient.ground_z_m = -100;
  log.command.declared.resize(4);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 6.28);
  const double p[] = {phase(random), phase(random), phase(random)};
  const double x[] = {kArm_m, -kArm_m, -kArm_m, kArm_m}, y[] = {-kArm_m, -kArm_m, kArm_m, kArm_m};
  Matrix4d loads;  // thrust along z and moments about the centre of mass of each motor
  for (int i = 0; i < 4; ++i)
    loads.col(i) << 1, y[i] - r.com_m.y(), -(x[i] - r.com_m.x()), (i % 2 == 0 ? -1 : 1) * kReaction_m;
  const Matrix4d thrusts = loads.inverse();
  const Vector3d inertia(1.43e-5, 1.43e-5, 2.85e-5);
  Vector3d position(0, 0, 2), velocity = Vector3d::Zero(), disturbed_Nm = Vector3d::Zero();
  for (int n = 0; n < static_cast<int>(kDuration_s / kStep_s); ++n) {
    const double t = n * kStep_s, rates[] = {1.3, 0.9, 0.4}, sizes[] = {0.06, 0.08, 0.1};
    double angle[3], turning[3];
    for (int k = 0; k < 3; ++k) {
      angle[k] = sizes[k] * std::sin(rates[k] * t + p[k]);
      turning[k] = -rates[k] * rates[k] * angle[k];
    }
    const Eigen::Quaterniond q = Eigen::AngleAxisd(angle[2], Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(angle[1], Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(angle[0], Vector3d::UnitX());
    const double thrust = r.mass_kg * (kGravity_m_s2 + 2 * (2 - position.z()) - 2 * velocity.z());
    for (int k = 0; k < 3; ++k)
      disturbed_Nm[k] += kStep_s * -3 * disturbed_Nm[k] + std::sqrt(kStep_s) * 4e-4 * normal(random);
    const Vector3d drag = q.inverse() * (-0.5 * r.mass_kg * velocity), by_drag = -r.com_m.cross(drag);
    Vector4d wanted;
    wanted << thrust, inertia[0] * turning[0] - disturbed_Nm[0] - by_drag[0],
        inertia[1] * turning[1] - disturbed_Nm[1] - by_drag[1],
        inertia[2] * turning[2] - 0.5 * disturbed_Nm[2] - by_drag[2];
    Vector4d able_N = r.thrust_N;
    if (t > r.breaks_s) able_N[2] *= 0.75;
    const Vector4d command = (thrusts * wanted).cwiseQuotient(able_N);
    if (n % 10 == 0) {
      flightlog::MocapStream& m = log.mocap;
      m.t_s.push_back(t), log.command.t_s.push_back(t);
      m.x_m.push_back(position.x() + 1e-3 * normal(random));
      m.y_m.push_back(position.y() + 1e-3 * normal(random));
      m.z_m.push_back(position.z() + 1e-3 * normal(random));
      m.qw.push_back(q.w()), m.qx.push_back(q.x()), m.qy.push_back(q.y()), m.qz.push_back(q.z());
      for (int k = 0; k < 4; ++k) log.command.declared[static_cast<std::size_t>(k)].push_back(command[k]);
    }
    velocity += kStep_s * (q * Vector3d(0, 0, thrust / r.mass_kg) - Vector3d(0, 0, kGravity_m_s2) - 0.5 * velocity);
    position += kStep_s * velocity;
  }
  return log;
}

/// References, then tests. `session`: of all references; empty: each its own.
Inference contrast(const std::vector<Robot>& before, const std::vector<Robot>& after, const std::string& session,
                   std::vector<std::string> withheld = {}) {
  model::Vehicle vehicle = model::read_any_vehicle(test::source_path("configs/vehicles/crazyflie_sd.toml"));
  for (model::BeatAveraged::Input& i : vehicle.beat_averaged->inputs) i.high = 1.5;  // room for a heavy robot
  Flights flights;
  std::uint64_t seed = 1;
  for (const std::vector<Robot>* robots : {&before, &after})
    for (const Robot& r : *robots) {
      flightlog::FlightLog log = fly(r, seed);
      if (robots == &before) log.header.session = session;
      (robots == &before ? flights.references : flights.tests)
          .push_back(
              std::make_shared<BeatAveragedPrediction>("flight_" + std::to_string(seed++), std::move(log), vehicle));
    }
  const std::string configs = test::source_path("configs/gap/");
  const sim::Randomisation uncertain =
      sim::read_randomisation(vehicle, io::Config::load(configs + "beat_averaged/priors.toml").root());
  InferenceOptions options{.max_finalists = 20,
                           .max_effects = 4,
                           .withheld = std::move(withheld),
                           .progress = {},
                           .discrepancy = read_model_discrepancy(configs + "beat_averaged/contrast_discrepancy.toml"),
                           .rule = read_verdict_rule(configs + "contrast_verdict.toml")};
  options.sessions = read_session_prior(configs + "beat_averaged/session_scatter.toml");
  const ReferenceFit fit(flights.references, uncertain, options);
  return infer(flights, uncertain, std::move(options), &fit);
}

Inference contrast(const Robot& before, const Robot& after, std::vector<std::string> withheld = {}) {
  return contrast({before, before}, {after, after}, "", std::move(withheld));
}

SeenQuantity seen(const Inference& d, const std::string& name) {
  return *std::ranges::find(d.seen, name, &SeenQuantity::name);
}

double magnitude(const Inference& d, int k) {
  const model::Vehicle vehicle = model::read_any_vehicle(test::source_path("configs/vehicles/crazyflie_sd.toml"));
  const sim::Randomisation uncertain = sim::read_randomisation(
      vehicle, io::Config::load(test::source_path("configs/gap/beat_averaged/priors.toml")).root());
  const Hypothesis h(uncertain, d.conclusion().effects);
  const auto i = h.shared() + k;
  return h.unknowns()[static_cast<std::size_t>(i)].value(d.conclusion().fit.mean()[i]);
}

TEST(BeatAveragedContrast, AMotorThatLosesThrustIsNamed) {
  Robot after;
  after.thrust_N[2] *= 0.8;
  const Inference d = contrast({}, after);
  ASSERT_EQ(d.verdict.kind, VerdictKind::effect);
  EXPECT_EQ(d.verdict.effects, (std::vector<std::string>{"actuator_loss"}));
  // sessions differ by 2 to 3 % of a motor's moment in roll, pitch and yaw
  EXPECT_NEAR(magnitude(d, 2), 0.2, 0.06);
  for (const int other : {0, 1, 3}) EXPECT_LT(magnitude(d, other), 0.06) << other;
  // what is seen says the same without a cause; noise of a mean moment over two flights is a per cent of a motor
  EXPECT_NEAR(seen(d, "thrust of rotor_3").tests, -0.2, 0.03);
  EXPECT_LT(seen(d, "thrust of rotor_3").times(), -5);
  for (const char* other : {"thrust of rotor_1", "thrust of rotor_2", "thrust of rotor_4"})
    EXPECT_NEAR(seen(d, other).tests, 0, 0.03) << other;
  EXPECT_TRUE(d.odd.empty());
}

// A propeller that breaks in flight: which flight, and when.
TEST(BeatAveragedContrast, TellsWhenAMotorBreaks) {
  Robot after;
  after.breaks_s = 8;
  const Inference d = contrast({}, after);
  const auto step = std::ranges::find_if(d.odd, [](const OddFlight& o) { return o.since_s.has_value(); });
  ASSERT_NE(step, d.odd.end());
  EXPECT_NEAR(*step->since_s, 8, 1);
}

// Flights of one session differ by 4 % of a motor, far more than sessions of other robots do: none is odd, but one that
// differs by 40 %.
TEST(BeatAveragedContrast, AFlightIsOddAmongThoseOfItsSet) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  std::vector<Robot> before(6);
  for (std::size_t i = 0; i < before.size(); ++i) before[i].thrust_N[0] *= i % 2 == 0 ? 0.96 : 1.04;
  EXPECT_TRUE(contrast(before, {{}}, "one").odd.empty());
  before[4].thrust_N[0] *= 0.6;
  const Inference d = contrast(before, {{}}, "one");
  ASSERT_EQ(d.odd.size(), 1U);
  EXPECT_EQ(d.odd.front().flight, "flight_5");
}

// The trims of two sessions differ by half a per cent of a motor, and 0.2 mm: nothing that matters.
TEST(BeatAveragedContrast, WhatSessionsDifferByIsNoFinding) {
  Robot after;
  after.thrust_N[0] *= 1.005, after.thrust_N[3] *= 0.995;
  after.com_m.x() += 2e-4;
  const Inference d = contrast({}, after);
  EXPECT_EQ(d.verdict.kind, VerdictKind::parameters);
  EXPECT_TRUE(d.odd.empty());
}

// Trims tell a weight from weaker motors only by the yaw and the small moments of drag, and sessions of a Crazyflie differ by some per cent in all of
// them: the answer may be "unknown", but not "unchanged", and no effect but a weight or weaker motors comes first or second.
TEST(BeatAveragedContrast, AWeightAtAMotorIsAChange) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Robot after;
  constexpr double kWeight_kg = 0.008;
  after.mass_kg += kWeight_kg;
  after.com_m += kWeight_kg / after.mass_kg * (Vector3d(-0.03, 0.03, 0) - after.com_m);
  double unchanged = 0;
  std::vector<std::vector<std::string>> effects;
  for (const ScoredHypothesis& a : contrast({}, after).hypotheses) {
    if (a.kind == HypothesisKind::none || a.kind == HypothesisKind::parameters) unchanged += a.probability;
    if (a.kind == HypothesisKind::effect) effects.push_back(a.effects);
  }
  EXPECT_LT(unchanged, 0.1);
  ASSERT_GE(effects.size(), 2U);
  for (std::size_t rank = 0; rank < 2; ++rank)
    for (const std::string& effect : effects[rank])
      EXPECT_TRUE(effect == "payload" || effect == "slung_load" || effect == "actuator_loss") << effect;
}

// A flight that is too short, or whose data have a fault, is left out and named; flights of one session count once.
TEST(BeatAveragedContrast, LeavesOutDoubtfulFlights) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const flight::Folder folder;
  DiagnosisSettings settings;
  settings.vehicle = test::source_path("configs/vehicles/crazyflie_sd.toml");
  const auto write = [&](const std::string& name, flightlog::FlightLog log) {
    for (flightlog::Column& c : log.command.declared)
      for (double& v : c) v = std::min(v, 1.0);
    log.header.ambient.ground_z_m = 0;
    flightlog::write_flight_log(folder / name, log);
    return (folder / name).string();
  };
  flightlog::FlightLog brief = fly({}, 5), frozen = fly({}, 6);
  const auto cut = [](flightlog::Column& c) { c.resize(250); };
  flightlog::MocapStream& m = brief.mocap;
  for (flightlog::Column* c : {&m.t_s, &m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz}) cut(*c);
  cut(brief.command.t_s);
  for (flightlog::Column& c : brief.command.declared) cut(c);
  for (double& t : frozen.mocap.t_s) t *= 3;
  settings.reference = {write("a", fly({}, 1)), write("b", fly({}, 2)), write("brief", brief)};
  settings.flights = {write("c", fly({}, 3)), write("frozen", frozen)};
  const Diagnosis d = diagnose(read_request(settings), nullptr).result;
  ASSERT_EQ(d.verdict.kind, VerdictKind::parameters);
  const auto warned = [&](const std::string& of) {
    return std::ranges::count_if(d.warnings, [&](const std::string& w) {
      return w.starts_with("left out: ") && w.find(of) != std::string::npos;
    });
  };
  EXPECT_EQ(warned("/brief"), 1);
  EXPECT_EQ(warned("/frozen"), 1);
  EXPECT_EQ(warned(""), 2);
  EXPECT_EQ(d.reference.size(), 2U);
  EXPECT_EQ(d.flights.size(), 1U);
  // by a folder of a session
  settings.flights = {write("c2", fly({}, 7))};
  std::filesystem::create_directory(folder / "monday");
  for (const char* name : {"a", "b"}) std::filesystem::rename(folder / name, folder / "monday" / name);
  settings.reference = {(folder / "monday").string()};
  const DiagnosisRequest request = read_request(settings);
  EXPECT_EQ(request.settings.reference.size(), 2U);
  EXPECT_EQ(request.sessions.at((folder / "monday" / "a").string()), (folder / "monday").string());
  EXPECT_EQ(diagnose(request, nullptr).result.verdict.kind, VerdictKind::parameters);
  // what most flights have is no accident of one
  settings.flights = {(folder / "c2").string(), (folder / "frozen").string(), write("frozen2", frozen)};
  EXPECT_EQ(diagnose(read_request(settings), nullptr).result.verdict.kind, VerdictKind::data);
}

}  // namespace
}  // namespace flappy::gap::beat_averaged_contrast_test
