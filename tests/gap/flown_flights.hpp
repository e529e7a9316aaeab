// Flights of our own simulator for the tests of a diagnosis.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "gap/answer/inference.hpp"
#include "gap/question/question.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "io/config.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"
#include "sim/randomise.hpp"

namespace flappy::gap {

inline const std::string kTestConfigs = FLAPPY_SOURCE_DIR "/configs/";

inline model::Vehicle nominal_vehicle() {
  return model::read_vehicle(kTestConfigs + "vehicles/hummingbird_nominal.toml");
}

inline sim::Randomisation shipped_priors() {
  return sim::read_randomisation(nominal_vehicle(), io::Config::load(kTestConfigs + "gap/priors.toml", {}).root());
}

inline InferenceOptions shipped_options() {
  InferenceOptions options;
  options.discrepancy = read_model_discrepancy();
  options.rule = read_verdict_rule();
  return options;
}

/// Eight seconds: take-off and hover, the last five under multisines.
inline Flights flown(const std::string& vehicle, const std::vector<std::string>& overrides = {}) {
  flight::Folder folder;
  rollout::FlyOptions options;
  options.log_folder = folder / "flight";
  std::vector<std::string> all = {"vehicle=../vehicles/" + vehicle + ".toml", "flight.duration_s=8"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  rollout::fly(rollout::read_fly_config(kTestConfigs + "fly/identify_multisine.toml", all), options);
  return {{},
          {std::make_shared<ResetPrediction>(
              Recording(options.log_folder, flightlog::read_flight_log(options.log_folder), nominal_vehicle()))}};
}

/// Rms of a group over the beats that it covers.
inline double rms(const PredictedFlight& f, const Rows& rows, int group) {
  double sum = 0, n = 0;
  for (std::size_t j = 0; j < f.beats(); ++j)
    if (f.covers(j, group / kCoefficients)) {
      const double x = rows[j * kRowsPerBeat + static_cast<std::size_t>(group)];
      sum += x * x, n += 1;
    }
  return std::sqrt(sum / n);
}

}  // namespace flappy::gap
