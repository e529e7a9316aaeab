// Recorded messages of ROS 2: rosbag2's MCAP files and SQLite databases, alone or in a bag's folder.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros {

struct BagTopic {
  std::string name, type;  ///< "/imu", "sensor_msgs/msg/Imu"
  /// Concatenated, as the bag has it; where it has none, empty.
  std::string definition;
  std::string encoding = "cdr";  ///< of its messages
};

struct BagMessage {
  const BagTopic* topic;  ///< lives as long as the bag
  std::int64_t received_ns;
  std::string_view bytes;  ///< until the next is read
};

/// Messages of one file or folder, in the order in which they were written.
class Bag {
 public:
  virtual ~Bag() = default;
  /// Nothing at the end, or where what follows cannot be read.
  virtual std::optional<BagMessage> next() = 0;
  /// Names of the topics that were announced so far, whether messages of them came or not.
  virtual std::vector<std::string> topics() const = 0;
  /// What was left out so far.
  virtual std::vector<std::string> warnings() const = 0;

  /// A file, or a folder whose .mcap or .db3 files are taken in order. InputError where it is no bag.
  static std::unique_ptr<Bag> open(const std::filesystem::path& path);
  /// Whether open() takes it for one.
  static bool is_bag(const std::filesystem::path& path);
};

/// The layout of a topic's messages, by the bag's own definition or by that of standard_messages(). MessageError where neither is
/// there or can be read, and where messages are not in CDR.
std::shared_ptr<const Layout> layout_of(const BagTopic& topic);

}  // namespace flappy::flightlog::ros
