#include "lab/blind/c/c_bench.hpp"

#include <algorithm>

#include "io/files.hpp"
#include "lab/blind/c/c_flight.hpp"

namespace flappy::blind::c {
namespace {

constexpr double kRest_s = 1, kZero_s = 0.5;  // the springs come to rest within 0.2 s
constexpr std::size_t kStream = 2000;         // random streams of runs begin behind those of flights and escapes

}  // namespace

FamilyFlight run_on_bench(const Assignment& a, std::size_t run, double until_s) {
  if (run >= Family::kFlights)
    throw io::InputError("run " + std::to_string(run) + ": a clamped robot flies no proposal; accepted: 0 to 2");
  const std::size_t stream = kStream + run;
  Robot robot(a, stream);
  const Eigen::Vector3d place_W(0, 0, (Room::kGround_m + Room::kCeiling_m) / 2);
  robot.mechanism().place(place_W, Eigen::Quaterniond::Identity());
  robot.mechanism().clamp();
  const RobotParameters& f = robot.parameters();
  const BenchProgramme programme(a, run, f);
  Sensors sensors(a, stream, robot, sensor_parameters(a, robot));
  Rig rig(a, stream, robot, rig_parameters(a, robot));
  const double tick_s = f.hold_s;
  const long before = std::lround(kRest_s / tick_s), zeroing = std::lround(kZero_s / tick_s),
             after = std::lround(std::min(until_s, programme.lasts_s()) / tick_s);
  FamilyFlight flight;
  double end_s = 0;
  for (long tick = -before; tick < after; ++tick) {
    const double t_s = static_cast<double>(tick) * tick_s, phase = beat_phase(t_s, f.flapping_Hz);
    const Inputs inputs = programme.inputs(t_s);
    const std::array<double, 2> voltages = beat_voltages(inputs, phase, f);
    if (tick >= 0) add_command(flight.log.command, t_s, voltages, inputs, phase);
    const bool filmed = programme.filmed(t_s);
    std::size_t step = 0;
    robot.tick(voltages, [&] {
      const double now_s = t_s + static_cast<double>(++step) * robot.step_s();
      sensors.after_step(robot, now_s);
      if (tick >= -zeroing) rig.after_step(robot, now_s, filmed);
    });
    end_s = t_s + tick_s;
    if (!robot.is_finite()) {
      flight.crashed = true;
      flight.how = "its motion diverged";
      break;
    }
  }
  sensors.finish(flight.log, end_s);
  flight.log.header.mocap = {};
  flight.log.header.imu = {};
  rig.finish(flight.log, end_s);
  flightlog::LogAmbient& room = flight.log.header.ambient;
  room.ground_z_m -= place_W.z();
  room.ceiling_z_m -= place_W.z();
  return flight;
}

}  // namespace flappy::blind::c
