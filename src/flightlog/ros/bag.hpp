// Reads recorded messages of ROS 2: rosbag2's MCAP files and SQLite databases, single files or the folder of a bag.
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
  /// Concatenated definition from the bag; empty where the bag has none.
  std::string definition;
  std::string encoding = "cdr";  ///< serialisation of the messages
};

struct BagMessage {
  const BagTopic* topic;  ///< lives as long as the bag
  std::int64_t received_ns;
  std::string_view bytes;  ///< valid until the next message is read
};

/// Messages of one file or folder, in the order of writing.
class Bag {
 public:
  virtual ~Bag() = default;
  /// The next message; nothing at the end or where the rest cannot be read.
  virtual std::optional<BagMessage> next() = 0;
  /// Names of the topics announced so far, with or without messages.
  virtual std::vector<std::string> topics() const = 0;
  /// Warnings about what was left out so far.
  virtual std::vector<std::string> warnings() const = 0;

  /// Opens a file, or a folder whose .mcap or .db3 files follow each other by number. InputError where it is no bag.
  static std::unique_ptr<Bag> open(const std::filesystem::path& path);
  static bool is_bag(const std::filesystem::path& path);
};

/// A topic's layout, from its bag or standard_messages(). MessageError where neither has it or messages are not CDR.
std::shared_ptr<const Layout> layout_of(const BagTopic& topic);

}  // namespace flappy::flightlog::ros
