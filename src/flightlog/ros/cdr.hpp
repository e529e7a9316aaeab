// Messages as ROS 2 has them on the wire and in bags: XCDR version 1, plain CDR (OMG DDS-XTypes 1.3, 7.4.3). Four bytes say the
// byte order; then all members in order, each aligned to its size, counted from behind those four. A string is its length with the
// closing zero, its bytes and the zero; a sequence its count and its elements. Where there is no element, nothing is aligned.
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

/// A scalar as a number; nothing says so of a string: it is NaN.
double to_number(const Scalar& scalar);

/// Told every member in order by its path: "pose.position.x", "name[0]". Of a long sequence only the first elements are told.
using Visitor = std::function<void(std::string_view path, const Scalar& value)>;

/// Elements of a sequence of numbers or strings that a visitor is told of; images and clouds of points have many more.
inline constexpr std::size_t kMostElements = 1024;

/// MessageError where the bytes end early or contradict the layout; whatever they are, nothing else happens. What follows the message
/// is not looked at, as senders pad.
void decode(const Layout& layout, std::string_view bytes, const Visitor& visit);

/// Members by path.
using Members = std::map<std::string, std::variant<std::int64_t, std::uint64_t, double, std::string>, std::less<>>;

/// All members of a message that has no sequence of more than kMostElements.
Members decode(const Layout& layout, std::string_view bytes);

/// The message of these members, little endian. A member that is not given is 0 or empty; a sequence has the elements from [0]
/// on that are given. MessageError for one that is too long, or a string where a number belongs.
std::string encode(const Layout& layout, const Members& members);

}  // namespace flappy::flightlog::ros
