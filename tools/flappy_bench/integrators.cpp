// The integrators our step was chosen from, on the same equations of motion, in double:
//   old rates  the same leapfrog, but terms that depend on rates use the rates at the start of the step
//   midpoint   Runge-Kutta of order 2, two evaluations a step
//   RK4        the classical one, four evaluations a step
// Within a Runge-Kutta step, a hinge that its stop holds at the start stays there; the other hinges have no stop. After the step, a hinge
// beyond its stop is put back, and its rate is removed by an impulse that also acts on the coupled bodies. An impact is therefore up to a
// step late, which hides the order of the integrator. Dry friction is that of an infinitesimal step.
#include <cmath>
#include <cstdlib>
#include <functional>

#include "accuracy.hpp"
#include "model/derive.hpp"
#include "sim/physics_step.hpp"

namespace flappy::bench {
namespace {

using namespace model;
using V = Vec3<double>;

constexpr double kInstant_s = 1e-9;
constexpr double kGravity_m_s2 = 9.81;
constexpr double kOutOfReach_rad = 1e3;

/// State with the centre of mass as position, so that all its parts are integrated alike.
struct Flapper {
  V com_m, com_velocity, body_rate;
  Quaternion<double> q;
  double angle[4], rate[4];  // psi left, right, theta left, right
};

/// Time derivative of a Flapper, which Runge-Kutta steps add up.
struct Rates {
  V com_m, com_velocity, body_rate;
  Quaternion<double> q;
  double angle[4], rate[4];
};

State<double> state_of(const Flapper& f) {
  State<double> x{};
  x.attitude = f.q;
  x.com_velocity_m_s = f.com_velocity;
  x.body_rate_rad_s = f.body_rate;
  x.left = {f.angle[0], f.angle[2], f.rate[0], f.rate[2], f.rate[0], f.rate[2]};
  x.right = {f.angle[1], f.angle[3], f.rate[1], f.rate[3], f.rate[1], f.rate[3]};
  return x;
}

struct Result {
  Motion<double> motion;
  V com_acceleration;
};

Result evaluate(const Parameters<double>& p, const Flapper& f, double volts, double step_s) {
  const State<double> x = state_of(f);
  const Matrix3<double> R = rotation_matrix(f.q);
  const Sides<WingPose<double>> pose{place_wing<+1>(p.left, x.left, f.body_rate),
                                     place_wing<-1>(p.right, x.right, f.body_rate)};
  const auto whole = whole_vehicle(p, pose);
  const V v = transpose_times(R, f.com_velocity) - whole.com_rate;
  const auto air_l = sim::air_on_wing<+1>(p.left, pose.left, v + cross(f.body_rate, whole.arm_left));
  const auto air_r = sim::air_on_wing<-1>(p.right, pose.right, v + cross(f.body_rate, whole.arm_right));
  const Sides<SideLoad<double>> load{
      sim::load_side<+1>(p.left, x.left, x.left.rotation_rate_rad_s, air_l, volts, step_s),
      sim::load_side<-1>(p.right, x.right, x.right.rotation_rate_rad_s, air_r, volts, step_s)};
  const Sides<WingInertia<double>> wing{wing_inertia(p.left, pose.left), wing_inertia(p.right, pose.right)};
  const auto inertia = body_inertia(p, x, pose, wing, whole);
  const auto drive = drive_body(p, x, pose, wing, whole, inertia, load, BodyLoad<double>{{0, 0, 0}, {0, 0, 0}}, R.row_z,
                                kGravity_m_s2);
  const auto hinges = eliminate_body(p, pose, wing, whole, inertia, drive, load);
  return {move(p, x, inertia, drive, hinges, step_s, 1 / step_s),
          p.inverse_mass_1_kg * (R * drive.force) - V{0, 0, kGravity_m_s2}};
}

/// Hinge rates (psi, theta) after a motion over `step_s`.
void hinge_rates(const Motion<double>& m, double step_s, double (&rate)[4]) {
  rate[0] = m.stroke_left / step_s, rate[1] = -m.stroke_right / step_s;
  rate[2] = m.rotation_left / step_s, rate[3] = m.rotation_right / step_s;
}

void leapfrog(const Parameters<double>& p, Flapper& f, double volts, double step) {
  const Result e = evaluate(p, f, volts, step);
  f.com_velocity = f.com_velocity + step * e.com_acceleration;
  f.body_rate = f.body_rate + step * e.motion.body_acceleration;
  hinge_rates(e.motion, step, f.rate);
  for (int i = 0; i < 4; ++i) f.angle[i] += step * f.rate[i];
  f.com_m = f.com_m + step * f.com_velocity;
  f.q = rotated(f.q, step / 2 * f.body_rate);
}

Rates rates(const Parameters<double>& p, const Flapper& f, double volts) {
  const Result e = evaluate(p, f, volts, kInstant_s);
  const V& w = f.body_rate;
  Rates d{f.com_velocity,
          e.com_acceleration,
          e.motion.body_acceleration,
          {-0.5 * (f.q.x * w.x + f.q.y * w.y + f.q.z * w.z), 0.5 * (f.q.w * w.x + f.q.y * w.z - f.q.z * w.y),
           0.5 * (f.q.w * w.y + f.q.z * w.x - f.q.x * w.z), 0.5 * (f.q.w * w.z + f.q.x * w.y - f.q.y * w.x)},
          {},
          {}};
  double next[4];
  hinge_rates(e.motion, kInstant_s, next);
  for (int i = 0; i < 4; ++i) d.angle[i] = f.rate[i], d.rate[i] = (next[i] - f.rate[i]) / kInstant_s;
  return d;
}

Flapper plus(Flapper f, double step, const Rates& d) {
  f.com_m = f.com_m + step * d.com_m;
  f.com_velocity = f.com_velocity + step * d.com_velocity;
  f.body_rate = f.body_rate + step * d.body_rate;
  f.q = {f.q.w + step * d.q.w, f.q.x + step * d.q.x, f.q.y + step * d.q.y, f.q.z + step * d.q.z};
  for (int i = 0; i < 4; ++i) f.angle[i] += step * d.angle[i], f.rate[i] += step * d.rate[i];
  return f;
}

struct Stops {
  double low[4], high[4];  // psi left, right, theta left, right
};

Stops stops_of(const Parameters<double>& p) {
  return {{p.left.stroke_lower_rad, p.right.stroke_lower_rad, p.left.rotation_lower_rad, p.right.rotation_lower_rad},
          {p.left.stroke_upper_rad, p.right.stroke_upper_rad, p.left.rotation_upper_rad, p.right.rotation_upper_rad}};
}

Parameters<double> with_stops(Parameters<double> p, const Stops& s) {
  p.left.stroke_lower_rad = s.low[0], p.right.stroke_lower_rad = s.low[1];
  p.left.rotation_lower_rad = s.low[2], p.right.rotation_lower_rad = s.low[3];
  p.left.stroke_upper_rad = s.high[0], p.right.stroke_upper_rad = s.high[1];
  p.left.rotation_upper_rad = s.high[2], p.right.rotation_upper_rad = s.high[3];
  return p;
}

/// Parameters for the stages of one step: stops are closed on the hinges that they hold, and out of reach for the others, because an
/// infinitesimal step would at once push back a stage beyond its stop.
Parameters<double> within_step(const Parameters<double>& p, const Flapper& f, double volts) {
  Stops s = stops_of(p);
  double next[4];
  hinge_rates(evaluate(p, f, volts, kInstant_s).motion, kInstant_s, next);
  for (int i = 0; i < 4; ++i) {
    const bool held = (f.angle[i] == s.low[i] || f.angle[i] == s.high[i]) && next[i] == 0;
    s.low[i] = held ? f.angle[i] : -kOutOfReach_rad;
    s.high[i] = held ? f.angle[i] : kOutOfReach_rad;
  }
  return with_stops(p, s);
}

/// Puts hinges back on their stops, with the impulse that removes their rate.
void stop_hinges(const Parameters<double>& p, Flapper& f, double volts) {
  const Stops s = stops_of(p);
  bool hit = false;
  for (int i = 0; i < 4; ++i) {
    hit = hit || f.angle[i] < s.low[i] || f.angle[i] > s.high[i];
    f.angle[i] = clamp(f.angle[i], s.low[i], s.high[i]);
  }
  if (!hit) return;
  const Result e = evaluate(p, f, volts, kInstant_s);
  f.body_rate = f.body_rate + kInstant_s * e.motion.body_acceleration;
  hinge_rates(e.motion, kInstant_s, f.rate);
}

void midpoint(const Parameters<double>& p, Flapper& f, double volts, double step) {
  const Parameters<double> stage = within_step(p, f, volts);
  f = plus(f, step, rates(stage, plus(f, step / 2, rates(stage, f, volts)), volts));
  stop_hinges(p, f, volts);
}

void runge_kutta_4(const Parameters<double>& p, Flapper& f, double volts, double step) {
  const Parameters<double> stage = within_step(p, f, volts);
  const Rates a = rates(stage, f, volts);
  const Rates b = rates(stage, plus(f, step / 2, a), volts);
  const Rates c = rates(stage, plus(f, step / 2, b), volts);
  const Rates d = rates(stage, plus(f, step, c), volts);
  f = plus(plus(plus(plus(f, step / 6, a), step / 3, b), step / 3, c), step / 6, d);
  stop_hinges(p, f, volts);
}

using Integrator = std::function<void(const Parameters<double>&, Flapper&, double, double)>;

Flight fly(const model::Vehicle& vehicle, const Integrator& integrate, const Parameters<double>& p, double step_s) {
  Flapper f{};
  f.q.w = 1;
  f.com_m = centre_of_mass(p, state_of(f));
  const int per_hold = static_cast<int>(std::lround(vehicle.driver.hold_s / step_s));
  double volts = 0;
  for (int i = 0; i < static_cast<int>(std::lround(0.3 / step_s)); ++i) {
    if (i % per_hold == 0) {
      const double beats =
          vehicle.driver.flapping_Hz * vehicle.driver.hold_s * static_cast<double>(std::div(i, per_hold).quot);
      volts =
          wing_beat_voltage<+1>(WingBeat<double>{10, 0, 0, 0}, beats - std::floor(beats + 0.5), p.left.voltage_limit_V);
    }
    integrate(p, f, volts, step_s);
    const double norm = std::sqrt(f.q.w * f.q.w + f.q.x * f.q.x + f.q.y * f.q.y + f.q.z * f.q.z);
    f.q = {f.q.w / norm, f.q.x / norm, f.q.y / norm, f.q.z / norm};
  }
  const V torso =
      f.com_m + rotation_matrix(f.q) * (V{vehicle.torso.com_m.x, vehicle.torso.com_m.y, vehicle.torso.com_m.z} -
                                        centre_of_mass(p, state_of(f)));
  return {torso.x, torso.y, torso.z, {f.q.w, f.q.x, f.q.y, f.q.z}};
}

}  // namespace

std::vector<IntegratorRow> integrator_study(const model::Vehicle& vehicle) {
  struct Candidate {
    const char* name;
    Integrator integrate;  // null: our step itself
    bool implicit_damping;
    int evaluations;
  };
  const Candidate candidates[] = {{"ours", nullptr, true, 1},
                                  {"old rates", leapfrog, true, 1},
                                  {"midpoint", midpoint, false, 2},
                                  {"RK4", runge_kutta_4, false, 4}};
  const Flight exact = free_flight(vehicle, 1e-6);
  std::vector<IntegratorRow> rows;
  for (const Candidate& c : candidates)
    for (const double us : {500, 200, 100, 50, 20, 10}) {
      const double step_s = us * 1e-6;
      const Flight flight = c.integrate
                                ? fly(vehicle, c.integrate, derive(vehicle, c.implicit_damping ? step_s : 0), step_s)
                                : free_flight(vehicle, step_s);
      rows.push_back({c.name, step_s, static_cast<int>(std::lround(0.3 / step_s)) * c.evaluations,
                      distance_m(flight, exact), turn_rad(flight, exact)});
    }
  return rows;
}

}  // namespace flappy::bench
