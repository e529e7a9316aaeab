// Random numbers: a Mersenne twister, whose output the C++ standard fixes, and an own Box-Muller transform, because
// std::normal_distribution differs between libraries.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <random>
#include <string_view>

namespace flappy::blind::c {

class Random {
 public:
  /// Independent streams for each seed, purpose and number.
  Random(std::uint64_t seed, std::string_view purpose, std::uint64_t number = 0) {
    std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
    for (const char letter : purpose) hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3ULL;
    engine_.seed(scrambled(scrambled(seed) ^ hash) + scrambled(number + 1));
  }

  /// Evenly distributed in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(uniform() * static_cast<double>(count)); }
  double sign() { return uniform() < 0.5 ? -1.0 : 1.0; }

  double normal() {
    if (kept_) {
      kept_ = false;
      return other_;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform())), angle = 2 * M_PI * uniform();
    other_ = radius * std::sin(angle);
    kept_ = true;
    return radius * std::cos(angle);
  }
  /// Standard normal number, redrawn beyond three standard deviations.
  double cut_normal() {
    for (;;) {
      const double value = normal();
      if (std::abs(value) <= 3) return value;
    }
  }
  Eigen::Vector3d normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }
  Eigen::Vector3d direction() {
    const Eigen::Vector3d v = normal3();
    return v / v.norm();
  }

 private:
  static std::uint64_t scrambled(std::uint64_t x) {  // splitmix64
    x += 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31U);
  }

  std::mt19937_64 engine_;
  double other_ = 0;
  bool kept_ = false;
};

}  // namespace flappy::blind::c
