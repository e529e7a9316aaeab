#include "flightlog/check/digits.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>

#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// Significant digits from which a double may have been written in full.
constexpr int kAllDigits = 15;

/// Unit of the last digit of the shortest text that stands for this double; 0 where it has all digits.
double unit_of(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::scientific).ptr;
  const std::string number(text, end);
  const std::size_t e = number.find('e'), point = number.find('.');
  const int after = point == std::string::npos ? 0 : static_cast<int>(e - point - 1);
  return after + 1 >= kAllDigits ? 0 : std::pow(10, std::atoi(number.c_str() + e + 1) - after);
}

}  // namespace

double last_digit(const std::vector<double>& values) {
  std::vector<double> units;
  for (const double v : values)
    if (std::isfinite(v) && v != 0) units.push_back(unit_of(v));
  return units.empty() ? 0 : io::median(units);
}

}  // namespace flappy::flightlog
