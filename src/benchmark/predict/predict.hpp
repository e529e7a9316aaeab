// The diagnosing side of the blind benchmark: all that it gets is a question.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::benchmark {

/// The answer of a simpler method.
struct Baseline {
  std::vector<std::string> named;    ///< none: parameters
  std::vector<std::string> ranking;  ///< all that it can rank, the most likely first
};

inline constexpr const char* kBaselines[] = {"largest_residual", "best_rmse", "stlsq", "black_box"};

/// What was said of a case before its label was opened.
struct Prediction {
  gap::Diagnosis diagnosis;
  std::map<std::string, Baseline> baselines;  ///< by kBaselines
  std::vector<double> features;               ///< of the residuals, for the black box (baselines.hpp)
  std::string corrected;                      ///< text of the corrected vehicle file; none: the data are at fault
  bool crashed = false;                       ///< the robot crashed in the flight that was to be diagnosed
};
/// Whether a verdict names no one answer as more likely than not: `group`, or less than one half.
bool abstains(const gap::Verdict& verdict);

struct Question {
  std::vector<std::filesystem::path> flights;  ///< folders of logs
  std::filesystem::path vehicle, priors, discrepancy, verdict;
  std::vector<std::string> withheld;  ///< effects that the catalogue is to lack
  bool baselines = true;
  std::filesystem::path experiments;  ///< manoeuvres to propose one of, where the verdict abstains; empty: none
};
using Predictor = std::function<Prediction(const Question&)>;

/// Diagnoses on one thread, as flappy-gap does (gap/diagnose/diagnose.hpp).
Prediction predict(const Question& question);

}  // namespace flappy::benchmark
