// Random numbers: each seed, flight and stream has its own Mersenne twister. Normals are made by Box and Muller,
// because std::normal_distribution differs between standard libraries.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace flappy::blind::b {

enum class Stream : std::uint64_t {
  kParameters = 1,
  kSensors,
  kConventions,
  kProgramme,
  kImu,
  kMocap,
  kPower,
  kWings,
  kStart,
  kSession,
  kRig,
  kRigConventions,
  kForces,
  kFilm,
  kEffect = 100,  ///< plus the number of the effect
};

/// Number under which a flight of a session draws; in session 0 the flight's own.
inline std::uint64_t draw_number(std::uint64_t flight, std::size_t session) {
  return flight + (static_cast<std::uint64_t>(session) << 32U);
}

class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t flight, Stream stream, std::uint64_t number = 0)
      : engine_(mixed(mixed(mixed(seed) ^ flight) ^ (static_cast<std::uint64_t>(stream) + number))) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    const double angle = 2 * std::numbers::pi * uniform();
    second_ = radius * std::sin(angle);
    has_second_ = true;
    return radius * std::cos(angle);
  }
  /// normal(), drawn again while its absolute value exceeds 3.
  double normal_within_three() {
    double x = normal();
    while (std::abs(x) > 3) x = normal();
    return x;
  }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  double sign() { return uniform() < 0.5 ? -1.0 : 1.0; }

 private:
  /// The finaliser of splitmix64.
  static std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31U);
  }

  std::mt19937_64 engine_;
  double second_ = 0;
  bool has_second_ = false;
};

}  // namespace flappy::blind::b
