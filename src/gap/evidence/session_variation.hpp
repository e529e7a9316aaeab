// Priors of what differs between two sessions of flights of one robot with wings, between which nothing that matters
// has changed: weather, a warm winding, a battery put back. For contrasts. configs/gap/session_variation.toml has them
// and says how they were learnt.
#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gap/evidence/discrepancy_shares.hpp"
#include "io/installation.hpp"
#include "model/effects/effect.hpp"

namespace flappy::gap {

/// Inverse gamma for the square of a scale, centred on `centre` or, if it follows the robot, on the robot's scale.
struct ScalePrior {
  double freedom = 0;  ///< degrees of freedom
  bool follows_robot = false;
  double centre = 1;
};

/// What contrasts of each reference session of the robot with the others say (gap/fit/own_sessions.hpp).
struct OwnSessions {
  double count = 0;             ///< K, number of sessions
  double mean_log_scale = 0;    ///< mean of log f_k, the scale of session k against the others
  std::vector<double> squares;  ///< [block] sum of delta^2 / f_k^2, in units of the prior
  std::vector<double> known;    ///< [block] number of coefficients that the flights determine
  /// Of the magnitudes of what changes, by the name of its background (Fitter::effects()): sum of squares in units of
  /// the prior, not over f_k^2; number that the flights determine.
  std::map<std::string, std::pair<double, double>> magnitudes;
  /// Correction of the log scale: the mean of the K - 1 others varies more than that of all K.
  double from_fewer() const { return 0.5 * std::log(1 - 1 / (count * count)); }
};

struct SessionVariation {
  /// How far a pair of sessions differs more or less than others: log scale ~ N(0, scale_sd^2).
  double scale_sd = 0.5;
  double own_scale_sd = 0.25;      ///< standard deviation of the log scale among sessions of one robot
  double own_offset = 0;           ///< log scale of tests less what contrasts among references say
  double own_share = 0.05;         ///< share that counts of what these contrasts say of the scales of blocks
  std::optional<OwnSessions> own;  ///< none: the references are one session
  /// Degrees of freedom of the scales of blocks, and of those of background magnitudes (ScalePrior).
  double block_freedom = 30, effect_freedom = 30;
  /// Deviation of another law of the same cause from the catalogue's, as a share of the change by the effect.
  /// law_error: [stage] the centre over effects and robots; law_spread: standard deviation of its logarithm; law_most:
  /// the largest over the centre.
  std::array<double, model::kStages> law_error{};
  double law_spread = 1, law_most = 8;
  /// Prior sd of the change of a parameter, in its prior standard deviations, by a part of its name.
  std::vector<std::pair<std::string, double>> parameters;
  Shares shares{};                           ///< prior of the smooth differences between sessions
  std::map<std::string, double> background;  ///< prior sd of a magnitude's change, by effect; "other": not listed

  /// A further session of the robot: log scale ~ N(log_scale(), sd_of_scale()^2). With own sessions, of which K - 1 say
  /// something of their own,
  ///   p = 1 / (scale_sd^2 - own_scale_sd^2) + (K - 1) / own_scale_sd^2
  ///   log_scale = (K - 1) / (own_scale_sd^2 p) (mean log f_k + own_offset + 1/2 log(1 - 1/K^2))
  ///   sd_of_scale^2 = own_scale_sd^2 + 1/p
  /// Without own sessions: 0 and scale_sd^2.
  double log_scale() const;
  double sd_of_scale() const;
  double first_scale() const { return std::exp(log_scale()); }
  /// Degrees of freedom of the scale of a block, and its centre over that of the session:
  ///   freedom = block_freedom + w known,    centre^2 = (block_freedom + w squares) / freedom,    w = own_share (K - 1)/K
  /// Without own sessions: block_freedom and 1.
  double freedom(std::size_t block) const;
  double centre(std::size_t block) const;
  /// Of the scale of a change of magnitude, by the name of its background:
  ///   freedom = effect_freedom + w known,    centre^2 = (effect_freedom + w squares) / freedom,    w = (K - 1)/K
  /// This centre is not over the session's scale.
  ScalePrior of_magnitude(const std::string& name) const;
  /// Prior sd of the change of a parameter, in its prior standard deviations; 0: it does not change between sessions.
  double parameter_sd(const std::string& name) const;
  /// Prior sd of the change of an effect's magnitude, in its coordinate.
  double background_sd(const std::string& effect) const;
  /// Law error of the effect's stage.
  double law_error_of(const std::string& effect) const;

 private:
  double precision_of_scale() const;
};

/// Text of configs/gap/session_variation.toml. `learnt`: source of the values, for the head of the file.
std::string session_text(const SessionVariation& session, const std::string& learnt);
/// io::InputError with file and line.
SessionVariation read_session_variation(
    const std::filesystem::path& path = io::config_path("gap/session_variation.toml"));

}  // namespace flappy::gap
