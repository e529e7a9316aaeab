// Counter-based random numbers (Philox 4x32-10, Random123): a draw depends on its key alone, not on order or threads.
#pragma once

#include <Random123/philox.h>

#include <cstdint>

#include "model/math.hpp"

namespace flappy::sim {

/// Purpose of a random number; part of its key. Never renumber: recorded runs depend on it.
enum class Stream : std::uint32_t {
  vehicle = 1,
  sensor_bias = 2,
  imu = 3,
  mocap = 4,
  start = 5,
  exploration = 6,
  start_estimate = 7,
  power = 8,
  wings = 9,
  weights = 10,
  replay = 11,
  target_noise = 12,
  snapshot = 13,
  force_sensor = 14,
  design = 15,
  effects = 16,
  inference = 17,
};

struct RandomKey {
  std::uint64_t seed = 0;
  std::uint32_t flapper = 0, episode = 0;
  Stream stream = Stream::vehicle;
};

/// Two uniform doubles in (0, 1), 53 bits each; `index` counts within the stream.
struct UniformPair {
  double first, second;
};

inline UniformPair uniform_pair(const RandomKey& key, std::uint32_t index) {
  using Philox = r123::Philox4x32;
  const Philox::ctr_type counter{{index, static_cast<std::uint32_t>(key.stream), key.flapper, key.episode}};
  const Philox::key_type k{{static_cast<std::uint32_t>(key.seed), static_cast<std::uint32_t>(key.seed >> 32)}};
  const Philox::ctr_type r = Philox()(counter, k);
  const auto unit = [](std::uint32_t high, std::uint32_t low) {
    const std::uint64_t bits = (std::uint64_t{high} << 21) ^ (low >> 11);
    return model::min((static_cast<double>(bits) + 0.5) * 0x1p-53, 1 - 0x1p-53);  // the largest would round to 1
  };
  return {unit(r[0], r[1]), unit(r[2], r[3])};
}

/// Standard normal (Box and Muller 1958).
inline double normal(const RandomKey& key, std::uint32_t index) {
  const UniformPair u = uniform_pair(key, index);
  return model::sqrt(-2 * model::log(u.first)) * model::cos_pi(2 * u.second - 1);
}

}  // namespace flappy::sim
