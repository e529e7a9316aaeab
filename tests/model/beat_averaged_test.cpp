// A robot that is known by the beat: what its file may say, what that means, and what effects do to it.
#include "model/beat_averaged.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "flappy/vehicle_file.hpp"
#include "model/effects/registry.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::model::beat_averaged_test {
namespace {

BeatAveraged some() {
  BeatAveraged b;
  b.nominal_Hz = 15;
  b.bandwidth_Hz = 3;
  b.inputs = {{"left", 0, 1}};
  b.actuators = {{"left_Hz", "left", BeatAveraged::Role::flapping, 25, 0, 0}};
  b.coefficients = {{"k", 2, 0}, {"c", -0.5, 0.1}};
  return b;
}

/// Of left_Hz = 3, v = (1, -2, 0.5), rates (0.1, 0.2, 0.3), battery 0.9.
BeatAveragedLoad load_of(BeatAveraged b, std::size_t component, const std::string& text, Triple at = {}) {
  b.wrenches = {{"wings", at, {}}};
  b.wrenches[0].terms[component] = text;
  const std::vector<double> variables = {3, 1, -2, 0.5, std::sqrt(5.25), 0.1, 0.2, 0.3, 0.9};
  return BeatAveragedWrench(b).at(variables);
}

TEST(BeatAveraged, ExpressionsAreSumsOfProducts) {
  const BeatAveraged b = some();
  EXPECT_DOUBLE_EQ(load_of(b, 2, "k * left_Hz").force_N[2], 6);
  EXPECT_DOUBLE_EQ(load_of(b, 2, "-c * v_y - 1.5").force_N[2], -1 - 1.5);
  EXPECT_DOUBLE_EQ(load_of(b, 0, "k*(left_Hz + v_y)^2*(v_x - 3)").force_N[0], 2 * 1 * -2);
  EXPECT_DOUBLE_EQ(load_of(b, 1, "- speed^2 * battery").force_N[1], -5.25 * 0.9);
  EXPECT_DOUBLE_EQ(load_of(b, 5, "w_x + 10*w_y + 100*w_z").moment_Nm[2], 32.1);
  EXPECT_DOUBLE_EQ(load_of(b, 0, "2e-1").force_N[0], 0.2);
}

TEST(BeatAveraged, ForceAtAPointHasAMoment) {
  // r x F, r = (1, 2, 3)
  const Triple at{0.1, 0.2, 0.3};
  const BeatAveragedLoad x = load_of(some(), 0, "1", at), y = load_of(some(), 1, "1", at),
                         z = load_of(some(), 2, "1", at);
  EXPECT_EQ(x.moment_Nm, (std::array<double, 3>{0, 0.3, -0.2}));
  EXPECT_EQ(y.moment_Nm, (std::array<double, 3>{-0.3, 0, 0.1}));
  EXPECT_EQ(z.moment_Nm, (std::array<double, 3>{0.2, -0.1, 0}));
}

TEST(BeatAveraged, NamesWhatIsNoExpression) {
  const auto fault = [](const std::string& text) {
    const auto found = expression_fault(text, some());
    return found ? found->what : "none";
  };
  EXPECT_EQ(fault("k * left_Hz"), "none");
  EXPECT_EQ(fault("k * right_Hz"), "nothing is called \"right_Hz\"");
  EXPECT_EQ(fault("k * (left_Hz"), "a \"(\" is not closed");
  EXPECT_EQ(fault("k left_Hz"), "\"left_Hz\" is left over");
  EXPECT_EQ(fault("k *"), "it ends too early");
  EXPECT_EQ(fault("k ^ 0.5"), "\"^\" is not followed by a power");
  EXPECT_EQ(fault("k / 2"), "\"/ 2\" is left over");
  EXPECT_NE(expression_fault("left_hz", some())->accepted.find("did you mean"), std::string::npos);
}

TEST(BeatAveraged, ShippedVehiclesReadBackAsTheyWere) {
  for (const char* name : {"flapper_nimble", "crazyflie", "crazyflie_sd"}) {
    SCOPED_TRACE(name);
    Vehicle v = read_any_vehicle(test::source_path("configs/vehicles/" + std::string(name) + ".toml"));
    v.effects["flapping_counter_force"] = {{"x_per_s", 1.5}, {"y_per_s", 0}, {"z_per_s", 0.25}};
    const std::string file = testing::TempDir() + "/" + name + ".toml";
    std::ofstream(file) << vehicle_text(v);
    Vehicle again = read_any_vehicle(file);
    EXPECT_EQ(vehicle_text(again), vehicle_text(v));
    const auto p = parameters(v), q = parameters(again);
    ASSERT_EQ(p.size(), q.size());
    for (std::size_t i = 0; i < p.size(); ++i) {
      EXPECT_EQ(p[i].path, q[i].path);
      EXPECT_EQ(*p[i].value, *q[i].value) << p[i].path;
    }
    EXPECT_EQ(again.beat_averaged->coefficients[0].sd, v.beat_averaged->coefficients[0].sd);
  }
}

class Refusal : public testing::Test {
 protected:
  /// What is said of the shipped file with a text for another, less its place.
  std::string edited(const std::string& from, const std::string& to) const {
    std::ifstream in(test::source_path("configs/vehicles/flapper_nimble.toml"));
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    const std::string file = testing::TempDir() + "/edited.toml";
    std::ofstream(file) << text;
    const std::string what = test::refusal([&] { read_any_vehicle(file); });
    if (what == "accepted") return what;
    EXPECT_EQ(what.rfind(file + ":", 0), 0U) << what;
    return what.substr(what.find(": ", file.size()) + 2);
  }
};

TEST_F(Refusal, SaysWhatAndWhere) {
  EXPECT_EQ(edited("input = \"left_flap\"", "input = \"left_flop\"").rfind("actuator.left_Hz.input: ", 0), 0U);
  EXPECT_EQ(edited("role = \"flapping\"", "role = \"flap\"").rfind("actuator.left_Hz.role: ", 0), 0U);
  EXPECT_EQ(edited("thrust_N_Hz * (left_Hz", "thrust_N_Hz * (left_hz")
                .rfind("wrench.both.moment_y_Nm: nothing is called \"left_hz\"", 0),
            0U);
  EXPECT_EQ(edited("bandwidth_Hz = 3.0", "bandwidth_Hz = 10.0").rfind("beat.bandwidth_Hz: ", 0), 0U);
  EXPECT_EQ(edited("lift_N = { value = 0.0, sd = 1.0 }", "lift_N = 0.0"), "accepted");  // known exactly
  EXPECT_EQ(edited("[wrench.both]", "[wrench.\"left wing\"]").rfind("wrench.\"left wing\": is no name of a wrench", 0),
            0U);
  EXPECT_EQ(edited("thrust_N_Hz * (left_Hz", std::string(40, '(') + "thrust_N_Hz * (left_Hz")
                .rfind("wrench.both.moment_y_Nm: its parentheses are too deep", 0),
            0U);
  EXPECT_EQ(edited("[actuator.left_Hz]", "[actuator.v_x]").rfind("actuator.v_x: something else has this name", 0), 0U);
  EXPECT_EQ(edited("[wrench.both]", "[effects.wing_damage]\n[wrench.both]")
                .rfind("effects.wing_damage: unknown effect; accepted: com_offset,", 0),
            0U);
  EXPECT_EQ(edited("\"beat_averaged\"", "\"beat\"").rfind("model: ", 0), 0U);
  EXPECT_EQ(
      edited("lift_N = { value = 0.0, sd = 1.0 }", "lift_N = { value = 0.0 }").rfind("coefficients.lift_N.sd: ", 0),
      0U);
}

TEST_F(Refusal, NothingFliesIt) {
  const std::string what =
      test::refusal([] { read_vehicle(test::source_path("configs/vehicles/flapper_nimble.toml")); });
  EXPECT_NE(what.find("model: a beat-averaged vehicle has no wings"), std::string::npos) << what;
}

// ---- forces of a simulator

const char* const kPredicted = R"(schema = 1
name = "own"
model = "predicted"
air.density_kg_m3 = 1.2
beat = { nominal_Hz = 15.0, bandwidth_Hz = 3.0 }
torso.mass_kg = 0.1
torso.com_m = { x = 0.0, y = 0.0, z = 0.0 }
torso.inertia_kg_m2 = { xx = 1e-4, yy = 1e-4, zz = 1e-4, xy = 0.0, yz = 0.0, xz = 0.0 }
extent = { below_m = 0.1, above_m = 0.1, around_m = 0.1 }
coefficients.drag_N_s_m = { value = 0.02, sd = 0.01 }
coefficients.lift_N = { value = 1.0, sd = 0.1, predicted_at = 0.9 }
)";

std::filesystem::path predicted(const std::string& more = "") {
  const std::filesystem::path file = testing::TempDir() + "/own.toml";
  std::ofstream(file) << kPredicted << more;
  return file;
}

TEST(Predicted, NeedsNoInputsAndNoExpressions) {
  const Vehicle v = read_any_vehicle(predicted());
  ASSERT_TRUE(v.beat_averaged && v.beat_averaged->predicted);
  EXPECT_TRUE(v.beat_averaged->inputs.empty() && v.beat_averaged->actuators.empty());
  EXPECT_EQ(v.beat_averaged->coefficients[0].predicted_at, 0.02);
  EXPECT_EQ(v.beat_averaged->coefficients[1].predicted_at, 0.9);
  const std::string file = testing::TempDir() + "/own_again.toml";
  std::ofstream(file) << vehicle_text(v);
  EXPECT_EQ(vehicle_text(read_any_vehicle(file)), vehicle_text(v));
  EXPECT_EQ(read_any_vehicle(file).beat_averaged->coefficients[1].predicted_at, 0.9);
}

TEST(Predicted, MaySayHowFastWingsFlap) {
  const Vehicle v =
      read_any_vehicle(predicted("input.flap = { low = 0.0, high = 1.0 }\n"
                                 "actuator.flap_Hz = { input = \"flap\", role = \"flapping\", gain = 25.0 }\n"));
  EXPECT_EQ(v.beat_averaged->inputs.size(), 1U);
  EXPECT_EQ(v.beat_averaged->actuators.size(), 1U);
}

TEST(Predicted, IsRefusedWhereForcesHaveAnotherSourceOrNothingCanFlyThem) {
  const auto refused = [](const std::function<void()>& read) {
    const std::string what = test::refusal(read);
    return what == "accepted" ? what : what.substr(what.find(": ") + 2);
  };
  const auto with = [&](const std::string& more) { return refused([&] { read_any_vehicle(predicted(more)); }); };
  EXPECT_EQ(with("").rfind("accepted", 0), 0U);
  EXPECT_EQ(with("wrench.wings.force_z_N = \"lift_N\"\n").rfind("wrench: unknown key", 0), 0U);
  EXPECT_EQ(
      with("effects.command_delay.delay_s = 0.1\n"),
      "effects.command_delay: acts between inputs and wings, which predicted forces have in them; accepted: effects "
      "that act on the vehicle itself");
  EXPECT_EQ(with("effects.thrust_axis_tilt.x_rad = 0.1\n"), "accepted");
  EXPECT_EQ(
      refused([] { read_flyable_vehicle(predicted()); }),
      "model: a vehicle whose forces stand in files of recorded flights cannot be flown; accepted: \"multibody\", "
      "\"beat_averaged\" or \"jointed\"; flappy-gap diagnose takes it");
}

// ---- effects

BeatAveragedState<double> state() {
  BeatAveragedState<double> s{};
  s.attitude = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  s.velocity_B_m_s = {1, -2, 0.5};
  s.rate_rad_s = {0, 0, 2};
  s.turning_rad_s2 = {0, 3, 0};
  s.mass_kg = 0.1, s.gravity_m_s2 = 9.81, s.air_density_kg_m3 = 1.2;
  s.position_m = {0, 0, 1};
  s.beat_share = 1.1, s.thrust_N = 1, s.stroke_plane = 0.2, s.stroke_plane_1_s = 4;
  return s;
}

Vehicle known_by_the_beat() {
  Vehicle v;
  v.beat_averaged = some();
  return v;
}

std::vector<double> load_of(const std::string& id, const std::vector<double>& q) {
  BeatAveragedLoads<double> load{};
  find_effect(known_by_the_beat(), id)->averaged.load(q.data(), state(), load);
  return {load.force_N.x, load.force_N.y, load.force_N.z, load.moment_Nm.x, load.moment_Nm.y, load.moment_Nm.z};
}

std::vector<double> seen_of(const std::string& id, const std::vector<double>& q) {
  Vec3<double> f{};
  find_effect(known_by_the_beat(), id)->averaged.seen(q.data(), state(), f);
  return {f.x, f.y, f.z};
}

void expect_near(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-12) << i;
}

TEST(BeatAveragedEffects, FollowTheirEquations) {
  expect_near(load_of("flapping_counter_force", {3, 2, 1}), {-0.1 * 1.1 * 3, 0.1 * 1.1 * 4, -0.1 * 1.1 * 0.5, 0, 0, 0});
  const double drag = 0.5 * 1.2 * 0.02 * std::sqrt(5.25);
  expect_near(load_of("body_drag", {0.02, 0}), {-drag, 2 * drag, -0.5 * drag, 0, 0, 0});
  expect_near(load_of("translational_lift", {0.3}), {0, 0, 0.3 * 0.1 * 5, 0, 0, 0});
  expect_near(load_of("stroke_plane_actuation", {10, -1}), {0.1 * (2 - 4), 0, 0, 0, 0, 0});
  expect_near(load_of("thrust_axis_tilt", {0.1, 0.2}), {0.2, -0.1, 0, 0, 0, 0});
  // d = (0.1, 0, 0): w x (w x d) = -4 d, a x d = (0, 3, 0) x d = (0, 0, -0.3)
  expect_near(seen_of("marker_offset", {0.1, 0, 0}), {-0.4, 0, -0.3});
  expect_near(seen_of("mocap_tilt", {0.01, 0.02}), {0.02 * 9.81, -0.01 * 9.81, 0});
}

// 20 g on a line of 0.5 m under 0.1962 N that is 0.1 m ahead of its hook: a fifth of it forwards.
TEST(BeatAveragedEffects, ASlungLoadPullsAtItsHook) {
  BeatAveragedState<double> s = state();
  s.weight = {0.05 + 0.1, 0, 0, 0, 9.81};
  BeatAveragedLoads<double> load{};
  const std::vector<double> q = {0.02, 0.02 * 0.05, 0, 0.5, -0.01};
  find_effect(known_by_the_beat(), "slung_load")->averaged.load(q.data(), s, load);
  const double down_N = 0.1962 * std::sqrt(1 - 0.2 * 0.2);
  EXPECT_NEAR(load.force_N.x, 0.03924, 1e-12);
  EXPECT_NEAR(load.force_N.z, -down_N, 1e-12);
  EXPECT_NEAR(load.moment_Nm.x, 0, 1e-12);
  EXPECT_NEAR(load.moment_Nm.y, -0.01 * 0.03924 + 0.05 * down_N, 1e-12);
  EXPECT_NEAR(load.moment_Nm.z, 0, 1e-12);
}

// Below a hook that stays a pendulum has the period 2 pi sqrt(l / g) / agm(1, cos(A / 2)) at the amplitude A (Carvalhaes, Suppes, Am. J. Phys. 76, 2008),
// and at the lowest point a tension of m g (3 - 2 cos A). The damping of 0.05 takes 29 % from an amplitude in a period, so that A is the mean over a half
// swing, to second order in its change; it makes a period longer by half of 0.05^2.
TEST(BeatAveragedEffects, ASlungLoadSwingsByAnyAngle) {
  constexpr double kLength_m = 0.4, kStep_s = 1e-4;
  const CatalogueEffect* effect = find_effect(known_by_the_beat(), "slung_load");
  const std::vector<double> q = {0.02, 0, 0, kLength_m, 0};
  for (const double degrees : {1.0, 25.0, 50.0}) {
    SCOPED_TRACE(degrees);
    const double begin = degrees * std::numbers::pi / 180;
    BeatAveragedState<double> s{};
    s.attitude = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    s.gravity_m_s2 = 9.81;
    s.force_m_s2 = {0, 0, 9.81};
    s.mass_kg = std::numeric_limits<double>::infinity();
    Hanging<double> w{kLength_m * std::sin(begin), 0, 0, 0, 9.81};
    double t = 0, lowest_m_s2 = 0, before_m = w.x_m;
    while (!(before_m > 0 && w.x_m <= 0)) {
      before_m = w.x_m;
      effect->averaged.swing(q.data(), s, kStep_s, w);
      lowest_m_s2 = w.tension_m_s2;
    }
    while (w.velocity_x_m_s < 0) effect->averaged.swing(q.data(), s, kStep_s, w), t += kStep_s;
    const double end = std::asin(-w.x_m / kLength_m);
    for (; w.velocity_x_m_s > 0; t += kStep_s) effect->averaged.swing(q.data(), s, kStep_s, w);
    const double last = std::asin(w.x_m / kLength_m);
    EXPECT_LT(end, begin);
    EXPECT_LT(last, end);
    // from the lowest point to the other side, and back to this one: three quarters, of which the first is damped to `end`
    const auto period_s = [](double amplitude) {
      double a = 1, g = std::cos(amplitude / 2);
      for (int i = 0; i < 6; ++i) {
        const double mean = (a + g) / 2;
        g = std::sqrt(a * g), a = mean;
      }
      return 2 * std::numbers::pi * std::sqrt(kLength_m / 9.81) / a;
    };
    const double expected_s = period_s(end) / 4 + period_s((end + last) / 2) / 2;
    EXPECT_NEAR(t, expected_s, 0.01 * expected_s);
    const double mean = (begin + end) / 2;
    EXPECT_NEAR(lowest_m_s2, 9.81 * (3 - 2 * std::cos(mean)), 0.02 * 9.81 * (3 - 2 * std::cos(mean)));
  }
}

// 50 g, 3 cm ahead of the middle of a robot of 100 g: the centre of mass is 1 cm ahead, and a reduced mass of 33.3 g at 3 cm turns with it.
TEST(BeatAveragedEffects, APayloadMovesTheCentreOfMass) {
  Vehicle v = known_by_the_beat();
  v.torso.mass_kg = 0.1;
  v.torso.inertia_kg_m2 = {1e-4, 2e-4, 3e-4, 0, 0, 0};
  const std::vector<double> q = {0.05, 0.05 * 0.03, 0, 0};
  find_effect(v, "payload")->change(q.data(), v);
  EXPECT_NEAR(v.torso.mass_kg, 0.15, 1e-15);
  EXPECT_NEAR(v.torso.com_m.x, 0.01, 1e-15);
  EXPECT_NEAR(v.torso.inertia_kg_m2.xx, 1e-4, 1e-15);
  EXPECT_NEAR(v.torso.inertia_kg_m2.yy, 2.3e-4, 1e-15);
  EXPECT_NEAR(v.torso.inertia_kg_m2.zz, 3.3e-4, 1e-15);
}

// A tenth of the left wing's thrust, its moment and its damping are lost; what the right wing and the body do stays.
TEST(BeatAveragedEffects, ALostActuatorTakesItsLoadsAlong) {
  Vehicle v = known_by_the_beat();
  BeatAveraged& b = *v.beat_averaged;
  b.actuators.push_back({"right_Hz", "left", BeatAveraged::Role::flapping, 25, 0, 0});
  b.wrenches = {{"left", {0, 0.2, 0}, {"", "", "left_Hz^2", "", "", ""}},
                {"right", {0, -0.2, 0}, {"", "", "right_Hz^2", "", "", ""}},
                {"both", {}, {"0.5", "", "", "", "", "-left_Hz * w_z - right_Hz * w_z"}}};
  const std::vector<double> q = {0.1, 0, 0, 0};
  find_effect(v, "actuator_loss")->change(q.data(), v);
  const BeatAveragedLoad load = BeatAveragedWrench(b).at(std::vector<double>{3, 3, 0, 0, 0, 0, 0, 0, 2, 1});
  EXPECT_DOUBLE_EQ(load.force_N[0], 0.5);
  EXPECT_DOUBLE_EQ(load.force_N[2], 0.9 * 9 + 9);
  EXPECT_NEAR(load.moment_Nm[0], 0.2 * (0.9 * 9 - 9), 1e-12);
  EXPECT_DOUBLE_EQ(load.moment_Nm[2], -2 * (0.9 * 3 + 3));
}

TEST(BeatAveragedEffects, AreNoneWithoutSizes) {
  for (const CatalogueEffect& e : catalogue_of(known_by_the_beat())) {
    SCOPED_TRACE(e.info.id);
    EXPECT_TRUE(e.change || e.averaged.drive || e.averaged.wind || e.averaged.load || e.averaged.seen);
    std::vector<double> q = e.values({});
    for (int k = 0; k < e.info.magnitudes; ++k) q[static_cast<std::size_t>(k)] = 0;
    EXPECT_FALSE(e.acts(q));
    if (e.averaged.load) expect_near(load_of(e.info.id, q), {0, 0, 0, 0, 0, 0});
    if (e.averaged.seen) expect_near(seen_of(e.info.id, q), {0, 0, 0});
    for (const EffectParameter& p : e.parameters) {
      EXPECT_LE(p.low, p.prior_low) << p.name;
      EXPECT_GE(p.high, p.prior_high) << p.name;
    }
  }
}

}  // namespace
}  // namespace flappy::model::beat_averaged_test
