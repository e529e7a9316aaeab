// ROS 2 messages on the wire and in bags: XCDR version 1, plain CDR (OMG DDS-XTypes 1.3, 7.4.3). Four bytes give the
// byte order. Members follow in order, aligned to their size from the end of these. A string: length with closing zero,
// bytes, zero; a sequence: count, elements. An empty sequence has no padding.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <variant>

#include "flightlog/ros/layout.hpp"

namespace flappy::flightlog::ros {

/// Integers and booleans are whole numbers. A string lives as long as the bytes that it was read from.
using Scalar = std::variant<std::int64_t, std::uint64_t, double, std::string_view>;

/// A scalar as a number; a string becomes NaN.
double to_number(const Scalar& scalar);

/// Called for every member in order with its path, "pose.position.x", "name[0]"; in a sequence of numbers or strings
/// only for the first kMaxElements.
using Visitor = std::function<void(std::string_view path, const Scalar& value)>;

/// Elements visited in a sequence of numbers or strings; images and point clouds have many more.
inline constexpr std::size_t kMaxElements = 1024;

/// Visits all members. MessageError where the bytes end early or contradict the layout; no other failure, whatever the
/// bytes are. Bytes after the message are ignored because senders pad.
void decode(const Layout& layout, std::string_view bytes, const Visitor& visit);

/// Values of members by path.
using Members = std::map<std::string, std::variant<std::int64_t, std::uint64_t, double, std::string>, std::less<>>;

Members decode(const Layout& layout, std::string_view bytes);

/// Serialises, little endian. A missing member is 0 or empty; a sequence ends before its first missing element.
/// MessageError for a sequence or string that is too long and for a string in place of a number.
std::string encode(const Layout& layout, const Members& members);

}  // namespace flappy::flightlog::ros
