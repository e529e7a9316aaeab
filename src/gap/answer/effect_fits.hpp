// The middle of a diagnosis: effects are screened, fitted, and combined into hypotheses with several effects.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// Hypotheses without effects.
struct Baselines {
  ScoredHypothesis none, parameters, unknown;
  Scales unknown_scales;  ///< scales of the fit with an unknown cause
};
Baselines weigh_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule);

/// Effects of the catalogue by falling screened gain: the first options.max_finalists, and the others.
struct ScreenedCatalogue {
  std::vector<ScreenedEffect> finalists, others;
  std::vector<std::string> untestable;  ///< effects that cannot show in these logs
};
ScreenedCatalogue screen_catalogue(const RobotFit& robot, const InferenceOptions& options);

class EffectFits {
 public:
  EffectFits(const Question& question, const RobotFit& robot, const Baselines& baselines,
             const InferenceOptions& options, int threads);

  /// A hypothesis for each effect, the best first. Finalists are fitted by simulation if `by_simulation`; others
  /// linearly.
  std::vector<ScoredHypothesis> single_effects(const ScreenedCatalogue& catalogue, bool by_simulation) const;

  struct Sets {
    std::vector<ScoredHypothesis> hypotheses;  ///< with one effect and with several, the best first
    Scales scales;                             ///< scales given the parameters alone
  };
  /// Effects join the set that explains most, one after another, as long as it gains more than by chance.
  Sets combine(std::vector<ScoredHypothesis> singles,
               const std::function<bool(double, const std::string&)>& progress) const;

  /// The hypotheses that explain most, with a remainder; only those for which one is found.
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
