// Plans flights: finds which effects a diagnosis of these flights would tell apart, and what other sensors, more
// flights, reference flights or other manoeuvres would bring.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "gap/result/planned.hpp"

namespace flappy::gap {

struct PlanSettings {
  std::string vehicle;             ///< the vehicle file
  std::string sensors;             ///< file of sensors; empty: as the manoeuvres have them
  std::string experiments;         ///< folder of manoeuvres; empty: configs/gap/experiments
  std::string manoeuvre = "tour";  ///< name of a configuration in `experiments`
  /// `like`: folders of flights that are taken in place of a manoeuvre. `like_reference`: folders of reference flights;
  /// empty: those of `like`.
  std::vector<std::string> like, like_reference;
  int flights = 3;           ///< number of flights; not used with `like`
  double duration_s = 10;    ///< a flight ends after this time, or with the manoeuvre
  bool reference = false;    ///< also plan as many reference flights, or those of `like_reference`
  bool matrix_only = false;  ///< without Plan::choices and PlannedEffect::sure_from
  /// Empty: the files of configs/gap that a diagnosis reads.
  std::string priors, discrepancy, verdict, sessions;
  std::string work;                          ///< file of hours of work; empty: configs/gap/plan_work.toml
  std::map<std::string, double> magnitudes;  ///< [effect] the magnitude asked about over the typical one
  int threads = 0;                           ///< 0: one for each processor
};

/// Simulates the flights with the vehicle file, or reads those of `like`, and finds what they would tell apart. After
/// Ctrl-C, Plan::choices is incomplete. io::InputError for a setting or file that is not accepted, a vehicle without
/// wings and motors, a log with faults, or a manoeuvre that the vehicle cannot fly.
Plan make_plan(const PlanSettings& settings);

}  // namespace flappy::gap
