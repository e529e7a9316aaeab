#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "io/ranks.hpp"
#include "lab/benchmark/questions.hpp"

namespace flappy::benchmark {

struct ScoreCommand : BenchQuestions {
  std::vector<std::filesystem::path> cases;  ///< cases.jsonl of other scores, added to the table
  std::filesystem::path out;  ///< folder for score.md, score.csv and cases.jsonl; empty: the first of `folders`
  std::filesystem::path experiments = io::config_path("gap/experiments");  ///< manoeuvres that may be proposed
  bool proposals = false;  ///< also fly what undecided diagnoses of part "singles" propose
  io::Ranks* ranks = nullptr;
  Predictor predictor = predict;
};

/// Makes and seals the missing predictions, then opens the labels and scores each family and all cases. Resumes an
/// interrupted run; null if interrupted again. InputError if logs, labels or predictions are not those that were
/// sealed, if a line of `cases` is none, or if a case is given twice.
nlohmann::ordered_json score_bench(const ScoreCommand& command);

}  // namespace flappy::benchmark
