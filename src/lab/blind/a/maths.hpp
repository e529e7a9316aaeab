// Elementary functions and random numbers with the same bits on every processor, unlike libm. They share no code with
// the simulator under test. Absolute errors are below 1e-13 unless stated.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace flappy::blind {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

inline constexpr double kPi = std::numbers::pi;

/// Nearest whole number, for |x| < 2^51.
inline double nearest(double x) {
  constexpr double kShift = 0x1.8p52;
  return (x + kShift) - kShift;
}

struct SinCos {
  double sin, cos;
};

/// Valid for |x| up to about 1e6.
inline SinCos sin_cos(double x) {
  const double n = nearest(x * (2 / kPi));
  const double r = (x - n * 0x1.921fb54400000p+0) - n * 0x1.0b4611a626331p-34, y = r * r;
  const double s =
      r + r * y *
              (-1.0 / 6 +
               y * (1.0 / 120 + y * (-1.0 / 5040 + y * (1.0 / 362880 + y * (-1.0 / 39916800 + y / 6227020800.0)))));
  const double c =
      1 + y * (-0.5 + y * (1.0 / 24 +
                           y * (-1.0 / 720 +
                                y * (1.0 / 40320 + y * (-1.0 / 3628800 + y * (1.0 / 479001600 - y / 87178291200.0))))));
  switch (static_cast<std::int64_t>(n) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

/// Valid for x up to 700, with a relative error below 1e-13; 0 for x below -700.
inline double exponential(double x) {
  if (x < -700) return 0;
  const double n = nearest(x * std::numbers::log2e);
  const double r = (x - n * 0x1.62e42fee00000p-1) - n * 0x1.a39ef35793c76p-33;
  double sum = 1;
  for (int k = 12; k > 0; --k) sum = 1 + r / k * sum;
  return sum * std::bit_cast<double>(static_cast<std::uint64_t>(1023 + static_cast<std::int64_t>(n)) << 52);
}

/// Natural logarithm; x must be positive and normal.
inline double logarithm(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  double exponent = static_cast<double>(static_cast<std::int64_t>(bits >> 52) - 1023);
  double m = std::bit_cast<double>((bits & 0xfffffffffffff) | (std::uint64_t{1023} << 52));
  if (m > std::numbers::sqrt2) m /= 2, exponent += 1;
  const double t = (m - 1) / (m + 1), y = t * t;
  double sum = 0;
  for (int k = 19; k > 0; k -= 2) sum = 1.0 / k + y * sum;
  return 2 * t * sum + exponent * std::numbers::ln2;
}

/// `base` must be positive.
inline double power(double base, double exponent) { return exponential(exponent * logarithm(base)); }

inline double hyperbolic_tangent(double x) {
  if (std::abs(x) > 20) return std::copysign(1.0, x);
  return 1 - 2 / (exponential(2 * x) + 1);
}

/// 1, 1/3, 1/5, ...
inline constexpr std::array<double, 17> kOdd = [] {
  std::array<double, 17> one_over{};
  for (std::size_t k = 0; k < one_over.size(); ++k) one_over[k] = 1.0 / static_cast<double>(2 * k + 1);
  return one_over;
}();

/// Angle in [0, pi] of a point at (cos, sin) with sin >= 0; the two need no common scale.
inline double angle_of(double sin, double cos) {
  // halved twice, tan(a / 2) = sin / (1 + cos), then the series of the arc tangent up to tan(pi / 8)
  const double length = std::sqrt(sin * sin + cos * cos) + 1e-300;
  const double c = std::abs(cos) / length, s = sin / length;
  const double half = s / (1 + c), t = half / (1 + std::sqrt(1 + half * half)), y = t * t;
  double sum = 0;
  for (std::size_t k = kOdd.size(); k-- > 0;) sum = kOdd[k] - y * sum;
  const double angle = 4 * t * sum;
  return cos < 0 ? kPi - angle : angle;
}

inline Quaterniond turned_by(const Vector3d& angle_rad) {
  const double a = std::sqrt(angle_rad.squaredNorm());
  if (a < 1e-9) return Quaterniond(1, angle_rad.x() / 2, angle_rad.y() / 2, angle_rad.z() / 2).normalized();
  const SinCos half = sin_cos(a / 2);
  const Vector3d v = half.sin / a * angle_rad;
  return {half.cos, v.x(), v.y(), v.z()};
}

/// What random numbers are drawn for.
enum class Purpose : std::uint64_t {
  // once for a robot
  com_offset,
  inertia_products,
  directions,
  damaged_side,
  sensors,
  warm_up,
  accelerometer,
  level,
  markers,
  parameters,
  other_sensors,
  declarations,
  // once for a session
  session,
  // once for a flight
  gusts,
  delays,
  brushes,
  imu_noise,
  gyro_walk,
  mocap_noise,
  programme,
  view,
  power_noise,
  wings_noise,
  escape_start,
  count
};
inline constexpr std::uint64_t kPurposes = 64;
static_assert(static_cast<std::uint64_t>(Purpose::count) <= kPurposes);

/// Number of a robot's stream of random numbers.
inline std::uint64_t stream_of(Purpose p) { return static_cast<std::uint64_t>(p); }
/// `number`: of the flight, or of the first flight of the session (flight_number()).
inline std::uint64_t stream_of(Purpose p, std::uint64_t number) {
  return kPurposes * (number + 1) + static_cast<std::uint64_t>(p);
}

/// Stream of random numbers for one purpose; its draws do not shift those of other purposes.
class Random {
 public:
  Random(std::uint64_t seed, Purpose p) : Random(seed, stream_of(p)) {}
  Random(std::uint64_t seed, Purpose p, std::uint64_t number) : Random(seed, stream_of(p, number)) {}

  /// Uniform in (0, 1).
  double uniform() { return (static_cast<double>(engine_() >> 12) + 0.5) * 0x1p-52; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2 * logarithm(uniform()));
    return radius * sin_cos(2 * kPi * uniform()).cos;
  }
  Vector3d normals() {
    const double x = normal(), y = normal();
    return {x, y, normal()};
  }
  /// Unit vector in a random direction of the x-y plane.
  Vector3d level() {
    const SinCos t = sin_cos(2 * kPi * uniform());
    return {t.cos, t.sin, 0};
  }
  double sign() { return uniform() < 0.5 ? -1 : 1; }

 private:
  Random(std::uint64_t seed, std::uint64_t stream) : engine_(seed * 0x9e3779b97f4a7c15ULL + stream) {}
  std::mt19937_64 engine_;
};

}  // namespace flappy::blind
