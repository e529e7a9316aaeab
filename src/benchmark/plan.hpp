// Which cases a blind benchmark has.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "benchmark/score.hpp"
#include "blind/effects.hpp"

namespace flappy::benchmark {

/// What flappy-blind detectability found of an effect, in the blind robot's sizes.
struct Detectability {
  double detectable = 0;
  bool undetectable = false;  ///< twice the size is beyond what can be, or beyond the prior
  /// Rivals that it cannot be told from at twice the size, and at the typical one.
  std::vector<std::string> inseparable, inseparable_at_typical;
};

/// Of every effect of the catalogue, and of those outside that the table has. InputError where one is missing.
std::map<std::string, Detectability> read_detectability(const std::filesystem::path& file);

/// One robot and its flights, as only the maker knows them.
struct PlannedCase {
  std::size_t number = 0;  ///< from 1, in an order that tells nothing
  std::string part;        ///< of kParts
  std::vector<blind::BlindEffect> effects;
  std::uint64_t seed = 0;
  bool hover = false, power = false;
  bool randomised = true;
  std::vector<std::string> inseparable;  ///< rivals that these flights do not tell from the truth
  std::vector<std::string> withheld;     ///< from the catalogue
};

struct PlanOptions {
  bool reported = false;           ///< seeds of the reported figures; otherwise those of development
  std::vector<std::string> parts;  ///< empty: all
  std::size_t at_most = 0;         ///< cases of each part; 0: all
};

std::vector<PlannedCase> plan_cases(const std::map<std::string, Detectability>& detectability,
                                    const PlanOptions& options);

}  // namespace flappy::benchmark
