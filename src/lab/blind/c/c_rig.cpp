#include "lab/blind/c/c_rig.hpp"

#include <algorithm>

#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

constexpr double kFrames_hz = 2000;

Eigen::Matrix3d turn_about(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

Eigen::Vector3d drawn_in_ball(Random& random, double radius) {
  const double share = std::cbrt(random.uniform());
  return radius * share * random.direction();
}

std::array<double, 4> quaternion(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  return {q.w(), q.x(), q.y(), q.z()};
}

/// Makes declarations inexact. It has its own random numbers, so draws of true values do not depend on it.
void declare_loosely(RigParameters& f, const Robot& robot, Random random) {
  flightlog::RigHeader& h = f.declared;
  const double half_s = static_cast<double>(f.steps) * robot.step_s() / 2;
  f.mean = random.uniform() < 0.5;
  const double late_s = f.latency_s + (f.mean ? half_s : 0), off_s = random.uniform(-0.3e-3, 0.3e-3);
  const bool counted = random.uniform() < 0.5;
  h.latency_s = std::clamp(f.latency_s + off_s + (f.mean && counted ? half_s : 0), std::max(0.0, late_s - 0.5e-3),
                           late_s + 0.5e-3);
  const Eigen::Vector3d way = random.direction();
  const Eigen::Vector3d off_m = random.uniform(0.1e-3, 0.5e-3) * way;
  for (int i = 0; i < 3; ++i) h.position_m[static_cast<std::size_t>(i)] += off_m[i];
  const double quarters = static_cast<double>(random.below(4)), upside_down = random.uniform() < 0.5 ? M_PI : 0;
  const Eigen::Matrix3d said =
      (turn_about(M_PI / 2 * quarters, Eigen::Vector3d::UnitZ()) * turn_about(upside_down, Eigen::Vector3d::UnitX()))
          .array()
          .round();
  const Eigen::Vector3d axis = random.direction();
  f.R_BS = turn_about(random.uniform(0.05, 0.3) * kDegree, axis) * said;
  h.attitude = quaternion(said);
  h.force_noise_N *= random.uniform(0.7, 1.5);
  h.moment_noise_Nm *= random.uniform(0.7, 1.5);
  h.resonance_hz = random.uniform() < 1.0 / 3 ? 0 : 10 * std::round(h.resonance_hz / 10);
  h.rate_hz = 10 * std::round(h.rate_hz / 10);
  f.declared_film.rate_hz = 10 * std::round(f.declared_film.rate_hz / 10);
  f.declared_film.noise_rad *= random.uniform(0.7, 1.5);
  f.film.late_s = random.uniform(-0.5e-3, 0.5e-3);
  const double fast = random.uniform(0, 50e-6);
  (random.uniform() < 0.5 ? f.fast_sensor : f.fast_film) = fast;
}

}  // namespace

RigParameters rig_parameters(const Assignment& a, const Robot& robot) {
  Random random(a.seed, "rig");
  RigParameters f;
  const double step_s = robot.step_s();
  const auto steps = [&](double hz) { return static_cast<std::size_t>(std::max(1L, std::lround(1 / (hz * step_s)))); };
  const std::array<double, 5> rates_hz = {1000, 2000, 2500, 5000, 10000};
  f.steps = steps(rates_hz[random.below(rates_hz.size())]);
  f.latency_s = random.uniform(0.1e-3, 1e-3);
  f.position_m.x() = random.uniform(-3e-3, 3e-3);
  f.position_m.y() = random.uniform(-3e-3, 3e-3);
  f.position_m.z() = random.uniform(-30e-3, -12e-3);
  const double lowest_hz = random.uniform(250, 700);
  const std::size_t softest = random.below(6);
  for (std::size_t i = 0; i < 6; ++i) {
    const double stiffer = random.uniform(1.05, 1.6);
    f.natural_hz[i] = lowest_hz * (i == softest ? 1 : stiffer);
    f.damping[i] = random.uniform(0.01, 0.05);
  }
  const bool fine = random.uniform() < 0.5;
  f.force_range_N = fine ? 8 : 12;
  f.moment_range_Nm = fine ? 0.05 : 0.12;
  f.force_digit_N = fine ? 1.0 / 682 : 1.0 / 320;
  f.moment_digit_Nm = fine ? 3e-3 / 364 : 1e-3 / 64;
  const double noise = random.uniform(0.6, 1.5);  // in steps of the converter
  f.force_noise_N = noise * f.force_digit_N;
  f.moment_noise_Nm = noise * f.moment_digit_Nm;
  const auto range = [&](int i) { return i < 3 ? f.force_range_N : f.moment_range_Nm; };
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const double share = random.sign() * random.uniform(0.001, 0.01);
      if (i != j) f.crosstalk(i, j) = share * range(i) / range(j);
    }
  f.drift_N_s = random.uniform(1e-3, 5e-3) / 60;
  f.walk_N_root_s = 0.5e-3 / std::sqrt(60.0);
  f.film.steps = steps(kFrames_hz);
  f.film.hidden_phase = random.uniform();

  flightlog::RigHeader& h = f.declared;
  const auto with_converter = [](double noise_sd, double digit) {
    return std::sqrt(noise_sd * noise_sd + digit * digit / 12);
  };
  h.rate_hz = 1 / (static_cast<double>(f.steps) * step_s);
  h.latency_s = f.latency_s;
  h.position_m = {f.position_m.x(), f.position_m.y(), f.position_m.z()};
  h.force_noise_N = with_converter(f.force_noise_N, f.force_digit_N);
  h.moment_noise_Nm = with_converter(f.moment_noise_Nm, f.moment_digit_Nm);
  h.resonance_hz = lowest_hz;
  f.declared_film = {1 / (static_cast<double>(f.film.steps) * step_s), f.film.noise_rad};
  if (a.conventions) declare_loosely(f, robot, Random(a.seed, "rig conventions"));
  if (a.session > 0) {  // clamped again, and clocks matched anew; the declarations stay
    Random day(a.seed, "rig session", a.session);
    f.position_m += drawn_in_ball(day, 0.1e-3);
    const Eigen::Vector3d turn = drawn_in_ball(day, 0.1 * kDegree);
    f.R_BS = turn_about(turn.norm(), turn.normalized()) * f.R_BS;
    f.latency_s += day.uniform(-0.1e-3, 0.1e-3);
    f.film.late_s += day.uniform(-0.1e-3, 0.1e-3);
  }
  return f;
}

Rig::Rig(const Assignment& a, std::size_t stream, const Robot& robot, const RigParameters& parameters)
    : f_(parameters),
      step_s_(robot.step_s()),
      flapping_Hz_(robot.parameters().flapping_Hz),
      noise_(a.seed, "rig noise", stream_of(a, stream)),
      walk_(a.seed, "rig drift", stream_of(a, stream)),
      film_noise_(a.seed, "film", stream_of(a, stream)),
      hiding_(a.seed, "hiding", stream_of(a, stream)) {
  for (int i = 0; i < 6; ++i)
    drift_per_s_[i] =
        walk_.sign() * walk_.uniform(0.5, 1) * f_.drift_N_s * (i < 3 ? 1 : f_.moment_range_Nm / f_.force_range_N);
  for (std::size_t i = 0; i < 6; ++i) {
    const double w = 2 * M_PI * f_.natural_hz[i], z = f_.damping[i], ringing = w * std::sqrt(1 - z * z);
    const double left = std::exp(-z * w * step_s_), c = std::cos(ringing * step_s_), s = std::sin(ringing * step_s_);
    swing_[i] = {left * (c + z * w / ringing * s), left * s / ringing, -left * w * w / ringing * s,
                 left * (c - z * w / ringing * s)};
  }
}

void Rig::after_step(const Robot& robot, double t_s, bool filmed) {
  load(robot.mechanism().support(), t_s);
  if (count_ % f_.film.steps == 0 && filmed) film(robot, t_s);
}

void Rig::load(const Wrench& wrench, double t_s) {
  ++count_;
  Vector6 load;
  load << f_.R_BS.transpose() * wrench.force_W,
      f_.R_BS.transpose() * (wrench.torque_W - f_.position_m.cross(wrench.force_W));
  if (!settled_) read_ = load;
  settled_ = true;
  for (int i = 0; i < 6; ++i) {
    const std::array<double, 4>& swing = swing_[static_cast<std::size_t>(i)];
    const double off = read_[i] - load[i], rate = rate_[i];
    read_[i] = load[i] + swing[0] * off + swing[1] * rate;
    rate_[i] = swing[2] * off + swing[3] * rate;
  }
  sum_ += read_;
  if (count_ % f_.steps != 0) return;
  const double interval_s = static_cast<double>(f_.steps) * step_s_;
  Vector6 sample = f_.crosstalk * (f_.mean ? Vector6(sum_ / static_cast<double>(f_.steps)) : read_);
  sum_.setZero();
  const double moments = f_.moment_range_Nm / f_.force_range_N;
  const Eigen::Vector3d walk_force = walk_.normal3(), walk_moment = walk_.normal3();
  walked_.head<3>() += f_.walk_N_root_s * std::sqrt(interval_s) * walk_force;
  walked_.tail<3>() += f_.walk_N_root_s * moments * std::sqrt(interval_s) * walk_moment;
  sample += drift_per_s_ * t_s + walked_;
  sample.head<3>() += f_.force_noise_N * noise_.normal3();
  sample.tail<3>() += f_.moment_noise_Nm * noise_.normal3();
  for (int i = 0; i < 6; ++i) {
    const double digit = i < 3 ? f_.force_digit_N : f_.moment_digit_Nm;
    sample[i] = digit * std::round(sample[i] / digit);
  }
  if (t_s <= 1e-9) {
    zero_ += (sample - zero_) / ++zeroed_;
    return;
  }
  sample -= zero_;
  forces_.t_s.push_back((t_s + f_.latency_s) * (1 + f_.fast_sensor));
  flightlog::Column* columns[6] = {&forces_.force_x_N,   &forces_.force_y_N,   &forces_.force_z_N,
                                   &forces_.moment_x_Nm, &forces_.moment_y_Nm, &forces_.moment_z_Nm};
  for (int i = 0; i < 6; ++i) columns[i]->push_back(sample[i]);
}

// A stretch of hidden frames begins at random, most often where one wing stands before the other or shines, twice a beat.
void Rig::film(const Robot& robot, double t_s) {
  const Mechanism& m = robot.mechanism();
  const double begins = f_.film.hidden / (1 - f_.film.hidden) / f_.film.hidden_frames *
                        (1 + std::cos(4 * M_PI * (flapping_Hz_ * t_s - f_.film.hidden_phase)));
  const double chance = hiding_.uniform();
  hidden_ = hidden_ ? chance >= 1 / f_.film.hidden_frames : chance < begins;
  const double angles[4] = {m.stroke(0), m.rotation(0), m.stroke(1), m.rotation(1)};
  double read[4];
  for (std::size_t i = 0; i < 4; ++i) read[i] = angles[i] + f_.film.noise_rad * film_noise_.normal();
  const double at_s = (t_s + f_.film.late_s) * (1 + f_.fast_film);
  if (hidden_ || at_s < 0) return;
  film_.t_s.push_back(at_s);
  flightlog::Column* columns[4] = {&film_.left_stroke_rad, &film_.left_rotation_rad, &film_.right_stroke_rad,
                                   &film_.right_rotation_rad};
  for (std::size_t i = 0; i < 4; ++i) columns[i]->push_back(read[i]);
}

void Rig::finish(flightlog::FlightLog& log, double end_s) const {
  log.header.rig = f_.declared;
  log.forces = forces_;
  flightlog::ForcesStream& of = *log.forces;
  while (!of.t_s.empty() && of.t_s.back() > end_s)  // arrived after the end of the recording
    for (flightlog::Column* column :
         {&of.t_s, &of.force_x_N, &of.force_y_N, &of.force_z_N, &of.moment_x_Nm, &of.moment_y_Nm, &of.moment_z_Nm})
      column->pop_back();
  if (film_.t_s.size() < 2) return;
  log.header.wings = f_.declared_film;
  log.wings = film_;
}

}  // namespace flappy::blind::c
