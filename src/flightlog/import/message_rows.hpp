// Messages of ROS 2 as rows.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"
#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog {

/// Reads messages of one type. A number's field is its path, "pose.position.x". What has a name is known by it: where a message has
/// a sequence of names (JointState), element i of every other is "position[left_stroke]"; where elements of a sequence have a
/// name or a child_frame_id themselves (TFMessage), "transforms[torso].transform.translation.x".
class MessageRows {
 public:
  explicit MessageRows(std::shared_ptr<const ros::Layout> layout) : layout_(std::move(layout)) {}

  /// The row, until the next is read. ros::MessageError for bytes that are no such message.
  const Row& read(std::string_view bytes);
  /// Of the row: the first member that is a stamp; kNoTime where there is none.
  std::int64_t stamp_ns() const { return stamp_ns_; }

 private:
  void rename();

  std::shared_ptr<const ros::Layout> layout_;
  Row row_;
  std::vector<std::string> names_;                          ///< of the members of all sequences
  std::vector<std::pair<std::string, std::string>> named_;  ///< "transforms[0]" and what it is called
  std::int64_t stamp_ns_ = kNoTime;
};

}  // namespace flappy::flightlog
