#include "deploy/proof/proof.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>

#include "deploy/embedded.hpp"
#include "deploy/proof/board.hpp"
#include "io/files.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::deploy {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxVectors = 30'000, kInferences = 1'000;

struct Bench {
  const fs::path& headers;
  const policy::PolicyVectors& vectors;
  const io::TemporaryFolder& work;
  std::size_t count, rounds;  ///< number of vectors, and of rounds over all of them that are timed

  std::vector<fs::path> sources(const char* board) const {
    std::vector<fs::path> all = {work / "prove.c", work / "again.c"};
    if (board != nullptr) all.push_back(work / board);
    return all;
  }
  std::vector<std::string> options() const {
    std::vector<std::string> all = strict_options({headers, work.path()});
    append(all, {"-DPROVE_OBS=" + std::to_string(vectors.inputs), "-DPROVE_ACT=" + std::to_string(vectors.outputs),
                 "-DPROVE_VECTORS=" + std::to_string(count), "-DPROVE_ROUNDS=" + std::to_string(rounds)});
    if (fs::exists(headers / "flappy_controller.h")) all.emplace_back("-DPROVE_CONTROLLER");
    return all;
  }
};

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> all;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    all.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return all;
}

/// The first line of a compiler's answer to an option; empty where it does not run.
std::string answer(const std::string& compiler, const char* question) {
  std::string out = run_limited({compiler, question}).out;
  return out.substr(0, out.find('\n'));
}

Parity row_of(const std::string& compiler, const std::string& options) {
  Parity row;
  row.compiler = compiler;
  row.version = answer(compiler, compiler.starts_with("clang") ? "-dumpversion" : "-dumpfullversion");
  row.options = options;
  row.target = answer(compiler, "-dumpmachine");
  row.target.resize(std::min(row.target.find('-'), row.target.size()));
  return row;
}

Parity missing(const std::string& compiler, const std::string& why_not) {
  Parity row;
  row.compiler = compiler;
  row.available = false;
  row.why_not = why_not;
  return row;
}

/// Counts the outputs that differ in any bit.
void compare(Parity& row, std::span<const float> expected, const char* found) {
  row.outputs = expected.size();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    float got;
    std::memcpy(&got, found + i * sizeof got, sizeof got);
    if (std::bit_cast<std::uint32_t>(got) == std::bit_cast<std::uint32_t>(expected[i])) continue;
    ++row.differing;
    const double difference = std::fabs(static_cast<double>(got) - static_cast<double>(expected[i]));
    row.largest_difference =
        std::isnan(difference) ? std::numeric_limits<double>::infinity() : std::max(row.largest_difference, difference);
  }
}

void try_out(Parity& row, const Bench& bench, const std::vector<std::string>& build,
             const std::vector<std::string>& start, bool count) {
  const io::Finished built = run_limited(build);
  if (built.exit_code != 0) {
    row.why_not = "does not compile: " + first_complaint(built.err);
    return;
  }
  const auto& seen = bench.vectors.observation;
  const io::Finished ran =
      run_limited(start, {reinterpret_cast<const char*>(seen.data()), seen.size() * sizeof(float)});
  // the output: two codes, two errors, the actions, two times
  std::int32_t code[2];
  float error[2];
  std::uint32_t time_us[2];
  const std::size_t actions = bench.vectors.action.size() * sizeof(float);
  if (ran.exit_code == 124) {
    row.why_not = "does not end within a minute";
  } else if (ran.exit_code != 0) {
    row.why_not = "crashes: exit code " + std::to_string(ran.exit_code);
    if (!ran.err.empty()) row.why_not += ": " + ran.err.substr(0, ran.err.find('\n'));
  } else if (ran.out.size() != sizeof code + sizeof error + actions + sizeof time_us) {
    row.why_not = "writes " + std::to_string(ran.out.size()) + " bytes";
  }
  if (!row.why_not.empty()) return;
  const char* at = ran.out.data();
  std::memcpy(code, at, sizeof code);
  std::memcpy(error, at += sizeof code, sizeof error);
  compare(row, bench.vectors.action, at += sizeof error);
  std::memcpy(time_us, at + actions, sizeof time_us);
  row.policy_selftest = code[0];
  row.controller_selftest = code[1];
  row.policy_error = static_cast<double>(error[0]);
  row.controller_error = static_cast<double>(error[1]);
  if (count)  // the board's clock then advances a nanosecond per instruction
    row.instructions_per_inference = 1000. * (static_cast<double>(time_us[0]) - static_cast<double>(time_us[1])) /
                                     static_cast<double>(bench.count * bench.rounds);
}

Parity on_this_machine(const Bench& bench, const std::string& compiler, const std::string& options) {
  Parity row = row_of(compiler, options);
  const fs::path program = bench.work / "prove";
  std::vector<std::string> build = {compiler};
  if (compiler == "g++") append(build, {"-x", "c++"});
  append(build, words(options));
  append(build, bench.options());
  for (const auto& source : bench.sources("board_host.c")) build.push_back(source.string());
  append(build, {"-o", program.string(), "-lm"});
  try_out(row, bench, build, {program.string()}, false);
  return row;
}

Parity on_the_board(const Bench& bench) {
  const std::string compiler = arm_compiler().prefix + "gcc";
  if (const std::string why_not = board_missing(); !why_not.empty()) return missing(compiler, why_not);
  Parity row = row_of(compiler, "-std=gnu99 -O2");
  row.target = "Cortex-M4F";
  for (const auto& word : board_machine()) row.machine += (row.machine.empty() ? "" : " ") + word;
  const fs::path program = bench.work / "prove.elf";
  std::vector<std::string> options = words(row.options);
  append(options, bench.options());
  try_out(row, bench, board_build(bench.work.path(), bench.sources(nullptr), options, program),
          board_run(program, true), true);
  return row;
}

}  // namespace

bool Parity::failed() const {
  return available && (!why_not.empty() || policy_selftest != 0 || controller_selftest != 0 || differing != 0);
}

std::vector<Parity> prove(const fs::path& folder, const policy::PolicyVectors& vectors, Reach reach) {
  const std::size_t count = vectors.action.size() / static_cast<std::size_t>(std::max(1, vectors.outputs));
  if (count < 1 || count > kMaxVectors || vectors.action.size() != count * static_cast<std::size_t>(vectors.outputs) ||
      vectors.observation.size() != count * static_cast<std::size_t>(vectors.inputs))
    throw std::invalid_argument("prove: the vectors do not have the sizes that they say");
  io::read_text(folder / "flappy_policy.h");  // throws where the file is missing
  const fs::path headers = fs::absolute(folder);
  const io::TemporaryFolder work;
  write_board(work.path());
  for (const char* name : {"prove.c", "again.c"}) io::write_atomically(work / name, kEmbedded.at(name));
  const Bench bench{headers, vectors, work, count, (kInferences + count - 1) / count};

  if (reach == Reach::here) {
    const std::string compiler = in_path("cc") ? "cc" : "gcc";
    return {in_path(compiler) ? on_this_machine(bench, compiler, "-std=gnu99 -O2")
                              : missing(compiler, "not installed: gcc")};
  }
  std::vector<Parity> rows;
  for (const std::string stem : {"gcc", "clang"}) {
    const std::vector<std::string> names = versions_in_path(stem);
    if (names.empty()) rows.push_back(missing(stem, "not installed: " + stem));
    std::set<std::string> versions;  // gcc and gcc-12 may be the same compiler
    for (const auto& name : names)
      if (versions.insert(row_of(name, "").version).second)
        // standard C99, and the compiler's default dialect with contraction of products and sums
        for (const char* options : {"-std=c99 -O0", "-std=c99 -O2", "-std=gnu99 -O3 -march=native"})
          rows.push_back(on_this_machine(bench, name, options));
  }
  rows.push_back(in_path("g++") ? on_this_machine(bench, "g++", "-std=c++17 -O2")
                                : missing("g++", "not installed: g++"));
  rows.push_back(on_the_board(bench));
  return rows;
}

}  // namespace flappy::deploy
