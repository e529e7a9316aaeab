// The diagnosing side of the blind benchmark: all that it gets is a question.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flappy::benchmark {

struct ScoredSize {
  double value = 0, low = 0, high = 0;  ///< 90 % interval
};

/// A set of effects that was fitted.
struct FittedSet {
  std::vector<std::string> effects;
  double probability = 0;
  std::map<std::string, ScoredSize> values;  ///< by "effect.parameter"
  std::optional<double> left;                ///< E, its mean loss on held-out flights
  double gain_sd = 0;                        ///< of E_refit - E, from blocks of beats
};

/// What the flights say of one hypothesis, before probabilities are made of it (gap/diagnose/verdict.hpp).
struct Weight {
  std::string kind;  ///< none, parameters, effect, unknown
  std::vector<std::string> effects;
  bool remainder = false;
  double log_evidence = 0, log_prior = 0;
};

/// What a simpler method said.
struct Baseline {
  std::vector<std::string> named;    ///< none: parameters
  std::vector<std::string> ranking;  ///< all it can rank, the likeliest first
};

/// Where something acts: in which channel, and with what it grows, in the words of blind::FamilyEffect.
struct Where {
  std::string channel, regime;
};

/// What a diagnosis said of a case before its label was opened.
struct Prediction {
  std::string kind =
      "data";  ///< effect, remainder (effects, and something more), group, parameters, none, unknown, data
  std::vector<std::string> effects;  ///< of an effect all that act together, of a group the rivals
  double probability = 0;            ///< of this verdict
  std::vector<FittedSet> sets;       ///< most probable first
  double none = 0, parameters = 0, unknown = 0;
  std::vector<Weight> weights;                  ///< of all hypotheses
  std::optional<double> nominal, refit, floor;  ///< E
  std::map<std::string, Baseline> baselines;    ///< by kBaselines
  std::vector<double> features;                 ///< what the residuals look like, for the black box (baselines.hpp)
  std::string manoeuvre;                        ///< proposed by a verdict that abstains; or none
  std::optional<Where> where;                   ///< of an unknown cause
  std::string corrected;                        ///< vehicle file with what was concluded; none of faulty data
};
/// Whether a verdict names no one answer as the likelier one: `group`, or less than one half.
bool abstains(const Prediction& prediction);

inline constexpr const char* kBaselines[] = {"largest_residual", "best_rmse", "stlsq", "black_box"};

struct Question {
  std::vector<std::filesystem::path> flights;  ///< folders of logs
  std::filesystem::path vehicle, priors, discrepancy, verdict;
  std::vector<std::string> withheld;  ///< entries that the catalogue is to lack
  bool baselines = true;
  std::filesystem::path experiments;  ///< manoeuvres to propose one of, where the verdict abstains; empty: none
};
using Predictor = std::function<Prediction(const Question&)>;

/// Diagnoses on one thread.
Prediction predict(const Question& question);

}  // namespace flappy::benchmark
