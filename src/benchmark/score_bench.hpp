// flappy-blind score.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "benchmark/predict/predict.hpp"
#include "io/installation.hpp"
#include "io/ranks.hpp"

namespace flappy::benchmark {

struct ScoreCommand {
  std::filesystem::path folder, vehicle;  ///< the latter: empty for the manifest's
  std::filesystem::path priors = io::config_path("gap/priors.toml");
  std::filesystem::path experiments = io::config_path("gap/experiments");  ///< for the prediction
  int threads = 0;  ///< cases at a time; 0: one for each processor
  io::Ranks* ranks = nullptr;
  Predictor predictor = predict;
};

/// Predicts what has no prediction yet, seals the predictions, opens the labels, scores. Goes on where it was stopped; null where
/// it was stopped again. InputError where logs, labels or predictions are not what was sealed.
nlohmann::ordered_json score_bench(const ScoreCommand& command);

}  // namespace flappy::benchmark
