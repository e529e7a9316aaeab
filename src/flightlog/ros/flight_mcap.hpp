// Writes a flight log as topics of ROS 2, for Foxglove, PlotJuggler and other readers of bags.
//
//   /pose         PoseStamped    motion capture, in "world"          /tf      TFMessage   the same, "world" to "torso"
//   /imu          Imu            in "torso"; variances as declared   /clock   Clock       with every pose
//   /wing_input   WingInput      inputs and voltages that the driver applied; NaN where the log lacks them
//   /battery      BatteryState   where power is logged: current is minus that of both motors
//   /motors       JointState     where power is logged: effort is the current in A of left_motor and right_motor
//   /joint_states JointState     where wings are logged: left_stroke, left_rotation, right_stroke, right_rotation
//   /wing_loads   WingLoads      where a simulator gives them: means over the control period that ends at the stamp
//
// And for each vehicle that is said to have flown, what it predicts (docs/reference/formats.md):
//
//   /NAME/imu            Imu           what the robot's IMU would have measured
//   /NAME/residual       Imu           /imu less /NAME/imu
//   /NAME/beat_residual  AccelStamped  the mean of a beat: specific force and angular acceleration, in B
//
// A message's log time is the arrival of its sample; its stamp is earlier by the declared latency.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog::ros {

/// How a vehicle predicts a flight: residuals are measured less predicted, in B.
struct VehicleTopics {
  struct Imu {
    std::size_t sample;  ///< of the log's imu
    std::array<double, 3> force_m_s2, rate_rad_s;
  };
  struct Beat {
    double t_s;  ///< measured time of its middle
    std::array<double, 3> force_m_s2, turning_rad_s2;
  };
  std::string name;
  std::vector<Imu> imu;
  std::vector<Beat> beats;
};

/// `wing_loads`: columns of wing_loads.csv (kWingLoadNames), or none. Returns the number of messages. InputError where
/// the file cannot be written, or the flight has no voltages.
std::uint64_t write_flight_mcap(const std::filesystem::path& path, const FlightLog& log,
                                const std::vector<VehicleTopics>& vehicles = {},
                                const std::vector<Column>& wing_loads = {});

}  // namespace flappy::flightlog::ros
