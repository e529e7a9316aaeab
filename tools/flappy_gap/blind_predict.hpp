// The diagnosing side of the blind benchmark: all that it gets is a question.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "gap/score.hpp"

namespace flappy::gap {

struct Question {
  std::vector<std::filesystem::path> flights;  ///< folders of logs
  std::filesystem::path vehicle, priors;
  std::vector<std::string> withheld;  ///< entries that the catalogue is to lack
  bool baselines = true;
  std::filesystem::path experiments;  ///< manoeuvres to propose one of, where the verdict abstains; empty: none
};
using Predictor = std::function<Prediction(const Question&)>;

/// Diagnoses on one thread.
Prediction predict(const Question& question);

}  // namespace flappy::gap
