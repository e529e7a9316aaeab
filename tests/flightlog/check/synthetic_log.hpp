// Logs of a known smooth motion, with noise, bias, latency, jitter and the shaking of the wing beat: made without the
// simulator, so that a mistake of its conventions cannot hide.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

struct SyntheticMotion {
  double duration_s = 20, rotation = 1, translation = 1;  ///< sizes
  double yaw_offset_rad = 0, shake_rad = 0.01, coning_rad = 0, arm_m = 0.004;
  std::uint64_t seed = 1;
};

class Synthesis {
 public:
  explicit Synthesis(const SyntheticMotion& motion) : motion_(motion), random_(motion.seed) {
    for (auto& axis : angles_) draw(axis, 0.3, 1.5);
    for (auto& axis : places_) draw(axis, 0.1, 0.6);
  }

  flightlog::FlightLog log() {
    flightlog::FlightLog log;
    flightlog::FlightHeader& h = log.header;
    h.vehicle = "hummingbird.toml";
    h.flapping_Hz = kBeat_Hz;
    h.ambient = {1.18, 0, 3, {{5, 0, -1, 0}}};
    h.mocap = {200, 0.006, 2e-4, 3e-3};
    h.imu = {500, 0.002, 80, {motion_.arm_m, 0, -0.006}, 0.02, {0.02, 0.02, 0.02}, 0.3};
    h.power = {7.4, 1000, 0.0005, 0.02, 0.03};
    h.wings = {1000, 0.02};
    add_command(log);
    add_mocap(log);
    add_imu(log);
    add_power(log);
    add_wings(log);
    return log;
  }

 private:
  static constexpr double kBeat_Hz = 34, kPi = std::numbers::pi;
  struct Wave {
    double size, turn_rad_s, phase;
  };
  using Axis = std::array<Wave, 3>;

  void draw(Axis& axis, double slow_Hz, double fast_Hz) {
    for (auto& w : axis) {
      const double f = slow_Hz * std::pow(fast_Hz / slow_Hz, uniform());
      w = {0.5 + uniform(), 2 * kPi * f, 2 * kPi * uniform()};
    }
  }
  static double at(const Axis& axis, double t) {
    double sum = 0;
    for (const auto& w : axis) sum += w.size * std::sin(w.turn_rad_s * t + w.phase);
    return sum;
  }
  Eigen::Quaterniond attitude(double t) const {
    const double shake = motion_.shake_rad * std::sin(2 * kPi * kBeat_Hz * t);
    const double coning = motion_.coning_rad * std::cos(2 * kPi * kBeat_Hz * t);
    const double k = motion_.rotation;
    return Eigen::AngleAxisd(motion_.yaw_offset_rad + 0.3 * k * at(angles_[2], t), Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(0.1 * k * at(angles_[1], t) + shake, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(0.1 * k * at(angles_[0], t) + coning, Eigen::Vector3d::UnitX());
  }
  Eigen::Vector3d position(double t) const {
    const double k = 0.2 * motion_.translation;
    return {k * at(places_[0], t), k * at(places_[1], t),
            1.4 + k * at(places_[2], t) + 5e-5 * std::sin(4 * kPi * kBeat_Hz * t)};
  }
  Eigen::Vector3d rate(double t) const {
    constexpr double h = 1e-4;
    const Eigen::AngleAxisd turn(attitude(t - h).conjugate() * attitude(t + h));
    return turn.axis() * turn.angle() / (2 * h);
  }
  Eigen::Vector3d specific_force(double t, const Eigen::Vector3d& arm) const {
    constexpr double h = 1e-4;
    const auto place = [&](double s) { return Eigen::Vector3d(position(s) + attitude(s) * arm); };
    const Eigen::Vector3d acceleration = (place(t + h) - 2 * place(t) + place(t - h)) / (h * h);
    return attitude(t).conjugate() * (acceleration + Eigen::Vector3d(0, 0, 9.81));
  }
  /// What a first-order low-pass makes of a signal: Gauss-Laguerre quadrature over its past.
  template <class Signal>
  static Eigen::Vector3d low_pass(const Signal& signal, double t, double time_constant_s) {
    constexpr double kNodes[] = {0.26356032, 1.41340306, 3.59642577, 7.08581001, 12.64080084};
    constexpr double kWeights[] = {0.52175561, 0.39866681, 0.07594245, 0.00361176, 0.00002337};
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < 5; ++i) sum += kWeights[i] * signal(t - time_constant_s * kNodes[i]);
    return sum;
  }
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  double normal(double sd) { return sd * normal_(random_); }
  Eigen::Vector3d normal3(double sd) { return {normal(sd), normal(sd), normal(sd)}; }

  void add_command(flightlog::FlightLog& log) const {
    flightlog::CommandStream& u = log.command;
    u.inputs.emplace();
    u.phase_rad.emplace();
    for (int i = 0; i < motion_.duration_s * 1000; ++i) {
      const double t = i * 1e-3, amplitude = 9 + 0.5 * std::sin(t), difference = 0.3 * std::sin(2 * t),
                   bias = 0.2 * std::cos(t);
      const double phase = std::remainder(2 * kPi * kBeat_Hz * t, 2 * kPi);
      u.t_s.push_back(100 + t);
      u.left_voltage_V.push_back((amplitude + difference) * std::cos(phase) + bias);
      u.right_voltage_V.push_back((amplitude - difference) * std::cos(phase) + bias);
      u.inputs->amplitude_V.push_back(amplitude);
      u.inputs->difference_V.push_back(difference);
      u.inputs->bias_V.push_back(bias);
      u.inputs->split_cycle.push_back(0);
      u.phase_rad->push_back(phase);
    }
  }
  void add_mocap(flightlog::FlightLog& log) {
    flightlog::MocapStream& m = log.mocap;
    const flightlog::MocapHeader& h = log.header.mocap;
    for (int i = 0; i < motion_.duration_s * h.rate_hz; ++i) {
      const double t = i / h.rate_hz;
      const Eigen::Vector3d p = position(t) + normal3(h.position_noise_m), e = normal3(h.attitude_noise_rad) / 2;
      const Eigen::Quaterniond q = (attitude(t) * Eigen::Quaterniond(1, e(0), e(1), e(2))).normalized();
      m.t_s.push_back(100 + t + h.latency_s + normal(2e-4));
      m.x_m.push_back(p(0)), m.y_m.push_back(p(1)), m.z_m.push_back(p(2));
      m.qw.push_back(q.w()), m.qx.push_back(q.x()), m.qy.push_back(q.y()), m.qz.push_back(q.z());
    }
  }
  void add_imu(flightlog::FlightLog& log) {
    flightlog::ImuStream& s = log.imu;
    const flightlog::ImuHeader& h = log.header.imu;
    const Eigen::Vector3d arm(h.position_m[0], h.position_m[1], h.position_m[2]);
    const Eigen::Vector3d gyro_bias = normal3(h.gyro_bias_sd_rad_s[0]), accel_bias = normal3(0.2);
    for (int i = 0; i < motion_.duration_s * h.rate_hz; ++i) {
      const double t = i / h.rate_hz, slow_s = 1 / (2 * kPi * h.bandwidth_hz);
      const auto force = [&](double past_s) { return specific_force(past_s, arm); };
      const Eigen::Vector3d g =
          low_pass([&](double past_s) { return rate(past_s); }, t, slow_s) + gyro_bias + normal3(h.gyro_noise_rad_s);
      const Eigen::Vector3d a = low_pass(force, t, slow_s) + accel_bias + normal3(h.accel_noise_m_s2);
      s.t_s.push_back(100 + t + h.latency_s + normal(5e-5));
      s.gyro_x_rad_s.push_back(g(0)), s.gyro_y_rad_s.push_back(g(1)), s.gyro_z_rad_s.push_back(g(2));
      s.accel_x_m_s2.push_back(a(0)), s.accel_y_m_s2.push_back(a(1)), s.accel_z_m_s2.push_back(a(2));
    }
  }
  void add_power(flightlog::FlightLog& log) {
    log.power.emplace();
    for (int i = 0; i < motion_.duration_s * 1000; ++i) {
      const double t = i * 1e-3, wave = std::cos(2 * kPi * kBeat_Hz * t - 0.8);
      log.power->t_s.push_back(100 + t + log.header.power->latency_s);
      log.power->battery_V.push_back(7.8 - 0.01 * t + normal(0.02));
      log.power->left_current_A.push_back(0.3 * wave + normal(0.03));
      log.power->right_current_A.push_back(0.3 * wave + normal(0.03));
    }
  }
  void add_wings(flightlog::FlightLog& log) {
    log.wings.emplace();
    for (int i = 0; i < motion_.duration_s * 1000; ++i) {
      const double t = i * 1e-3, x = 2 * kPi * kBeat_Hz * t;
      log.wings->t_s.push_back(100 + t);
      log.wings->left_stroke_rad.push_back(1.1 * std::sin(x) + normal(0.02));
      log.wings->left_rotation_rad.push_back(0.7 * std::cos(x) + normal(0.02));
      log.wings->right_stroke_rad.push_back(1.1 * std::sin(x) + normal(0.02));
      log.wings->right_rotation_rad.push_back(0.7 * std::cos(x) + normal(0.02));
    }
  }

  SyntheticMotion motion_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::array<Axis, 3> angles_, places_;
};

inline flightlog::FlightLog synthetic_log(const SyntheticMotion& motion = {}) { return Synthesis(motion).log(); }

}  // namespace flappy::flightlog
