// Short names of the DDS message structs, which idlc generates from src/server/idl.
#pragma once

#include <flappy_msgs.h>
#include <ros2_msgs.h>

#include <string>

namespace flappy::server {

using Time = builtin_interfaces_msg_dds__Time_;
using Header = std_msgs_msg_dds__Header_;
using PoseStamped = geometry_msgs_msg_dds__PoseStamped_;
using TransformStamped = geometry_msgs_msg_dds__TransformStamped_;
using Imu = sensor_msgs_msg_dds__Imu_;
using JointState = sensor_msgs_msg_dds__JointState_;
using BatteryState = sensor_msgs_msg_dds__BatteryState_;
using TFMessage = tf2_msgs_msg_dds__TFMessage_;
using Clock = rosgraph_msgs_msg_dds__Clock_;
using KeyValue = diagnostic_msgs_msg_dds__KeyValue_;
using DiagnosticStatus = diagnostic_msgs_msg_dds__DiagnosticStatus_;
using DiagnosticArray = diagnostic_msgs_msg_dds__DiagnosticArray_;
using WingInput = flappy_msgs_msg_dds__WingInput_;
using Tick = flappy_msgs_msg_dds__Tick_;
using TrainingMetrics = flappy_msgs_msg_dds__TrainingMetrics_;
using JobStatusMessage = flappy_msgs_msg_dds__JobStatus_;
using Watch = flappy_msgs_msg_dds__Watch_;
using CommandMessage = flappy_msgs_msg_dds__Command_;
using FileChunk = flappy_msgs_msg_dds__FileChunk_;
using CommandResultMessage = flappy_msgs_msg_dds__CommandResult_;

template <class M>
const dds_topic_descriptor_t& descriptor() = delete;
#define FLAPPY_MESSAGE(M, c_name)                        \
  template <>                                            \
  inline const dds_topic_descriptor_t& descriptor<M>() { \
    return c_name##_desc;                                \
  }
FLAPPY_MESSAGE(PoseStamped, geometry_msgs_msg_dds__PoseStamped_)
FLAPPY_MESSAGE(Imu, sensor_msgs_msg_dds__Imu_)
FLAPPY_MESSAGE(JointState, sensor_msgs_msg_dds__JointState_)
FLAPPY_MESSAGE(BatteryState, sensor_msgs_msg_dds__BatteryState_)
FLAPPY_MESSAGE(TFMessage, tf2_msgs_msg_dds__TFMessage_)
FLAPPY_MESSAGE(Clock, rosgraph_msgs_msg_dds__Clock_)
FLAPPY_MESSAGE(DiagnosticArray, diagnostic_msgs_msg_dds__DiagnosticArray_)
FLAPPY_MESSAGE(WingInput, flappy_msgs_msg_dds__WingInput_)
FLAPPY_MESSAGE(Tick, flappy_msgs_msg_dds__Tick_)
FLAPPY_MESSAGE(TrainingMetrics, flappy_msgs_msg_dds__TrainingMetrics_)
FLAPPY_MESSAGE(JobStatusMessage, flappy_msgs_msg_dds__JobStatus_)
FLAPPY_MESSAGE(Watch, flappy_msgs_msg_dds__Watch_)
FLAPPY_MESSAGE(CommandMessage, flappy_msgs_msg_dds__Command_)
FLAPPY_MESSAGE(FileChunk, flappy_msgs_msg_dds__FileChunk_)
FLAPPY_MESSAGE(CommandResultMessage, flappy_msgs_msg_dds__CommandResult_)
#undef FLAPPY_MESSAGE

std::string ros_name(const std::string& dds_name);  ///< "sensor_msgs::msg::dds_::Imu_" -> "sensor_msgs/msg/Imu"
Time time_of(double t_s);                           ///< to whole nanoseconds, rounded
double seconds_of(const Time& t);
Time now();  ///< wall-clock time, for messages that belong to no flight

}  // namespace flappy::server
