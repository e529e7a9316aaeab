// The messages that this project reads and writes, known without a definition beside them.
#pragma once

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros {

/// Those of ROS 2 (the same from Humble on), and flappy_msgs:
///
///   WingInput        what the driver applied: inputs of the wing beat, voltages, phase of the beat
///   Tick             what a simulated robot tells its autopilot in each control period
///   TrainingMetrics  how far a training is
///   JobStatus        a job in the queue of a server
///   Watch            which flapper of a batch is shown
///   Command, CommandResult, FileChunk   what is asked of a server, and what it says and hands over
///
/// Each as members alone: constants, defaults and comments are no part of a message on the wire, nor of its hash.
const Definitions& standard_messages();

namespace type_name {
inline constexpr const char *kPoseStamped = "geometry_msgs/msg/PoseStamped", *kImu = "sensor_msgs/msg/Imu",
                            *kJointState = "sensor_msgs/msg/JointState",
                            *kBatteryState = "sensor_msgs/msg/BatteryState", *kTFMessage = "tf2_msgs/msg/TFMessage",
                            *kClock = "rosgraph_msgs/msg/Clock", *kWingInput = "flappy_msgs/msg/WingInput";
}  // namespace type_name

}  // namespace flappy::flightlog::ros
