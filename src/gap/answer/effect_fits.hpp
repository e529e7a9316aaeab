// The middle of a diagnosis: effects are screened, fitted, and combined into hypotheses with several effects. infer()
// calls, in this order: weigh_baselines, screen_catalogue, single_effects, raise_baselines, combine, with_remainders.
#pragma once

#include "gap/question/question.hpp"

namespace flappy::gap {

/// Hypotheses without effects, with their log evidence.
struct Baselines {
  ScoredHypothesis none, parameters, unknown;
  Scales unknown_scales;  ///< scales with which an unknown cause explains most
};
Baselines weigh_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule);

/// Raises the log evidence of baselines to what deviations from the laws of effects explain without an effect
/// (Question::other_laws), where that is more. For the parameters, only deviations of harmless changes count; effects
/// that are fitted only linearly gain as much. For an unknown cause all count, less its penalty. `singles`: each effect
/// alone; is sorted again.
void raise_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule, int threads,
                     std::vector<ScoredHypothesis>& singles, Baselines& baselines);

/// Effects of the catalogue, the largest gain in screening first. The first options.max_finalists are finalists.
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

  /// Returns a hypothesis for each effect, the one that explains most first. If `by_simulation`, finalists are fitted
  /// by simulation; where that fit does not find the effect, the finalist gets a linear fit. All others are fitted
  /// linearly.
  std::vector<ScoredHypothesis> single_effects(const ScreenedCatalogue& catalogue, bool by_simulation) const;

  struct Sets {
    std::vector<ScoredHypothesis> hypotheses;  ///< with one effect and with several, the one that explains most first
    /// Scales of the hypothesis without effects. Their search starts from the scales of the best set.
    Scales scales;
  };
  /// Adds effects to the set that explains most, one after another, as long as this gains more than by chance. Returns
  /// `singles`, of single_effects(), and the larger sets. `progress` returns false to stop.
  Sets combine(std::vector<ScoredHypothesis> singles,
               const std::function<bool(double, const std::string&)>& progress) const;

  /// Returns the few hypotheses that explain most, each with a remainder in addition; left out if no remainder is
  /// found. Arguments: the members of Sets.
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
