// The families of blind robots by name, and drawing of robots that fly.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lab/blind/family.hpp"

namespace flappy::benchmark {

inline constexpr const char* kFamilies[] = {"a", "b", "c"};

/// InputError if there is no such family, or if this build lacks it.
const blind::Family& family_named(const std::string& name);

/// InputError if the robots of a benchmark are of another engine, or version of it, than those that this build flies.
void check_engine(const std::filesystem::path& folder, const std::string& family, const std::string& engine);

/// InputError if robots of the family cannot be clamped.
void require_bench(const blind::Family& family);

/// Whether the catalogue has an effect with this cause.
bool in_catalogue(const blind::FamilyEffect& effect);

/// Number of the flight that flies Assignment::proposed.
inline constexpr std::size_t kProposedFlight = blind::Family::kFlights;

/// A robot that flew all its flights.
struct FlownRobot {
  std::uint64_t draw = 0;         ///< number of the draw of its seed
  std::vector<std::string> lost;  ///< how the robots of the earlier draws crashed
  blind::Assignment assignment;   ///< with the seed of the draw
  std::vector<blind::FamilyFlight> flights, reference;
};

std::uint64_t seed_of_draw(std::uint64_t seed, std::uint64_t draw);

/// Draws robots until one flies all its flights, like blind::fly_sampled, with the draw's seed in `a`, which `prepare`
/// may then change. `reference`: flights before, which the same robot has to fly, too, of `sessions` other sessions: in
/// flight one of each in turn, on a bench all runs of each. Logs name their session. blind::NeverFlies after 20 draws.
FlownRobot fly_drawn(const blind::Family& family, blind::Assignment a, std::uint64_t seed,
                     const std::function<void(blind::Assignment&)>& prepare = {},
                     std::optional<blind::Assignment> reference = {}, std::size_t sessions = 1);

}  // namespace flappy::benchmark
