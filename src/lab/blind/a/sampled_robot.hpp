#pragma once

#include <filesystem>

#include "io/files.hpp"
#include "lab/blind/a/flights.hpp"
#include "sim/randomise.hpp"

namespace flappy::blind {

struct Crash {
  std::size_t flight;  ///< counted from 1
  std::string how;
};

struct SampledRobot {
  Case flown;               ///< has the vehicle and the seed of the draw
  std::uint64_t draw = 0;   ///< number of the draw, from 0
  std::vector<Crash> lost;  ///< crashes of the earlier draws
  std::vector<RobotFlight> flights;
};

/// The robot as its file declares it. Throws InputError if the file has effects.
Case declared_case(const std::filesystem::path& vehicle_file);

class NeverFlies : public io::InputError {
 public:
  using InputError::InputError;
};

inline constexpr std::uint64_t kTries = 20;  ///< largest number of draws

/// The case of one draw of a seed. `c`: the part that all draws share.
Case sampled_case(Case c, const sim::Randomisation& randomisation, std::uint64_t seed, std::uint64_t draw);

/// Draws robots until one flies all its flights. Equal seeds give equal bytes. Throws NeverFlies after 20 draws.
SampledRobot fly_sampled(Case c, const sim::Randomisation& randomisation, std::uint64_t seed);

}  // namespace flappy::blind
