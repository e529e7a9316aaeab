// The hash by which ROS 2 (from Iron on) knows a type of message (REP 2016).
#pragma once

#include <string>

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros {

/// "RIHS01_" and the SHA-256 of the type's description: JSON of its members and of all types that it refers to, by name, with
/// the spaces that ROS 2 writes.
std::string type_hash(const Layout& layout);

/// What is hashed.
std::string type_description(const Layout& layout);

}  // namespace flappy::flightlog::ros
