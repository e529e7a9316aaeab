// The middle of a diagnosis: effects are screened, fitted, and combined into hypotheses with several effects. infer()
// calls these functions in the order in which they stand here.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// Hypotheses without effects, with their log evidence.
struct Baselines {
  ScoredHypothesis none, parameters, unknown;
  Scales unknown_scales;  ///< scales with which an unknown cause explains most
};
Baselines weigh_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule);

/// Raises what has no effect to what deviations from all laws explain (Question::other_laws): the parameters, and with
/// them effects that are fitted only linearly, by those of harmless changes; an unknown cause, which pays its penalty, by
/// any. `singles`: each effect alone.
void raise_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule, int threads,
                     std::vector<ScoredHypothesis>& singles, Baselines& baselines);

/// Effects of the catalogue by falling screened gain: the first options.max_finalists, and the others.
struct ScreenedCatalogue {
  std::vector<ScreenedEffect> finalists, others;
  std::vector<std::string> untestable;  ///< effects that cannot show in these logs
};
ScreenedCatalogue screen_catalogue(const RobotFit& robot, const InferenceOptions& options);

/// Fits effects and sets of them.
class EffectFits {
 public:
  /// Keeps references to all.
  EffectFits(const Question& question, const RobotFit& robot, const Baselines& baselines,
             const InferenceOptions& options, int threads);

  /// A hypothesis for each effect, the one that explains most first. Finalists are fitted by simulation if
  /// `by_simulation`, and keep a linear fit where the simulated one did not find the effect; others are fitted
  /// linearly.
  std::vector<ScoredHypothesis> single_effects(const ScreenedCatalogue& catalogue, bool by_simulation) const;

  struct Sets {
    std::vector<ScoredHypothesis> hypotheses;  ///< with one effect and with several, the one that explains most first
    Scales scales;                             ///< scales of the parameters alone, searched from those of the best set
  };
  /// Effects join the set that explains most, one after another, as long as a set gains more than by chance. `singles`:
  /// of single_effects. `progress` returns false to stop.
  Sets combine(std::vector<ScoredHypothesis> singles,
               const std::function<bool(double, const std::string&)>& progress) const;

  /// The few hypotheses that explain most, each once more with a remainder, if one is found. Arguments as in Sets.
  std::vector<ScoredHypothesis> with_remainders(const std::vector<ScoredHypothesis>& hypotheses,
                                                const Scales& scales) const;

 private:
  void join_further(const std::function<bool(double, const std::string&)>& progress, Sets& sets) const;
  double log_prior_of_one() const;
  Eigen::VectorXd start(const Hypothesis& hypothesis, const std::vector<ScreenedEffect>& set) const;
  ScoredHypothesis fitted(const std::vector<ScreenedEffect>& set, const Fitter& fitter) const;
  ScoredHypothesis linear(const ScreenedEffect& effect) const;
  void move_parameters(const std::vector<ScreenedEffect>& set, const Fitter& fitter, ScoredHypothesis& a) const;
  void take(const Hypothesis& hypothesis, Fit fit, const Scales& scales, ScoredHypothesis& a) const;
  bool vanished(const ScoredHypothesis& a) const;
  std::vector<ScreenedEffect> coordinates(const ScoredHypothesis& a) const;
  double gain_by_chance(const ScoredHypothesis& a) const;

  const Question& question_;
  const RobotFit& robot_;
  const Baselines& baselines_;
  const InferenceOptions& options_;
  const VerdictRule& rule_;
  int threads_;
  std::size_t catalogue_size_;
};

}  // namespace flappy::gap
