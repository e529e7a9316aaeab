#include "lab/blind/c/c_flight.hpp"

#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {

double beat_phase(double t_s, double flapping_Hz) {
  const double beats = t_s * flapping_Hz + 1e-9;  // a tick at the start of a beat belongs to that beat
  return std::max(0.0, beats - std::floor(beats) - 1e-9);
}

void add_command(flightlog::CommandStream& commands, double t_s, const std::array<double, 2>& voltages,
                 const Inputs& inputs, double phase) {
  if (!commands.inputs) commands.inputs.emplace();
  if (!commands.phase_rad) commands.phase_rad.emplace();
  commands.t_s.push_back(t_s);
  commands.left_voltage_V.push_back(voltages[0]);
  commands.right_voltage_V.push_back(voltages[1]);
  commands.inputs->amplitude_V.push_back(inputs.amplitude_V);
  commands.inputs->difference_V.push_back(inputs.difference_V);
  commands.inputs->bias_V.push_back(inputs.bias_V);
  commands.inputs->split_cycle.push_back(inputs.split_cycle);
  commands.phase_rad->push_back(2 * M_PI * phase);
}

std::string trouble(const Robot& robot, bool may_tumble) {
  if (!robot.is_finite()) return "its motion diverged";
  const Motion now = robot.mechanism().motion();
  const RobotParameters& f = robot.parameters();
  if (now.position_W.z() - f.below_m < Room::kGround_m) return "it struck the ground";
  if (now.position_W.z() + f.above_m + 0.01 > Room::kCeiling_m) return "it struck the ceiling";
  if (now.position_W.y() + f.around_m > Room::kWall_m) return "it struck the wall";
  if (now.position_W.head<2>().norm() > 5) return "it flew away";
  if (!may_tumble && now.R_WB(2, 2) < -0.2) return "it turned over";
  return {};
}

Flown fly_one(const Assignment& a, std::size_t flight, bool keep_path, Length length) {
  if (flight >= Family::kFlights && !a.proposed)
    throw io::InputError("flight " + std::to_string(flight) + ": accepted: 0 to 2");
  Robot robot(a, flight);
  const RobotParameters& f = robot.parameters();
  Programme programme(a, flight, f);
  Pilot pilot(f, a, flight);
  Sensors sensors(a, flight, robot, sensor_parameters(a, robot));
  const double tick_s = f.hold_s;
  const long before = std::lround(length.trim_s / tick_s), after = std::lround(length.flight_s / tick_s);

  robot.mechanism().place(
      programme.start_W(),
      Eigen::Quaterniond(Eigen::AngleAxisd(programme.target(-length.trim_s).heading_rad, Eigen::Vector3d::UnitZ())));
  Flown flown;
  flightlog::CommandStream& commands = flown.flight.log.command;
  double end_s = 0;
  if (keep_path) flown.path.push_back(robot.mechanism().motion());
  for (long tick = -before; tick < after; ++tick) {
    const double t_s = static_cast<double>(tick) * tick_s;
    pilot.look(robot.mechanism().motion(), tick_s);
    const Inputs piloted = pilot.fly(programme.target(t_s), tick_s), more = programme.excitation(t_s);
    const Inputs inputs = clipped({piloted.amplitude_V + more.amplitude_V, piloted.difference_V + more.difference_V,
                                   piloted.bias_V + more.bias_V, piloted.split_cycle + more.split_cycle},
                                  f);
    const double phase = beat_phase(t_s, f.flapping_Hz);
    const std::array<double, 2> voltages = beat_voltages(inputs, phase, f);
    if (tick >= 0) add_command(commands, t_s, voltages, inputs, phase);
    if (keep_path) flown.voltages.push_back(voltages);
    std::size_t step = 0;
    robot.tick(voltages, [&] {
      ++step;
      sensors.after_step(robot, t_s + static_cast<double>(step) * robot.step_s());
      if (!keep_path) return;
      const Motion now = robot.mechanism().motion();
      flown.path.back().acceleration_W = now.acceleration_W;
      flown.path.back().turning_B = now.turning_B;
      flown.path.push_back(now);
    });
    end_s = t_s + tick_s;
    flown.flight.how = trouble(robot, false);
    if (!flown.flight.how.empty()) {
      flown.flight.crashed = true;
      break;
    }
  }
  sensors.finish(flown.flight.log, end_s);
  return flown;
}

FamilyFlight fly_on_board(const Assignment& a, std::size_t number, const std::array<double, 4>& start, double lasts_s,
                          OnBoard& firmware) {
  Robot robot(a, number);
  Sensors sensors(a, number, robot, sensor_parameters(a, robot));
  const double tick_s = robot.parameters().hold_s;
  const Eigen::Quaterniond attitude(Eigen::AngleAxisd(start[3], Eigen::Vector3d::UnitZ()));
  robot.mechanism().place({start[0], start[1], start[2]}, attitude);
  firmware.start(0, {start[0], start[1], start[2], attitude.w(), attitude.x(), attitude.y(), attitude.z()});
  FamilyFlight flight;
  flightlog::CommandStream& commands = flight.log.command;
  double end_s = 0;
  for (long tick = 0; flight.how.empty() && tick < std::lround(lasts_s / tick_s); ++tick) {
    const double t_s = static_cast<double>(tick) * tick_s;
    sensors.hand_over(firmware, t_s);
    const std::array<double, 2> volts = firmware.volts(t_s);
    commands.t_s.push_back(t_s);
    commands.left_voltage_V.push_back(volts[0]);
    commands.right_voltage_V.push_back(volts[1]);
    std::size_t step = 0;
    robot.tick(volts, [&] { sensors.after_step(robot, t_s + static_cast<double>(++step) * robot.step_s()); });
    end_s = t_s + tick_s;
    flight.how = trouble(robot, true);
  }
  flight.crashed = !flight.how.empty();
  sensors.finish(flight.log, end_s);
  return flight;
}

}  // namespace flappy::blind::c
