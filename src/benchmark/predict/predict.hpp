// The diagnosing side of the blind benchmark. It gets a Question and nothing else of a case.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::benchmark {

struct Baseline {
  std::vector<std::string> named;    ///< effects; empty: the parameters explain the flights
  std::vector<std::string> ranking;  ///< all effects that it ranks, the most likely first
};

inline constexpr const char* kBaselines[] = {"largest_residual", "best_rmse", "stlsq", "black_box"};

/// The prediction of a case, made before its label is opened.
struct Prediction {
  gap::Diagnosis diagnosis;
  std::map<std::string, Baseline> baselines;  ///< by name (kBaselines)
  std::vector<double> features;               ///< features of the residuals, for the black box (baselines.hpp)
  std::string corrected;                      ///< text of the corrected vehicle file; empty: the data are faulty
  bool crashed = false;                       ///< the robot crashed in the flight to be diagnosed
};
/// Whether a verdict gives no single answer: it is a group, or its probability is below one half.
bool abstains(const gap::Verdict& verdict);

struct Question {
  std::vector<std::filesystem::path> flights;  ///< folders of logs
  std::filesystem::path vehicle, priors, discrepancy, verdict;
  std::vector<std::string> withheld;  ///< effects to leave out of the catalogue
  bool baselines = true;
  std::filesystem::path experiments;  ///< manoeuvres, one of which is proposed if the verdict abstains; empty: none
};
using Predictor = std::function<Prediction(const Question&)>;

/// Diagnoses on one thread, as flappy-gap does (gap/diagnose/diagnose.hpp).
Prediction predict(const Question& question);

}  // namespace flappy::benchmark
