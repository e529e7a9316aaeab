// Each effect by itself, against numbers worked out by hand: its sign and its size.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flappy/batch.hpp"
#include "model/derive.hpp"
#include "sim/physics_step.hpp"
#include "sim/rows.hpp"
#include "vehicles.hpp"

namespace flappy::model {
namespace {

using One = Lanes<double, 1>;
constexpr double kStep = 1e-4;

double value(const One& x) { return x.raw[0]; }

/// The same numbers, each in a lane of its own.
template <template <class> class S>
S<One> in_lane(const S<double>& from) {
  S<One> to;
  for (std::size_t k = 0; k < sizeof from / sizeof(double); ++k)
    reinterpret_cast<One*>(&to)[k] = One(reinterpret_cast<const double*>(&from)[k]);
  return to;
}

/// A flapper, what effects see of it, and memory for them.
struct Bench {
  explicit Bench(Vehicle v = test::nominal())
      : vehicle(std::move(v)),
        p(in_lane(derive(vehicle, kStep))),
        figures{in_lane(effect_constants(vehicle).left), in_lane(effect_constants(vehicle).right)} {
    x.attitude.w = One(1);
  }

  Surroundings<One> see() {
    pose = {place_wing<+1>(p.left, x.left, x.body_rate_rad_s), place_wing<-1>(p.right, x.right, x.body_rate_rad_s)};
    return {p,
            x,
            pose,
            figures,
            rotation_matrix(x.attitude),
            x.position_m,
            velocity_B,
            com,
            One(0.019),
            One(kStep),
            One(1 / kStep),
            One(9.81),
            One(0),
            One(3),
            wall[0],
            wall[1],
            wall[2],
            wind_B,
            {shoulder, shoulder},
            lift};
  }
  StateRows<One> state() { return {memory, 1, One(0) < One(1)}; }
  Sides<Hinges<One>> hinges(double left_V, double right_V) {
    return {sim::hinges_of(p.left, figures.left, x.left, One(left_V)),
            sim::hinges_of(p.right, figures.right, x.right, One(right_V))};
  }
  /// Hinges as `Effect` leaves them.
  template <class Effect, int n>
  Sides<Hinges<One>> hinges(const One (&q)[n], double left_V, double right_V) {
    auto h = hinges(left_V, right_V);
    if constexpr (requires { Effect::motor(q, see(), state(), h); }) Effect::motor(q, see(), state(), h);
    Effect::hinges(q, see(), state(), h);
    return h;
  }
  template <class Effect, int side = 1, int n>
  WingWrench<One> air(const One (&q)[n], const WingWrench<One>& before) {
    WingWrench<One> after = before;
    Effect::template air<side>(q, see(), state(), after);
    return after;
  }
  template <class Effect, int n>
  BodyLoad<One> world(const One (&q)[n]) {
    BodyLoad<One> load{};
    Effect::world(q, see(), state(), load);
    return load;
  }

  Vehicle vehicle;
  Parameters<One> p;
  State<One> x{};
  Sides<SideConstants<One>> figures;
  Sides<WingPose<One>> pose;
  Vec3<One> velocity_B{}, com{}, wind_B{}, shoulder{};
  One wall[3] = {One(1e6), One(1), One(0)}, lift{};
  double memory[CommandDelay::kStates] = {};
};

const WingWrench<One> kUnit{One(1), One(1), One(1), {One(1), One(1), One(1)}};

double normal(const WingWrench<One>& w) { return value(w.normal_force_N); }
/// Of kUnit, with nothing but its lift changed.
double lift(const WingWrench<One>& w) {
  EXPECT_EQ(value(w.normal_force_N), 1);
  EXPECT_EQ(value(w.force_x_N), 1);
  EXPECT_EQ(value(w.moment_Nm.x), value(w.force_z_N));
  EXPECT_EQ(value(w.moment_Nm.y), 1);
  EXPECT_EQ(value(w.moment_Nm.z), 1);
  return value(w.force_z_N);
}

// ---- the vehicle

Vehicle with(const std::string& id, std::map<std::string, double> given) {
  Vehicle v = test::nominal();
  v.effects[id] = std::move(given);
  return v;
}

/// What the effect changes of a derived figure.
double change(const Vehicle& v, auto figure) {
  return figure(derive(v, kStep)) - figure(derive(test::nominal(), kStep));
}

TEST(ComOffset, MovesTheTorsosMass) {
  const Vehicle v = with("com_offset", {{"x_m", 0}, {"y_m", 1e-3}, {"z_m", 0}});
  const double m = v.torso.mass_kg, y = v.torso.com_m.y;
  EXPECT_NEAR(change(v, [](const auto& p) { return p.fixed_moment_kg_m.y; }), m * 1e-3, 1e-18);
  // about the origin, so that it stays the same about the torso's own centre: m ((y + 1 mm)^2 - y^2)
  EXPECT_NEAR(change(v, [](const auto& p) { return p.fixed_second_kg_m2.yy; }), m * (2e-3 * y + 1e-6), 1e-20);
}

TEST(ComOffset, OfOneMillimetreToTheLeftRollsLeft) {
  // a standing vehicle's wings weigh nothing here: the load at the origin that carries the weight M g has the lever
  // m/M 1 mm to the centre of mass, so roll accelerates by -m g 1 mm / I_xx, I_xx of all parts about the centre of mass
  Vehicle v = with("com_offset", {{"x_m", 0}, {"y_m", 1e-3}, {"z_m", 0}});
  v.effects["tether"] = {{"line_kg_m", -total_mass_kg(v)}, {"stiffness_N_m", 0}};  // lifts at 1 m of height
  v.air_density_kg_m3 = 0;
  for (Side* s : {&v.left, &v.right}) {  // wings that their springs hold
    s->spring = {1, 1, 0};
    s->rotation.lower_rad = -1e-6;
    s->rotation.upper_rad = 1e-6;
  }
  sim::BatchOptions o;
  o.world.ground_z_m = -1;
  o.step_s = kStep;
  sim::Batch<double> b(1, v, o);
  b.step(100);
  const auto whole = [&](const RigidBody& body, const Triple& at) {
    const double y = body.com_m.y + at.y, z = body.com_m.z + at.z;
    return body.inertia_kg_m2.xx + body.mass_kg * (y * y + z * z);
  };
  double inertia = whole(v.torso, {0, 1e-3, 0}), moment_z = v.torso.mass_kg * v.torso.com_m.z;
  for (const Side* s : {&v.left, &v.right})
    for (const RigidBody* body : {&s->leading_edge, &s->wing}) {
      inertia += whole(*body, s->shoulder_m);
      moment_z += body->mass_kg * (body->com_m.z + s->shoulder_m.z);
    }
  inertia -= moment_z * moment_z / total_mass_kg(v);
  const double expected = -v.torso.mass_kg * 9.81 * 1e-3 / inertia * 0.01;
  EXPECT_NEAR(expected / 0.01, -19, 0.5);  // the wings' share of inertia included
  // springs of 1 Nm/rad still give way by the vibration that the sudden load starts; other axes turn by the products
  EXPECT_NEAR(b.state(0).body_rate_rad_s[0], expected, 0.02 * std::abs(expected));
}

TEST(InertiaProducts, AreThoseOfTheTensor) {
  const Vehicle v = with("inertia_products", {{"xy", 0.05}, {"xz", -0.02}, {"yz", 0.01}});
  const InertiaTensor& i = v.torso.inertia_kg_m2;
  const double mean = (i.xx + i.yy + i.zz) / 3;
  // second moment of mass = -I off the diagonal
  EXPECT_NEAR(change(v, [](const auto& p) { return p.fixed_second_kg_m2.xy; }), -0.05 * mean, 1e-20);
  EXPECT_NEAR(change(v, [](const auto& p) { return p.fixed_second_kg_m2.xz; }), 0.02 * mean, 1e-20);
  EXPECT_NEAR(change(v, [](const auto& p) { return p.fixed_second_kg_m2.yz; }), -0.01 * mean, 1e-20);
  EXPECT_NEAR(change(v, [](const auto& p) { return p.fixed_second_kg_m2.xx; }), 0, 1e-22);
}

TEST(WingInertiaShape, IsMirroredAndMovesAwayFromTheLeadingEdge) {
  const Vehicle v = with("wing_inertia", {{"chord_m", 1e-3}, {"product", 0.1}});
  for (const bool left : {true, false}) {
    const Side& s = left ? v.left : v.right;
    const RigidBody& w = s.wing;
    const auto of = [&](const auto& p) { return left ? p.left : p.right; };
    EXPECT_NEAR(change(v, [&](const auto& p) { return of(p).wing_moment_kg_m.z; }), -1e-3 * w.mass_kg, 1e-18);
    EXPECT_LT(w.com_m.z, 0);  // where the chord is
    const double product = 0.1 * std::sqrt(w.inertia_kg_m2.yy * w.inertia_kg_m2.zz) * (left ? 1 : -1);
    EXPECT_NEAR(change(v, [&](const auto& p) { return of(p).wing_second_kg_m2.yz; }),
                -product - 1e-3 * w.mass_kg * w.com_m.y, 1e-18);
  }
}

TEST(WingDamage, TakesTheTipFromPlanformAndMass) {
  const Vehicle v = with("wing_damage", {{"left_area", 0.05}, {"right_area", 0}});
  // a chord that falls linearly by 0.587 of its mean: 5 % of the area are the last 0.0697 of the span, where r^2 is 0.932
  // on the mean, so r_22 loses 0.05 x 0.9314 of 0.2842; by a sum over 1e5 strips
  const Planform& w = v.left.planform;
  const double slope = 12 * (w.r11 - w.r00 / 2);
  double area = 0, second = 0, fourth = 0;
  for (double r = 1 - 5e-6; area < 0.05 * w.r00; r -= 1e-5) {
    const double c = w.r00 + slope * (r - 0.5);
    area += 1e-5 * c;
    second += 1e-5 * c * r * r;
    fourth += 1e-5 * c * c * c * c;
  }
  const auto share = [&](auto figure) { return change(v, figure) / figure(derive(test::nominal(), kStep)); };
  EXPECT_NEAR(share([](const auto& p) { return p.left.force2; }), -second / w.r22, 3e-5);  // a strip
  EXPECT_NEAR(share([](const auto& p) { return p.left.force2; }), -0.164, 2e-3);
  EXPECT_NEAR(share([](const auto& p) { return p.left.force0; }), -0.05, 1e-12);
  EXPECT_NEAR(share([](const auto& p) { return p.left.rotational_damping_Nm_s2; }), -fourth / w.z_rd, 3e-5);
  EXPECT_EQ(share([](const auto& p) { return p.right.force2; }), 0);
  const double lost = 0.05 * v.left.wing.mass_kg;
  EXPECT_NEAR(total_mass_kg(test::nominal()) - total_mass_kg(v), lost, 1e-15);
  // at 0.965 of the span
  EXPECT_NEAR(change(v, [](const auto& p) { return p.left.wing_moment_kg_m.y; }), -lost * 0.965 * w.wing_length_m,
              1e-3 * lost * w.wing_length_m);
  EXPECT_NEAR(change(v, [](const auto& p) { return p.left.wing_second_kg_m2.yy; }),
              -lost * 0.932 * w.wing_length_m * w.wing_length_m, 2e-3 * lost * w.wing_length_m * w.wing_length_m);
  EXPECT_EQ(change(v, [](const auto& p) { return p.right.wing_moment_kg_m.y; }), 0);
}

// ---- voltage, motor, stops

TEST(CommandDelay, ShiftsByItsTime) {
  for (const double steps : {0.0, 1.0, 20.0, 2.5}) {
    Bench b;
    const One q[1] = {One(steps * kStep)};
    for (int i = 0; i < 600; ++i) {
      const auto h = b.hinges<CommandDelay>(q, std::sin(0.3 * i), i);
      const int whole = static_cast<int>(steps);
      const auto at = [&](int k) { return k >= 0 ? static_cast<double>(k) : 0; };
      const double part = steps - whole;
      EXPECT_EQ(value(h.right.voltage_V), (1 - part) * at(i - whole) + part * at(i - whole - 1)) << steps << ", " << i;
      if (part == 0 && i >= whole) EXPECT_EQ(value(h.left.voltage_V), std::sin(0.3 * (i - whole)));
    }
  }
}

TEST(DriverDeadZone, TakesItsVoltage) {
  Bench b;
  const One q[1] = {One(0.4)};
  EXPECT_EQ(value(b.hinges<DriverDeadZone>(q, 0.3, -0.39).left.voltage_V), 0);
  EXPECT_EQ(value(b.hinges<DriverDeadZone>(q, 0.3, -0.39).right.voltage_V), 0);
  EXPECT_DOUBLE_EQ(value(b.hinges<DriverDeadZone>(q, 10, -10).left.voltage_V), 9.6);
  EXPECT_DOUBLE_EQ(value(b.hinges<DriverDeadZone>(q, 10, -10).right.voltage_V), -9.6);
}

TEST(DriverBandwidth, FollowsExponentially) {
  Bench b;
  const One q[1] = {One(1e-3)};
  for (int i = 1; i <= 30; ++i) {
    const auto h = b.hinges<DriverBandwidth>(q, 10, -4);
    EXPECT_NEAR(value(h.left.voltage_V), 10 * (1 - std::exp(-i * kStep / 1e-3)), 1e-13);
    EXPECT_NEAR(value(h.right.voltage_V), -4 * (1 - std::exp(-i * kStep / 1e-3)), 1e-13);
  }
}

TEST(WindingHeating, WarmsExponentiallyAndTakesTorqueAndDamping) {
  // a stalled motor at 10 V: R grows with the temperature, d(dT)/dt = (rise V^2 / (R_0 (1 + a dT)) - dT) / time, by steps
  // of a hundredth; a small rise keeps R, where the exponential is exact
  for (const double rise : {1e-6, 30.0}) {
    Bench b;
    const double time = 0.5, R = b.vehicle.left.motor.resistance_ohm;
    const One q[2] = {One(rise), One(time)};
    double dT = 0;
    for (int i = 0; i < 5000; ++i) {
      const auto h = b.hinges<WindingHeating>(q, 10, 0);
      WindingHeating::after(q, b.see(), b.state(), h);
      for (int k = 0; k < 100; ++k) dT += kStep / 100 / time * (rise * 100 / (R * (1 + 0.00393 * dT)) - dT);
    }
    // Euler of step h errs by h / 2 time = 1e-4 of what changes
    EXPECT_NEAR(b.memory[0], dT, 1e-4 * dT);
    if (rise < 1) EXPECT_NEAR(dT, rise * 100 / R * (1 - std::exp(-1)), 1e-4 * dT);
    EXPECT_EQ(b.memory[2], 0);  // the right one carries no current
    const auto h = b.hinges<WindingHeating>(q, 10, 0);
    const double hotter = 1 + 0.00393 * b.memory[0];
    EXPECT_NEAR(value(h.left.resistance_ohm), R * hotter, 1e-12);
    EXPECT_NEAR(value(h.left.torque_per_V_Nm), value(b.p.left.stroke_torque_per_V_Nm) / hotter, 1e-15);
    // what is left of the damping: electric / hotter + mechanical; the nominal motor's is nearly all electric
    const Motor& m = b.vehicle.left.motor;
    const double electric = m.efficiency * std::pow(m.gear_ratio * m.torque_constant_Nm_A, 2) / R;
    EXPECT_NEAR(value(b.p.left.stroke_damping_Nm_s) - value(h.left.damping_Nm_s), electric * (1 - 1 / hotter), 1e-16);
    EXPECT_NEAR(value(h.left.stiffening_kg_m2), kStep / 2 * value(h.left.damping_Nm_s), 1e-20);
  }
}

TEST(WindingHeating, IsNotLostInSinglePrecision) {
  // 1e5 steps that each add 2e-8 of what there is: a plain sum in float would stand still
  float memory[2] = {};
  using F = Lanes<float, 1>;
  const StateRows<F> state{memory, 1, F(0) < F(1)};
  for (int i = 0; i < 100000; ++i) state.add(0, F(i == 0 ? 1 : 2e-8));
  EXPECT_NEAR(memory[0], 1.002, 1e-6);
}

TEST(BatterySag, SolvesItsCircuit) {
  Bench b;
  b.x.left.stroke_rate_rad_s = One(150);
  b.x.right.stroke_rate_rad_s = One(-80);
  const double source = 2, fade = 0.05, nominal = 18;
  const One q[3] = {One(source), One(fade), One(nominal)};
  b.memory[0] = 20;  // C
  const auto h = b.hinges<BatterySag>(q, 12, -6);
  const Motor& m = b.vehicle.left.motor;
  const double emf = m.gear_ratio * m.torque_constant_Nm_A, R = m.resistance_ohm;
  const double i_l = (value(h.left.voltage_V) - emf * 150) / R, i_r = (value(h.right.voltage_V) + emf * 80) / R;
  const double battery_V = value(h.left.voltage_V) / 12 * nominal;
  EXPECT_NEAR(value(h.right.voltage_V), -6 * battery_V / nominal, 1e-14);
  const double drawn_A = 12 / nominal * i_l - 6 / nominal * i_r;
  EXPECT_NEAR(battery_V, nominal - source * drawn_A - fade * 20, 1e-13);
  EXPECT_NEAR(battery_V * drawn_A, value(h.left.voltage_V) * i_l + value(h.right.voltage_V) * i_r, 1e-13);  // power
  EXPECT_NEAR(b.memory[0], 20 + kStep * drawn_A, 1e-14);
  EXPECT_GT(drawn_A, 0.3);
  // empty, it turns nobody backward
  b.x.left.stroke_rate_rad_s = b.x.right.stroke_rate_rad_s = One(0);
  b.memory[0] = 1000;
  EXPECT_EQ(value(b.hinges<BatterySag>(q, 12, -6).left.voltage_V), 0);
}

TEST(CoulombFriction, FallsWithSpeed) {
  Bench b;
  const One q[2] = {One(1.5), One(100)};
  const double f = value(b.p.left.stroke_friction_Nm);
  EXPECT_NEAR(value(b.hinges<CoulombFriction>(q, 0, 0).left.friction_Nm), 2.5 * f, 1e-15 * f);
  b.x.left.stroke_rate_rad_s = One(-100);
  EXPECT_NEAR(value(b.hinges<CoulombFriction>(q, 0, 0).left.friction_Nm), f * (1 + 1.5 / std::numbers::e), 1e-14 * f);
}

TEST(SpringHardening, IsDuffings) {
  Bench b;
  const One q[1] = {One(0.1)};
  const double rest = b.vehicle.left.spring.rest_angle_rad, k = b.vehicle.left.spring.stiffness_positive_Nm_rad;
  b.x.left.stroke_rad = One(rest + 1.2);
  const auto h = b.hinges<SpringHardening>(q, 0, 0);
  SideParameters<One> p = b.p.left;
  sim::put_hinges(h.left, p);
  EXPECT_NEAR(value(spring_torque(p, b.x.left.stroke_rad)), -k * 1.2 - 0.1 * k * 1.2 * 1.2 * 1.2, 1e-16);
}

/// Steps a bench's flapper, welded, without air on the wings but for what effects see in their figures.
struct Stand {
  explicit Stand(Vehicle v, double air_density = 1.2) : airless(std::move(v)) {
    Vehicle in_air = airless;
    in_air.air_density_kg_m3 = air_density;
    airless.air_density_kg_m3 = 0;
    const auto figures = effect_constants(in_air);
    effects.states = memory;
    effects.stride = 1;
    effects.meter = meter;
    effects.kept = 0;
    for (auto& row : effects.rows) row = One(0);
    for (int k = 0; k < 2 * kRows<SideConstants>; ++k)
      effects.rows[kEffectParameterRows + k] = One(reinterpret_cast<const double*>(&figures)[k]);
    x.attitude.w = One(1);
    x.support = One(2);
  }
  void set(const char* id, std::initializer_list<double> q) {
    const int e = effect_index(id);
    effects.set |= std::uint64_t{1} << e;
    effects.kept |= std::uint64_t{1} << e;
    int row = model::effects()[static_cast<std::size_t>(e)].first_row;
    for (const double parameter : q) effects.rows[row++] = One(parameter);
  }
  /// `left_V`, `right_V`: of the driver. Fills the meter.
  void step(double left_V, double right_V = 0) {
    const Parameters<One> p = in_lane(derive(airless, h));
    Parameters<One> own = p;
    effects.own = &own;
    sim::physics_step<true>(p, x, {One(left_V), One(right_V)}, com_m, effects,
                            {One(h), One(h / 2), One(1 / h), One(gravity), One(0), One(10)});
  }

  Vehicle airless;
  sim::ActiveEffects<One> effects;
  State<One> x{};
  Vec3<One> com_m{};
  double h = kStep, gravity = 0;
  double memory[64] = {};
  double meter[3] = {};  // share of the source, current of the left and of the right motor
};

TEST(StopCompliance, GivesWayByItsComplianceUnderAConstantTorque) {
  // gravity on a wing turned to its side and pulled to the stop: the leading edge along y, held level, so the moment about
  // it is m g times the horizontal part of the chord's lever; attitude: B pitched by 90 degrees puts the chord level
  Vehicle v = test::nominal();
  for (Side* s : {&v.left, &v.right}) s->spring = {1, 1, 0}, s->rotation = {-0.5, 0.5, 0, 0};
  for (const double compliance : {1000.0, 3000.0}) {
    Stand s(v);
    s.gravity = 9.81;
    s.x.attitude = {One(std::sqrt(0.5)), One(0), One(std::sqrt(0.5)), One(0)};
    s.set("stop_compliance", {compliance, 0.7});
    for (int i = 0; i < 20000; ++i) s.step(0);
    const double theta = value(s.x.left.rotation_rad), over = std::abs(theta) - 0.5;
    // moment about y of the weight -m g along W z = -m g (-x_B): lever in the wing's frame, turned by theta about y
    const Triple& c = v.left.wing.com_m;
    const double torque = v.left.wing.mass_kg * 9.81 * (c.z * std::cos(theta) - c.x * std::sin(theta));
    EXPECT_LT(torque, 0);
    EXPECT_GT(over, 0);
    EXPECT_NEAR(over, std::abs(torque) * compliance, 1e-6 * over + 1e-9);
    EXPECT_NEAR(value(s.x.left.rotation_rate_rad_s), 0, 1e-6);
  }
}

TEST(StopCompliance, TendsToTheHardStop) {
  // a wing thrown against its stop: it stays there, whatever holds it
  double last = 1;
  for (const double compliance : {1.0, 1e-3, 1e-6}) {
    Stand s(test::nominal());
    s.set("stop_compliance", {compliance, 0.5});
    s.x.left.rotation_rate_rad_s = One(300);
    double most = 0;
    for (int i = 0; i < 200; ++i) {
      s.step(0);
      most = std::max(most,
                      value(s.x.left.rotation_rad) - value(in_lane(derive(s.airless, kStep).left).rotation_upper_rad));
    }
    EXPECT_LT(most, last);
    last = std::max(most, 1e-12);
  }
  EXPECT_LT(last, 1e-4);
}

TEST(GearBacklash, PlaysFreelyThroughHalfTheGap) {
  // from the middle of the gap a motor at rest, friction f, accelerates at (T V - f) / J alone; the wing stays
  Vehicle v = test::nominal();
  for (Side* s : {&v.left, &v.right}) s->spring.rest_angle_rad = 0;
  const double gap = 0.05;
  Stand s(v);
  s.set("gear_backlash", {gap});
  const SideParameters<double> p = derive(s.airless, kStep).left;
  const double torque = p.stroke_torque_per_V_Nm * 5 - p.stroke_friction_Nm;
  const double moves_s =
      std::sqrt(gap * p.rotor_kg_m2 / torque);  // without damping, which takes 2 % of the rate by then
  int still = 0;
  while (std::abs(value(s.x.left.stroke_rate_rad_s)) < 1e-9 && still < 1000) {
    s.step(5);
    ++still;
  }
  EXPECT_NEAR(still * kStep, moves_s, 0.05 * moves_s + kStep);
  EXPECT_GT(still, 5);
  for (int i = 0; i < 300; ++i) s.step(5);
  EXPECT_GT(value(s.x.left.stroke_rad), 0.1);
  // pressed against its tooth, the motor leads by half the gap and the deflection under the spring's torque
  const double spring = p.spring_positive_Nm_rad * value(s.x.left.stroke_rad);
  const double stiffness = p.stroke_torque_per_V_Nm * p.voltage_limit_V / 0.001;
  for (int i = 0; i < 5000; ++i) s.step(5);
  EXPECT_NEAR(s.memory[0], gap / 2 + spring / stiffness, 0.1 * spring / stiffness);
  EXPECT_EQ(s.memory[4], 0);  // no voltage on the right
}

// The motor's own rate is what induces its voltage.
TEST(GearBacklash, TellsTheMotorsRate) {
  Bench b;
  b.x.left.stroke_rate_rad_s = One(30);
  b.memory[1] = 12;  // of the left, faster than its wing
  const One q[1] = {One(0.05)};
  const auto h = b.hinges<GearBacklash>(q, 5, 5);
  EXPECT_EQ(value(h.left.motor_rate_rad_s), 42);
  EXPECT_EQ(value(h.right.motor_rate_rad_s), value(b.x.right.stroke_rate_rad_s));
}

// What belongs to the motor goes by the motor's rate, which the meter's currents tell: in the first step it turns by itself,
// before the teeth press the wing.
struct Loose : Stand {
  Loose(const char* id, std::initializer_list<double> q) : Stand(test::nominal()) {
    set(id, q);
    set("gear_backlash", {0.2});
  }
};
constexpr int kLooseSteps = 10;  // of about 14, after which phi' is 100 rad/s

TEST(GearBacklash, HeatsTheWindingByTheMotorsCurrent) {
  const double rise = 1e-6, time = 0.5;  // too little to change R by more than 1e-10
  Loose s("winding_heating", {rise, time});
  const double R = s.airless.left.motor.resistance_ohm;
  double dT = 0;
  for (int i = 0; i < kLooseSteps; ++i) {
    s.step(5);
    dT += kStep / time * (rise * R * s.meter[1] * s.meter[1] - dT);
    EXPECT_NEAR(s.memory[0], dT, 1e-9 * dT) << i;
  }
  EXPECT_LT(s.meter[1], 0.8 * 5 / R);  // back-EMF
}

TEST(GearBacklash, LoadsTheBatteryByTheMotorsCurrents) {
  const double source = 2, nominal = 18;
  Loose s("battery_sag", {source, 0, nominal});
  for (int i = 0; i < kLooseSteps; ++i) {
    s.step(5, -4);
    const double drawn_A = 5 / nominal * s.meter[1] - 4 / nominal * s.meter[2];
    EXPECT_NEAR(s.meter[0] * nominal, nominal - source * drawn_A, 1e-13) << i;
  }
  EXPECT_LT(s.meter[1], 0.8 * 5 / s.airless.left.motor.resistance_ohm);
}

TEST(GearBacklash, LetsTheMotorsOwnRateOvercomeItsStiction) {
  const double extra = 20, stribeck = 30;
  Loose s("coulomb_friction", {extra, stribeck});
  const SideParameters<double> p = derive(s.airless, kStep).left;
  const Motor& m = s.airless.left.motor;
  double rate = 0;
  for (int i = 0; i < kLooseSteps; ++i) {
    s.step(5);
    EXPECT_NEAR((5 - m.resistance_ohm * s.meter[1]) / (m.gear_ratio * m.torque_constant_Nm_A), rate, 1e-11) << i;
    const double friction = p.stroke_friction_Nm * (1 + extra * std::exp(-rate / stribeck));
    const double inertia = p.rotor_kg_m2 / kStep, half = p.stroke_damping_Nm_s / 2;  // damping at the mean rate
    rate = ((inertia - half) * rate + p.stroke_torque_per_V_Nm * 5 - friction) / (inertia + half);
  }
  EXPECT_GT(rate, stribeck);
}

TEST(GearBacklash, TendsToTheRigidGear) {
  double last = 1;
  for (const double gap : {0.1, 0.04, 0.015, 0.0001}) {
    Stand rigid(test::nominal()), loose(test::nominal());
    loose.set("gear_backlash", {gap});
    double apart = 0;
    for (int i = 0; i < 600; ++i) {
      const double V = 4 * std::cos(2 * std::numbers::pi * 34 * i * kStep);
      rigid.step(V, V);
      loose.step(V, V);
      apart = std::max(apart, std::abs(value(rigid.x.left.stroke_rad) - value(loose.x.left.stroke_rad)));
    }
    EXPECT_LT(apart, last) << gap;
    last = apart;
  }
  EXPECT_LT(last, 0.008);  // of 1 rad: the teeth give 5e-4 rad at this torque, which resonance magnifies
}

// ---- air

TEST(GroundAndCeiling, GiveTheirFactor) {
  Bench b;
  const One q[2] = {One(0.2), One(0.06)};
  b.x.position_m.z = One(0.05);
  b.x.left.stroke_rad = One(0.3);
  EXPECT_NEAR(lift(b.air<GroundEffect>(q, kUnit)), 1 + 0.2 * std::exp(-(0.05 + 0.019) / 0.06), 1e-15);
  b.x.position_m.z = One(-1);
  EXPECT_NEAR(lift(b.air<GroundEffect>(q, kUnit)), 1.2, 1e-15);
  b.x.position_m.z = One(2.9);
  EXPECT_NEAR(lift(b.air<CeilingEffect>(q, kUnit)), 1 + 0.2 * std::exp(-(0.1 - 0.019) / 0.06), 1e-15);
  b.x.attitude = {One(0), One(1), One(0), One(0)};  // upside down: the stroke plane hangs below
  EXPECT_NEAR(lift(b.air<CeilingEffect>(q, kUnit)), 1 + 0.2 * std::exp(-(0.1 + 0.019) / 0.06), 1e-15);
}

TEST(Wind, BlowsInWAndGustsWithItsRms) {
  Bench b;
  b.x.attitude = {One(std::sqrt(0.5)), One(0), One(0), One(std::sqrt(0.5))};  // x of B along y of W
  const One still[5] = {One(0.3), One(0), One(-0.1), One(0), One(0.5)};
  Vec3<One> wind{One(0), One(0), One(0)};
  Wind::wind(still, b.see(), b.state(), wind);
  EXPECT_NEAR(value(wind.x), 0, 1e-15);
  EXPECT_NEAR(value(wind.y), -0.3, 1e-15);
  EXPECT_NEAR(value(wind.z), -0.1, 1e-15);

  b.x.attitude = {One(1), One(0), One(0), One(0)};
  const One gusty[5] = {One(0), One(0), One(0), One(0.4), One(0.05)};
  double sums[3] = {}, product = 0;
  const int n = 400000;
  for (int i = 0; i < n; ++i) {
    Wind::wind(gusty, b.see(), b.state(), wind);
    const double w[3] = {value(wind.x), value(wind.y), value(wind.z)};
    for (int k = 0; k < 3; ++k) sums[k] += w[k] * w[k] / n;
    product += w[0] * w[1] / n;
  }
  // 40 s of sines of 0.2 to 0.5 s: what is left of whole periods is below 1 %
  for (const double sum : sums) EXPECT_NEAR(std::sqrt(sum), 0.4, 0.01);
  EXPECT_NEAR(product / 0.16, 0, 0.03);
}

TEST(Wind, IsWhatWingsAndBodyMeet) {
  Bench b;
  b.wind_B = {One(1), One(0), One(0)};
  const One q[2] = {One(0.0015), One(0)};
  const double drag = 0.5 * b.vehicle.air_density_kg_m3 * 0.0015;
  EXPECT_NEAR(value(b.world<BodyDrag>(q).force_B.x), drag, 1e-15);
  b.velocity_B = {One(1), One(0), One(0)};
  EXPECT_EQ(value(b.world<BodyDrag>(q).force_B.x), 0);
  b.velocity_B = {One(1), One(0), One(-2)};
  EXPECT_NEAR(value(b.world<BodyDrag>(q).force_B.z), 4 * drag, 1e-15);
}

TEST(WingFlexibility, LetsTheTrailingEdgeGiveWay) {
  Bench b;
  b.shoulder = {One(-4), One(0), One(0)};  // towards -x: the force is towards +x
  b.x.left.rotation_rad = One(-0.7);
  const auto s = b.see();
  const auto stiff = blade_element<+1>(b.p.left, b.pose.left.theta, One(0), flow<+1>(s).v, flow<+1>(s).w);
  ASSERT_GT(normal(stiff), 0.01);
  const One q[1] = {One(2)};
  const auto soft = b.air<WingFlexibility>(q, stiff);
  const double twist = 2 * normal(stiff) * value(b.p.left.span_to_pressure_m) / b.vehicle.left.planform.wing_length_m;
  const auto turned = blade_element<+1>(b.p.left, sin_cos(One(-0.7 - twist)), One(0), flow<+1>(s).v, flow<+1>(s).w);
  EXPECT_NEAR(normal(soft), normal(turned), 1e-14);
  EXPECT_LT(value(soft.force_x_N), value(stiff.force_x_N));  // less drag,
  EXPECT_GT(value(soft.force_z_N) / value(soft.force_x_N),
            value(stiff.force_z_N) / value(stiff.force_x_N));  // more lift to it
}

/// Mean over the span of c(x)^n x^k, by strips; the error of a smooth chord's is below 1e-7.
double mean_chord_power(auto chord, int n, int k) {
  constexpr int kStrips = 4000;
  double sum = 0;
  for (int i = 0; i < kStrips; ++i) {
    const double x = (i + 0.5) / kStrips;
    sum += std::pow(chord(x), n) * std::pow(x, k) / kStrips;
  }
  return sum;
}

/// The same of the trapezoid with the area and the first moment of the shipped wings.
double trapezoid(int n, int k) {
  const Planform& w = test::nominal().left.planform;
  return mean_chord_power([&](double x) { return w.r00 + 12 * (w.r11 - w.r00 / 2) * (x - 0.5); }, n, k);
}

TEST(ShippedWings, AreNearlyTrapezoids) {
  const Planform& w = test::nominal().left.planform;
  EXPECT_NEAR(trapezoid(1, 2), w.r22, 0.0002 * w.r22);
  EXPECT_NEAR(trapezoid(1, 3), w.r33, 0.0002 * w.r33);
  EXPECT_NEAR(trapezoid(2, 0), w.z_cp0, 0.0006 * w.z_cp0);
  EXPECT_NEAR(trapezoid(2, 1), w.z_cp1, 0.0005 * w.z_cp1);
  EXPECT_NEAR(trapezoid(2, 2), w.z_cp2, 0.0015 * w.z_cp2);
  EXPECT_NEAR(trapezoid(4, 0), w.z_rd, 0.0031 * w.z_rd);
}

TEST(RotationalLift, AddsToAPitchingUpWingOnBothStrokes) {
  // moved without turning at U: F = pi 3/4 rho U theta' times the integral of c^2, c^2 R z_cp0
  for (const double forward : {1.0, -1.0}) {
    Bench b;
    b.shoulder = {One(-3 * forward), One(0), One(0)};  // blade element's U_i = 3 forward
    b.x.left.rotation_rate_rad_s = One(200);
    b.x.left.rotation_rad = One(-0.6 * forward);  // trailing edge behind
    const One q[1] = {One(1)};
    const WingWrench<One> none{};
    const auto w = b.air<RotationalLift>(q, none);
    const Planform& f = b.vehicle.left.planform;
    const double c2 = f.mean_chord_m * f.mean_chord_m * f.wing_length_m;
    const double expected = std::numbers::pi * 0.75 * b.vehicle.air_density_kg_m3 * 3 * 200 * c2 * f.z_cp0;
    EXPECT_NEAR(normal(w), expected, 1e-12 * expected);
    EXPECT_NEAR(value(w.force_x_N), std::cos(0.6) * expected, 1e-12 * expected);
    EXPECT_NEAR(value(w.force_z_N), std::sin(0.6) * forward * expected, 1e-12 * expected);
    // towards +x, that is: with the drag and lift of the wing that pitches up (theta' > 0 and U_i > 0), against the other's
    const auto s = b.see();
    const auto steady = blade_element<+1>(b.p.left, b.pose.left.theta, One(0), flow<+1>(s).v, flow<+1>(s).w);
    EXPECT_GT(normal(w) * normal(steady) * forward, 0);
    // at the span where c^2 has its mean
    EXPECT_NEAR(value(w.moment_Nm.z) / value(w.force_x_N), -f.wing_length_m * f.z_cp1 / f.z_cp0, 1e-12);
    // at mid-chord: half of <c^3> / <c^2>, by the trapezoid that gives the wings' moments to 0.31 %
    const double arm = 0.5 * f.mean_chord_m * trapezoid(3, 0) / trapezoid(2, 0);
    EXPECT_NEAR(value(w.moment_Nm.y) / -expected, arm, 0.0031 * arm);
  }
  // turned about the shoulder at w_z: the next moments
  Bench b;
  b.x.right.stroke_rate_rad_s = One(100);
  b.x.right.rotation_rate_rad_s = One(-50);
  const One q[1] = {One(0.5)};
  const auto w = b.air<RotationalLift, -1>(q, WingWrench<One>{});
  const Planform& f = b.vehicle.right.planform;
  const double scale = 0.5 * std::numbers::pi * 0.75 * b.vehicle.air_density_kg_m3 * 100 * -50 * f.mean_chord_m *
                       f.mean_chord_m * f.wing_length_m * f.wing_length_m;
  EXPECT_NEAR(normal(w), scale * f.z_cp1, 1e-12 * std::abs(scale));
  EXPECT_NEAR(value(w.moment_Nm.z), scale * f.wing_length_m * f.z_cp2, 1e-12 * std::abs(scale));
  const double arm = 0.5 * f.mean_chord_m * trapezoid(3, 1) / trapezoid(2, 1);
  EXPECT_NEAR(value(w.moment_Nm.y) / -normal(w), arm, 0.0031 * arm);
}

TEST(WakeCapture, IsTheWingMeetingAirThatDiesDown) {
  Bench b;
  const One q[2] = {One(0.3), One(0.1)};
  const auto fly = [&](double rate, int steps) {
    b.x.left.stroke_rate_rad_s = One(rate);
    WingWrench<One> last{};
    for (int i = 0; i < steps; ++i) last = b.air<WakeCapture>(q, WingWrench<One>{});
    return last;
  };
  /// What a wing that turns at `rate` gains where the air comes at it with `wake`.
  const auto expected = [](double rate, double wake) {
    const auto force = [](double r) {
      Bench c;
      c.x.left.stroke_rate_rad_s = One(r);
      const auto s = c.see();
      return normal(blade_element<+1>(c.p.left, c.pose.left.theta, One(0), flow<+1>(s).v, flow<+1>(s).w));
    };
    return force(rate + std::copysign(wake, rate)) - force(rate);
  };
  EXPECT_EQ(normal(fly(10, 20)), 0);  // no wake yet
  EXPECT_EQ(normal(fly(40, 20)), 0);
  EXPECT_NEAR(normal(fly(-1, 1)), expected(-1, 0.3 * 40), 1e-15);
  EXPECT_GT(std::abs(expected(-1, 0.3 * 40)),
            100 * std::abs(expected(-1, 0.3)));  // a wing that hardly moves has a peak
  // 40 steps of stroke before it, of which the last is 39 steps after the first
  EXPECT_NEAR(normal(fly(-1, 3)), expected(-1, 12 * std::exp(-3 / (0.1 * b.memory[2] / kStep))), 1e-14);
  EXPECT_NEAR(b.memory[2], 40 * kStep, 1e-15);
  EXPECT_NEAR(normal(fly(-5, 56)), 0, 1e-5 * std::abs(expected(-5, 12)));
  const auto w = fly(2, 1);
  EXPECT_NEAR(normal(w), expected(2, 0.3 * 5), 1e-15);
  EXPECT_NEAR(b.memory[2], 59 * kStep, 1e-15);
  EXPECT_NEAR(std::hypot(value(w.force_x_N), value(w.force_z_N)), std::abs(normal(w)), 1e-15);
  EXPECT_NEAR(normal(fly(0, 1)), expected(1e-12, 1.5 * std::exp(-1 / (0.1 * 59))), 1e-13);  // that stops, not reversed
}

TEST(ClapAndFling, ActsWhereBothWingsAreAndIsShedOnTheWay) {
  Bench b;
  const One q[2] = {One(0.5), One(1.3)};
  const Planform& f = b.vehicle.left.planform;
  const double width = f.mean_chord_m / (2 * f.wing_length_m);
  const auto gain = [&](double left, double right) {
    b.x.left.stroke_rad = One(left);
    b.x.right.stroke_rad = One(right);
    return lift(b.air<ClapAndFling>(q, kUnit)) - 1;
  };
  const auto afresh = [&](double left, double right) {
    b.memory[0] = 0;
    return gain(left, right);
  };
  EXPECT_EQ(afresh(1.3, 1.5), 0);
  EXPECT_NEAR(afresh(1.3 + width / 2, 1.6), 0.25, 1e-12);
  EXPECT_NEAR(afresh(-1.6, -1.3 - width / 4), 0.5 * (3.0 / 16 - 2.0 / 64), 1e-12);
  EXPECT_EQ(afresh(1.6, -1.6), 0);
  EXPECT_NEAR(afresh(1.6, 1.6), 0.5, 1e-12);
  EXPECT_NEAR(gain(0, 0), 0.5, 1e-12);  // kept at rest
  // two chords of the tip's travel: e-fold, but for the square of a step
  const double rate = 100;
  b.x.left.stroke_rate_rad_s = One(-rate);
  const int steps = static_cast<int>(2 * f.mean_chord_m / (f.wing_length_m * rate * kStep));
  for (int i = 0; i < steps; ++i) gain(0, 0);
  const double step = 1.0 / steps;
  EXPECT_NEAR(gain(0, 0), 0.5 * std::exp(-1.0), 0.5 * 2 * step);
}

TEST(AddedMass, ResistsAccelerationNormalToTheWing) {
  Bench b;
  const One q[1] = {One(2)};
  const Planform& f = b.vehicle.left.planform;
  const double strip = 2 * b.vehicle.air_density_kg_m3 * std::numbers::pi / 4 * f.mean_chord_m * f.mean_chord_m;
  const auto rate = [&](double velocity, double stroke) {
    b.shoulder = {One(velocity), One(0), One(0)};
    b.x.left.stroke_rate_rad_s = One(stroke);
    const auto w = b.air<AddedMass>(q, WingWrench<One>{});
    AddedMass::after(q, b.see(), b.state(), b.hinges(0, 0));
    return w;
  };
  EXPECT_EQ(normal(rate(1, 0)), 0);  // nothing is known of what was before
  // 0.01 m/s within a step: 100 m/s^2
  const double moved = strip * f.wing_length_m * f.z_cp0 * 100;
  EXPECT_NEAR(normal(rate(1.01, 0)), -moved, 1e-11 * moved);
  // 1 rad/s within a step: 1e4 rad/s^2, which moves the left wing, at +y, towards -x: the air pushes towards +x
  const double turned = strip * f.wing_length_m * f.wing_length_m * f.z_cp1 * 1e4;
  const auto w = rate(1.01, 1);
  EXPECT_NEAR(normal(w), turned, 1e-11 * turned);
  EXPECT_NEAR(value(w.moment_Nm.z), -strip * std::pow(f.wing_length_m, 3) * f.z_cp2 * 1e4, 1e-11 * turned);
  // 1e4 rad/s^2 in pitch about the leading edge: rho pi/4 c^2 at c/2, and rho pi/128 c^4 about mid-chord
  b.x.left.rotation_rate_rad_s = One(1);
  const double pitch = 2 * b.vehicle.air_density_kg_m3 * std::numbers::pi * (1 / 16. + 1 / 128.) *
                       std::pow(f.mean_chord_m, 4) * f.wing_length_m * f.z_rd * 1e4;
  EXPECT_NEAR(value(rate(1.01, 1).moment_Nm.y), -pitch, 1e-11 * pitch);
}

TEST(AddedMass, IntegratesTheCubeOfTheChord) {
  const auto check = [](const Vehicle& v, auto chord, double tolerance) {
    const Planform& f = v.left.planform;
    const SideConstants<double> figures = effect_constants(v).left;
    const double scale = v.air_density_kg_m3 * std::numbers::pi / 8 * std::pow(f.mean_chord_m, 3) * f.wing_length_m;
    const double c3 = scale * mean_chord_power(chord, 3, 0),
                 c3r = scale * f.wing_length_m * mean_chord_power(chord, 3, 1);
    EXPECT_NEAR(figures.added_chord_kg_m, c3, tolerance * c3);
    EXPECT_NEAR(figures.added_cross_kg_m2, c3r, tolerance * c3r);
  };
  const auto check_shape = [&](auto chord, bool quadratic) {
    Vehicle v = test::nominal();
    Planform& w = v.left.planform;
    const auto mean = [&](int n, int k) { return mean_chord_power(chord, n, k); };
    w.r00 = mean(1, 0), w.r11 = mean(1, 1), w.r22 = mean(1, 2), w.r33 = mean(1, 3);
    w.z_cp0 = mean(2, 0), w.z_cp1 = mean(2, 1), w.z_cp2 = mean(2, 2), w.z_rd = mean(4, 0);
    // e, what a quadratic misses, has the mean square <c^2> less the squares of its parts; errors of c^3 are 3 c e^2
    const double a0 = w.r00, a1 = 2 * w.r11 - w.r00, a2 = 6 * w.r22 - 6 * w.r11 + w.r00;
    const double missed = w.z_cp0 - (a0 * a0 + 3 * a1 * a1 + 5 * a2 * a2);
    check(v, chord, quadratic ? 1e-6 : 3 * missed / mean(3, 0));
    return missed;
  };
  EXPECT_LT(check_shape([](double x) { return 2 * (1 - x); }, true), 1e-6);
  EXPECT_LT(check_shape([](double x) { return 0.5 + 3 * x * (1 - x); }, true), 1e-6);
  EXPECT_LT(check_shape([](double x) { return 4 / std::numbers::pi * std::sqrt(1 - x * x); }, false),
            0.0015);  // ellipses
  EXPECT_LT(check_shape([](double x) { return 8 / std::numbers::pi * std::sqrt(x - x * x); }, false), 0.003);
  const Planform& w = test::nominal().left.planform;
  check(
      test::nominal(), [&](double x) { return w.r00 + 12 * (w.r11 - w.r00 / 2) * (x - 0.5); }, 0.0031);
}

TEST(AddedMass, GivesTheHingesTheirOwnPartOnceOnly) {
  // a body at rest: what the lagged air takes from the hinges is what they are given back, at every rotation
  for (const double theta : {-0.7, 0.0, 0.4}) {
    Bench b;
    const One q[1] = {One(1)};
    b.x.left = {One(0.3), One(theta), One(10), One(-20)};
    b.x.right = {One(-0.1), One(theta), One(30), One(5)};
    AddedMass::after(q, b.see(), b.state(), b.hinges(0, 0));
    b.x.left = {One(0.3), One(theta), One(12), One(-27)};
    b.x.right = {One(-0.1), One(theta), One(24), One(9)};
    const auto h = b.hinges<AddedMass>(q, 0, 0);
    const auto left = b.air<AddedMass, +1>(q, WingWrench<One>{}), right = b.air<AddedMass, -1>(q, WingWrench<One>{});
    EXPECT_GT(std::abs(value(left.moment_Nm.z)), 1e-5);
    EXPECT_NEAR(value(left.moment_Nm.z) + value(h.left.stroke_torque_Nm), 0, 1e-16);
    EXPECT_NEAR(value(left.moment_Nm.y) + value(h.left.rotation_torque_Nm), 0, 1e-16);
    EXPECT_NEAR(value(right.moment_Nm.z) + value(h.right.stroke_torque_Nm), 0, 1e-16);
    EXPECT_NEAR(value(right.moment_Nm.y) + value(h.right.rotation_torque_Nm), 0, 1e-16);
  }
}

TEST(AddedMass, SlowsASpringsSwingAsMoreInertiaWould) {
  // welded, airless but for the added mass, rotation held: the stroke swings at sqrt(k / (J + added))
  Vehicle v = test::nominal();
  for (Side* s : {&v.left, &v.right}) {
    s->rotation = {0, 0, 0, 0};
    s->stroke.damping_Nm_s = s->stroke.friction_Nm = 0;
    s->motor.torque_constant_Nm_A = s->motor.friction_Nm = s->motor.damping_Nm_s = 0;
    s->spring = {0.013, 0.013, 0};
  }
  const auto quarter_s = [&](double factor) {
    Stand s(v, 1.2);
    s.h = 2e-5;
    if (factor > 0) s.set("added_mass", {factor});
    s.x.left.stroke_rad = One(0.5);
    double t = 0, before = 0.5;
    while (value(s.x.left.stroke_rad) > 0) {
      before = value(s.x.left.stroke_rad);
      s.step(0);
      t += s.h;
    }
    const double now = value(s.x.left.stroke_rad);
    return t - s.h * now / (now - before);
  };
  const Planform& f = v.left.planform;
  const double R = f.wing_length_m, c = f.mean_chord_m;
  const double added = 1.2 * std::numbers::pi / 4 * c * c * R * R * R * f.z_cp2;
  const double own = quarter_s(0), J = 0.013 * std::pow(own / (std::numbers::pi / 2), 2);
  EXPECT_GT(added / J, 0.1);
  // a leapfrog's frequency errs by (w h)^2 / 24, its start by h / 2
  EXPECT_NEAR(quarter_s(1), std::sqrt(1 + added / J) * own, 2e-5);
  EXPECT_NEAR(quarter_s(5), std::sqrt(1 + 5 * added / J) * own, 2e-5);
}

TEST(AddedMass, LosesNoMomentum) {
  // free, without gravity and other air: what the vehicle's momentum changes by is what the strips' took, along the normals
  // of their steps, whatever the wings do; a step later
  Vehicle v = test::nominal();
  Stand s(v);
  s.x.support = One(0);
  s.set("added_mass", {2});
  s.x.left.rotation_rate_rad_s = One(50);
  const double mass = total_mass_kg(v);
  const auto p = in_lane(derive(s.airless, kStep));
  Vec3<double> expected{0, 0, 0};
  double moved = 0;
  for (int i = 0; i < 400; ++i) {
    const Sides<WingPose<One>> pose{place_wing<+1>(p.left, s.x.left, s.x.body_rate_rad_s),
                                    place_wing<-1>(p.right, s.x.right, s.x.body_rate_rad_s)};
    const auto R = rotation_matrix(s.x.attitude);
    const double before[11] = {s.memory[0], s.memory[1], s.memory[2], s.memory[3], s.memory[4], s.memory[5],
                               s.memory[6], s.memory[7], s.memory[8], s.memory[9], s.memory[10]};
    const double V = 12 * std::cos(2 * std::numbers::pi * 34 * i * kStep);
    s.step(V, 0.7 * V);
    const auto taken = [&](const WingPose<One>& g, const SideConstants<One>& f, int row, double side) {
      const auto momentum = [&](const double* u) {
        return value(f.added_kg) * u[0] - value(f.added_chord_kg_m) * u[1] - side * value(f.added_span_kg_m) * u[2];
      };
      const double change = before[0] * 2 * (momentum(s.memory + row) - momentum(before + row));
      moved += std::abs(change);
      const Vec3<One> n = R * rotate_z(g.beta.sin, g.beta.cos, g.theta.cos, One(-g.theta.sin));
      expected = expected - Vec3<double>{value(n.x) * change, value(n.y) * change, value(n.z) * change};
    };
    taken(pose.left, s.effects.constants().left, 1, 1);
    taken(pose.right, s.effects.constants().right, 6, -1);
  }
  const Vec3<One>& v_C = s.x.com_velocity_m_s;
  EXPECT_GT(moved, 1e-3);
  EXPECT_NEAR(mass * value(v_C.x), expected.x, 1e-14);
  EXPECT_NEAR(mass * value(v_C.y), expected.y, 1e-14);
  EXPECT_NEAR(mass * value(v_C.z), expected.z, 1e-14);
  EXPECT_GT(std::abs(expected.x) + std::abs(expected.z), 1e-6);
}

// ---- loads on the body

TEST(WallEffect, PushesAwayAndRaisesTheFarSide) {
  Bench b;
  b.wall[0] = One(0.05), b.wall[1] = One(0), b.wall[2] = One(1);  // on the right, its normal to the left
  b.lift = One(0.12);
  const One q[3] = {One(0.1), One(0.002), One(0.06)};
  const double near = 0.12 * std::exp(-0.05 / 0.06);
  auto load = b.world<WallEffect>(q);
  EXPECT_NEAR(value(load.force_B.y), 0.1 * near, 1e-16);
  EXPECT_EQ(value(load.force_B.x), 0);
  EXPECT_NEAR(value(load.moment_B.x), 0.002 * near, 1e-17);  // +x: the left side goes up
  b.x.attitude = {One(0), One(0), One(0), One(1)};           // turned about, the wall is on its left
  load = b.world<WallEffect>(q);
  EXPECT_NEAR(value(load.force_B.y), -0.1 * near, 1e-15);
  EXPECT_NEAR(value(load.moment_B.x), -0.002 * near, 1e-16);
  b.wall[0] = One(1e6);
  EXPECT_EQ(value(b.world<WallEffect>(q).force_B.y), 0);
}

TEST(BodyDrag, HasItsMagnitudeAtOneMetrePerSecond) {
  Bench b;
  b.velocity_B = {One(0), One(1), One(0)};
  const One q[2] = {One(0.0015), One(0.01)};
  const auto load = b.world<BodyDrag>(q);
  const double drag = 0.5 * b.vehicle.air_density_kg_m3 * 0.0015;
  EXPECT_NEAR(value(load.force_B.y), -drag, 1e-16);
  EXPECT_NEAR(value(load.moment_B.x), 0.01 * drag, 1e-17);  // above the centre of mass, which is the origin here
}

TEST(Tether, WeighsWithHeightAndPullsBack) {
  Bench b;
  b.x.position_m = {One(0.5), One(-1), One(2)};
  b.com = {One(0), One(0), One(-0.001)};
  const One q[5] = {One(2e-4), One(1e-3), One(0.1), One(0), One(-0.01)};
  const auto load = b.world<Tether>(q);
  EXPECT_NEAR(value(load.force_B.z), -2e-4 * 9.81 * 2, 1e-16);
  EXPECT_NEAR(value(load.force_B.x), -1e-3 * 0.4, 1e-16);
  EXPECT_NEAR(value(load.force_B.y), 1e-3, 1e-16);
  EXPECT_NEAR(value(load.moment_B.y), -0.009 * value(load.force_B.x), 1e-18);
  b.x.position_m.z = One(-1);
  EXPECT_EQ(value(b.world<Tether>(q).force_B.z), 0);
}

}  // namespace
}  // namespace flappy::model
