// What differs between two sessions of flights of one robot in which nothing that matters has changed: weather, a warm
// winding, a battery put back. configs/gap/session_variation.toml has its parameters and how they were learnt.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gap/evidence/discrepancy_shares.hpp"
#include "io/installation.hpp"
#include "model/effects/effect.hpp"

namespace flappy::gap {

struct SessionVariation {
  /// How far a pair of sessions differs more or less than others: log scale ~ N(0, scale_sd^2).
  double scale_sd = 0.5;
  /// Degrees of freedom of the scales of blocks, and of those of background magnitudes (ScalePrior).
  double block_freedom = 30, effect_freedom = 30;
  /// Deviation of another law of the same cause from the catalogue's, as a share of the change by the effect. law_error:
  /// [stage] the centre over effects and robots; law_spread: standard deviation of its logarithm; law_most: the largest
  /// over the centre.
  std::array<double, model::kStages> law_error{};
  double law_spread = 1, law_most = 8;
  /// Prior sd of the change of a parameter, in its prior standard deviations, by a part of its name.
  std::vector<std::pair<std::string, double>> parameters;
  Shares shares{};                           ///< prior of the smooth differences between sessions
  std::map<std::string, double> background;  ///< prior sd of a magnitude's change, by effect; "other": not listed

  /// 0: a parameter that does not change between sessions.
  double parameter_sd(const std::string& name) const;
  double background_sd(const std::string& effect) const;
  /// Law error of the effect's stage.
  double law_error_of(const std::string& effect) const;
};

/// Text of configs/gap/session_variation.toml. `learnt`: source of the values, for the head of the file.
std::string session_text(const SessionVariation& session, const std::string& learnt);
/// io::InputError with file and line.
SessionVariation read_session_variation(
    const std::filesystem::path& path = io::config_path("gap/session_variation.toml"));

}  // namespace flappy::gap
