#include "design/stand.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "flappy/batch.hpp"
#include "model/wing_beat.hpp"

namespace flappy::design {
namespace {

constexpr int kAmplitudes = 16;               // a block of lanes
constexpr double kMinAmplitude = 0.25;        // of the largest
constexpr int kSettling = 12, kMeasured = 8;  // beats
constexpr double kSmall = 1.0 / 3;            // of the limits: inputs that give the moments per input
constexpr double kCopper_K = 0.0039;          // temperature coefficient of its resistance, 1/K at 20 to 25 degrees
constexpr double kCatalogue_C = 25;           // at which catalogues state resistances

/// Sums of one lane over its beats.
struct Sums {
  double square_A2[2] = {0, 0}, largest_A = 0, stroke_rad = 0, gear_Nm = 0, rotation_rad_s = 0;
  std::size_t samples = 0;
};

struct Motion {
  double rate_rad_s[2];
};

class Held {
 public:
  Held(const Robot& robot, const Workshop& workshop, double step_s)
      : robot_(robot), workshop_(workshop), step_s_(step_s), com_m_(whole_body(robot.vehicle).com_m) {}

  std::vector<StandPoint> fly(std::span<const sim::Input> inputs, double& flown_s) const {
    const model::Vehicle& v = robot_.vehicle;
    const double hold_s = v.driver.hold_s, beat_s = 1 / v.driver.flapping_Hz;
    const auto holds = [&](int beats) { return std::lround(beats * beat_s / hold_s); };
    const long first = holds(kSettling), last = first + holds(kMeasured);
    sim::BatchOptions options;
    options.step_s = step_s_;
    options.threads = 1;
    options.meters_energy = true;
    sim::Batch<float> batch(inputs.size(), v, options);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      batch.reset(i, {}, sim::Start::welded);
      batch.set_input(i, inputs[i]);
    }
    const int steps = static_cast<int>(std::lround(hold_s / step_s_));
    std::vector<Sums> sums(inputs.size());
    std::vector<Motion> before(inputs.size());
    std::vector<sim::HeldImpulse> impulse(inputs.size());
    std::vector<double> energy_J(inputs.size());
    for (long k = 0; k < last; ++k) {
      if (k == first)
        for (std::size_t i = 0; i < inputs.size(); ++i)
          impulse[i] = batch.held_impulse(i), energy_J[i] = batch.energy_J(i);
      if (k >= first)
        for (std::size_t i = 0; i < inputs.size(); ++i) before[i] = motion(batch.state(i));
      batch.step(steps);
      if (k >= first)
        for (std::size_t i = 0; i < inputs.size(); ++i)
          add(sums[i], inputs[i], before[i], batch.state(i), static_cast<double>(k) * hold_s);
    }
    flown_s += static_cast<double>(last) * hold_s * static_cast<double>(inputs.size());
    std::vector<StandPoint> points;
    const double measured_s = static_cast<double>(last - first) * hold_s;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const sim::HeldImpulse end = batch.held_impulse(i);
      double force[3], moment[3];
      for (int a = 0; a < 3; ++a) {
        force[a] = (end.force_N_s[a] - impulse[i].force_N_s[a]) / measured_s;
        moment[a] = (end.moment_Nm_s[a] - impulse[i].moment_Nm_s[a]) / measured_s;
      }
      points.push_back(point(inputs[i], sums[i], force, moment, (batch.energy_J(i) - energy_J[i]) / measured_s));
      if (batch.status(i) & sim::kFrozen) points.back().lift_N = std::numeric_limits<double>::quiet_NaN();
    }
    return points;
  }

 private:
  static Motion motion(const sim::FlapperState& s) { return {{s.stroke_rate_rad_s[0], s.stroke_rate_rad_s[1]}}; }

  /// Adds a hold of the driver that began at t_s, in which the voltage was constant.
  void add(Sums& s, const sim::Input& input, const Motion& was, const sim::FlapperState& now, double t_s) const {
    const model::Vehicle& v = robot_.vehicle;
    double beat = t_s * v.driver.flapping_Hz;
    beat -= std::floor(beat);
    if (beat >= 0.5) beat -= 1;  // as wing_beat_voltage() takes it
    const model::WingBeat<double> u{input.amplitude_V, input.difference_V, input.bias_V, input.split_cycle};
    for (int side = 0; side < 2; ++side) {
      const model::Side& wing = side == 0 ? v.left : v.right;
      const model::Motor& m = wing.motor;
      const double volts = side == 0 ? model::wing_beat_voltage<1>(u, beat, m.voltage_limit_V)
                                     : model::wing_beat_voltage<-1>(u, beat, m.voltage_limit_V);
      const double back = m.torque_constant_Nm_A * m.gear_ratio;
      const auto current = [&](double rate) { return (volts - back * rate) / m.resistance_ohm; };
      const double a = current(was.rate_rad_s[side]), b = current(now.stroke_rate_rad_s[side]);
      s.square_A2[side] += (a * a + a * b + b * b) / 3;  // linear in between
      s.largest_A = std::max({s.largest_A, std::abs(a), std::abs(b)});
      s.gear_Nm = std::max(s.gear_Nm, m.efficiency * back * std::max(std::abs(a), std::abs(b)));
      s.stroke_rad = std::max(s.stroke_rad, std::abs(now.stroke_rad[side]));
      s.rotation_rad_s = std::max(s.rotation_rad_s, std::abs(now.rotation_rate_rad_s[side]));
    }
    ++s.samples;
  }

  StandPoint point(const sim::Input& input, const Sums& s, const double (&force)[3], const double (&moment)[3],
                   double power_W) const {
    StandPoint p;
    p.amplitude_V = input.amplitude_V;
    p.lift_N = force[2];
    p.moment_Nm = {moment[0] - (com_m_.y * force[2] - com_m_.z * force[1]),
                   moment[1] - (com_m_.z * force[0] - com_m_.x * force[2]),
                   moment[2] - (com_m_.x * force[1] - com_m_.y * force[0])};
    p.power_W = power_W;
    const double mean_A2 = std::max(s.square_A2[0], s.square_A2[1]) / static_cast<double>(s.samples);
    p.winding_C = winding_C(std::sqrt(mean_A2), *robot_.motor, workshop_.ambient_C, workshop_.flight_s);
    p.current_A = s.largest_A;
    p.stroke_rad = s.stroke_rad;
    p.gear_Nm = s.gear_Nm;
    const model::RigidBody& wing = robot_.vehicle.left.wing;
    const double hinge =
        wing.inertia_kg_m2.yy + wing.mass_kg * (wing.com_m.x * wing.com_m.x + wing.com_m.z * wing.com_m.z);
    p.stop_J = hinge * s.rotation_rad_s * s.rotation_rad_s / 2;
    return p;
  }

  const Robot& robot_;
  const Workshop& workshop_;
  double step_s_;
  model::Triple com_m_;
};

/// Where a quantity of the sweep crosses `limit`, as a fractional index; nothing if it does not. Linear in between.
std::optional<double> crossing(const std::vector<StandPoint>& sweep, double StandPoint::*quantity, double limit) {
  if (!(sweep[0].*quantity < limit)) return 0;
  for (std::size_t k = 0; k + 1 < sweep.size(); ++k) {
    const double a = sweep[k].*quantity, b = sweep[k + 1].*quantity;
    if (b >= limit) return static_cast<double>(k) + (limit - a) / (b - a);
  }
  return std::nullopt;
}

double at(const std::vector<StandPoint>& sweep, double StandPoint::*quantity, double index) {
  const auto k = std::min(static_cast<std::size_t>(index), sweep.size() - 2);
  const double share = index - static_cast<double>(k);
  return (1 - share) * (sweep[k].*quantity) + share * (sweep[k + 1].*quantity);
}

}  // namespace

double winding_C(double current_rms_A, const MotorType& m, double ambient_C, double seconds) {
  const double heated_K_W =
      m.winding_K_W * (1 - std::exp(-seconds / m.winding_s)) + m.housing_K_W * (1 - std::exp(-seconds / m.housing_s));
  const double heated_K = current_rms_A * current_rms_A * m.resistance_ohm * heated_K_W;  // without the copper's growth
  if (!(kCopper_K * heated_K < 1)) return std::numeric_limits<double>::infinity();
  return (ambient_C + heated_K * (1 - kCopper_K * kCatalogue_C)) / (1 - kCopper_K * heated_K);
}

Stand measure(const Robot& robot, const Workshop& workshop, double step_s, double gravity_m_s2, double& flown_s) {
  const Held held(robot, workshop, step_s);
  const model::Driver& d = robot.vehicle.driver;
  std::vector<sim::Input> inputs;
  for (int i = 0; i < kAmplitudes; ++i) {
    const double share = kMinAmplitude + (1 - kMinAmplitude) * i / (kAmplitudes - 1);
    inputs.push_back({d.amplitude_limit_V * share, 0, 0, 0});
  }
  Stand s;
  s.sweep = held.fly(inputs, flown_s);
  for (const StandPoint& p : s.sweep)
    if (std::isnan(p.lift_N)) return s;
  const double weight_N = whole_body(robot.vehicle).mass_kg * gravity_m_s2;
  double most = kAmplitudes - 1;
  most = std::min(most, crossing(s.sweep, &StandPoint::winding_C, robot.motor->winding_limit_C).value_or(most));
  most = std::min(most, crossing(s.sweep, &StandPoint::current_A, robot.motor->current_limit_A).value_or(most));
  s.most_lift_N = at(s.sweep, &StandPoint::lift_N, most);
  const auto hover = crossing(s.sweep, &StandPoint::lift_N, weight_N);
  if (!hover || *hover == 0) return s;  // at 0 it flies at a quarter of its amplitude: nothing to hold on to
  const double hover_V = at(s.sweep, &StandPoint::amplitude_V, *hover);
  const auto k = std::min(static_cast<std::size_t>(*hover), s.sweep.size() - 2);
  s.lift_per_V_N = (s.sweep[k + 1].lift_N - s.sweep[k].lift_N) / (s.sweep[k + 1].amplitude_V - s.sweep[k].amplitude_V);

  const double limits[kAxes] = {d.difference_limit_V, d.bias_limit_V, d.split_cycle_limit};
  inputs.assign(1, {hover_V, 0, 0, 0});
  for (const double share : {kSmall, 1.0})
    for (std::size_t axis = 0; axis < kAxes; ++axis)
      for (const double sign : {1.0, -1.0}) {
        sim::Input input{hover_V, 0, 0, 0};
        (axis == 0 ? input.difference_V : axis == 1 ? input.bias_V : input.split_cycle) = sign * share * limits[axis];
        inputs.push_back(input);
      }
  const std::vector<StandPoint> points = held.fly(inputs, flown_s);
  for (const StandPoint& p : points)
    if (std::isnan(p.lift_N)) return s;
  s.hover = points[0];
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const auto difference = [&](std::size_t first, std::size_t of) {
      return (points[first].moment_Nm[of] - points[first + 1].moment_Nm[of]) / 2;
    };
    for (std::size_t of = 0; of < kAxes; ++of)
      s.moment_per_input[axis][of] = difference(1 + 2 * axis, of) / (kSmall * limits[axis]);
    s.authority_Nm[axis] = std::abs(difference(1 + 2 * kAxes + 2 * axis, axis));
  }
  s.hovers = true;
  return s;
}

}  // namespace flappy::design
