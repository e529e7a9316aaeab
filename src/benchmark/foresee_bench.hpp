// Plans of the cases of a blind benchmark, written before its labels are opened. score_bench compares them with the
// diagnoses.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "benchmark/score.hpp"
#include "io/installation.hpp"

namespace flappy::benchmark {

struct ForeseeCommand {
  std::vector<std::filesystem::path> folders;  ///< of make_bench
  std::filesystem::path vehicle;               ///< empty: that of the manifest
  std::filesystem::path priors = io::config_path("gap/priors.toml"),
                        discrepancy = io::config_path("gap/model_discrepancy.toml"),
                        sessions = io::config_path("gap/session_variation.toml"),
                        verdict;  ///< empty: as score_bench
  int threads = 0;                ///< number of cases at a time; 0: one for each processor
};

/// Table in the folder of a benchmark: a row for each case and effect.
inline constexpr const char* kForeseenFile = "foreseen.csv";

/// Plans the flights of every case and writes the table. Each effect has the magnitude that it would have in the case
/// (plan_cases). Resumes an interrupted run; false if interrupted again. InputError if labels were opened.
bool foresee_bench(const ForeseeCommand& command);

/// The plan's expectation for a case if its robot has this effect. None: no plan was written, or the effect changes no
/// row.
std::optional<Foresight> read_foreseen(const std::filesystem::path& folder, std::size_t number,
                                       const std::string& effect);

}  // namespace flappy::benchmark
