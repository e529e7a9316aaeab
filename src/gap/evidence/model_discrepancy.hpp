// What every model of a flapping wing gets wrong, before anything is known of a vehicle: the model discrepancy (Kennedy and
// O'Hagan 2001). Its figures and how they were learnt stand in configs/gap/model_discrepancy.toml.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gap/replay/reset_prediction.hpp"
#include "io/installation.hpp"

namespace flappy::gap {

/// Kinds of functions of the regime (gap/evidence/evidence.hpp).
enum class BasisFunction {
  constant,
  input,
  rate,
  product,
  place,
  velocity_x,
  velocity_y,
  velocity_z,
  drag_x,
  drag_y,
  drag_z,
  count
};

struct ModelDiscrepancy {
  /// How much more or less than usual models of a vehicle may be off, and how often that is so.
  struct Scale {
    double factor, probability;
  };
  std::vector<Scale> scales;
  /// How well an entry's equation describes the effect of its name: sd of every coefficient as a share of its own.
  double form_error = 0;
  /// Sd of the coefficient of such a function in every model, as a share of the channel's signal.
  double share(int channel, int harmonic, BasisFunction function) const {
    return shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
                 [static_cast<std::size_t>(function)];
  }
  /// Sd of the coordinates of an effect's sizes (gap/evidence/hypothesis.hpp) in a vehicle without any effect.
  double background_sd(const std::string& effect) const;

  std::array<std::array<std::array<double, static_cast<std::size_t>(BasisFunction::count)>, kHarmonics + 1>, kChannels>
      shares{};
  std::map<std::string, double> background;  ///< by effect, and of "other"
};

ModelDiscrepancy read_model_discrepancy(
    const std::filesystem::path& path = io::config_path("gap/model_discrepancy.toml"));

}  // namespace flappy::gap
