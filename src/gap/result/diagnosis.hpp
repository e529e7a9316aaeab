// The result of a diagnosis: plain data, which diagnosis.json holds (gap/result/diagnosis_json.hpp). Intervals hold 90 %.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "flightlog/check/data_fault.hpp"

namespace flappy::gap {

/// A number with its 90 % interval, in SI units.
struct Estimate {
  std::string name;  ///< as "wind.speed_m_s", "imu_mounting.x_rad"
  double value = 0, low = 0, high = 0;
  std::string unit;  ///< as "kg/m"; "" where it has none
};

/// Share of the closable gap that a hypothesis closes (gap/localise/closure.hpp).
struct Closure {
  double value = 0, low = 0, high = 0;
};

/// none: the vehicle file explains the flights. parameters: it does with other parameters. effect: one effect or several of the catalogue
/// are missing in it. unknown: something is missing that the catalogue does not have.
enum class HypothesisKind { none, parameters, effect, unknown };

/// One of the hypotheses that exclude each other; their probabilities add up to 1.
struct RankedHypothesis {
  HypothesisKind kind = HypothesisKind::effect;
  std::vector<std::string> effects;
  std::string group;       ///< groups of the effects, joined by +; of another kind its name
  bool remainder = false;  ///< the effects and something unknown
  double probability = 0, log_evidence = 0, log_prior = 0;
  std::vector<Estimate> parameters;  ///< of the effects: magnitudes, then shape parameters
  std::optional<double> loss;        ///< mean loss in flights held out; none: it was not fitted
  double loss_gain_sd = 0;           ///< standard deviation of its gain over the loss of the parameters alone
  std::optional<Closure> closure;
};

/// group: one of several effects that the flights cannot tell apart. data: the data forbid a diagnosis.
enum class VerdictKind { effect, group, parameters, none, unknown, data };

struct Verdict {
  VerdictKind kind = VerdictKind::unknown;
  std::vector<std::string> effects;  ///< of a group: those of its hypotheses that hold a twentieth of it or more
  bool remainder = false;            ///< something unknown is missing beside the effects
  double probability = 0;            ///< of a group: of all its hypotheses
};

/// The vehicle file; its parameters fitted; the most probable effects fitted as well.
enum class Stage { nominal, refit, effect };

/// What a row of the table of residuals tests (gap/localise/where.hpp).
enum class ResidualTest { channel, regime, phase, frequency, input, whiteness };

/// Part of the beats or of the rows that a residual belongs to.
struct Regime {
  enum class Third { all, low, middle, high };
  std::string quantity;  ///< as "height", "frequency", "harmonic", or an input
  Third third = Third::all;
  std::optional<double> low, high;  ///< bounds of the quantity; of an outer third one of them
  std::string unit;                 ///< of the bounds
};

/// A residual and that of noise alone, as root mean squares in the channel's unit.
struct ResidualLocation {
  Stage stage = Stage::refit;
  ResidualTest test = ResidualTest::channel;
  std::string channel, unit;
  Regime regime;
  double gap = 0, noise_floor = 0;
  double p_value = 1;       ///< that noise alone makes the residual
  bool discovered = false;  ///< among all tests of its stage at most 5 % of these are false
};

/// A part of the residual that no effect explains.
struct UnexplainedTerm {
  std::string channel;
  int harmonic = 0;      ///< of the beat; 0: its mean
  std::string function;  ///< of the regime, which the residual is proportional to
  std::string
      regime;  ///< quantity that the function depends on: always, amplitude, velocity, height, heading, time, ...
  double times_usual = 0;  ///< how many times larger it is than model discrepancy is as a rule
  double gain_nats = 0;    ///< evidence that it brings
};

/// A recorded flight beside both vehicles flown along the same path in simulation; NaN where a vehicle was lost.
struct ClosedLoop {
  std::string flight, quantity;
  double recorded = 0, nominal = 0, corrected = 0;
};

/// A quantity of a proposed flight under each of two hypotheses, as means over `NextExperiment::course_step_s`.
struct Course {
  std::string quantity;  ///< x_m, ..., amplitude_V, ...
  std::vector<double> first, second;
};

/// The flight that tells the hypotheses apart best (gap/diagnose/next_experiment.hpp).
struct NextExperiment {
  std::string manoeuvre;  ///< name of a configuration in configs/gap/experiments
  /// The most probable hypothesis and the one that the flight tells from it best: effects joined by +, or a kind.
  std::vector<std::string> separates;
  double expected_nats = 0;  ///< expected evidence between these two
  double information = 0;    ///< expected information on all hypotheses, nats
  double course_step_s = 0;
  std::vector<Course> courses;  ///< those that differ most first
};

/// Residual of one channel in flights held out, as root mean square.
struct HeldOutError {
  std::string channel;
  double rms = 0, low = 0, high = 0;  ///< interval of resampled blocks of beats
  double by_type = 0;                 ///< rms where all flights of a type are held out together
};

/// Controls of a diagnosis of a beat-averaged vehicle, in flights held out.
struct Validation {
  /// The vehicle file, its parameters fitted, then one effect more on each rung.
  struct Rung {
    std::string added;
    std::vector<HeldOutError> errors;
  };
  std::vector<Rung> ladder;
  /// The contribution of an effect, and copies of it shifted in time, which should gain nothing.
  struct Control {
    std::string effect, channel;  ///< the channel in which the effect gains most
    double gain = 0;              ///< share of the rms that the effect removes
    double best_of_shifted = 0;   ///< the largest share that a shifted copy removes
  };
  std::vector<Control> controls;
  /// A magnitude estimated from each flight alone.
  struct Agreement {
    std::string name;
    std::vector<double> value, sd;  ///< [flight]
    double p_value = 1;             ///< that all flights have the same magnitude; NaN where one says nothing of it
  };
  std::vector<Agreement> agreements;
};

struct Diagnosis {
  std::vector<std::string> flights;          ///< folders of the logs
  std::vector<flightlog::DataFault> faults;  ///< any: nothing was diagnosed
  bool complete = true;                      ///< false: it was stopped before every effect was weighed
  Verdict verdict;
  std::vector<RankedHypothesis> hypotheses;  ///< those with effects first, each part by falling probability
  std::vector<UnexplainedTerm> unexplained;  ///< the largest gain first
  std::vector<std::string> jointly_with;     ///< effects that are fitted jointly with the unexplained terms
  std::optional<UnexplainedTerm> other_law;  ///< where a named effect deviates most from the law of the catalogue
  std::vector<Estimate> background;          ///< magnitudes in the corrected vehicle that are not told from chance
  std::vector<Estimate> sensors;             ///< errors of the declared sensors that the flights show
  /// Vehicle parameters beside the named effects, in prior standard deviations, the farthest first.
  std::vector<std::pair<std::string, double>> moved_parameters;
  std::vector<ResidualLocation> locations;
  std::optional<double> nominal_loss, refit_loss, effect_loss;  ///< mean losses in flights held out
  double noise_floor = 0;                                       ///< loss of noise alone
  std::optional<Closure> closure;                               ///< of the most probable hypothesis that was fitted
  std::vector<std::string> untestable;                          ///< effects that cannot show in these logs
  std::optional<Validation> validation;                         ///< of a beat-averaged vehicle
  std::vector<ClosedLoop> closed_loop;
  std::optional<NextExperiment> next;  ///< none where no two hypotheses are left
};

const char* name_of(HypothesisKind kind);
const char* name_of(VerdictKind kind);
const char* name_of(Stage stage);
const char* name_of(ResidualTest test);

/// As "height below 0.5 m", "harmonic 2 of the beat", "0.5 to 1 Hz".
std::string text_of(const Regime& regime, ResidualTest test);

/// Discoveries of a stage that say where, the largest over its noise first; inputs and whiteness are left out.
std::vector<ResidualLocation> largest_discoveries(const Diagnosis& diagnosis, Stage stage, std::size_t most);

/// Unit of a parameter from its name: "kg/m" of line_kg_m, "" where it has none.
std::string unit_of(const std::string& name);

}  // namespace flappy::gap
