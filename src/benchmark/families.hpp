// The families of blind robots by name, and robots of theirs that fly.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "blind/family.hpp"

namespace flappy::benchmark {

inline constexpr const char* kFamilies[] = {"a", "b", "c"};

/// InputError for one that there is not, or that this build has not.
const blind::Family& family_named(const std::string& name);

/// Whether the catalogue has an entry with this cause.
bool in_catalogue(const blind::FamilyEffect& effect);

/// Which flight of a robot is that of Assignment::proposed.
inline constexpr std::size_t kProposedFlight = blind::Family::kFlights;

/// A robot of a family that flew.
struct FlownRobot {
  std::uint64_t draw = 0;         ///< which of the seed's
  std::vector<std::string> lost;  ///< how the draws before crashed
  blind::Assignment assignment;   ///< with the seed of the draw
  std::vector<blind::FamilyFlight> flights;
};

/// What a robot of `draw` of `seed` has as its own.
std::uint64_t seed_of_draw(std::uint64_t seed, std::uint64_t draw);

/// Robots of `seed`, one after another until one flies all its flights, as blind::fly_sampled does; `a.seed` does not count.
/// `prepare` may change an assignment once it has the seed of its draw. blind::NeverFlies after 20 of them.
FlownRobot fly_drawn(const blind::Family& family, blind::Assignment a, std::uint64_t seed,
                     const std::function<void(blind::Assignment&)>& prepare = {});

}  // namespace flappy::benchmark
