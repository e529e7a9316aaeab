// Writes a flight log as topics of ROS 2, for Foxglove, PlotJuggler and other readers of bags.
//
//   /pose         PoseStamped    motion capture, in "world"          /tf      TFMessage   the same, "world" to "torso"
//   /imu          Imu            in "torso"; variances as declared   /clock   Clock       with every pose
//   /wing_input   WingInput      inputs and voltages that the driver applied; NaN where the log lacks them
//   /battery      BatteryState   where power is logged: current is minus that of both motors
//   /motors       JointState     where power is logged: effort is the current in A of left_motor and right_motor
//   /joint_states JointState     where wings are logged: left_stroke, left_rotation, right_stroke, right_rotation
//
// A message's log time is the arrival of its sample; its stamp is earlier by the declared latency.
#pragma once

#include <filesystem>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog::ros {

/// InputError where the file cannot be written, or the flight has no voltages.
void write_flight_mcap(const std::filesystem::path& path, const FlightLog& log);

}  // namespace flappy::flightlog::ros
