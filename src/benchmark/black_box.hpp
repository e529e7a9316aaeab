// A plain black box beside the diagnosis: ridge regression from what the residuals look like to what the robot had, learnt on scored robots of other
// families alone. It knows no physics and no catalogue: what it never saw it cannot name.
#pragma once

#include <string>
#include <vector>

namespace flappy::benchmark {

/// What residuals looked like (Prediction::features), and which single effect was at work; "" for none.
struct Example {
  std::vector<double> features;
  std::string effect;
};

/// Least squares on one column for each effect, features scaled to unit variance; its ridge is that which predicts examples left out best.
class BlackBox {
 public:
  /// `examples`: two at least, all with as many features.
  explicit BlackBox(const std::vector<Example>& examples);
  /// Effects and "" by what is predicted of them, the largest first.
  std::vector<std::string> ranked(const std::vector<double>& features) const;

 private:
  std::vector<std::string> effects_;
  std::vector<double> mean_, scale_;
  std::vector<std::vector<double>> weights_;  ///< [effect][feature]
  std::vector<double> offset_;
};

}  // namespace flappy::benchmark
