// Mistakes that firmware makes with exported C, and how each changes the wiring.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "deploy/flown/wiring.hpp"

namespace flappy::deploy {

/// Where a mistake is made, in the order in which data flow.
enum class Stage { sensor, observation, time, output, software };
const char* name_of(Stage stage);

struct Mistake {
  Stage stage = Stage::sensor;
  std::string id;     ///< "gyro_in_degrees"
  std::string words;  ///< "the gyro's rates are in degrees"; %g stands for a parameter
  /// Changes a wiring; `p`: the parameters.
  std::function<void(Wiring& w, const std::vector<double>& p)> make;
  std::vector<std::vector<double>> starts = {};  ///< parameters from which the best ones are searched; empty: none
  std::vector<double> scales = {};               ///< [parameter] size of the first step of a search

  /// Words with these parameters.
  std::string said(const std::vector<double>& p) const;
};

/// All that are tried. `c`: names the gains; `int8`: whether the export has a policy of 8 bits.
std::vector<Mistake> mistakes_of(const Contract& contract, const ExportedC& c, bool int8);

}  // namespace flappy::deploy
