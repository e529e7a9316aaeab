#include "lab/blind/c/c_session.hpp"

#include "lab/blind/c/c_drive.hpp"

namespace flappy::blind::c {
namespace {

/// Evenly distributed in a ball; rms of each coordinate: radius over the root of five.
Eigen::Vector3d in_ball(Random& random, double radius) {
  const double share = std::cbrt(random.uniform());
  return radius * share * random.direction();
}

}  // namespace

// For each change: its reason, its rms, and the effect of magnitude 0.2 that its bound stays below.
SessionChange session_change(const Assignment& a) {
  SessionChange day;
  if (a.session == 0) return day;
  Random random(a.seed, "session", a.session);
  const auto within = [&](double bound) { return random.uniform(-bound, bound); };
  // A heated room. Its warmth also drives the windings and the grease.
  const double room_K = within(2);
  // Weather moves the pressure by up to 12 hPa: 0.8 %. Ground effect 0.2: 2.3 %.
  day.air = (1 + within(0.012)) / (1 + room_K / 293);
  // The charger's cut-off, and the rest since charging: 0.4 %. Dead zone 0.2: 0.09 V of 10 V.
  day.supply = 1 + within(0.007);
  // Time since the last flight, alike for both motors but for their cooling: 0.9 %. Winding heating 0.2: 3 %.
  const double rest_K = within(3.5);
  for (std::size_t side = 0; side < 2; ++side) {
    day.winding[side] = 1 + kCopper_1_K * (room_K + rest_K + within(1));
    // Wear and new grease: 4 %. Warm grease is thinner, so damping varies by 4 %. Coulomb friction 0.2: 32 %.
    const double wear = 0.04 * random.cut_normal();
    day.friction[side] = 1 + wear;
    day.damping[side] = 1 + wear - 0.015 * room_K;
    // The spring's clamp is tightened by hand: 0.2 deg. Spring creep 0.2: 0.4 deg.
    day.rest_rad[side] = within(0.35) * kDegree;
  }
  // The battery, 0.3 of the torso, is put back into a tray longer than wide. It moves the robot's centre of mass by 0.07
  // and 0.05 mm, and a product of inertia by 0.2 % of Ixx; more or less tape weighs 0.02 g. Centre of mass 0.2: 0.17 mm
  // level; inertia products 0.2: 1.1 %; tether 0.2: 0.03 g.
  day.battery_m.x() = within(0.46e-3);
  day.battery_m.y() = within(0.31e-3);
  day.battery_m.z() = within(0.3e-3);
  day.tape_kg = within(0.03e-3);
  // The IMU is pressed down anew: 0.06 deg about each axis. Accelerometer misalignment 0.2: 0.16 deg, and across the axes.
  day.imu_turn_rad = in_ball(random, 0.13 * kDegree);
  // A gyro's bias differs each time it is switched on: 0.0019 rad/s. Gyro bias 0.2: 0.0047 rad/s.
  day.gyro_bias_rad_s = in_ball(random, 4.2e-3);
  // The markers are glued on anew: 0.11 mm, 0.045 deg. Marker offset 0.2: 0.27 mm; mocap tilt 0.2: 0.25 deg at 1 m.
  day.markers_m = in_ball(random, 0.25e-3);
  day.markers_turn_rad = in_ball(random, 0.1 * kDegree);
  // Clocks are matched anew at each start: 0.06 and 0.17 ms. Mocap delay 0.2: 0.5 ms and more.
  day.imu_late_s = within(0.1e-3);
  day.mocap_late_s = within(0.3e-3);
  // Somebody turned the pilot's gains: 2 % each. No effect is like it.
  for (double& gain : day.gains) gain = 1 + within(0.035);
  return day;
}

std::uint64_t stream_of(const Assignment& a, std::size_t flight) {
  return (static_cast<std::uint64_t>(a.session) << 32U) + flight;
}

std::uint64_t programme_stream_of(const Assignment& a, std::size_t flight) {
  return (static_cast<std::uint64_t>(a.programme_of.value_or(a.session)) << 32U) + flight;
}

}  // namespace flappy::blind::c
