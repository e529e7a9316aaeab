#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"
#include "flightlog/import/not_measured.hpp"
#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog {

/// Turns ROS 2 messages of one type into rows. A number's field is its path, "pose.position.x". Names replace indices:
/// where a message has a sequence "name" (JointState), element i of every other one becomes "position[left_stroke]";
/// where elements have a member name or child_frame_id (TFMessage), they become
/// "transforms[torso].transform.translation.x". What the message says is not measured is kNotMeasured.
class MessageRows {
 public:
  explicit MessageRows(std::shared_ptr<const ros::Layout> layout)
      : layout_(std::move(layout)), not_measured_(layout_->name) {}

  /// The row of a message, valid until the next call. ros::MessageError where the bytes do not fit the type.
  const Row& read(std::string_view bytes);
  /// The first stamp in the last message; kNoTime where it has none.
  std::int64_t stamp_ns() const { return stamp_ns_; }

 private:
  void rename();

  std::shared_ptr<const ros::Layout> layout_;
  NotMeasured not_measured_;
  Row row_;
  std::vector<std::string> names_;                          ///< the message's sequence "name"
  std::vector<std::pair<std::string, std::string>> named_;  ///< "transforms[0]" and its name
  std::int64_t stamp_ns_ = kNoTime;
};

}  // namespace flappy::flightlog
