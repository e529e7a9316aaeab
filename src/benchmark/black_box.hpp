// A black box as a baseline: ridge regression from features of residuals to a robot's effect, learnt only on scored
// robots of other families. No physics, no catalogue: it names only effects of its examples.
#pragma once

#include <string>
#include <vector>

namespace flappy::benchmark {

/// Features of the residuals (Prediction::features), and the single effect that the robot had; "" for none.
struct Example {
  std::vector<double> features;
  std::string effect;
};

/// Least squares on an indicator column for each effect; features are scaled to unit variance. The ridge is the one
/// that predicts left-out examples best.
class BlackBox {
 public:
  /// `examples`: at least two, all with the same number of features.
  explicit BlackBox(const std::vector<Example>& examples);
  /// Effects, and "" for none, by their predicted indicator, the largest first.
  std::vector<std::string> ranked(const std::vector<double>& features) const;

 private:
  std::vector<std::string> effects_;
  std::vector<double> mean_, scale_;
  std::vector<std::vector<double>> weights_;  ///< [effect][feature]
  std::vector<double> offset_;
};

}  // namespace flappy::benchmark
