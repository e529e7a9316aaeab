// Reads the members of a ROS 2 message from its definition (the text of a .msg file). A concatenated definition, as in
// MCAP and rosbag2, also has the messages that it refers to, each after a line of '=' and a line "MSG: package/Type".
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog::ros {

/// Thrown for an invalid definition and for invalid bytes of a message.
class MessageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Numbered as in type_description_interfaces/msg/FieldType, because type hashes (REP 2016) contain these numbers.
enum class Kind : std::uint8_t {
  message = 1,
  int8 = 2,
  uint8 = 3,
  int16 = 4,
  uint16 = 5,
  int32 = 6,
  uint32 = 7,
  int64 = 8,
  uint64 = 9,
  float32 = 10,
  float64 = 11,
  boolean = 15,
  byte = 16,
  string = 17,
};

enum class Many : std::uint8_t { one, array, bounded, unbounded };

struct Layout;

struct LayoutField {
  std::string name;
  Kind kind = Kind::message;
  Many many = Many::one;
  std::size_t capacity = 0;         ///< size of an array, largest size of a bounded sequence
  std::size_t string_capacity = 0;  ///< 0: unbounded
  std::shared_ptr<const Layout> message;
};

struct Layout {
  std::string name;  ///< "package/msg/Type"
  std::vector<LayoutField> fields;
};

/// "package/msg/Type" from "package/Type"; other names stay as they are.
std::string full_type_name(std::string_view name);

/// Texts of definitions by type name.
class Definitions {
 public:
  /// Adds all parts of a concatenated definition; known parts are not replaced.
  void add(std::string_view type, std::string_view text);
  bool has(std::string_view type) const { return texts_.contains(full_type_name(type)); }
  /// MessageError where the type, or one that it refers to, is unknown, cannot be read or contains itself.
  std::shared_ptr<const Layout> layout(std::string_view type) const;
  std::string concatenated(std::string_view type) const;
  std::vector<std::string> names() const;

 private:
  std::map<std::string, std::string> texts_;
};

}  // namespace flappy::flightlog::ros
