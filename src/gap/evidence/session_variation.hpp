// Priors of what differs between two sessions of one robot with wings although nothing that matters has changed,
// because of weather, a warm winding, or a battery put back. For contrasts. configs/gap/session_variation.toml has them
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
  double centre = 1;  ///< not used if follows_robot
};

/// Scales and changes that own_sessions() (gap/fit/own_sessions.hpp) finds. It contrasts each reference session of the
/// robot with the other ones.
struct OwnSessions {
  double count = 0;             ///< K, number of sessions
  double mean_log_scale = 0;    ///< mean of log f_k, the scale of session k against the others
  std::vector<double> squares;  ///< [block] sum of delta^2 / f_k^2 over sessions, in units of the prior
  std::vector<double> known;    ///< [block] number of coefficients that the flights determine
  /// For changes of magnitudes. Key: name of the background (Fitter::effects()). Value: sum of the squared changes over
  /// sessions, in units of the prior and not divided by f_k^2; number of changes that the flights determine.
  std::map<std::string, std::pair<double, double>> magnitudes;
  /// Correction of the log scale: session k is compared with K - 1 others, whose mean varies more than that of all K.
  double from_fewer() const { return 0.5 * std::log(1 - 1 / (count * count)); }
};

struct SessionVariation {
  /// By how much more or less one pair of sessions differs than others do: log scale ~ N(0, scale_sd^2).
  double scale_sd = 0.5;
  double own_scale_sd = 0.25;      ///< standard deviation of the log scale among sessions of one robot
  double own_offset = 0;           ///< log scale of tests less what contrasts among references say
  double own_share = 0.05;         ///< weight of what these contrasts say of the scales of blocks, 0 to 1
  std::optional<OwnSessions> own;  ///< none: the references are one session
  /// Degrees of freedom of the scales of blocks, and of those of background magnitudes (ScalePrior).
  double block_freedom = 30, effect_freedom = 30;
  /// How far a robot's law of an effect deviates from the catalogue's, divided by the change that the effect makes.
  /// law_error: [stage] the centre over effects and robots; law_spread: standard deviation of the logarithm about it;
  /// law_most: the largest deviation, divided by the centre.
  std::array<double, model::kStages> law_error{};
  double law_spread = 1, law_most = 8;
  /// Prior sd of the change of a parameter, in units of the parameter's own prior sd, by a part of its name.
  std::vector<std::pair<std::string, double>> parameters;
  Shares shares{};                           ///< prior of the smooth differences between sessions
  std::map<std::string, double> background;  ///< prior sd of a magnitude's change, by effect; "other": all not listed

  /// Prior for a further session of the robot: log scale ~ N(log_scale(), sd_of_scale()^2). With K own sessions, of
  /// which K - 1 are independent,
  ///   p = 1 / (scale_sd^2 - own_scale_sd^2) + (K - 1) / own_scale_sd^2
  ///   log_scale = (K - 1) / (own_scale_sd^2 p) (mean log f_k + own_offset + 1/2 log(1 - 1/K^2))
  ///   sd_of_scale^2 = own_scale_sd^2 + 1/p
  /// Without own sessions: 0 and scale_sd^2.
  double log_scale() const;
  double sd_of_scale() const;
  double first_scale() const { return std::exp(log_scale()); }
  /// Degrees of freedom of the scale of a block, and the centre of its prior divided by the session's scale:
  ///   freedom = block_freedom + w known,   centre^2 = (block_freedom + w squares) / freedom,   w = own_share (K - 1)/K
  /// Without own sessions: block_freedom and 1.
  double freedom(std::size_t block) const;
  double centre(std::size_t block) const;
  /// Prior of the scale of a magnitude's change. `name`: of its background.
  ///   freedom = effect_freedom + w known,    centre^2 = (effect_freedom + w squares) / freedom,    w = (K - 1)/K
  /// This centre is not divided by the session's scale.
  ScalePrior of_magnitude(const std::string& name) const;
  /// Prior sd of the change of a parameter, in units of the parameter's own prior sd; 0: it does not change between
  /// sessions.
  double parameter_sd(const std::string& name) const;
  /// Prior sd of the change of an effect's magnitude, in its coordinate.
  double background_sd(const std::string& effect) const;
  /// Law error of the effect's stage.
  double law_error_of(const std::string& effect) const;

 private:
  double precision_of_scale() const;
};

/// Text of configs/gap/session_variation.toml and bench_session_variation.toml. `learnt`: source of the values, for the head of the file.
std::string session_text(const SessionVariation& session, const std::string& learnt);
/// io::InputError with file and line.
SessionVariation read_session_variation(
    const std::filesystem::path& path = io::config_path("gap/session_variation.toml"));

}  // namespace flappy::gap
