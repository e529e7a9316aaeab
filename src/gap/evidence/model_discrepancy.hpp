// What every model of a flapping wing gets wrong, before anything is known of a vehicle: the model discrepancy (Kennedy and
// O'Hagan 2001). Its figures and how they were learnt stand in configs/gap/model_discrepancy.toml.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gap/replay/predicted_flight.hpp"
#include "io/installation.hpp"

namespace flappy::gap {

/// Functions that models get wrong together.
enum class Regimes { always, inputs, velocity, place, count };
Regimes regimes_of(BasisFunction function);

/// How much more or less than usual a robot has of an entry: an inverse gamma law of so many degrees of freedom about 1, or, of an entry
/// that models of a wing describe each in its own way, about how far models of this robot are off.
struct Tail {
  double freedom = 0;
  bool of_model = false;
};

struct ModelDiscrepancy {
  /// Of one robot models are off by more or less than usual, and so is each kind of regime in each channel and harmonic of it (a
  /// block): log robot ~ N(0, robot_sd^2), and block^2 / robot^2 ~ inverse gamma of so many degrees of freedom, so that what is
  /// left has heavy tails. So has what every vehicle has of an entry (Tail).
  struct Spread {
    double robot_sd, block_freedom;
    double place_freedom;  ///< .. of blocks of the place, of which a wing knows nothing
    double entry_freedom;  ///< the same of what a vehicle has of an entry
    double model_freedom;  ///< .. of one that models describe each in its own way
    /// What models are off by is what is left beside every entry together, and the same for every hypothesis.
    bool beside_all;
  } spread{};
  /// What a sensor may be off by beyond its header, whatever the hypothesis: one standard deviation of each number.
  struct Nuisance {
    std::string id, value;  ///< of gap/replay/sensor_correction.hpp
    double sd;
  };
  std::vector<Nuisance> nuisances;
  /// Sd of the coefficient of such a function in every model, as a share of the channel's signal.
  double share(int channel, int harmonic, BasisFunction function) const {
    return shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
                 [static_cast<std::size_t>(function)];
  }
  /// Sd of the coordinates of an effect's sizes (gap/evidence/hypothesis.hpp) in a vehicle without any effect.
  double background_sd(const std::string& effect) const;
  /// Degrees of freedom of how much more or less a robot has of a block of such functions.
  double freedom_of(Regimes regimes) const {
    return regimes == Regimes::place ? spread.place_freedom : spread.block_freedom;
  }
  Tail tail_of(const std::string& effect) const;

  std::array<std::array<std::array<double, static_cast<std::size_t>(BasisFunction::count)>, kHarmonics + 1>, kChannels>
      shares{};
  std::map<std::string, double> background;  ///< by effect, and of "other"
  std::vector<std::string> of_models;        ///< entries that follow the robot's own factor, with spread.model_freedom
};

/// After an entry with a size for each wing: what both wings have of it alike.
inline constexpr const char* kOfBoth = "_of_both";

/// As such a file; `learnt`: from what, for its head.
std::string discrepancy_text(const ModelDiscrepancy& discrepancy, const std::string& learnt);
ModelDiscrepancy read_model_discrepancy(
    const std::filesystem::path& path = io::config_path("gap/model_discrepancy.toml"));

}  // namespace flappy::gap
