// A diagnosis from a vehicle file, flight logs and settings: the only entry point for all front ends and the blind
// benchmark. Call, in this order, read_request and diagnose; then, if wanted, fly_closed_loop and propose_experiment.
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
  std::vector<std::string> flights;  ///< each the folder of a log, or of a session, which has folders of logs
  /// Folders as in `flights`, of the same robot's flights before the change in question; empty: no contrast. NAME=LOG
  /// begins a named set, to which the logs after it belong; logs before the first NAME are an unnamed set. The first
  /// set is the reference; each other set is compared with it, as `flights` are.
  std::vector<std::string> reference;
  /// Files; empty: those of configs/gap, or of configs/gap/beat_averaged for a beat-averaged vehicle.
  std::string priors, discrepancy, verdict, sessions;
  std::vector<std::string> withheld;  ///< effects to leave out of the catalogue; not their groups (cf. DiagnoseCommand)
  /// For a beat-averaged vehicle, the only channels that count; empty: all that it compares.
  std::vector<std::string> channels;
  /// flappy-fly configuration by which the flights were flown, for the closed-loop check. Empty: simulations follow the
  /// recorded paths with the controller of fly/hover.toml.
  std::string manoeuvre;
  std::string experiments;  ///< folder of manoeuvres, one of which may be proposed; empty: configs/gap/experiments
  int threads = 0;          ///< 0: one for each processor
};

/// A set of flights of DiagnosisSettings::reference.
struct NamedFlights {
  std::string name;                  ///< empty: the unnamed set
  std::vector<std::string> flights;  ///< folders
};

/// Splits DiagnosisSettings::reference into its sets; the first one is the reference. io::InputError if NAME is empty,
/// or has a space, a dot or a slash.
std::vector<NamedFlights> sets_of(const std::vector<std::string>& reference);

/// The settings, and the contents of all files that they name, except the logs.
struct DiagnosisRequest {
  DiagnosisSettings settings;  ///< folders of sessions replaced by those of their logs; `reference`: the first set
  std::vector<NamedFlights> others;  ///< the other sets of `reference`
  /// [folder of a log] The folder of the session in which it was given.
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
/// Diagnoses the flights, then each other set. Leaves out flights with faulty data if half of their set or more is
/// sound; else nothing is diagnosed, and the verdict is `data`. Leaves out flights that are too short if others remain.
/// Warnings name what was left out. `progress` returns false to stop before the next effect is fitted. io::InputError
/// if a log cannot be read, or the vehicle cannot have flown it; if streams differ in a contrast; if flights of a
/// beat-averaged vehicle have too few rows.
Diagnosed diagnose(const DiagnosisRequest& request,
                   const std::function<bool(double share, const std::string& what)>& progress = {});

/// Adds the closed-loop check (closed_loop_prediction.hpp). Does nothing for an incomplete or faulty diagnosis, a
/// beat-averaged vehicle, or a contrast.
void fly_closed_loop(const DiagnosisRequest& request, Diagnosed& diagnosed);
/// Adds the most informative next flight (next_experiment.hpp) if the second hypothesis is probable enough. Does
/// nothing for an incomplete or faulty diagnosis, or a beat-averaged vehicle.
void propose_experiment(const DiagnosisRequest& request, Diagnosed& diagnosed);

}  // namespace flappy::gap
