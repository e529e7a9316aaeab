#include "flightlog/import/recorded_units.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

namespace flappy::flightlog {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStandardGravity_m_s2 = 9.80665;  // of the unit g, by definition (3rd CGPM, 1901)
constexpr double kInch_m = 0.0254;                 // by definition

struct Spelt {
  RecordedUnit unit;
  std::vector<std::string_view> names;
};

const std::array<Spelt, 19> kUnits = {{
    {{"_m", 1}, {"m", "meter", "meters", "metre", "metres"}},
    {{"_m", 1e-2}, {"cm", "centimeters", "centimetres"}},
    {{"_m", 1e-3}, {"mm", "millimeter", "millimeters", "millimetre", "millimetres"}},
    {{"_m", kInch_m}, {"in", "inch", "inches"}},
    {{"_rad", 1}, {"rad", "radian", "radians"}},
    {{"_rad", kDegree}, {"deg", "degree", "degrees", "\xC2\xB0"}},
    {{"_rad_s", 1}, {"rad/s", "rad/sec", "rads^-1"}},
    {{"_rad_s", kDegree}, {"deg/s", "deg/sec", "dps", "\xC2\xB0/s"}},
    {{"_m_s2", 1}, {"m/s2", "m/s^2", "m/s/s", "m/s\xC2\xB2", "ms^-2"}},
    {{"_m_s2", kStandardGravity_m_s2}, {"g"}},
    {{"_V", 1}, {"v", "volt", "volts"}},
    {{"_V", 1e-3}, {"mv"}},
    {{"_A", 1}, {"a", "ampere", "amperes"}},
    {{"_A", 1e-3}, {"ma"}},
    {{"_s", 1}, {"s", "sec", "second", "seconds"}},
    {{"_s", 1e-3}, {"ms", "msec", "milliseconds"}},
    {{"_s", 1e-6}, {"us", "usec", "\xC2\xB5s", "\xCE\xBCs", "microseconds"}},
    {{"_s", 1e-9}, {"ns", "nsec", "nanoseconds"}},
    {{"_s", 60}, {"min", "minutes"}},
}};

}  // namespace

std::optional<RecordedUnit> recorded_unit(std::string_view text) {
  std::string name;
  for (const char c : text)
    if (std::string_view(" \t[]()").find(c) == std::string_view::npos)
      name += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const Spelt& spelt : kUnits)
    if (std::ranges::find(spelt.names, name) != spelt.names.end()) return spelt.unit;
  return std::nullopt;
}

std::string_view quantity_of(std::string_view column) {
  for (const std::string_view suffix : {"_rad_s", "_m_s2", "_rad", "_m", "_V", "_A"})
    if (column.ends_with(suffix)) return suffix;
  return {};
}

}  // namespace flappy::flightlog
