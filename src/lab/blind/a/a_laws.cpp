// The laws by themselves, as Family::law() states them: the nominal vehicle, magnitude 1, seed 1.
#include "lab/blind/a/a_laws.hpp"

#include "flappy/vehicle_file.hpp"
#include "io/installation.hpp"
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

std::array<double, kStrips> laws::twist_shape(const Strips& s) {
  std::array<double, kStrips> shape{};
  double beyond = 0;  // load from a strip's middle to the tip
  for (std::size_t i = kStrips; i-- > 0;) {
    const double own = square(s.chord_m[i] * s.r_m[i]);
    shape[i] = (beyond + 0.5 * own) / (s.chord_m[i] * s.chord_m[i] * s.chord_m[i]);
    beyond += own;
  }
  double twist = 0;
  for (double& x : shape) {
    const double slope = x;
    x = twist + 0.5 * slope;
    twist += slope;
  }
  for (double& x : shape) x /= twist;
  return shape;
}

namespace {

using Values = std::vector<double>;
using Arguments = std::span<const double>;

constexpr std::uint64_t kSeed = 1;

const model::Vehicle& nominal() {
  static const model::Vehicle v = model::read_vehicle(io::config_path("vehicles/hummingbird_nominal.toml"));
  return v;
}

Values values(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Linear between the middles of strips, straight to 0 at the shoulder.
double along_span(const std::array<double, kStrips>& shape, double share) {
  const double at = share * kStrips - 0.5;
  if (at <= 0) return shape[0] * share * 2 * kStrips;
  const auto i = std::min(static_cast<std::size_t>(at), kStrips - 2);
  return shape[i] + (at - static_cast<double>(i)) * (shape[i + 1] - shape[i]);
}

Values rotational_lift(Arguments at) {
  const model::Vehicle& v = nominal();
  const Strips s = cut_into_strips(v.left.planform);
  double force = 0;
  for (std::size_t i = 0; i < kStrips; ++i)
    force += laws::rotational_lift(v.air_density_kg_m3, s.chord_m[i], s.width_m, std::abs(at[1]) * s.r_m[i], at[2]);
  return {force};
}

Values added_mass(Arguments at) {
  Robot robot(nominal(), {}, {}, kSeed);
  RobotState x = robot.state();
  x.side[0].wing = {0, at[0], at[1], at[2]};
  robot.set_state(x);
  const auto moments = robot.added_mass_moments(0, at[3], at[4]);
  return {moments[0], moments[1]};
}

Values wake_capture(Arguments at) {
  constexpr double kBeat_Hz = 34;
  const auto rate = [&](double t_s) { return at[1] * sin_cos(2 * kPi * kBeat_Hz * t_s).sin; };
  laws::Wake wake;
  for (double t_s = -4 / kBeat_Hz; t_s < at[0]; t_s += kRobotStep_s) laws::wake_step(wake, rate(t_s), kRobotStep_s);
  // all strips meet the same share of their speed, so one of them stands for the wing
  const auto normal = [](double stroke_rad_s) {
    const double root = std::sqrt(0.5);
    const double sin = std::copysign(root, stroke_rad_s), cos = -sin;
    return wing_section(sin, cos).normal * stroke_rad_s * stroke_rad_s;
  };
  const double now = rate(at[0]);
  return {(normal(now + laws::wake_met(wake, now)) - normal(now)) / normal(at[1])};
}

Values wind(Arguments at) {
  // response to one unit of noise in a step of 1 ms
  constexpr double kStep_s = 1e-3;
  static const Values impulse = [] {
    Values h;
    laws::Gust g;
    for (int n = 0; n < 8000; ++n)
      h.push_back(laws::gust_step(g, n == 0 ? Vector3d::Ones() : Vector3d::Zero(), kStep_s).x());
    return h;
  }();
  double cosine = 0, sine = 0, whole = 0;
  for (std::size_t n = 0; n < impulse.size(); ++n) {
    const SinCos wave = sin_cos(2 * kPi * at[1] * kStep_s * static_cast<double>(n));
    cosine += impulse[n] * wave.cos, sine += impulse[n] * wave.sin, whole += impulse[n] * impulse[n];
  }
  return {laws::wind_profile(at[0]), 2 * kStep_s * (cosine * cosine + sine * sine) / whole};
}

Values winding_heating(Arguments at) {
  constexpr double kStep_s = 1e-3;
  laws::Heat heat;
  for (double t_s = 0; t_s < at[0]; t_s += kStep_s) laws::heat_step(heat, at[1] * kStep_s, kStep_s);
  return {laws::kCopper_1_K * heat.winding_K, laws::kMagnet_1_K * heat.magnet_K};
}

Values battery_sag(Arguments at) {
  constexpr double kStep_s = 1e-3;
  laws::Battery battery;
  double loss_V = 0;
  for (double t_s = 0; t_s < at[0]; t_s += kStep_s) loss_V = laws::sag_step(battery, at[1], kStep_s);
  return {loss_V};
}

Values driver_bandwidth(Arguments at) {
  laws::Filter filter;
  double volts = 0;
  for (double t_s = 0; t_s < at[0]; t_s += kRobotStep_s) volts = laws::filter_step(filter, 1, 10, kRobotStep_s);
  return {volts - 10};
}

Values command_delay(Arguments at) {
  Random random(kSeed, Purpose::delays, 0);
  double delay_s = 0;
  for (int n = 0; n <= static_cast<int>(at[0] + 0.5); ++n) delay_s = laws::packet_delay(random);
  return {delay_s};
}

Values stop_compliance(Arguments at) {
  const Stop stop = Robot(nominal(), {}, Magnitudes({{"stop_compliance", 1}}), kSeed).rotation_stop(0);
  const laws::StopForce f = laws::stop(stop.softness, at[0], stop.hard);
  return {std::max(f.stiffness_Nm_rad * at[0] + f.damping_Nm_s * at[1], 0.0)};
}

Values accelerometer_misalignment(Arguments at) {
  Random random(kSeed, Purpose::accelerometer);
  const Vector3d felt(at[0], at[1], at[2]);
  return values(laws::misalignment(random, 1) * felt - felt);
}

Values vibration_rectification(Arguments at) {
  constexpr int kPeriods = 12, kCounted = 4;
  laws::Element element;
  element.steady = Vector3d(0, 0, 9.81);
  const int steps = static_cast<int>(kPeriods / (at[1] * kRobotStep_s)), from = steps - steps * kCounted / kPeriods;
  double sum = 0;
  for (int n = 0; n < steps; ++n) {
    const double shaken = at[0] * sin_cos(2 * kPi * at[1] * n * kRobotStep_s).sin;
    const Vector3d added = laws::rectified(element, {0, 0, 9.81 + shaken}, Vector3d::Ones(), kRobotStep_s);
    if (n >= from) sum += added.z();
  }
  return {sum / std::max(1, steps - from)};
}

Values mocap_tilt(Arguments at) {
  Random random(kSeed, Purpose::level);
  const Vector3d place(at[0], at[1], at[2]);
  return values(laws::levelled(random, 1).place(place) - place);
}

Values marker_offset(Arguments at) {
  Random random(kSeed, Purpose::markers);
  const laws::Moved moved = laws::marker(random, 1);
  const Quaterniond attitude = turned_by({0, 0, at[2]}) * turned_by({0, at[1], 0}) * turned_by({at[0], 0, 0});
  const Quaterniond change = attitude * moved.turned * attitude.conjugate();  // in W
  const double sin = std::sqrt(change.vec().squaredNorm());
  Values all = values(attitude * moved.at_m);
  for (const double x : values(2 * angle_of(sin, change.w()) / sin * change.vec())) all.push_back(x);
  return all;
}

Values wing_flexibility(Arguments at) {
  static const std::array<double, kStrips> shape = laws::twist_shape(cut_into_strips(nominal().left.planform));
  return {laws::tip_twist(1, at[1]) * along_span(shape, at[0])};
}

}  // namespace

Values law_of(const std::string& effect, Arguments at) {
  if (effect == "ground_effect") return {laws::ground(at[0])};
  if (effect == "ceiling_effect") return {laws::ceiling(at[0])};
  if (effect == "wall_effect") {
    const model::Side& left = nominal().left;
    return {laws::wall_pull(at[0]),
            laws::wall_loss(at[0] - left.shoulder_m.y - kLiftStation * left.planform.wing_length_m)};
  }
  if (effect == "body_drag") return values(laws::body_drag({at[0], at[1], at[2]}, nominal().air_density_kg_m3));
  if (effect == "added_mass") return added_mass(at);
  if (effect == "rotational_lift") return rotational_lift(at);
  if (effect == "wake_capture") return wake_capture(at);
  if (effect == "clap_and_fling") return {laws::clap_and_fling(at[0], 0)};
  if (effect == "wing_flexibility") return wing_flexibility(at);
  if (effect == "wing_damage") return {laws::wear(1, at[0])};
  if (effect == "wind") return wind(at);
  if (effect == "spring_hardening") return {-laws::leaf_added(nominal().left.spring.stiffness_positive_Nm_rad, at[0])};
  if (effect == "gear_backlash") return {laws::gear_contact(laws::kGearGap_rad / 2, at[0], at[1]).torque_Nm};
  if (effect == "coulomb_friction") {
    const model::Motor& m = nominal().left.motor;
    return {m.gear_ratio * m.efficiency * laws::motor_friction(at[0])};
  }
  if (effect == "winding_heating") return winding_heating(at);
  if (effect == "battery_sag") return battery_sag(at);
  if (effect == "driver_dead_zone") return {laws::dead_time(at[1])};
  if (effect == "driver_bandwidth") return driver_bandwidth(at);
  if (effect == "command_delay") return command_delay(at);
  if (effect == "stop_compliance") return stop_compliance(at);
  if (effect == "gyro_bias") return {laws::gyro_warm(at[0]), laws::kGyroWalk_rad_s15 * std::sqrt(at[0])};
  if (effect == "accelerometer_misalignment") return accelerometer_misalignment(at);
  if (effect == "vibration_rectification") return vibration_rectification(at);
  if (effect == "mocap_tilt") return mocap_tilt(at);
  if (effect == "marker_offset") return marker_offset(at);
  if (effect == "mocap_delay") return {laws::mocap_delay(at[0])};
  if (effect == "tether") return values(laws::tether({at[0], at[1], at[2]}, 9.81));
  return {};
}

}  // namespace flappy::blind
