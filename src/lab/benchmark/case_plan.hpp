#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lab/benchmark/score.hpp"
#include "lab/blind/a/a_effects.hpp"
#include "lab/blind/family.hpp"

namespace flappy::benchmark {

/// One robot and its flights, as only the maker knows them.
struct PlannedCase {
  std::size_t number = 0;  ///< from 1, in random order
  std::string part;        ///< one of kParts or kContrastParts
  std::vector<blind::BlindEffect> effects;
  std::uint64_t seed = 0;
  bool hover = false, power = false;
  /// Clamped and filmed, with currents: in a contrast in place of its flights, else in addition to them.
  bool bench = false;
  bool own_parameters = false, conventions = false;  ///< as in blind::Assignment
  bool published = false;                            ///< its vehicle is drawn from the published randomisation
  /// In a contrast, the robot flies `references` flights without its effects, and then `flights` in another session.
  std::size_t references = 0, flights = blind::Family::kFlights;
  /// The references are of so many sessions: in turn, or on a bench each with all runs.
  std::size_t reference_sessions = 1;
  bool calm_reference = false;        ///< the references hover and follow slow paths
  std::vector<std::string> withheld;  ///< effects withheld from the catalogue
};

/// The assignment of a case to its family, without the seed.
blind::Assignment assignment_of(const PlannedCase& planned, const std::filesystem::path& vehicle);
/// That of its reference flights; none without them.
std::optional<blind::Assignment> reference_of(const PlannedCase& planned, const std::filesystem::path& vehicle);

struct PlanOptions {
  bool reported = false;             ///< seeds of the reported scores; false: seeds for development
  bool contrast = false;             ///< parts of the contrast; false: of the diagnosis without reference flights
  std::vector<std::string> parts;    ///< empty: all
  std::vector<std::string> effects;  ///< robots have these effects of the catalogue alone; empty: all
  std::size_t skip = 0;              ///< number of cases that each part leaves out, its first ones
  std::size_t at_most = 0;           ///< most cases of each part; 0: all
  std::vector<std::uint64_t> only;   ///< PlannedCase::number of the cases to keep; empty: all
  std::size_t flights = blind::Family::kFlights;  ///< most flights of a session of a contrast
  /// The references of a contrast are of so many sessions. Each number has seeds of its own, and so have benches.
  std::size_t reference_sessions = blind::Family::kFlights;
  bool bench = false;  ///< robots of contrasts are clamped in place of flying
};

/// Seeds of family b begin at 20,000,000 (development) and 29,000,000 (reported); a and c: 10,000,000 and 30,000,000
/// likewise. io::InputError for parts, effects or numbers that are not there.
std::vector<PlannedCase> plan_cases(const blind::Family& family, const PlanOptions& options);

}  // namespace flappy::benchmark
