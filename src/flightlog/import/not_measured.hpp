// What messages say is not measured, although they hold a number for it:
//
//   any message      X_covariance with -1 as element 0: all of X (sensor_msgs/Imu: "disregard the associated estimate")
//   sensor_msgs      Range: a range outside min_range to max_range; NavSatFix: a position with status.status below 0
//   PX4 [1]          sensor_combined: accelerometer_m_s2, where its relative timestamp is 2^31 - 1
//                    ..._local_position...: x and y, z, vx and vy, vz, dist_bottom, where their ..._valid is 0
//                    battery_status: voltage_v of 0, current_a of -1
//                    distance_sensor: current_distance, where signal_quality is 0
//
// PX4's messages are told by their name in ULog and in px4_msgs of ROS 2. Covariances of 0 mean "unknown", not that
// nothing was measured. NaN needs no rule.
// [1] PX4/PX4-Autopilot, msg/*.msg.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

class NotMeasured {
 public:
  /// `type` of all messages: "sensor_msgs/msg/Imu", or a topic of ULog, "sensor_combined".
  explicit NotMeasured(std::string_view type);
  /// Replaces what the message says is not measured by kNotMeasured.
  void mark(Row& row);

 private:
  std::string type_;                 ///< "sensor_combined" of px4_msgs/msg/SensorCombined, too
  std::vector<std::string> fields_;  ///< names of this message's fields
};

}  // namespace flappy::flightlog
