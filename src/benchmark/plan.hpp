// Which cases a blind benchmark has.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "benchmark/score.hpp"
#include "blind/a/effects.hpp"
#include "blind/family.hpp"

namespace flappy::benchmark {

/// What flappy-blind detectability found of an effect, in its family's sizes.
struct Detectability {
  double detectable = 0;
  bool undetectable = false;  ///< twice the size is beyond what can be
  bool hidden = false;        ///< hover does not show twice the size
};

/// Of every effect of a family that the catalogue has, and of those outside that the table has. InputError where one is missing.
std::map<std::string, Detectability> read_detectability(const std::filesystem::path& file, const blind::Family& family);

/// One robot and its flights, as only the maker knows them.
struct PlannedCase {
  std::size_t number = 0;  ///< from 1, in an order that tells nothing
  std::string part;        ///< of kParts
  std::vector<blind::BlindEffect> effects;
  std::uint64_t seed = 0;
  bool hover = false, power = false;
  bool own_figures = false, conventions = false;  ///< as in blind::Assignment
  bool published = false;                         ///< its vehicle is drawn from the published randomisation
  std::vector<std::string> withheld;              ///< from the catalogue
};

/// What its family flies, but for the seed.
blind::Assignment assignment_of(const PlannedCase& planned, const std::filesystem::path& vehicle);

struct PlanOptions {
  bool reported = false;           ///< seeds of the reported figures; otherwise those of development
  std::vector<std::string> parts;  ///< empty: all
  std::size_t at_most = 0;         ///< cases of each part; 0: all
};

/// Seeds of b begin at 20,000,000 for development and at 28,000,000 for what is reported, those of a and c likewise.
std::vector<PlannedCase> plan_cases(const blind::Family& family,
                                    const std::map<std::string, Detectability>& detectability,
                                    const PlanOptions& options);

}  // namespace flappy::benchmark
