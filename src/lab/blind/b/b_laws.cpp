#include "lab/blind/b/b_laws.hpp"

#include "lab/blind/b/b_effects.hpp"
#include "lab/blind/b/b_sensors.hpp"
#include "lab/blind/b/plant.hpp"

namespace flappy::blind::b {
namespace {

constexpr std::uint64_t kSeed = 1;  ///< of random directions and draws

const EffectMagnitudes& drawn() {
  static const EffectMagnitudes a = effect_magnitudes_of({}, kSeed);
  return a;
}

const Plant& nominal(std::size_t effect) {
  static const std::vector<Plant> all = [] {
    std::vector<Plant> plants;
    for (std::size_t i = 0; i <= kEffects; ++i) {
      EffectMagnitudes a = drawn();
      if (i < kEffects) a.magnitude[i] = 1;
      plants.emplace_back(nominal_parameters(), a);
    }
    return plants;
  }();
  return all[effect];
}

using Outcome = std::vector<double>;
Outcome listed(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Of the left wing of a torso at rest, in steady circulation.
WingAir::Flow flow_of(double rotation, double stroke_rate, double rotation_rate) {
  WingAir::Flow flow;
  flow.shoulder_m_s.setZero();
  flow.sin_rotation = std::sin(rotation);
  flow.cos_rotation = std::cos(rotation);
  flow.rate_rad_s = Vector3d(-flow.sin_rotation * stroke_rate, rotation_rate, flow.cos_rotation * stroke_rate);
  flow.rotation_rate_rad_s = rotation_rate;
  flow.lag = nominal(kEffects).wing(0).settled(flow);
  return flow;
}

double normal_force(std::size_t with, const WingAir::Flow& flow) {
  return nominal(with).wing(0).load(flow).force_N.x();
}

Outcome wake(double time, double peak) {
  const RobotParameters& f = nominal(kEffects).parameters();
  const double w = 2 * kPi * f.flapping_Hz;
  const auto rate_at = [&](double t) { return peak * std::sin(w * t); };
  const auto flow_at = [&](double t) { return flow_of(kPi / 4, rate_at(t), 0); };
  // the wake after a harmonic stroke that began some beats ago
  const double begins = -4 / f.flapping_Hz, h = 1e-5;
  double wake = 0;
  for (long step = 0, steps = std::lround((time - begins) / h); step < steps; ++step)
    wake += h * wake_rate(rate_at(begins + (static_cast<double>(step) + 0.5) * h), wake);
  WingAir::Flow flow = flow_at(time);
  const double without = normal_force(kEffects, flow);
  flow.wake_rad_s = kWakeShare * wake;
  const double most = std::abs(normal_force(kEffects, flow_at(0.25 / f.flapping_Hz)));
  return {(normal_force(kEffects, flow) - without) / most};
}

double rectifies(double amplitude, double frequency_hz) {
  const double bandwidth_hz = SensorTruth{}.bandwidth_hz, h = 5e-5;
  Vector3d y(0, 0, kGravity_m_s2);
  double sum = 0;
  // 0.1 s to settle, then whole periods
  const long settle = 2000, count = std::lround(std::ceil(0.2 * frequency_hz) / frequency_hz / h);
  for (long i = 0; i < settle + count; ++i) {
    const double wave = std::sin(2 * kPi * frequency_hz * h * static_cast<double>(i));
    y = low_pass(y, Vector3d(0, 0, kGravity_m_s2 + amplitude * wave), bandwidth_hz, h);
    if (i >= settle) sum += rectified(y, 1).z();
  }
  return sum / static_cast<double>(count);
}

Outcome markers(std::span<const double> at) {
  const Misfit fit = misfit(drawn().marker, drawn().marker_m);
  const Eigen::Quaterniond attitude = Eigen::AngleAxisd(at[2], Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(at[1], Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(at[0], Vector3d::UnitX());
  const Vector3d shift = attitude * fit.shift_m, turn = attitude * fit.turn_rad;
  return {shift.x(), shift.y(), shift.z(), turn.x(), turn.y(), turn.z()};
}

std::size_t arguments(std::size_t effect) {
  switch (effect) {
    case kGroundEffect:
    case kCeilingEffect:
    case kWallEffect:
    case kClapAndFling:
    case kWingDamage:
    case kSpringHardening:
    case kCoulombFriction:
    case kDriverBandwidth:
    case kCommandDelay:
    case kGyroBias:
    case kMocapDelay:
      return 1;
    case kWakeCapture:
    case kWingFlexibility:
    case kWind:
    case kGearBacklash:
    case kWindingHeating:
    case kBatterySag:
    case kDriverDeadZone:
    case kStopCompliance:
    case kVibrationRectification:
      return 2;
    case kBodyDrag:
    case kRotationalLift:
    case kAccelerometerMisalignment:
    case kMocapTilt:
    case kMarkerOffset:
    case kTether:
      return 3;
    case kAddedMass:
      return 5;
    default:
      return 0;
  }
}

}  // namespace

std::vector<double> law_of(const std::string& id, std::span<const double> at) {
  const std::size_t effect = effect_number(id);
  if (arguments(effect) == 0 || at.size() < arguments(effect)) return {};
  const RobotParameters& f = nominal(kEffects).parameters();
  const Side& left = f.side[0];
  switch (effect) {
    case kGroundEffect:
      return {ground_share(at[0])};
    case kCeilingEffect:
      return {ceiling_share(at[0])};
    case kWallEffect:
      return {wall_pull(at[0] - f.around_m), wall_loss(at[0] - left.shoulder_m.y() - left.wing_length_m)};
    case kBodyDrag:
      return listed(body_drag_N({at[0], at[1], at[2]}, f.density_kg_m3));
    case kAddedMass: {
      State x{};
      x[kQuaternion] = 1;
      x[kRotation] = at[0], x[kStrokeRate] = at[1], x[kRotationRate] = at[2];
      const auto [stroke, rotation] = nominal(kAddedMass).added_moments(0, x, at[3], at[4]);
      return {stroke, rotation};
    }
    case kRotationalLift: {
      const WingAir::Flow flow = flow_of(at[0], at[1], at[2]);
      return {normal_force(kRotationalLift, flow) - normal_force(kEffects, flow)};
    }
    case kWakeCapture:
      return wake(at[0], at[1]);
    case kClapAndFling:
      // both wings part at 150 rad/s from a sum of pi less the gap
      return {clap_share(at[0], -(kPi - at[0]) * 300)};
    case kWingFlexibility:
      return {WingAir::bend_share(at[0]) * bend_angle(at[1])};
    case kWingDamage:
      return {worn_share(at[0])};
    case kWind:
      return {wind_profile(at[0]), gust_density(at[1], 0)};
    case kSpringHardening:
      return {-left.stiffness_positive_Nm_rad * hardening(at[0], 1)};
    case kGearBacklash:
      return {backlash_torque(at[0], at[1], 1)};
    case kCoulombFriction: {
      // bristles in steady sliding: their rate is 0
      const double z = at[0] == 0 ? 0 : std::copysign(bristle_strength(at[0]), at[0]);
      return {bristle_torque(z, 1)};
    }
    case kWindingHeating: {
      Heat heat;
      for (double t = 0.5e-3; t < at[0]; t += kTick_s) heat.take(at[1] * kTick_s, kTick_s);
      return {heat.resistance(1), heat.torque_constant(1)};
    }
    case kBatterySag: {
      Sag sag;
      for (double t = 0.5e-3; t < at[0]; t += kTick_s) sag.take(at[1], kTick_s);
      return {sag.loss_V(1)};
    }
    case kDriverDeadZone:
      return {dead_time_V(at[0], 1)};
    case kDriverBandwidth: {
      constexpr double kStepTo_V = 10;
      RunningMean mean;
      double now = 0;
      const long steps = 200;
      for (long i = 0; i < steps && at[0] > 0; ++i) now = mean.take(kStepTo_V, at[0] / steps, kMean_s);
      return {now - kStepTo_V};
    }
    case kCommandDelay:
      return {command_delay_s(std::lround(std::floor(at[0])), 1)};
    case kStopCompliance:
      return {pad_torque(kRotationStop, at[0], at[1], 1)};
    case kGyroBias:
      return {gyro_warm_up(at[0]), kGyroWanders_rad_s * std::sqrt(1 - std::pow(gyro_keeps(at[0]), 2))};
    case kAccelerometerMisalignment: {
      const Vector3d force(at[0], at[1], at[2]);
      return listed(skewed(force, drawn().skew) - force);
    }
    case kVibrationRectification:
      return {rectifies(at[0], at[1])};
    case kMocapTilt: {
      const double way = drawn().mocap_tilt_direction_rad;
      const Vector3d place(at[0], at[1], at[2]);
      const Eigen::Quaterniond tilt(Eigen::AngleAxisd(kTilt_rad, Vector3d(std::cos(way), std::sin(way), 0)));
      return listed(misplaced(place, tilt, kWand * drawn().mocap_scale_sign) - place);
    }
    case kMarkerOffset:
      return markers(at);
    case kMocapDelay:
      return {drawn().delay_sign * clock_late_s(at[0], 1)};
    case kTether:
      return listed(tether_N(at[0], at[1], at[2], kGravity_m_s2));
    default:
      return {};
  }
}

}  // namespace flappy::blind::b
