// A diagnosis from a vehicle file, flight logs and settings: the only entry point for all front ends and the blind
// benchmark. In this order: read_request, diagnose, then fly_closed_loop and propose_experiment, which may be left out.
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
  std::vector<std::string> withheld;  ///< effects to leave out of the catalogue, one by one (cf. DiagnoseCommand)
  /// For a beat-averaged vehicle, the only channels that count; empty: all that it compares.
  std::vector<std::string> channels;
  /// flappy-fly configuration of the flights. Empty: simulations follow the recorded paths with the controller of
  /// fly/hover.toml.
  std::string manoeuvre;
  std::string experiments;  ///< folder of manoeuvres, one of which may be proposed; empty: configs/gap/experiments
  int threads = 0;          ///< 0: one for each processor
};

/// A set of flights of DiagnosisSettings::reference.
struct NamedFlights {
  std::string name;                  ///< empty: the unnamed set
  std::vector<std::string> flights;  ///< folders
};

/// Splits DiagnosisSettings::reference into its sets; the first one is the reference. io::InputError for NAME=LOG whose
/// name is none.
std::vector<NamedFlights> sets_of(const std::vector<std::string>& reference);

/// Settings with all files but the logs read.
struct DiagnosisRequest {
  DiagnosisSettings settings;  ///< folders of sessions replaced by those of their logs; `reference`: the first set
  std::vector<NamedFlights> others;  ///< the other sets of `reference`
  /// By the folder of a log: the folder of a session in which it was given.
  std::map<std::string, std::string> sessions;
  model::Vehicle vehicle;
  sim::Randomisation uncertain;  ///< the vehicle with the priors of its parameters
  InferenceOptions options;
  std::vector<int> channels;          ///< as BeatAveragedPrediction takes them
  rollout::FlyConfig pilot;           ///< who flies in the closed-loop check
  std::vector<Manoeuvre> manoeuvres;  ///< one of which may be proposed
};
/// Reads and checks all files but the logs. io::InputError for a setting or file that is not accepted.
DiagnosisRequest read_request(const DiagnosisSettings& settings);

/// A diagnosis, and what it was made of. Other sets have only a result, in Diagnosis::sets.
struct Diagnosed {
  Diagnosis result;
  std::optional<model::Vehicle> corrected;  ///< none: the data are faulty, or the diagnosis was stopped
  // empty if the data are faulty:
  Flights flights;                              ///< without those that were left out
  std::optional<sim::Randomisation> uncertain;  ///< with the minor draws at their estimates
  Inference inference;
};
/// Diagnoses the flights, then each other set. Flights with faulty data are left out while half of their set or more is
/// sound, flights that are too short while others remain; warnings say so. With fewer sound flights nothing is
/// diagnosed, and the verdict is `data`. `progress` returns false to stop before the next effect is fitted.
/// io::InputError for a log that cannot be read, or that the vehicle cannot have flown; in a contrast for logs with
/// different streams; for too few rows of a beat-averaged vehicle.
Diagnosed diagnose(const DiagnosisRequest& request,
                   const std::function<bool(double share, const std::string& what)>& progress = {});

/// Adds the closed-loop check (closed_loop_prediction.hpp). Does nothing for an incomplete or faulty diagnosis, a
/// beat-averaged vehicle, or a contrast.
void fly_closed_loop(const DiagnosisRequest& request, Diagnosed& diagnosed);
/// Adds the most informative next flight (next_experiment.hpp) if the second hypothesis is probable enough. Does
/// nothing for an incomplete or faulty diagnosis, or a beat-averaged vehicle.
void propose_experiment(const DiagnosisRequest& request, Diagnosed& diagnosed);

}  // namespace flappy::gap
