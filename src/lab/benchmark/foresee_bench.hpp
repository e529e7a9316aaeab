// Plans of the cases of a blind benchmark, written before its labels are opened. score_bench compares them with the
// diagnoses.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "lab/benchmark/questions.hpp"
#include "lab/benchmark/score.hpp"

namespace flappy::benchmark {

/// Table in the folder of a benchmark: a row for each case and effect.
inline constexpr const char* kForeseenFile = "foreseen.csv";

/// Plans the flights of every case and writes the table. Each effect is at magnitude 1 with reference flights, at
/// that of part "singles" without them. Resumes an interrupted run; false if interrupted again. InputError if labels were opened.
bool foresee_bench(const BenchQuestions& command);

/// The plan's expectation for a case if its robot has this effect. None: no plan was written, or the effect changes no
/// row.
std::optional<Foresight> read_foreseen(const std::filesystem::path& folder, std::size_t number,
                                       const std::string& effect);

}  // namespace flappy::benchmark
