#pragma once

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros {

/// Messages of ROS 2 (unchanged since Humble) and of flappy_msgs:
///
///   WingInput        applied by the driver: inputs of the wing beat, voltages, phase of the beat
///   WingLoads        of a simulator: force, moment, lift, drag and power of each wing
///   Tick             sent by a simulated robot to its autopilot in each control period
///   TrainingMetrics  progress of a training
///   JobStatus        a job in the queue of a server
///   Watch            selects the flapper of a batch that is shown
///   Command, CommandResult, FileChunk   a request to a server, its reply, and a part of a file that it sends
///
/// The texts have members only: constants, defaults and comments belong neither to a message's bytes nor to its hash.
const Definitions& standard_messages();

namespace type_name {
inline constexpr const char *kPoseStamped = "geometry_msgs/msg/PoseStamped", *kImu = "sensor_msgs/msg/Imu",
                            *kJointState = "sensor_msgs/msg/JointState",
                            *kBatteryState = "sensor_msgs/msg/BatteryState", *kTFMessage = "tf2_msgs/msg/TFMessage",
                            *kClock = "rosgraph_msgs/msg/Clock", *kWingInput = "flappy_msgs/msg/WingInput",
                            *kAccelStamped = "geometry_msgs/msg/AccelStamped",
                            *kWingLoads = "flappy_msgs/msg/WingLoads";
}  // namespace type_name

}  // namespace flappy::flightlog::ros
