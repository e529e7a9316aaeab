// Robots drawn one after another until one flies all its flights.
#pragma once

#include <filesystem>

#include "blind/a/flights.hpp"
#include "io/files.hpp"
#include "sim/randomise.hpp"

namespace flappy::blind {

struct Crash {
  std::size_t flight;  ///< counted from 1
  std::string how;
};

struct SampledRobot {
  Case flown;               ///< with the vehicle and the seed of the draw
  std::uint64_t draw = 0;   ///< which of the seed's
  std::vector<Crash> lost;  ///< of the draws before
  std::vector<RobotFlight> flights;
};

/// The robot as its file declares it. InputError where the file has effects.
Case declared_case(const std::filesystem::path& vehicle_file);

/// Every one of the draws crashed.
class NeverFlies : public io::InputError {
 public:
  using InputError::InputError;
};

inline constexpr std::uint64_t kTries = 20;  ///< robots drawn until one does not crash

/// One draw of a seed's. `c`: what all draws share.
Case sampled_case(Case c, const sim::Randomisation& randomisation, std::uint64_t seed, std::uint64_t draw);

/// `c`: what all draws share. The same bytes for the same seed. NeverFlies after 20 draws.
SampledRobot fly_sampled(Case c, const sim::Randomisation& randomisation, std::uint64_t seed);

}  // namespace flappy::blind
