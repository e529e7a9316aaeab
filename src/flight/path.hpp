// The reference path of a flapper: quintic segments in x, y, z (in W) and heading, starting at whole control ticks.
#pragma once

#include <cstdint>

#include "flight/estimator.hpp"

namespace flappy::flight {

/// Polynomial segment: coefficients[x, y, z, heading][n] of (t - start)^n; m, rad and s.
template <class T>
struct Segment {
  std::uint32_t start_tick;
  T coefficients[4][6];
};

/// Segments in order of their start; the last one never ends.
template <class T>
struct PathView {
  const Segment<T>* segments;
  std::uint32_t count;
  T tick_s;
};

inline namespace FLAPPY_ISA {

template <class T>
struct Setpoint {
  Vec3<T> position_m, velocity_m_s, acceleration_m_s2;  // in W
  SinCos<T> heading;
  T heading_rate_rad_s;
};

/// Set point at each lane's own tick, which must not go back. `segment`: current, advanced here.
template <class L, class T>
FLAPPY_INLINE Setpoint<L> setpoint_at(const PathView<T>& path, const std::uint32_t* tick, std::uint32_t* segment) {
  constexpr int kN = sizeof(L) / sizeof(T);
  T time[kN];
  bool same = true;
  for (int i = 0; i < kN; ++i) {
    while (segment[i] + 1 < path.count && tick[i] >= path.segments[segment[i] + 1].start_tick) ++segment[i];
    time[i] = static_cast<T>(tick[i] - path.segments[segment[i]].start_tick) * path.tick_s;
    same = same && segment[i] == segment[0];
  }
  const L t = L::load(time);
  L value[4], rate[4], bend[4];
  for (int c = 0; c < 4; ++c) {
    L a[6];
    for (int n = 0; n < 6; ++n) {
      T each[kN];
      if (same) {
        a[n] = L(path.segments[segment[0]].coefficients[c][n]);
      } else {
        for (int i = 0; i < kN; ++i) each[i] = path.segments[segment[i]].coefficients[c][n];
        a[n] = L::load(each);
      }
    }
    value[c] = (((((a[5] * t + a[4]) * t + a[3]) * t + a[2]) * t + a[1]) * t) + a[0];
    rate[c] = ((((L(5) * a[5]) * t + L(4) * a[4]) * t + L(3) * a[3]) * t + L(2) * a[2]) * t + a[1];
    bend[c] = (((L(20) * a[5]) * t + L(12) * a[4]) * t + L(6) * a[3]) * t + L(2) * a[2];
  }
  return {{value[0], value[1], value[2]},
          {rate[0], rate[1], rate[2]},
          {bend[0], bend[1], bend[2]},
          sin_cos_wide(value[3]),
          rate[3]};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
