// The result of a diagnosis: plain data, which diagnosis.json holds (diagnosis_json.hpp). `low` and `high` of a value
// bound its 90 % interval.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "flightlog/check/data_fault.hpp"

namespace flappy::gap {

struct Estimate {
  std::string name;  ///< for example "wind.speed_m_s", "imu_mounting.x_rad"
  double value = 0, low = 0, high = 0;
  std::string unit;  ///< for example "kg/m"; "": dimensionless
};

/// (loss of refitted parameters - loss of a hypothesis) / (loss of refitted parameters - loss of noise)
/// (gap/localise/closure.hpp).
struct Closure {
  double value = 0, low = 0, high = 0;
};

/// none: the vehicle file explains the flights; parameters: the file with other parameters explains them; effect:
/// effects of the catalogue are missing in the file; unknown: an unknown cause is missing. In a contrast: none: nothing
/// changed since the reference; parameters: the flights differ by no more than sessions do; effect: effects appeared;
/// unknown: something else changed.
enum class HypothesisKind { none, parameters, effect, unknown };

/// One of the hypotheses that exclude each other; their probabilities add up to 1.
struct RankedHypothesis {
  HypothesisKind kind = HypothesisKind::effect;
  std::vector<std::string> effects;
  std::string group;       ///< groups of the effects, joined by +; without effects, the name of the kind
  bool remainder = false;  ///< something unknown is missing in addition to the effects
  /// log_evidence (nats) includes log_prior. The probability follows from tempered evidence (gap/answer/verdict.hpp);
  /// in a contrast of a beat-averaged vehicle, from the evidence as it is.
  double probability = 0, log_evidence = 0, log_prior = 0;
  std::vector<Estimate> parameters;  ///< effect by effect: its magnitudes, then its shape parameters
  std::optional<double> loss;        ///< mean loss in held-out flights; none: it was not fitted by simulation
  double loss_gain_sd = 0;           ///< standard deviation of (loss of the parameters alone - loss)
  std::optional<Closure> closure;
  /// Log evidence without the prior.
  double explained() const { return log_evidence - log_prior; }
};

/// One of the effects that are most probable if an effect is missing, whatever the verdict.
struct Suspect {
  std::string effect;
  double probability = 0;          ///< that it is among the missing effects, given that one is missing
  std::optional<Closure> closure;  ///< none: the effect alone was not fitted by simulation
};

/// group: one of several effects that the flights cannot tell apart. data: the logs are faulty; nothing was diagnosed.
enum class VerdictKind { effect, group, parameters, none, unknown, data };

struct Verdict {
  VerdictKind kind = VerdictKind::unknown;
  std::vector<std::string> effects;  ///< for a group: effects of its hypotheses (naming.member_of_pool of verdict.toml)
  bool remainder = false;            ///< something unknown is missing in addition to the effects
  double probability = 0;            ///< for a group: the sum over all its hypotheses
};

/// What had been fitted before a residual is tested. nominal: nothing, the vehicle file is as it is; refit: its
/// parameters; effect: the most probable effects as well.
enum class Fitted { nominal, refit, effect };

enum class ResidualTest { channel, regime, phase, frequency, input, whiteness };

/// Part of the beats or of the rows that a residual belongs to.
struct Regime {
  enum class Third { all, low, middle, high };
  std::string quantity;  ///< for example "height", "frequency", "harmonic", or the name of an input
  Third third = Third::all;
  std::optional<double> low, high;  ///< bounds of the quantity; an outer third has only one
  std::string unit;                 ///< unit of the bounds
};

/// A residual and that of noise alone, as root mean squares in the channel's unit.
struct ResidualLocation {
  Fitted fitted = Fitted::refit;
  ResidualTest test = ResidualTest::channel;
  std::string channel, unit;
  Regime regime;
  double gap = 0, noise_floor = 0;
  double p_value = 1;       ///< p value of the null hypothesis that the residual is noise alone
  bool discovered = false;  ///< significant; of the discoveries of a stage (Fitted), at most 5 % should be false
};

/// A block of the discrepancy that exceeds its prior, or, as other_law, a deviation of an effect's law.
struct UnexplainedTerm {
  std::string channel;
  int harmonic = 0;      ///< harmonic of the beat; 0: its mean
  std::string function;  ///< function of the regime to which the residual is proportional
  std::string regime;    ///< quantity that the function depends on: always, amplitude, velocity, height, time, ...
  double times_prior_scale = 0;  ///< scale of the block over that of the robot; for other_law, the law factor
  double gain_nats = 0;          ///< gain of evidence
};

/// A quantity of a recorded flight, and of simulated flights of the nominal and the corrected vehicle along the same
/// path; NaN if that vehicle was lost.
struct ClosedLoop {
  std::string flight, quantity;
  double recorded = 0, nominal = 0, corrected = 0;
};

/// A quantity of a proposed flight under each of two hypotheses, as means over `NextExperiment::course_step_s`.
struct Course {
  std::string quantity;  ///< x_m, ..., amplitude_V, ...
  std::vector<double> first, second;
};

struct NextExperiment {
  std::string manoeuvre;  ///< name of a configuration in configs/gap/experiments, or of one of its interventions
  std::string change;     ///< what is done to the robot before, in words; empty: nothing
  std::string cost;       ///< cost of the change, in words
  /// The most probable hypothesis without an unknown cause, and the rival that the flight separates best from it. A
  /// name is the effects joined by +, or the kind.
  std::vector<std::string> separates;
  double expected_nats = 0;  ///< between these two: mean of the expected nats of each over the other
  double information = 0;    ///< expected information on all hypotheses, nats
  double course_step_s = 0;
  std::vector<Course> courses;  ///< the largest difference first
};

/// Rms of the residual of a channel, over all beats of all test flights, each flight held out.
struct HeldOutError {
  std::string channel;
  double rms = 0, low = 0, high = 0;  ///< in the channel's unit; 90 % interval by resampling blocks of beats
  double by_type = 0;  ///< rms where all flights of a type are held out together; `rms` if all have one type
};

/// How far a diagnosis of a beat-averaged vehicle without references holds in flights that were held out.
struct Validation {
  /// First the vehicle file, then the file with fitted parameters; each later rung adds one concluded effect.
  struct Rung {
    std::string added;                 ///< "file", "parameters", or the effect
    std::vector<HeldOutError> errors;  ///< [channel with rows]
  };
  std::vector<Rung> ladder;
  /// How much of the residual without an effect goes away if the effect's change of the prediction is subtracted.
  /// Controls are copies of this change, shifted in time; they should remove nothing.
  struct Control {
    std::string effect, channel;  ///< the channel in which the effect gains most
    double gain = 0;              ///< share of the rms that the effect removes
    double best_of_shifted = 0;   ///< the largest share that a shifted copy removes
  };
  std::vector<Control> controls;
  /// A magnitude, estimated from each flight alone.
  struct Agreement {
    std::string name;               ///< as Estimate::name
    std::vector<double> value, sd;  ///< [test flight]
    double p_value = 1;             ///< p value of the null hypothesis that all flights have the same magnitude
  };
  std::vector<Agreement> agreements;
};

/// A quantity that flights show in a contrast: see gap/session/quantities.hpp; with wings,
/// gap/question/changes_seen.hpp.
struct SeenQuantity {
  std::string name, unit;
  double reference = 0, tests = 0;  ///< means
  double scatter = 0;               ///< standard deviation by which sessions of the unchanged robot differ
  double times() const { return (tests - reference) / scatter; }
};

/// A flight that differs from the others of its set, or within itself.
struct OddFlight {
  std::string flight, quantity;
  double times = 0;               ///< in standard deviations between sessions; with since_s, of the step's noise
  std::optional<double> since_s;  ///< from when on it differs from its beginning; none: all of it is odd
  std::optional<double> step;     ///< by how much, in the quantity's unit
};

/// How far the predictions for a robot with wings are off on one rung of the ladder (gap/localise/ladder.hpp).
struct LadderRung {
  std::string rung;
  /// Root mean square of residual over noise for each value of Fitted; 1: noise alone. None: nothing in the logs shows
  /// this rung, or it was not fitted.
  std::optional<double> nominal, refit, effect;
  double probability = 0;  ///< that effects of this rung are missing
};

struct NamedDiagnosis;

struct Diagnosis {
  std::vector<std::string> flights;          ///< folders of the logs
  std::vector<std::string> reference;        ///< folders of the reference's logs; empty: no contrast
  std::vector<std::string> warnings;         ///< what makes the answer less sure, one line each
  std::vector<flightlog::DataFault> faults;  ///< if not empty, nothing was diagnosed
  bool complete = true;                      ///< false: stopped before every effect was weighed
  Verdict verdict;
  std::vector<SeenQuantity> seen;            ///< in a contrast: what changed, whatever the cause
  std::vector<OddFlight> odd;                ///< in a contrast of a beat-averaged vehicle: which flights stand out
  std::vector<RankedHypothesis> hypotheses;  ///< those with effects, then the others; each by falling probability
  std::vector<Suspect> suspects;             ///< at most three, the most probable first
  /// Terms of the conclusion's remainder. If it has none: terms of the hypothesis `unknown`, even if that is
  /// improbable.
  std::vector<UnexplainedTerm> unexplained;  ///< the largest gain first
  std::vector<std::string> jointly_with;     ///< effects that are fitted jointly with the unexplained terms
  std::optional<UnexplainedTerm> other_law;  ///< largest deviation of a named effect from the law of the catalogue
  std::vector<Estimate> background;          ///< further effects of the corrected vehicle, which may be due to chance
  std::vector<Estimate> sensors;             ///< errors of the declared sensors that the flights show
  /// Parameters fitted jointly with the named effects, in prior standard deviations; the largest change first.
  std::vector<std::pair<std::string, double>> moved_parameters;
  std::vector<ResidualLocation> locations;
  std::optional<double> nominal_loss, refit_loss, effect_loss;  ///< mean losses in held-out flights
  double noise_floor = 0;                                       ///< loss of noise alone
  std::optional<Closure> closure;                               ///< closure of the most probable fitted hypothesis
  std::vector<LadderRung> ladder;                               ///< empty for a beat-averaged vehicle
  std::vector<std::string> untestable;                          ///< effects that cannot show in these logs
  std::optional<Validation> validation;                         ///< only for a beat-averaged vehicle
  std::vector<ClosedLoop> closed_loop;  ///< empty in a contrast, for a beat-averaged vehicle or a stopped diagnosis
  /// None for a beat-averaged vehicle, a stopped diagnosis, no safe manoeuvre, or fewer than two probable hypotheses.
  std::optional<NextExperiment> next;
  /// In a contrast: the diagnosis of each other set of DiagnosisSettings::reference, against the same reference.
  std::vector<NamedDiagnosis> sets;
};

struct NamedDiagnosis {
  std::string name;
  Diagnosis diagnosis;
};

const char* name_of(HypothesisKind kind);
const char* name_of(VerdictKind kind);
const char* name_of(Fitted fitted);
const char* name_of(ResidualTest test);

/// Text of a regime, for example "height below 0.5 m", "harmonic 2 of the beat", "0.5 to 1 Hz".
std::string text_of(const Regime& regime, ResidualTest test);

/// Discoveries of the stage `fitted` in the tests channel, regime, phase and frequency: at most `most`, the largest
/// relative to its noise first.
std::vector<ResidualLocation> largest_discoveries(const Diagnosis& diagnosis, Fitted fitted, std::size_t most);

/// Unit of a parameter by the suffix of its name: "kg/m" for line_kg_m; "" if it has none.
std::string unit_of(const std::string& name);

}  // namespace flappy::gap
