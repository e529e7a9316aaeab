#include "lab/blind/b/b_session.hpp"

#include <cmath>

namespace flappy::blind::b {
Vector3d any_way(Random& random, double longest) {
  const double up = random.uniform(-1, 1), heading = random.uniform(-kPi, kPi), length = random.uniform(0, longest);
  const double level = std::sqrt(1 - up * up);
  return length * Vector3d(level * std::cos(heading), level * std::sin(heading), up);
}

SessionChange draw_session(std::uint64_t seed, std::size_t session) {
  SessionChange c;
  Random random(seed, session, Stream::kSession);
  const auto within = [&](double bound) { return random.uniform(-bound, bound); };
  c.warmer_K = within(3);
  c.pressure = within(0.009);
  c.mass = within(0.004);
  const double reach = 0.16e-3 * std::sqrt(random.uniform()), way = within(kPi);
  c.com_m = {reach * std::cos(way), reach * std::sin(way), within(0.06e-3)};
  c.full_supply = within(0.0035);
  for (std::size_t j = 0; j < 2; ++j) {
    c.brush[j] = within(0.0035);
    c.wear[j] = within(0.09);
    c.grease[j] = within(0.05);
    c.rest_angle_rad[j] = within(0.2 * kDegree);
  }
  c.imu_turn_rad = any_way(random, 0.15 * kDegree);
  c.marker_turn_rad = any_way(random, 0.1 * kDegree);
  c.marker_m = any_way(random, 0.18e-3);
  c.mocap_late_s = within(0.4e-3);
  c.imu_late_s = within(0.1e-3);
  c.clamp_turn_rad = any_way(random, 0.1 * kDegree);
  c.clamp_m = any_way(random, 0.1e-3);
  PilotGains& g = c.gains;
  for (double* gain : {&g.position, &g.height, &g.velocity, &g.climb, &g.roll, &g.pitch, &g.yaw, &g.roll_rate,
                       &g.pitch_rate, &g.yaw_rate})
    *gain += within(0.04);
  return c;
}

void change(const SessionChange& by, RobotParameters& robot, SensorTruth& sensors) {
  constexpr double kRoom_K = 293;
  robot.density_kg_m3 *= (1 + by.pressure) / (1 + by.warmer_K / kRoom_K);
  robot.torso.mass_kg *= 1 + by.mass;
  robot.torso.inertia_kg_m2 *= 1 + by.mass;
  robot.torso.com_m += by.com_m;
  robot.full_supply *= 1 + by.full_supply;
  for (std::size_t j = 0; j < 2; ++j) {
    Motor& motor = robot.side[j].motor;
    motor.resistance_ohm *= (1 + kCopper_K * by.warmer_K) * (1 + by.brush[j]);
    motor.torque_constant_Nm_A *= 1 - kMagnet_K * by.warmer_K;
    motor.friction_Nm *= 1 + by.wear[j];
    motor.damping_Nm_s *= (1 - 0.02 * by.warmer_K) * (1 + by.grease[j]);
    robot.side[j].rest_angle_rad += by.rest_angle_rad[j];
  }
  sensors.imu_turn = turned(by.imu_turn_rad) * sensors.imu_turn;
  sensors.marker_turn = turned(by.marker_turn_rad);
  sensors.marker_m += by.marker_m;
  sensors.mocap_late_s += by.mocap_late_s;
  sensors.imu_late_s += by.imu_late_s;
}

void swap_wings(RobotParameters& robot, EffectMagnitudes& effects) {
  std::array<Side, 2>& side = robot.side;
  const auto swap = [&](const auto... member) { (std::swap(side[0].*member, side[1].*member), ...); };
  swap(&Side::edge, &Side::wing, &Side::rotation);
  swap(&Side::wing_length_m, &Side::mean_chord_m, &Side::lift, &Side::drag, &Side::turning_drag);
  const Matrix3d mirror = Vector3d(1, -1, 1).asDiagonal();
  for (Side& s : side)
    for (Link* link : {&s.edge, &s.wing}) {
      link->com_m = mirror * link->com_m;
      link->inertia_kg_m2 = mirror * link->inertia_kg_m2 * mirror;
    }
  effects.damaged_side = 1 - effects.damaged_side;
  effects.torn_side = 1 - effects.torn_side;
  std::swap(effects.creep_sign[0], effects.creep_sign[1]);
}

void add_weight(double mass_kg, const Vector3d& at, Link& link) {
  const Matrix3d I = Matrix3d::Identity();
  const auto point = [&](double m, const Vector3d& d) { return Matrix3d(m * (d.dot(d) * I - d * d.transpose())); };
  const Vector3d before = link.com_m, com = (link.mass_kg * before + mass_kg * at) / (link.mass_kg + mass_kg);
  link.inertia_kg_m2 += point(link.mass_kg, before - com) + point(mass_kg, at - com);
  link.com_m = com;
  link.mass_kg += mass_kg;
}

}  // namespace flappy::blind::b
