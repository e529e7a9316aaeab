// What follows a search: designs of the front are chosen, their gains are tuned, they are flown again with shorter
// steps, and their sensitivities are measured. The results are files:
//   designs.csv              all designs of the search;  front.csv: those that no other beats
//   search.csv               hypervolume over flights, by generation
//   design.json              what flappy-report shows
//   designs/NN/              vehicle.toml, controller.toml, hover.toml, escape.toml: flights for flappy-fly; 00: published
#pragma once

#include <limits>

#include "design/design_config.hpp"

namespace flappy::design {

/// Success of a trained policy on vehicles that it never saw, with its 95 % interval; NaN without one.
struct Policy {
  double success = std::numeric_limits<double>::quiet_NaN(), low = success, high = success;
};

inline constexpr const char* kPublished = "00";  ///< the published robot's name among the chosen designs

/// A chosen design, verified.
struct Verified {
  std::string name;
  Record record;                           ///< as the search has it
  Judged tuned;                            ///< with tuned gains, on other vehicles, with the configuration's step
  Figures fine;                            ///< the same flights with VerifyConfig::step_s
  double tuned_cost = 0, fitted_cost = 0;  ///< costs by flappy-tune; NaN without tuning
  std::vector<std::string> limited_by;     ///< bounds of variables and limits of figures that it is at
  Policy policy;
  /// Change of each objective for 1 % more of each variable, in shares of the published robot; NaN for choices.
  std::vector<std::vector<double>> sensitivity;  ///< [variable][objective]
};

/// Designs of the front that are far apart: the best in each objective, then always the one that is farthest from those
/// chosen. Designs that beat the published robot in every objective come first.
std::vector<Record> choose(const Search& search, std::size_t count);

Verified verify(const Judge& judge, const Search& search, const DesignConfig& config, const Record& record,
                const std::string& name);

/// Largest improvement of each objective on the front that costs no other objective; NaN: there is none; 1 where the
/// published robot has no finite value.
std::vector<double> given_away(const Search& search);

/// Why designs were refused, such as "stroke_rad above 1.5", and how many; the most frequent first.
std::vector<std::pair<std::string, std::size_t>> refusals(const std::vector<Record>& records);

void write_records(const std::filesystem::path& folder, const Search& search, const std::vector<Generation>& history);
void write_design(const std::filesystem::path& folder, const Judge& judge, const Verified& design);
void write_results(const std::filesystem::path& folder, const Judge& judge, const Search& search,
                   const std::vector<Generation>& history, const std::vector<Verified>& designs);

}  // namespace flappy::design
