#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/installation.hpp"
#include "lab/benchmark/predict/predict.hpp"
#include "lab/benchmark/records.hpp"

namespace flappy::benchmark {

/// Benchmarks that score_bench diagnoses or foresee_bench plans, and the files that both use for it.
struct BenchQuestions {
  std::vector<std::filesystem::path> folders;  ///< benchmarks that make_bench wrote
  std::filesystem::path vehicle;               ///< empty: that of the manifest
  std::filesystem::path priors = io::config_path("gap/priors.toml"),
                        discrepancy = io::config_path("gap/model_discrepancy.toml"),
                        verdict;  ///< empty: configs/gap/verdict.toml, contrast_verdict.toml of a contrast
  std::filesystem::path sessions = io::config_path("gap/session_variation.toml");  ///< only for a contrast
  int threads = 0;  ///< number of cases at a time; 0: one for each processor

  std::filesystem::path vehicle_of(const Manifest& manifest) const;
  /// The option of this command whose file or value is not the one kept in `file` (then as text: "--verdict"); empty if all are. If
  /// `file` does not exist, keeps them there.
  std::string other_option(const std::filesystem::path& file) const;
  /// About a case of the benchmark in `folder`; nothing is withheld.
  Question question(const std::filesystem::path& folder, const Manifest& manifest, const PublicCase& of) const;
};

}  // namespace flappy::benchmark
