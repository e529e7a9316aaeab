// flappy-blind score.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "benchmark/predict/predict.hpp"
#include "io/installation.hpp"
#include "io/ranks.hpp"

namespace flappy::benchmark {

struct ScoreCommand {
  std::vector<std::filesystem::path> folders;
  std::filesystem::path vehicle;  ///< empty for the manifest's
  std::filesystem::path out;      ///< for score.md and score.csv; empty for the first folder
  std::filesystem::path priors = io::config_path("gap/priors.toml"),
                        discrepancy = io::config_path("gap/model_discrepancy.toml"),
                        verdict = io::config_path("gap/verdict.toml");
  std::filesystem::path experiments = io::config_path("gap/experiments");  ///< for the prediction
  int threads = 0;  ///< cases at a time; 0: one for each processor
  io::Ranks* ranks = nullptr;
  Predictor predictor = predict;
};

/// In every folder predicts what has no prediction yet and seals the predictions; then opens the labels and scores all cases, those of
/// each family, too. Goes on where it was stopped; null where it was stopped again. InputError where logs, labels or predictions are not
/// what was sealed.
nlohmann::ordered_json score_bench(const ScoreCommand& command);

}  // namespace flappy::benchmark
