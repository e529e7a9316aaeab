// The hash that identifies a message type in ROS 2, from Iron on (REP 2016).
#pragma once

#include <string>

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros {

/// "RIHS01_" and the SHA-256 of type_description().
std::string type_hash(const Layout& layout);

/// JSON of a type and of all that it refers to, sorted by name, with the spaces that ROS 2 writes.
std::string type_description(const Layout& layout);

}  // namespace flappy::flightlog::ros
