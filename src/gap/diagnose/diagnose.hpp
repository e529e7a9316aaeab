// A diagnosis from a vehicle file, flight logs and settings: the only entry point for all front ends and the blind
// benchmark.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gap/answer/inference.hpp"
#include "gap/next/next_experiment.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::gap {

struct DiagnosisSettings {
  std::string vehicle;               ///< the vehicle file
  std::vector<std::string> flights;  ///< folders of logs, or of a session: a folder with such folders
  /// Folders of logs of the same robot from before the change that the flights are asked about; empty: no contrast.
  /// NAME=LOG begins a named set, to which the logs after it belong. The unnamed or first set is the reference; every
  /// other set is asked about as the flights are.
  std::vector<std::string> reference;
  /// Empty: the files of configs/gap, or of configs/gap/beat_averaged for a beat-averaged vehicle.
  std::string priors, discrepancy, verdict, sessions;
  std::vector<std::string> withheld;  ///< effects to leave out of the catalogue
  /// For a beat-averaged vehicle, the only channels that count; empty: all that it compares.
  std::vector<std::string> channels;
  /// flappy-fly configuration of the flights. Empty: simulations follow the recorded paths with the controller of
  /// fly/hover.toml.
  std::string manoeuvre;
  std::string experiments;  ///< folder of manoeuvres, one of which may be proposed; empty: configs/gap/experiments
  int threads = 0;          ///< 0: one for each processor
};

/// A set of flights that differ from the reference in one thing.
struct NamedFlights {
  std::string name;
  std::vector<std::string> flights;
};

/// Sets of reference flights, the first of which is the reference. NAME=LOG begins a set, or goes on with it. Throws io::InputError for
/// a name that is none.
std::vector<NamedFlights> sets_of(const std::vector<std::string>& reference);

struct DiagnosisRequest {
  DiagnosisSettings settings;        ///< `reference` without other sets and names
  std::vector<NamedFlights> others;  ///< the other sets of `reference`
  /// By the folder of a log: the folder of a session in which it was given.
  std::map<std::string, std::string> sessions;
  model::Vehicle vehicle;
  sim::Randomisation uncertain;
  InferenceOptions options;
  std::vector<int> channels;
  rollout::FlyConfig pilot;
  std::vector<Manoeuvre> manoeuvres;
};
/// Reads and checks all files but the logs. io::InputError for a setting or file that is not accepted.
DiagnosisRequest read_request(const DiagnosisSettings& settings);

struct Diagnosed {
  Diagnosis result;
  std::optional<model::Vehicle> corrected;  ///< none: the data are faulty, or the diagnosis was stopped
  // empty if the data are faulty:
  Flights flights;
  std::optional<sim::Randomisation> uncertain;  ///< with the minor draws at their estimates
  Inference inference;
};
/// Diagnoses; `progress` returns false to stop before the next effect is fitted. io::InputError for an unreadable log.
Diagnosed diagnose(const DiagnosisRequest& request,
                   const std::function<bool(double share, const std::string& what)>& progress = {});

/// Adds the closed-loop check (closed_loop_prediction.hpp). No effect on incomplete results, beat-averaged vehicles and
/// contrasts.
void fly_closed_loop(const DiagnosisRequest& request, Diagnosed& diagnosed);
/// Adds the most informative next flight (next_experiment.hpp) if the second hypothesis is probable enough. No effect
/// on incomplete results and beat-averaged vehicles.
void propose_experiment(const DiagnosisRequest& request, Diagnosed& diagnosed);

}  // namespace flappy::gap
