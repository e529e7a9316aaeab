// flappy-blind calibrate: how much a nat of evidence counts, learnt from robots of which all is known.
//
// Probabilities are made of log evidences by few constants (configs/gap/verdict.toml): what a hypothesis gains by chance, what nats are
// worth, how often a cause is unknown. They are chosen to give the right answers of scored cases the largest mean logarithm of
// probability, a proper score (Good 1952), every part of every family counting alike.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "io/installation.hpp"

namespace flappy::benchmark {

struct CalibrateCommand {
  std::vector<std::filesystem::path> folders;                           ///< that were scored
  std::filesystem::path verdict = io::config_path("gap/verdict.toml");  ///< to start from
  std::filesystem::path out;
};

/// Writes the verdict's constants and prints what they were and are. InputError where a folder was not scored.
nlohmann::ordered_json calibrate(const CalibrateCommand& command);

}  // namespace flappy::benchmark
