// flappy-blind calibrate: learns the constants of the verdict (configs/gap/verdict.toml) from robots whose truth is
// known. They maximise the mean log probability of the right answers, a proper score (Good 1952), in which every part
// of every family weighs the same. What a verdict says of its probability (VerdictRule::Said) is learnt from robots of
// each family in turn, judged by constants that the others taught, or it would seem too sure.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "gap/question/verdict_rule.hpp"
#include "io/installation.hpp"
#include "lab/benchmark/score_statistics.hpp"

namespace flappy::benchmark {

struct CalibrateCommand {
  std::vector<std::filesystem::path> folders;                           ///< scored benchmarks
  std::filesystem::path verdict = io::config_path("gap/verdict.toml");  ///< constants to start from
  std::filesystem::path out;
};

/// Writes the verdict file to `out`, and prints new and old values. InputError if a folder was not scored, or if
/// constants that are not learnt differ from those of `verdict`.
nlohmann::ordered_json calibrate(const CalibrateCommand& command);

/// By logistic regression of whether claims are right (Platt 1999), with Newton's method; without claims, what the evidence says.
gap::VerdictRule::Said learn_said(const std::vector<Claim>& claims, const std::vector<double>& weights);

}  // namespace flappy::benchmark
