#include "lab/blind/b/b_flight.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/blind/b/b_session.hpp"

namespace flappy::blind::b {

Case make_case(const Assignment& a) {
  Case c;
  c.effect_magnitudes = effect_magnitudes_of(a.present_effects(), a.seed);
  c.parameters = read_parameters(a.vehicle_file);
  c.header.vehicle = c.parameters.file;
  c.header.vehicle_sha256 = c.parameters.sha256;
  c.header.flapping_Hz = c.parameters.flapping_Hz;
  c.header.gravity_m_s2 = kGravity_m_s2;
  c.header.ambient = {c.parameters.density_kg_m3, c.room.ground_z_m, c.room.ceiling_z_m, {{0, c.room.wall_y_m, 0, -1}}};
  c.sensors = draw_sensors(a, c.parameters.side[0].motor.voltage_limit_V, c.header);
  if (a.own_parameters) draw_parameters(a.seed, c.parameters);
  if (a.session > 0) {
    const SessionChange by = draw_session(a.seed, a.session);
    change(by, c.parameters, c.sensors);
    c.gains = by.gains;
  }
  if (a.changes.swapped_wings) swap_wings(c.parameters, c.effect_magnitudes);
  if (a.changes.added_mass_kg > 0) {
    const auto& at = a.changes.added_at_m;
    add_weight(a.changes.added_mass_kg, {at[0], at[1], at[2]}, c.parameters.torso);
  }
  c.header.changes = a.changes;
  return c;
}

Flight::Flight(const Assignment& a, const Case& c, std::uint64_t flight, const Vector3d& start, double heading,
               double trim_s)
    : robot_(c.parameters, c.effect_magnitudes, c.room, a.seed, flight),
      sensors_(a, c.sensors, robot_, flight, trim_s, a.power, a.wings),
      observer_(c.header, start, heading),
      pilot_(c.parameters, c.gains),
      radio_(a.seed, flight, c.effect_magnitudes[kCommandDropout], -trim_s),
      trim_s_(trim_s) {
  robot_.put(start, heading);
  log_.header = c.header;
  log_.command.inputs.emplace();
  log_.command.phase_rad.emplace();
}

Radio::Radio(std::uint64_t seed, std::uint64_t flight, double magnitude, double begins_s)
    : random_(seed, flight, Stream::kEffect, kCommandDropout),
      magnitude_(magnitude),
      fails_s_(begins_s + random_.uniform(0.3, 1)) {}

Beat Radio::arrived(const Beat& sent, double now) {
  if (magnitude_ == 0) return sent;
  if (now >= fails_s_) {
    returns_s_ = now + magnitude_ * random_.uniform(0.03, 0.09);
    fails_s_ = returns_s_ + random_.uniform(0.2, 0.7);
  }
  if (now >= returns_s_) last_ = sent;
  return last_;
}

void add_command(const RobotParameters& f, const Beat& sent, double now_s, double before_s,
                 flightlog::CommandStream& to) {
  const std::array<double, 2> voltages = waveform(f, sent, now_s + before_s);
  to.t_s.push_back(std::max(0.0, now_s));
  to.left_voltage_V.push_back(voltages[0]);
  to.right_voltage_V.push_back(voltages[1]);
  to.inputs->amplitude_V.push_back(std::clamp(sent.amplitude_V, 0.0, f.amplitude_limit_V));
  to.inputs->difference_V.push_back(std::clamp(sent.difference_V, -f.difference_limit_V, f.difference_limit_V));
  to.inputs->bias_V.push_back(std::clamp(sent.bias_V, -f.bias_limit_V, f.bias_limit_V));
  to.inputs->split_cycle.push_back(std::clamp(sent.split_cycle, -f.split_cycle_limit, f.split_cycle_limit));
  const double beats = (now_s + before_s) * f.flapping_Hz;
  to.phase_rad->push_back(2 * std::numbers::pi * (beats - std::floor(beats)));
}

std::string Flight::tick(const Beat& sent, bool may_tumble) {
  const double now = time_s();
  const RobotParameters& f = robot_.plant().parameters();
  if (now >= -1e-9) add_command(f, sent, now, trim_s_, log_.command);
  sensors_.before_tick(robot_, now);
  robot_.drive(radio_.arrived(sent, now), now + trim_s_);
  const std::string how = fly(may_tumble);
  observer_.tick(sensors_, time_s());  // takes the samples, which are then no firmware's
  return how;
}

std::string Flight::tick(OnBoard& firmware) {
  const double now = std::max(0.0, time_s());
  const auto three = [](const Vector3d& v) { return std::array<double, 3>{v.x(), v.y(), v.z()}; };
  while (const auto s = sensors_.imu(now)) firmware.imu(s->arrival_s, three(s->gyro_rad_s), three(s->accel_m_s2));
  while (const auto s = sensors_.mocap(now)) {
    const Vector3d& p = s->position_m;
    const Eigen::Quaterniond& q = s->attitude;
    firmware.pose(s->arrival_s, {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()});
  }
  const std::array<double, 2> volts = firmware.volts(now);
  log_.command.inputs.reset();
  log_.command.phase_rad.reset();
  log_.command.t_s.push_back(now);
  log_.command.left_voltage_V.push_back(volts[0]);
  log_.command.right_voltage_V.push_back(volts[1]);
  sensors_.before_tick(robot_, now);
  robot_.drive(volts);
  return fly(true);
}

std::string Flight::fly(bool may_tumble) {
  const double now = time_s();
  for (int step = 1; step <= kStepsPerTick; ++step) {
    if (path_) {
      std::array<double, 13> pose;
      std::copy_n(robot_.state().begin(), pose.size(), pose.begin());
      path_->pose.push_back(pose);
    }
    robot_.step();
    if (path_) path_->acceleration.push_back(robot_.felt().acceleration);
    sensors_.after_step(robot_, now + step * kStep_s, step);
  }
  ++ticks_;
  return robot_.crash(may_tumble);
}

flightlog::FlightLog Flight::log(double end_s) const {
  flightlog::FlightLog log = log_;
  sensors_.write(end_s, log);
  return log;
}

}  // namespace flappy::blind::b
