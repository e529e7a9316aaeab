// The model discrepancy: what every model of a flapping wing gets wrong, before anything is known of a vehicle (Kennedy and O'Hagan 2001). Its
// parameters, and how they were learnt, stand in configs/gap/model_discrepancy.toml.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gap/replay/predicted_flight.hpp"
#include "io/installation.hpp"

namespace flappy::gap {

/// Classes of functions of the regime that share a scale.
enum class Regimes { always, inputs, velocity, place, count };
Regimes regimes_of(BasisFunction function);

/// Prior of a scale: an inverse gamma law of its square about 1 or, if it follows the robot, about the scale of the robot.
struct ScalePrior {
  double freedom = 0;  ///< degrees of freedom
  bool follows_robot = false;
};

struct ModelDiscrepancy {
  /// Priors of the scales by which models of one robot are off by more or less than those of others: log robot ~ N(0, robot_sd^2), and
  /// (block / robot)^2 ~ inverse gamma for each class of regimes in a channel and harmonic, so that what is left has heavy tails.
  struct Spread {
    double robot_sd;
    double block_freedom;
    double place_freedom;   ///< of blocks of the place, which a wing does not sense
    double effect_freedom;  ///< of background magnitudes
    double model_freedom;   ///< of background magnitudes of effects that each model of a wing describes in its own way
  } spread{};
  /// An error of a declared sensor, under every hypothesis, with its prior standard deviation.
  struct Nuisance {
    std::string id, value;  ///< of gap/replay/sensor_correction.hpp
    double sd;
  };
  std::vector<Nuisance> nuisances;
  /// Prior standard deviation of the coefficient of such a function, as a share of the channel's signal.
  double share(int channel, int harmonic, BasisFunction function) const {
    return shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
                 [static_cast<std::size_t>(function)];
  }
  /// Prior standard deviation of the background magnitude of an effect, in its coordinates (gap/evidence/hypothesis.hpp): what a vehicle without
  /// the effect has of it, or of what looks like it.
  double background_sd(const std::string& effect) const;
  /// Degrees of freedom of the scale of a block of such functions.
  double freedom_of(Regimes regimes) const {
    return regimes == Regimes::place ? spread.place_freedom : spread.block_freedom;
  }
  ScalePrior scale_prior(const std::string& effect) const;

  std::array<std::array<std::array<double, static_cast<std::size_t>(BasisFunction::count)>, kHarmonics + 1>, kChannels>
      shares{};
  std::map<std::string, double> background;  ///< by effect; "other": of those that are not named
  std::vector<std::string>
      of_models;               ///< effects whose background magnitude follows the robot, with spread.model_freedom
  bool beat_averaged = false;  ///< every background magnitude follows the robot, with spread.effect_freedom
};

/// Suffix of the background magnitude that both wings share of an effect with a magnitude for each wing.
inline constexpr const char* kOfBoth = "_of_both";

/// The text of such a file; `learnt`: from what, for its head.
std::string discrepancy_text(const ModelDiscrepancy& discrepancy, const std::string& learnt);
/// io::InputError by file and line.
ModelDiscrepancy read_model_discrepancy(
    const std::filesystem::path& path = io::config_path("gap/model_discrepancy.toml"));

}  // namespace flappy::gap
