#include "lab/blind/a/robot_controller.hpp"

#include "lab/blind/a/view.hpp"

namespace flappy::blind {
namespace {

constexpr double kMultisine_s = 10;  // period of the multisines

/// Rms of a flight's multisines, in the order of Inputs (configs/fly/identify_multisine.toml).
constexpr std::array<double, 4> kRms = {0.4, 0.15, 0.2, 0.01};

/// Gains of configs/controllers/pid.toml, except for steps and turns of the set-point: yaw as published, height slower.
flight::PidConstants<double> gains() {
  flight::PidConstants<double> k{};
  k.position_xy_1_s = 8.08, k.position_z_1_s = 10, k.speed_limit_m_s = 1.5, k.climb_limit_m_s = 1.5;
  k.forward = {4.93, 3.71, 0.0142, 10};
  k.left = {7.04, 2.33, 0.0101, 10};
  k.up = {4.1, 12.7, 0.04, 5};
  k.acceleration_limit_m_s2 = 10;
  k.roll_limit_rad = kPi / 4, k.pitch_limit_rad = kPi / 6, k.yaw_error_limit_rad = kPi / 18;
  k.roll = {16.7, 29.1, 0.708, 2};
  k.pitch = {14.9, 8.19, 0.319, 2};
  k.yaw = {0.2, 0.33, 0.003, 0.1};
  k.hover_V = 9.8, k.lower_V = -4, k.upper_V = 8.2;
  k.difference_limit_V = 3, k.bias_limit_V = 3.5, k.split_cycle_limit = 0.15;
  const auto share = [](double hz) { return 1 - exponential(-2 * kPi * hz * kControl_s); };
  k.velocity_share = share(20.1), k.rate_share = share(368);
  k.period_s = kControl_s, k.per_period_Hz = 1 / kControl_s, k.gravity_m_s2 = 9.81;
  return k;
}

double& input(Inputs& u, int k) {
  return k == 0 ? u.amplitude_V : k == 1 ? u.difference_V : k == 2 ? u.bias_V : u.split_cycle;
}

}  // namespace

Plan::Plan(Programme programme, std::size_t flight, const Room& room, std::uint64_t seed, std::uint64_t number) {
  Random random(seed, 100 * number + 141);
  const double low = room.ground_z_m + 0.08, high = room.ceiling_z_m - 0.09;
  const auto add = [&](double t_s, double x, double y, double z, double heading = 0) {
    waypoints_.push_back({t_s, {x, y, z}, heading});
  };
  double share = 0;  // of kRms that the flight is excited with
  if (programme == Programme::hover) {
    add(0, 0, 0, 0.5);
  } else if (programme == Programme::calm) {
    // around a rectangle, upright or level; its legs of 2.5 s stay below 0.2 m/s and 0.3 rad/s
    const double x = random.between(0.15, 0.25) * random.sign(), other = random.between(0.15, 0.25);
    const double turn = random.between(0.2, 0.4) * random.sign(), y = other * random.sign();
    add(0, 0, 0, 0.5);
    if (flight == 1) add(2.5, 0, 0, 0.5 + other), add(5, x, 0, 0.5 + other, turn), add(7.5, x, 0, 0.5, turn);
    if (flight == 2) add(2.5, x, 0, 0.5, turn), add(5, x, y, 0.5), add(7.5, 0, y, 0.5, -turn);
    if (flight > 0) add(10, 0, 0, 0.5);
  } else if (flight == 0) {
    add(0, 0, 0, 0.5);
    share = 1;
  } else if (flight == 1) {
    // down to the ground, up to the ceiling, to the wall and back, along x and back
    const Wall& wall = room.wall;
    const double to_wall = (0 - wall.x_m) * wall.normal_x + (0 - wall.y_m) * wall.normal_y - 0.16;
    const double wx = -to_wall * wall.normal_x, wy = -to_wall * wall.normal_y;
    const double dash = 0.55 * random.sign();
    add(0, 0, 0, 0.4), add(0.9, 0, 0, low), add(1.4, 0, 0, low);
    add(4.1, 0, 0, high), add(4.6, 0, 0, high);
    add(6.1, wx, wy, 1.0), add(6.5, wx, wy, 1.0), add(7.9, 0.1 * wx, 0.1 * wy, 0.6);
    add(8.9, 0.1 * wx + dash, 0.1 * wy, 0.5), add(10, 0.1 * wx, 0.1 * wy, 0.5);
    share = 0.35;
  } else {
    const double turn = 2 * kPi * random.sign(), side = 0.06 * random.sign();
    add(0, 0, 0, 0.6), add(0.3, 0, 0, 0.6), add(3.8, 0, 0, 0.6, turn), add(4.3, 0, 0, 0.6, turn);
    add(4.6, side, 0, 0.6, turn), add(5.3, side, 0, 0.6, turn), add(5.6, side, side, 0.6, turn);
    add(6.2, side, side, 0.6, turn), add(6.21, side, side, 0.66, turn), add(6.5, side, side, 0.66, turn);
    add(9.9, side, side, 0.66, 0);
    share = 0.4;
    for (const double at : {0.8, 2.2, 4.8, 7.0, 8.4}) steps_.push_back({0, at, at + 0.15, 1.2 * random.sign()});
    for (const double at : {1.5, 5.8}) steps_.push_back({1, at, at + 0.06, 0.5 * random.sign()});
    for (const double at : {3.0, 6.6}) steps_.push_back({2, at, at + 0.06, 0.8 * random.sign()});
  }
  // input k has the harmonics h with h mod 4 = k, so no two inputs correlate over a period
  for (int k = 0; k < 4 && share > 0; ++k) {
    std::vector<int> harmonics;
    for (int h = 3; h <= 150; ++h)
      if (h % 4 == k) harmonics.push_back(h);
    const double each =
        share * kRms[static_cast<std::size_t>(k)] * std::sqrt(2.0 / static_cast<double>(harmonics.size()));
    for (const int h : harmonics) sines_.push_back({k, each, h / kMultisine_s, random.uniform()});
  }
}

Aim Plan::at(double t_s) const {
  std::size_t k = 0;
  while (k + 1 < waypoints_.size() && waypoints_[k + 1].t_s <= t_s) ++k;
  const Waypoint& from = waypoints_[k];
  Aim aim{from.position_m, Vector3d::Zero(), Vector3d::Zero(), from.heading_rad, 0};
  if (k + 1 == waypoints_.size() || t_s <= from.t_s) return aim;
  const Waypoint& to = waypoints_[k + 1];
  const double whole = to.t_s - from.t_s, s = (t_s - from.t_s) / whole;
  // from rest to rest: 10 s^3 - 15 s^4 + 6 s^5
  const double way = s * s * s * (10 + s * (-15 + 6 * s)), speed = 30 * s * s * (1 - s) * (1 - s) / whole;
  const double bend = 60 * s * (1 - s) * (1 - 2 * s) / (whole * whole);
  const Vector3d leg = to.position_m - from.position_m;
  aim.position_m += way * leg;
  aim.heading_rad += way * (to.heading_rad - from.heading_rad);
  if (whole < 0.05) return aim;  // a step of the set-point has no velocity
  aim.velocity_m_s = speed * leg;
  aim.acceleration_m_s2 = bend * leg;
  aim.heading_rad_s = speed * (to.heading_rad - from.heading_rad);
  return aim;
}

Inputs Plan::excitation(double t_s) const {
  Inputs u;
  if (t_s < 0) return u;
  for (const Sine& s : sines_) input(u, s.input) += s.amplitude * sin_cos(2 * kPi * (s.Hz * t_s + s.phase_turns)).cos;
  for (const Step& s : steps_)
    if (t_s >= s.begin_s && t_s < s.end_s) input(u, s.input) += s.height;
  return u;
}

struct RobotController::Memory {
  flight::PidConstants<double> constants = gains();
  flight::Pid<double> pid{};
  model::Driver driver;
  View view;
};

RobotController::RobotController(const model::Driver& driver, std::uint64_t seed, std::uint64_t flight)
    : memory_(new Memory{.driver = driver, .view = View(seed, flight)}) {}
RobotController::~RobotController() = default;

Inputs RobotController::steer(const Torso& torso, const Aim& aim, const Inputs& excitation) {
  Memory& m = *memory_;
  const flight::Estimate<double> seen = m.view.see(torso);
  const auto vec3 = [](const Vector3d& v) { return model::Vec3<double>{v.x(), v.y(), v.z()}; };
  const SinCos heading = sin_cos(aim.heading_rad);
  flight::Setpoint<double> wanted{};
  wanted.position_m = vec3(aim.position_m);
  wanted.velocity_m_s = vec3(aim.velocity_m_s);
  wanted.acceleration_m_s2 = vec3(aim.acceleration_m_s2);
  wanted.heading = {heading.sin, heading.cos};
  wanted.heading_rate_rad_s = aim.heading_rad_s;
  const auto u = flight::PidController::update(m.constants, m.pid, seen, wanted);
  return clipped({u.amplitude_V + excitation.amplitude_V, u.difference_V + excitation.difference_V,
                  u.bias_V + excitation.bias_V, u.split_cycle + excitation.split_cycle},
                 m.driver);
}

Inputs clipped(const Inputs& u, const model::Driver& d) {
  const auto within = [](double x, double most) { return std::clamp(x, -most, most); };
  return {std::clamp(u.amplitude_V, 0.0, d.amplitude_limit_V), within(u.difference_V, d.difference_limit_V),
          within(u.bias_V, d.bias_limit_V), within(u.split_cycle, d.split_cycle_limit)};
}

double RobotController::voltage(const Inputs& inputs, std::size_t side, double beat, double limit_V) {
  const model::WingBeat<double> u{inputs.amplitude_V, inputs.difference_V, inputs.bias_V, inputs.split_cycle};
  const double fraction = beat < 0.5 ? beat : beat - 1;
  return side == 0 ? model::wing_beat_voltage<+1>(u, fraction, limit_V)
                   : model::wing_beat_voltage<-1>(u, fraction, limit_V);
}

}  // namespace flappy::blind
