#include "lab/blind/b/b_air.hpp"

#include <algorithm>
#include <cmath>

#include "lab/blind/b/b_laws.hpp"

namespace flappy::blind::b {
namespace {

constexpr double kCentroid = 0.46, kGyration = 0.53;
constexpr std::array<double, 2> kA = {0.165, 0.335}, kB = {0.0455, 0.3};

/// Chord over the mean chord at the share x of the span.
double beta_chord(double x) {
  const double variance = kGyration * kGyration - kCentroid * kCentroid;
  const double n = kCentroid * (1 - kCentroid) / variance - 1;
  const double p = kCentroid * n, q = (1 - kCentroid) * n;
  const double whole = std::exp(std::lgamma(p) + std::lgamma(q) - std::lgamma(p + q));
  return std::pow(x, p - 1) * std::pow(1 - x, q - 1) / whole;
}

}  // namespace

// By symmetry lift is zero at 0 and 90 degrees, but the fits are not quite: two factors correct this.
double lift_coefficient(double alpha) {
  const double fit = 0.225 + 1.58 * std::sin(2.13 * alpha - 7.2 * kDegree);
  return fit * std::tanh(alpha / (3 * kDegree)) * std::tanh((kPi / 2 - alpha) / (6 * kDegree));
}

double WingAir::bend_share(double x) {
  // of the density x^(p-1) (1-x)^(q-1), whose largest value is at (p - 1) / (p + q - 2)
  const double n = kCentroid * (1 - kCentroid) / (kGyration * kGyration - kCentroid * kCentroid) - 1;
  const double p = kCentroid * n, q = (1 - kCentroid) * n;
  const double share = beta_chord(std::clamp(x, 1e-6, 1 - 1e-6)) / beta_chord((p - 1) / (p + q - 2));
  return share * share * share;
}

double drag_coefficient(double alpha) { return 1.92 - 1.55 * std::cos(2.04 * alpha - 9.82 * kDegree); }

Polar::Polar(double lift, double drag) {
  for (int i = 0; i <= kCells; ++i) {
    const double share = static_cast<double>(i) / kCells;
    const double alpha = std::atan2(share, 1 - share);
    const double cl = kScale * lift * lift_coefficient(alpha), cd = drag * drag_coefficient(alpha);
    const double sine = std::sin(alpha), cosine = std::cos(alpha);
    row[static_cast<std::size_t>(i)] = {cl * cosine + cd * sine, cl * sine - cd * cosine, cl,
                                        0.82 * alpha / kPi + 0.05};
  }
}

WingAir::WingAir(const RobotParameters& parameters, const EffectMagnitudes& effect_magnitudes, std::size_t side)
    : polar_(parameters.side[side].lift, parameters.side[side].drag),
      sign_(side == 0 ? 1 : -1),
      length_(parameters.side[side].wing_length_m),
      density_(parameters.density_kg_m3),
      added_(Eigen::Matrix3d::Zero()) {
  const Side& s = parameters.side[side];
  const double worn = effect_magnitudes.damaged_side == static_cast<int>(side) ? effect_magnitudes[kWingDamage] : 0;
  flap_ = effect_magnitudes.torn_side == static_cast<int>(side) ? effect_magnitudes[kTornFlap] : 0;
  flap_side_ = effect_magnitudes.flap_opens;
  const double width = length_ / kStrips;
  reference_r_ = kGyration * length_;
  reference_chord_ = s.mean_chord_m * beta_chord(kGyration);
  turning_force_ = turning_torque_ = 0;
  const double turning = 0.5 * density_ * s.turning_drag * drag_coefficient(kPi / 2);
  double area = 0;
  for (std::size_t i = 0; i < kStrips; ++i) {
    Strip& strip = strips_[i];
    strip.r = (static_cast<double>(i) + 0.5) * width;
    strip.chord = s.mean_chord_m * beta_chord(strip.r / length_);
    area += strip.chord * width;
  }
  // Few strips miss some area, so chords are stretched to give the file's.
  const double stretch = length_ * s.mean_chord_m / area;
  for (std::size_t i = 0; i < kStrips; ++i) {
    Strip& strip = strips_[i];
    strip.chord *= stretch;
    const double station = strip.r / length_;
    strip.chord *= std::max(0.1, 1 - worn * worn_share(station));
    strip.bend = bend_share(station);
    strip.flap = station > kFlapFrom && station < kFlapTo ? 1 : 0;
    const double c = strip.chord;
    strip.pressure = 0.5 * density_ * c * width;
    strip.share = strip.r / reference_r_;
    turning_force_ += turning * c * c * c / 3 * width;
    turning_torque_ += turning * c * c * c * c / 4 * width;
    if (effect_magnitudes.any(kAddedMass)) {
      const double mass = kPi / 4 * density_ * c * c * width * effect_magnitudes[kAddedMass];
      const Vector3d w(-c / 2, -sign_ * strip.r, 1);
      added_ += mass * w * w.transpose();
      added_(0, 0) += kPi / 128 * density_ * c * c * c * c * width * effect_magnitudes[kAddedMass];
    }
  }
  rotational_lift_ = effect_magnitudes[kRotationalLift] * 2 * s.lift;
  twists_ = effect_magnitudes.any(kWingFlexibility);
  bends_ = effect_magnitudes.any(kEdgeBending);
}

double WingAir::area_m2() const {
  double area = 0;
  for (const Strip& s : strips_) area += 2 * s.pressure / density_;
  return area;
}

double WingAir::circulation_of(double x, double z) const {
  const double share = std::abs(x) / (std::abs(x) + std::abs(z) + 1e-9);
  return (x * z > 0 ? -1.0 : 1.0) * std::sqrt(x * x + z * z) * polar_.at(share).lift;
}

std::array<double, 2> WingAir::settled(const Flow& flow) const {
  const double x = flow.shoulder_m_s.x() - flow.rate_rad_s.z() * sign_ * reference_r_;
  const double z = flow.shoulder_m_s.z() + flow.rate_rad_s.x() * sign_ * reference_r_;
  return {kA[0] * circulation_of(x, z), kA[1] * circulation_of(x, z)};
}

WingAir::Load WingAir::load(const Flow& flow) const {
  Load out;
  // The wake rotates about the stroke axis: sign z of the leading edge's frame, here in the wing's frame.
  const Vector3d rate = flow.rate_rad_s - flow.wake_rad_s * sign_ * Vector3d(-flow.sin_rotation, 0, flow.cos_rotation);
  const auto at = [&](double r) {
    return std::pair{flow.shoulder_m_s.x() - rate.z() * sign_ * r, flow.shoulder_m_s.z() + rate.x() * sign_ * r};
  };

  const auto [rx, rz] = at(reference_r_);
  const double speed = std::sqrt(rx * rx + rz * rz);
  const double circulation = circulation_of(rx, rz);
  double deficit = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    deficit += kA[i] * circulation - flow.lag[i];
    out.lag_rate[i] = 2 * speed / reference_chord_ * kB[i] * (kA[i] * circulation - flow.lag[i]);
  }

  double fx = 0, fz = 0, tx = 0, ty = 0, tz = 0;
  for (const Strip& s : strips_) {
    auto [ux, uz] = at(s.r);
    if (bends_) {
      const double v = flow.bending_rate_rad_s * s.r * s.r / length_;
      ux += v * flow.cos_rotation;
      uz += v * flow.sin_rotation;
    }
    double turn_cosine = 1, turn_sine = 0;
    if (twists_) {
      const double turn = flow.bend_rad * s.bend;
      turn_cosine = std::cos(turn);
      turn_sine = std::sin(turn);
      const double x = turn_cosine * ux - turn_sine * uz;
      uz = turn_sine * ux + turn_cosine * uz;
      ux = x;
    }
    const double ax = std::abs(ux), az = std::abs(uz);
    const Polar::Row c = polar_.at(ax / (ax + az + 1e-9));
    const double square = ux * ux + uz * uz;
    const double behind = s.chord * (uz >= 0 ? c.centre : 0.92 - c.centre);
    double x = (ux > 0 ? -c.normal : c.normal) * square - deficit * s.share * uz;
    double z = (uz > 0 ? c.chordwise : -c.chordwise) * square + deficit * s.share * ux;
    const double pressure =
        flap_ != 0 && s.flap != 0 ? s.pressure * std::max(0.0, 1 - flap_ * flap_share(flap_side_ * ux)) : s.pressure;
    x *= pressure;
    z *= pressure;
    if (rotational_lift_ != 0) {
      // The measured coefficient falls with the angular velocity [2].
      const double u = std::sqrt(square);
      const double reduced = std::abs(flow.rotation_rate_rad_s) * s.chord / (u + 0.5);
      const double forward = u * uz / (az + 0.3);  // positive if the leading edge leads
      x += rotational_lift_ * turning_coefficient(reduced) * pressure * s.chord * flow.rotation_rate_rad_s * forward;
    }
    double force_x = x, force_z = z;
    if (twists_) {
      force_x = turn_cosine * x + turn_sine * z;
      force_z = -turn_sine * x + turn_cosine * z;
    }
    fx += force_x;
    fz += force_z;
    tx += s.r * force_z;
    ty -= behind * x;
    tz -= s.r * force_x;
  }
  const double w = flow.rate_rad_s.y();
  fx += turning_force_ * w * std::abs(w);
  ty -= turning_torque_ * w * std::abs(w);
  tz -= 0.5 * length_ * turning_force_ * w * std::abs(w);
  out.force_N = Vector3d(fx, 0, fz) * flow.gain;
  out.torque_Nm = Vector3d(sign_ * tx, ty, sign_ * tz) * flow.gain;
  return out;
}

}  // namespace flappy::blind::b
