// The priors of the model discrepancy: of what every model gets wrong, before anything is known of a vehicle (Kennedy
// and O'Hagan 2001). configs/gap/model_discrepancy.toml has them and says how they were learnt; beat-averaged vehicles
// have files of their own in configs/gap/beat_averaged.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gap/evidence/session_variation.hpp"
#include "io/installation.hpp"

namespace flappy::gap {

/// Classes of basis functions. The coefficients of a class share a scale in each channel and harmonic.
enum class Regimes { always, inputs, velocity, place, count };
Regimes regimes_of(BasisFunction function);

struct ModelDiscrepancy {
  /// Priors of the scales by which models of one robot are off (Scales). The robot's: log robot ~ N(0, robot_sd^2).
  /// That of each block: (block / robot)^2 ~ inverse gamma, which has heavy tails; ..._freedom are its degrees of
  /// freedom.
  struct Spread {
    double robot_sd;
    double block_freedom;
    double place_freedom;   ///< replaces block_freedom for blocks of the place, which a wing does not sense
    double effect_freedom;  ///< for background magnitudes, except those of effects in `of_models`
    double model_freedom;   ///< for background magnitudes of effects in `of_models`
  } spread{};
  /// An error of a declared sensor, which every hypothesis includes, with its prior standard deviation.
  struct Nuisance {
    std::string id, value;  ///< error and its parameter, as in gap/replay/sensor_correction.hpp
    double sd;
  };
  std::vector<Nuisance> nuisances;
  /// Prior sd of the coefficients of functions of this kind, as a share of the group's signal (Evidence::signal).
  double share(int channel, int harmonic, BasisFunction function) const {
    return share_of(shares, channel, harmonic, function);
  }
  /// Prior sd of the background magnitude of an effect, in its coordinates (hypothesis.hpp): what a vehicle without the
  /// effect has of it, or of something that looks like it. A name with a suffix that is not listed has that of the name
  /// without.
  double background_sd(const std::string& effect) const;
  /// Degrees of freedom of the scale of a block.
  double freedom_of(Regimes regimes) const {
    return regimes == Regimes::place ? spread.place_freedom : spread.block_freedom;
  }
  /// Prior of the scale of a background magnitude. `effect`: an effect, perhaps with one of the prefixes or suffixes
  /// below.
  ScalePrior scale_prior(const std::string& effect) const;

  Shares shares{};
  SessionVariation session;                  ///< only used in a contrast
  std::map<std::string, double> background;  ///< background_sd by effect; "other": effects that are not listed
  /// Effects of wings, hinges and drive, for which each model has other laws: the scale of their background is centred
  /// on the robot's, with model_freedom.
  std::vector<std::string> of_models;
  bool beat_averaged = false;  ///< all scales of backgrounds are centred on the robot's, with effect_freedom
};

/// Names of background magnitudes for what changes between sessions: of all parameters together; a prefix for an
/// effect.
inline constexpr const char *kSessionParameters = "session of parameters", *kSessionOf = "session of ";

/// Prefix of a background magnitude that acts in all flights of a contrast: what the model gets wrong in both sessions.
inline constexpr const char* kModelOf = "model of ";

/// Suffix of the background magnitude that both wings share, for an effect with a magnitude for each wing.
inline constexpr const char* kOfBoth = "_of_both";
/// Last suffix of the background magnitude that acts on a bench alone, for logs of flights and of a bench: what errors of
/// a model look like there is not what they look like in flight, while an effect is the same in both.
inline constexpr const char* kOnBench = "_on_bench";
/// Names of all background magnitudes that an effect may have: without suffix, and with one or both.
std::array<std::string, 4> backgrounds_of(const std::string& effect);

/// Text of configs/gap/model_discrepancy.toml. `learnt`: source of the values, for the head of the file.
std::string discrepancy_text(const ModelDiscrepancy& discrepancy, const std::string& learnt);
/// io::InputError with file and line.
ModelDiscrepancy read_model_discrepancy(
    const std::filesystem::path& path = io::config_path("gap/model_discrepancy.toml"));

}  // namespace flappy::gap
