// flappy-blind calibrate: learns the constants of the verdict from robots whose truth is known.
//
// A few constants turn log evidences into probabilities (configs/gap/verdict.toml): the gain by chance, the tempering of the evidence, the prior of
// an unknown cause. They are chosen to maximise the mean logarithm of the probability of the right answers in scored cases, a proper score
// (Good 1952), in which every part of every family has the same weight.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "io/installation.hpp"

namespace flappy::benchmark {

struct CalibrateCommand {
  std::vector<std::filesystem::path> folders;                           ///< scored benchmarks
  std::filesystem::path verdict = io::config_path("gap/verdict.toml");  ///< constants to start from
  std::filesystem::path out;
};

/// Writes the verdict file with the learnt constants to `out`, and prints them with their old values. InputError if a folder was not scored.
nlohmann::ordered_json calibrate(const CalibrateCommand& command);

}  // namespace flappy::benchmark
