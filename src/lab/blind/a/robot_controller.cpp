#include "lab/blind/a/robot_controller.hpp"

#include "lab/blind/a/view.hpp"

namespace flappy::blind {
namespace {

constexpr double kMultisine_s = 10;  // period of the multisines

/// Rms of a flight's multisines, in the order of Inputs (configs/fly/identify_multisine.toml).
constexpr std::array<double, 4> kRms = {0.4, 0.15, 0.2, 0.01};

/// Mass, moments of inertia with the wings at mid-stroke, and slopes of thrust and moments over the inputs.
constexpr double kMass_kg = 12.45e-3, kGravity_m_s2 = 9.81, kHover_V = 9.7, kThrust_N_V = 0.0196;
constexpr std::array<double, 3> kInertia_kg_m2 = {5.35e-6, 4.35e-6, 3.25e-6},
                                kMoment_Nm = {9.72e-4, 5.41e-4, 3.67e-3};  // a V, a V, a unit of split cycle
constexpr double kLowest_V = -4.1, kHighest_V = 8.3;                       // beside hover
constexpr std::array<double, 3> kMaxSum_m_s2 = {4.3, 4.3, 7.4}, kMaxTurn_rad_s2 = {490, 310, 161};  // of integrals
constexpr double kMaxLevel_m_s2 = 7.7, kMaxHeading = 0.19;                                          // sine
constexpr double kMaxPlace_m = 0.22;      // errors beyond count as this
constexpr std::size_t kBeatPeriods = 15;  // control periods in a beat of 29.4 ms

Vector3d triple(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

double& input(Inputs& u, int k) {
  return k == 0 ? u.amplitude_V : k == 1 ? u.difference_V : k == 2 ? u.bias_V : u.split_cycle;
}

}  // namespace

Plan::Plan(Programme programme, std::size_t flight, const Room& room, std::uint64_t seed, std::uint64_t number) {
  Random random(seed, Purpose::programme, number);
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
  model::Driver driver;
  View view;
  PilotGains gains;
  std::array<Vector3d, kBeatPeriods> velocities{};
  std::array<Vector3d, kBeatPeriods> rates{};
  std::size_t seen = 0;
  Vector3d place_sum_m_s2 = Vector3d::Zero(), turn_sum_rad_s2 = Vector3d::Zero();
};

RobotController::RobotController(const model::Driver& driver, std::uint64_t seed, std::uint64_t flight,
                                 const PilotGains& gains)
    : memory_(new Memory{.driver = driver, .view = View(seed, flight), .gains = gains}) {}
RobotController::~RobotController() = default;

Inputs RobotController::steer(const Torso& torso, const Aim& aim, const Inputs& excitation) {
  Memory& m = *memory_;
  const Torso seen = m.view.see(torso);
  m.velocities[m.seen % kBeatPeriods] = seen.velocity_m_s;
  m.rates[m.seen % kBeatPeriods] = seen.rate_rad_s;
  const std::size_t known = std::min(m.seen + 1, kBeatPeriods), ago = std::min(m.seen, kBeatPeriods / 2);
  Vector3d velocity = Vector3d::Zero();
  double yaw_rate_rad_s = 0;
  for (std::size_t k = 0; k < known; ++k) {
    velocity += m.velocities[k] / static_cast<double>(known);
    yaw_rate_rad_s += m.rates[k].z() / static_cast<double>(known);
  }
  Vector3d body_rate = 0.5 * (seen.rate_rad_s + m.rates[(m.seen - ago) % kBeatPeriods]);
  body_rate.z() = yaw_rate_rad_s;
  ++m.seen;

  const auto within = [](const Vector3d& v, const Vector3d& most) {
    return Vector3d(v.cwiseMax(-most).cwiseMin(most));
  };
  const Vector3d place = triple(m.gains.place_1_s2), speed = triple(m.gains.speed_1_s);
  const Vector3d off = within(seen.position_m - aim.position_m, Vector3d::Constant(kMaxPlace_m)),
                 fast = velocity - aim.velocity_m_s;
  m.place_sum_m_s2 = within(
      m.place_sum_m_s2 +
          kControl_s * triple(m.gains.place_sum_1_s).cwiseProduct(place.cwiseProduct(off) + speed.cwiseProduct(fast)),
      triple(kMaxSum_m_s2));
  Vector3d wanted = aim.acceleration_m_s2 - place.cwiseProduct(off) - speed.cwiseProduct(fast) - m.place_sum_m_s2;
  const double level = std::sqrt(wanted.head<2>().squaredNorm());
  if (level > kMaxLevel_m_s2) wanted.head<2>() *= kMaxLevel_m_s2 / level;
  wanted.z() = std::max(wanted.z() + kGravity_m_s2, 0.4 * kGravity_m_s2);

  const Matrix3d R = seen.attitude.toRotationMatrix();
  // A target turned by more than the pilot can follow is led in by its sine.
  const SinCos asked = sin_cos(aim.heading_rad);
  const double length = std::sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0)) + 1e-9, c = R(0, 0) / length,
               s = R(1, 0) / length;
  double sine = c * asked.sin - s * asked.cos;
  const double cosine = c * asked.cos + s * asked.sin;
  if (cosine < 0) sine = std::copysign(1.0, sine);
  sine = std::clamp(sine, -kMaxHeading, kMaxHeading);
  const double rest = std::sqrt(1 - sine * sine);
  const Vector3d ahead(c * rest - s * sine, s * rest + c * sine, 0);
  Matrix3d Rd;
  Rd.col(2) = wanted / std::sqrt(wanted.squaredNorm());
  const Vector3d side = Rd.col(2).cross(ahead);
  Rd.col(1) = side / std::sqrt(side.squaredNorm());
  Rd.col(0) = Rd.col(1).cross(Rd.col(2));

  const Matrix3d apart = Rd.transpose() * R - R.transpose() * Rd;
  const Vector3d turned = 0.5 * Vector3d(apart(2, 1), apart(0, 2), apart(1, 0));
  const Vector3d rate = body_rate - R.transpose() * Vector3d(0, 0, aim.heading_rad_s);
  const Vector3d turn = triple(m.gains.turn_1_s2), slow = triple(m.gains.rate_1_s);
  m.turn_sum_rad_s2 = within(
      m.turn_sum_rad_s2 +
          kControl_s * triple(m.gains.turn_sum_1_s).cwiseProduct(turn.cwiseProduct(turned) + slow.cwiseProduct(rate)),
      triple(kMaxTurn_rad_s2));
  const Vector3d moment_Nm =
      triple(kInertia_kg_m2).cwiseProduct(-turn.cwiseProduct(turned) - slow.cwiseProduct(rate) - m.turn_sum_rad_s2);
  const double more_V = kMass_kg * (wanted.dot(R.col(2)) - kGravity_m_s2) / kThrust_N_V;
  return clipped(
      {kHover_V + std::clamp(more_V, kLowest_V, kHighest_V) + excitation.amplitude_V,
       moment_Nm.x() / kMoment_Nm[0] + excitation.difference_V, moment_Nm.y() / kMoment_Nm[1] + excitation.bias_V,
       moment_Nm.z() / kMoment_Nm[2] + excitation.split_cycle},
      m.driver);
}

Inputs clipped(const Inputs& u, const model::Driver& d) {
  const auto within = [](double x, double most) { return std::clamp(x, -most, most); };
  return {std::clamp(u.amplitude_V, 0.0, d.amplitude_limit_V), within(u.difference_V, d.difference_limit_V),
          within(u.bias_V, d.bias_limit_V), within(u.split_cycle, d.split_cycle_limit)};
}

/// Two half cosines: the first, from crest to trough, takes the share 1/2 -+ split_cycle of the beat (left: -).
double RobotController::voltage(const Inputs& u, std::size_t side, double beat, double limit_V) {
  const double sign = side == 0 ? 1 : -1, falling = 0.5 - sign * u.split_cycle;
  const double half_turn = beat < falling ? beat / falling : (1 - beat) / (1 - falling);
  const double volts = (u.amplitude_V + sign * u.difference_V) * sin_cos(kPi * half_turn).cos + u.bias_V;
  return std::clamp(volts, -limit_V, limit_V);
}

}  // namespace flappy::blind
