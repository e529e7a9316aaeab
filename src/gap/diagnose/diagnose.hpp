// A diagnosis from a vehicle file, flight logs and settings: the one way in for flappy-gap, the server's jobs, Python and the blind benchmark.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gap/diagnose/inference.hpp"
#include "gap/diagnose/next_experiment.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

struct DiagnosisSettings {
  std::string vehicle;               ///< file of the vehicle as it was believed
  std::vector<std::string> flights;  ///< folders of logs
  /// Empty: priors.toml, model_discrepancy.toml and verdict.toml of configs/gap, or of configs/gap/beat_averaged for such a vehicle.
  std::string priors, discrepancy, verdict;
  std::vector<std::string> withheld;  ///< effects that the catalogue is to lack
  std::vector<std::string> channels;  ///< of a beat-averaged vehicle: the only ones that count; empty: all
  /// Configuration of flappy-fly that the flights flew. Empty: closed loops follow the recorded paths with the controller of fly/hover.toml.
  std::string manoeuvre;
  std::string experiments;  ///< folder of manoeuvres to propose one of; empty: configs/gap/experiments
  int threads = 0;          ///< 0: one for each processor
};

/// Settings, read and checked.
struct DiagnosisRequest {
  DiagnosisSettings settings;
  model::Vehicle vehicle;
  sim::Randomisation uncertain;
  InferenceOptions options;
  std::vector<int> channels;
  rollout::FlyConfig pilot;
  std::vector<Manoeuvre> manoeuvres;
};
/// io::InputError; reads no log.
DiagnosisRequest read_request(const DiagnosisSettings& settings);

/// A diagnosis, and what was inferred on the way to it.
struct Diagnosed {
  Diagnosis result;
  std::optional<model::Vehicle> corrected;  ///< none: the data are at fault, or the diagnosis was stopped
  // where the data are not at fault:
  Flights flights;
  std::optional<sim::Randomisation> uncertain;  ///< with the minor draws that the flights show
  Inference inference;
};
/// Reads the logs and diagnoses. `progress`: false stops it before the next effect is fitted. io::InputError for what cannot be read.
Diagnosed diagnose(const DiagnosisRequest& request,
                   const std::function<bool(double share, const std::string& what)>& progress = {});

/// Adds to a complete result the recorded flights in closed loop, under the vehicle file and the corrected vehicle.
void fly_closed_loop(const DiagnosisRequest& request, Diagnosed& diagnosed);
/// Adds to a complete result the flight that tells the hypotheses apart best, where a second one is probable enough.
void propose_experiment(const DiagnosisRequest& request, Diagnosed& diagnosed);

}  // namespace flappy::gap
