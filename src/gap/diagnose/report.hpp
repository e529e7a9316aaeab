// What a diagnosis has to tell: a verdict, sizes, where the gap lies and how far it shrinks; diagnosis.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "flightlog/check/data_faults.hpp"
#include "gap/diagnose/closed_loop_prediction.hpp"
#include "gap/diagnose/next_experiment.hpp"
#include "gap/diagnose/verdict.hpp"
#include "gap/localise/closure.hpp"

namespace flappy::gap {

/// What an effect's parameter is, with its 90 % interval.
struct SizeEstimate {
  std::string name;  ///< effect.parameter
  double value = 0, low = 0, high = 0;
  std::string unit;
};

/// Of the effects of a hypothesis.
std::vector<SizeEstimate> sizes_of(const ScoredHypothesis& hypothesis, const sim::Randomisation& uncertain);

/// A hypothesis as reported.
struct Reported {
  ScoredHypothesis::Kind kind = ScoredHypothesis::Kind::effect;
  std::vector<std::string> effects;
  std::string group;       ///< of no effect: its kind
  bool remainder = false;  ///< something more beside the effects
  double probability = 0, log_evidence = 0;
  std::vector<SizeEstimate> sizes;
  std::optional<double> loss;  ///< E, where it was fitted
  double gain_sd = 0;          ///< of E_refit - E
  std::optional<Closure> closure;
};

/// By how much the fit moved a parameter of the vehicle.
struct Moved {
  std::string name;
  double prior_sd = 0;
};

/// A function of the regime that nothing of the catalogue explains.
struct Unexplained {
  std::string channel, harmonic, function;
  std::string
      regime;  ///< of the function: always, amplitude, difference, bias, split_cycle, velocity, rate, height, ceiling, wall,
               ///< heading, time
  double times = 0;  ///< of what models of this robot usually get wrong
  double gain = 0;   ///< nats
};

struct Report {
  std::vector<std::string> flights;
  std::vector<flightlog::DataFault> faults;  ///< any: nothing else was looked at
  bool complete = true;                      ///< false: stopped before every effect was weighed
  Conclusion conclusion;
  std::vector<Reported> candidates;  ///< effects, the most probable first; then the kinds without one
  std::vector<Unexplained> unexplained;
  std::optional<Unexplained> otherwise;   ///< where what is concluded acts most otherwise than its entry says
  std::vector<std::string> jointly_with;  ///< effects that are in force beside what is unexplained
  std::vector<SizeEstimate> background;   ///< of effects no larger than any robot may have, beside the concluded ones
  std::vector<Moved> moved;               ///< parameters beside the concluded effects, the farthest first
  std::vector<SizeEstimate> sensors;      ///< what headers have wrong for sure, and not by next to nothing
  std::vector<GapLocation> places;
  std::optional<double> nominal, refit, effect;  ///< E; the effect: of the best candidate with one
  double noise_floor = 0;
  std::optional<Closure> closure;
  std::vector<double> over_noise[3];  ///< by stage: rms of residual over noise, [channel], 0 where there is none
  std::optional<Validation> validation;
  std::vector<std::string> untestable;
  std::vector<ClosedLoop> closed_loop;
  std::optional<NextExperiment> next;  ///< none where no two hypotheses are left
};

/// Names of the stages of places.
inline constexpr const char* kStages[] = {"nominal", "refit", "effect"};

/// Of data that forbid a diagnosis.
Report report_of(const std::vector<std::string>& names, std::vector<flightlog::DataFault> faults);
/// Without names and places.
Report verdict_report_of(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                         const Diagnosis& diagnosis);
/// `names`: of the flights' folders.
Report report_of(const std::vector<std::string>& names, const std::vector<PredictedFlight>& flights,
                 const sim::Randomisation& uncertain, const Diagnosis& diagnosis);

/// Its candidates without effects stand for parameters, none and unknown, whose name is their group: all add up to 1.
/// "complete" is there only where it is false.
nlohmann::ordered_json diagnosis_json(const Report& report);

/// Of an effect's parameter, from its name: "kg/m" of line_kg_m, "" where it has none.
std::string unit_of(const std::string& name);

}  // namespace flappy::gap
