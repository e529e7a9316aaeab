#include "lab/blind/a/flights.hpp"

#include <cstdio>

namespace flappy::blind {
namespace {

/// Rounds to 1 ns, which removes rounding errors of step times number.
double tidy(double t_s) { return std::round(t_s * 1e9) / 1e9; }

/// World z component of the body's z axis below which the pilot of a programme has lost control.
constexpr double kMinUpright = 0.17;

std::string crash(const Robot& robot, const Room& room, double least_upright) {
  const Torso& t = robot.torso();
  const Vector3d& p = t.position_m;
  const double up = 1 - 2 * (t.attitude.x() * t.attitude.x() + t.attitude.y() * t.attitude.y());
  if (!(p.squaredNorm() < 1e6) || !(t.rate_rad_s.squaredNorm() < 1e6)) return "left all bounds";
  if (p.z() < room.ground_z_m) return "touched the ground";
  if (p.z() > room.ceiling_z_m - 0.019) return "touched the ceiling";
  const Wall& w = room.wall;
  if ((p.x() - w.x_m) * w.normal_x + (p.y() - w.y_m) * w.normal_y < 0.084) return "touched the wall";
  if (up < least_upright) return "turned over";
  if (p.head<2>().squaredNorm() > 9) return "flew away";
  return {};
}

void add(flightlog::FlightLog& log, const RobotImu::Sample& s) {
  flightlog::ImuStream& m = log.imu;
  m.t_s.push_back(tidy(s.arrival_s));
  m.gyro_x_rad_s.push_back(s.gyro_rad_s.x());
  m.gyro_y_rad_s.push_back(s.gyro_rad_s.y());
  m.gyro_z_rad_s.push_back(s.gyro_rad_s.z());
  m.accel_x_m_s2.push_back(s.accel_m_s2.x());
  m.accel_y_m_s2.push_back(s.accel_m_s2.y());
  m.accel_z_m_s2.push_back(s.accel_m_s2.z());
}

void add(flightlog::FlightLog& log, const RobotMocap::Sample& s) {
  flightlog::MocapStream& m = log.mocap;
  m.t_s.push_back(tidy(s.arrival_s));
  m.x_m.push_back(s.position_m.x());
  m.y_m.push_back(s.position_m.y());
  m.z_m.push_back(s.position_m.z());
  m.qw.push_back(s.attitude.w());
  m.qx.push_back(s.attitude.x());
  m.qy.push_back(s.attitude.y());
  m.qz.push_back(s.attitude.z());
}

void add_command(flightlog::FlightLog& log, double t_s, const std::array<double, 2>& volts, const Inputs& u,
                 double phase_rad) {
  flightlog::CommandStream& c = log.command;
  c.t_s.push_back(tidy(t_s));
  c.left_voltage_V.push_back(volts[0]);
  c.right_voltage_V.push_back(volts[1]);
  if (!c.inputs) return;
  c.inputs->amplitude_V.push_back(u.amplitude_V);
  c.inputs->difference_V.push_back(u.difference_V);
  c.inputs->bias_V.push_back(u.bias_V);
  c.inputs->split_cycle.push_back(u.split_cycle);
  c.phase_rad->push_back(phase_rad);
}

void add_truth(std::vector<flightlog::Column>& truth, double t_s, const Robot& robot, const Vector3d& bias) {
  const Torso& t = robot.torso();
  const Vector3d &p = t.position_m, &v = t.velocity_m_s, &w = t.rate_rad_s;
  const Quaterniond& q = t.attitude;
  const Wing &l = robot.wing(0), &r = robot.wing(1);
  const double row[] = {tidy(t_s),      p.x(),
                        p.y(),          p.z(),
                        q.w(),          q.x(),
                        q.y(),          q.z(),
                        v.x(),          v.y(),
                        v.z(),          w.x(),
                        w.y(),          w.z(),
                        l.stroke_rad,   l.rotation_rad,
                        r.stroke_rad,   r.rotation_rad,
                        l.stroke_rad_s, l.rotation_rad_s,
                        r.stroke_rad_s, r.rotation_rad_s,
                        bias.x(),       bias.y(),
                        bias.z()};
  truth.resize(std::size(row));
  for (std::size_t k = 0; k < truth.size(); ++k) truth[k].push_back(row[k]);
}

flightlog::FlightHeader header_of(const Case& c, const SensorSet& sensors, const Room& room) {
  flightlog::FlightHeader h;
  h.vehicle = c.vehicle_file;
  h.vehicle_sha256 = c.vehicle_sha256;
  h.flapping_Hz = c.vehicle.driver.flapping_Hz;
  h.gravity_m_s2 = room.gravity_m_s2;
  h.ambient = {c.declared_density_kg_m3,
               room.ground_z_m,
               room.ceiling_z_m,
               {{room.wall.x_m, room.wall.y_m, room.wall.normal_x, room.wall.normal_y}}};
  h.mocap = sensors.mocap;
  h.imu = sensors.imu;
  h.power = sensors.power;
  h.wings = sensors.wings;
  h.changes = c.changes;
  return h;
}

}  // namespace

Room flight_room() { return {}; }

Robot robot_of(const Case& c, std::size_t flight) {
  Robot robot(c.vehicle, flight_room(), c.magnitudes, c.seed, flight_number(c.session, flight), kRobotStep_s,
              c.changes.swapped_wings);
  robot.charge(c.battery_V);
  return robot;
}

namespace {

Aim aim_of(const ProposedFlight& flight, double t_s) {
  constexpr double kStep_s = 1e-3;
  const auto before = flight.goal(t_s - kStep_s), now = flight.goal(t_s), after = flight.goal(t_s + kStep_s);
  Aim aim{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), now[3], (after[3] - before[3]) / (2 * kStep_s)};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<int>(i);
    aim.position_m(axis) = now[i];
    aim.velocity_m_s(axis) = (after[i] - before[i]) / (2 * kStep_s);
    aim.acceleration_m_s2(axis) = (after[i] - 2 * now[i] + before[i]) / (kStep_s * kStep_s);
  }
  return aim;
}

}  // namespace

RobotFlight fly(const Case& c, std::size_t flight, const Watch& watch) {
  const std::uint64_t number = flight_number(c.session, flight);
  const Plan plan(c.programme, flight, flight_room(), c.seed,
                  flight_number(c.programme_of.value_or(c.session), flight));
  RobotController pilot(c.vehicle.driver, c.seed, number, c.gains);

  // It trims at 1 m in the first two fifths of kTrim_s, then moves to where the log begins.
  const auto asked = [&](double t_s) { return c.proposed ? aim_of(*c.proposed, t_s) : plan.at(t_s); };
  const Vector3d home_m = asked(0).position_m;
  constexpr double kTrimHeight_m = 1;
  Torso start;
  start.position_m = {home_m.x(), home_m.y(), kTrimHeight_m};
  const auto aim_at = [&](double t_s) {
    Aim aim = asked(std::max(t_s, 0.0));
    if (t_s < 0) {
      const double s = std::clamp((t_s + 0.6 * kTrim_s) / (0.3 * kTrim_s), 0.0, 1.0);
      aim.position_m.z() = kTrimHeight_m + s * s * (3 - 2 * s) * (home_m.z() - kTrimHeight_m);
    }
    return aim;
  };
  double farthest_m = 0;
  const auto steer = [&](double t_s, double, const Torso& torso) {
    const Aim aim = aim_at(t_s);
    if (t_s >= 0) farthest_m = std::max(farthest_m, std::sqrt((torso.position_m - aim.position_m).squaredNorm()));
    if (!c.proposed || t_s < 0) return pilot.steer(torso, aim, plan.excitation(t_s));
    const auto u = c.proposed->excitation(t_s);
    return pilot.steer(torso, aim, {u[0], u[1], u[2], u[3]});
  };
  RobotFlight f = fly(c, flight, start, c.proposed ? c.proposed->lasts_s : kFlight_s, kMinUpright, steer, watch);
  f.farthest_m = farthest_m;
  return f;
}

namespace {

/// Hands samples to a firmware when they arrive.
class Arrivals {
 public:
  explicit Arrivals(OnBoard& firmware) : firmware_(firmware) {}
  void add(const RobotImu::Sample& s) { imu_.push_back(s); }
  void add(const RobotMocap::Sample& s) { mocap_.push_back(s); }
  void hand_over(double now_s) {
    const auto three = [](const Vector3d& v) { return std::array<double, 3>{v.x(), v.y(), v.z()}; };
    for (; !imu_.empty() && tidy(imu_.front().arrival_s) <= now_s + 1e-9; imu_.erase(imu_.begin()))
      firmware_.imu(tidy(imu_.front().arrival_s), three(imu_.front().gyro_rad_s), three(imu_.front().accel_m_s2));
    for (; !mocap_.empty() && tidy(mocap_.front().arrival_s) <= now_s + 1e-9; mocap_.erase(mocap_.begin()))
      firmware_.pose(tidy(mocap_.front().arrival_s), pose_of(mocap_.front().position_m, mocap_.front().attitude));
  }
  static OnBoard::Pose pose_of(const Vector3d& p, const Quaterniond& q) {
    return {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
  }

 private:
  OnBoard& firmware_;
  std::vector<RobotImu::Sample> imu_;
  std::vector<RobotMocap::Sample> mocap_;
};

RobotFlight flown(const Case& c, std::size_t flight, const Torso& start, double duration_s, double least_upright,
                  const Steer& steer, const Watch& watch, OnBoard* firmware) {
  const Room room = flight_room();
  const SensorSet sensors = c.sensors ? *c.sensors : sensors_of(c.seed, c.power, c.wings);
  const std::uint64_t number = flight_number(c.session, flight);
  Robot robot = robot_of(c, flight);
  RobotImu imu(sensors, c.magnitudes, c.seed, number, kRobotStep_s);
  RobotMocap mocap(sensors, c.magnitudes, c.seed, number);
  Random power_random(c.seed, Purpose::power_noise, number), wings_random(c.seed, Purpose::wings_noise, number);
  RobotFlight f;
  f.log.header = header_of(c, sensors, room);
  if (!firmware) f.log.command.inputs.emplace(), f.log.command.phase_rad.emplace();
  if (sensors.power) f.log.power.emplace();
  if (sensors.wings) f.log.wings.emplace();

  robot.place_torso(start);

  const auto steps_of = [](double s) { return static_cast<std::int64_t>(std::lround(s / kRobotStep_s)); };
  const std::int64_t trim = firmware ? 0 : steps_of(kTrim_s), end = trim + steps_of(duration_s),
                     control = steps_of(kControl_s), hold = steps_of(c.vehicle.driver.hold_s);
  std::array<double, 2> volts{};
  Inputs inputs;
  std::int64_t mocap_count = 0, power_count = 0, wings_count = 0;
  std::optional<Arrivals> arrivals;
  if (firmware) {
    arrivals.emplace(*firmware);
    firmware->start(0, Arrivals::pose_of(start.position_m, start.attitude));
  }
  const auto due = [](std::int64_t step, double rate_hz, std::int64_t& count) {
    if (step < std::llround(static_cast<double>(count) / (rate_hz * kRobotStep_s))) return false;
    ++count;
    return true;
  };
  for (std::int64_t n = 0; n < end; ++n) {
    const std::int64_t step = n - trim;
    const double t_s = static_cast<double>(step) * kRobotStep_s;
    const bool logged = step >= 0;
    const double turns = static_cast<double>(n) * kRobotStep_s * c.vehicle.driver.flapping_Hz,
                 beat = turns - std::floor(turns);
    if (n % control == 0) {
      if (!firmware) inputs = steer(t_s, beat, robot.torso());
      if (logged) {
        add_truth(f.truth, t_s, robot, imu.constant_bias_rad_s());
        f.most_tilt_rad = std::max(f.most_tilt_rad,
                                   std::acos(std::clamp(robot.torso().attitude.toRotationMatrix()(2, 2), -1.0, 1.0)));
      }
      f.how = crash(robot, room, least_upright);
      if (!f.how.empty()) {
        char text[40];
        std::snprintf(text, sizeof text, " at %.2f s", t_s);
        f.how += text;
        f.crashed = true;
        return f;
      }
    }
    if (n % hold == 0) {
      if (firmware) {
        arrivals->hand_over(t_s);
        volts = firmware->volts(t_s);
      } else {
        volts = {RobotController::voltage(inputs, 0, beat, c.vehicle.left.motor.voltage_limit_V),
                 RobotController::voltage(inputs, 1, beat, c.vehicle.right.motor.voltage_limit_V)};
      }
      if (logged) add_command(f.log, t_s, volts, inputs, 2 * kPi * beat);
    }
    if (logged && due(step, sensors.mocap.rate_hz, mocap_count))
      if (const auto s = mocap.look(robot.torso(), t_s)) {
        add(f.log, *s);
        if (arrivals) arrivals->add(*s);
      }
    if (logged && sensors.wings && due(step, sensors.wings->rate_hz, wings_count)) {
      flightlog::WingsStream& w = *f.log.wings;
      const auto seen = [&](double angle) { return angle + sensors.wings->noise_rad * wings_random.normal(); };
      w.t_s.push_back(tidy(t_s));
      w.left_stroke_rad.push_back(seen(robot.wing(0).stroke_rad));
      w.left_rotation_rad.push_back(seen(robot.wing(0).rotation_rad));
      w.right_stroke_rad.push_back(seen(robot.wing(1).stroke_rad));
      w.right_rotation_rad.push_back(seen(robot.wing(1).rotation_rad));
    }
    if (watch) watch(robot, volts);
    robot.step(volts[0], volts[1]);
    if (!logged) continue;
    if (const auto s = imu.after_step(robot, t_s + kRobotStep_s)) {
      add(f.log, *s);
      if (arrivals) arrivals->add(*s);
    }
    if (sensors.power && due(step, sensors.power->rate_hz, power_count)) {
      flightlog::PowerStream& p = *f.log.power;  // values at the start of the step
      p.t_s.push_back(tidy(t_s + sensors.power->latency_s));
      p.battery_V.push_back(robot.battery_V() + sensors.power->voltage_noise_V * power_random.normal());
      p.left_current_A.push_back(robot.current_A(0) + sensors.power->current_noise_A * power_random.normal());
      p.right_current_A.push_back(robot.current_A(1) + sensors.power->current_noise_A * power_random.normal());
    }
  }
  return f;
}

}  // namespace

RobotFlight fly(const Case& c, std::size_t flight, const Torso& start, double duration_s, double least_upright,
                const Steer& steer, const Watch& watch) {
  return flown(c, flight, start, duration_s, least_upright, steer, watch, nullptr);
}

RobotFlight fly_on_board(const Case& c, std::size_t flight, const Torso& start, double duration_s, OnBoard& firmware) {
  constexpr double kAnyWayUp = -2;
  return flown(c, flight, start, duration_s, kAnyWayUp, {}, {}, &firmware);
}

}  // namespace flappy::blind
