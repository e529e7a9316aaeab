// Exported C on other compilers and processors: what agrees, what is seen to differ, and what a processor needs for it.
#include "deploy/proof/proof.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>

#include "deploy/proof/board.hpp"
#include "full.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::deploy {
namespace {

namespace fs = std::filesystem;

constexpr int kObs = 5, kAct = 2;

/// A policy of two layers with the given width between them, as an exporter might write it.
struct Toy {
  int hidden = 8;
  std::string sum = "fused(weight, x, sum)";  ///< how a product is added
  std::string before;                         ///< at the begin of the step
  std::string other;                          ///< before the step
  float off = 0;                              ///< what the self-test's expectation is wrong by

  float weight(int i) const { return 0.3F * std::sin(1.7F * static_cast<float>(i) + 0.2F); }
  int weights() const { return hidden * (kObs + 1) + kAct * (hidden + 1); }

  std::vector<float> layer(int& at, const std::vector<float>& in, int outputs, bool fused) const {
    std::vector<float> out;
    for (int o = 0; o < outputs; ++o) {
      float sum_of = weight(at++);
      for (const float x : in) {
        const float w = weight(at++);
        sum_of = fused ? std::fma(w, x, sum_of) : w * x + sum_of;
      }
      out.push_back(sum_of / (1 + std::fabs(sum_of)));
    }
    return out;
  }
  /// What this program, which does not contract, makes of an observation.
  std::vector<float> act(const std::vector<float>& observation, bool fused = true) const {
    int at = 0;
    const std::vector<float> middle = layer(at, observation, hidden, fused);
    return layer(at, middle, kAct, fused);
  }

  void write(const fs::path& folder) const {
    std::ostringstream c;
    c << std::hexfloat << "#ifndef FLAPPY_POLICY_H\n#define FLAPPY_POLICY_H\n#include <stdint.h>\n"
      << "#define FLAPPY_POLICY_OBS " << kObs << "\n#define FLAPPY_POLICY_ACT " << kAct << "\n#define HIDDEN " << hidden
      << "\nstatic const float weights[] = {";
    for (int i = 0; i < weights(); ++i) c << weight(i) << "F,";
    const std::vector<float> first = act(std::vector<float>(kObs, 0.5F));
    c << "};\nstatic const float expected[] = {" << first[0] + off << "F," << first[1] << "F};\n"
      << kArithmetic << other;
    c << "static inline const float *layer(const float *w, const float *in, int n, float *out, int outputs) {\n"
         "  int o, i;\n  for (o = 0; o < outputs; ++o) {\n    float sum = *w++;\n"
         "    for (i = 0; i < n; ++i) { const float weight = *w++, x = in[i]; sum = "
      << sum
      << "; }\n    out[o] = sum / (1.0F + (sum < 0 ? -sum : sum));\n  }\n  return w;\n}\n"
         "static inline int flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {\n"
         "  float middle[HIDDEN];\n  const float *w;\n"
      << before
      << "  w = layer(weights, obs, FLAPPY_POLICY_OBS, middle, HIDDEN);\n"
         "  (void)layer(w, middle, HIDDEN, action, FLAPPY_POLICY_ACT);\n  return 0;\n}\n"
         "static inline void flappy_policy_selftest_errors(float error[FLAPPY_POLICY_ACT]) {\n"
         "  const float obs[FLAPPY_POLICY_OBS] = {0.5F, 0.5F, 0.5F, 0.5F, 0.5F};\n"
         "  float action[FLAPPY_POLICY_ACT];\n  int i;\n  (void)flappy_policy_step(obs, action);\n"
         "  for (i = 0; i < FLAPPY_POLICY_ACT; ++i) {\n    const float d = action[i] - expected[i];\n"
         "    error[i] = d < 0 ? -d : d;\n  }\n}\n"
         "static inline int flappy_policy_selftest(void) {\n  float error[FLAPPY_POLICY_ACT];\n"
         "  flappy_policy_selftest_errors(error);\n  return error[0] <= 1e-3F && error[1] <= 1e-3F ? 0 : "
         "7;\n}\n#endif\n";
    std::ofstream(folder / "flappy_policy.h") << c.str();
  }

  /// a b + c rounded once, where the processor has no instruction for it: in double, rounded to odd.
  static constexpr const char* kArithmetic = R"(static inline float fused(float a, float b, float c) {
#if defined __FMA__ || (defined __ARM_FEATURE_FMA && defined __ARM_FP) || defined __riscv_flen
  return __builtin_fmaf(a, b, c);
#else
  union { double number; uint64_t bits; } sum;
  const double product = (double)a * (double)b;
  double of_c, lost;
  sum.number = product + (double)c;
  of_c = sum.number - product;
  lost = (product - (sum.number - of_c)) + ((double)c - of_c);
  if ((lost > 0 || lost < 0) && (sum.bits & 1U) == 0U) sum.bits += (lost > 0) == (sum.number > 0) ? 1U : ~(uint64_t)0;
  return (float)sum.number;
#endif
}
)";
};

/// Observations and what the toy makes of them.
policy::PolicyVectors vectors_of(const Toy& toy, std::size_t count, bool fused = true) {
  policy::PolicyVectors vectors{kObs, kAct, {}, {}};
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-2, 2);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<float> observation;
    for (int j = 0; j < kObs; ++j) observation.push_back(number(random));
    const std::vector<float> action = toy.act(observation, fused);
    vectors.observation.insert(vectors.observation.end(), observation.begin(), observation.end());
    vectors.action.insert(vectors.action.end(), action.begin(), action.end());
  }
  return vectors;
}

std::vector<Parity> proof_of(const Toy& toy, const policy::PolicyVectors& vectors) {
  const io::TemporaryFolder folder;
  toy.write(folder.path());
  return prove(folder.path(), vectors, Reach::everywhere);
}

const Parity& board(const std::vector<Parity>& rows) { return rows.back(); }

/// A PATH with nothing in it but these programs, until the end of the test.
class NarrowPath {
 public:
  explicit NarrowPath(const std::vector<std::string>& programs) {
    for (const auto& program : programs) {
      std::istringstream folders(before_);
      for (std::string folder; std::getline(folders, folder, ':');)
        if (!fs::exists(folder_ / program) && fs::exists(fs::path(folder) / program))
          fs::create_symlink(fs::path(folder) / program, folder_ / program);
    }
    setenv("PATH", folder_.path().c_str(), 1);
  }
  ~NarrowPath() { setenv("PATH", before_.c_str(), 1); }
  NarrowPath(const NarrowPath&) = delete;
  NarrowPath& operator=(const NarrowPath&) = delete;

 private:
  io::TemporaryFolder folder_;
  std::string before_ = std::getenv("PATH");
};

TEST(Proof, AgreesToTheBit) {
  const Toy toy;
  std::vector<Parity> rows = proof_of(toy, vectors_of(toy, 300));
  ASSERT_GE(rows.size(), 8u);  // gcc and clang thrice, g++, the board
  std::size_t of_gcc = 0, of_clang = 0;
  std::set<std::string> tried;
  for (const auto& row : rows) {
    EXPECT_TRUE(row.available) << row.compiler;
    EXPECT_FALSE(row.failed()) << row.compiler << " " << row.options << " " << row.why_not;
    EXPECT_EQ(row.outputs, 600u);
    EXPECT_EQ(row.differing, 0u) << row.compiler << " " << row.options;
    EXPECT_EQ(row.policy_error, 0);
    EXPECT_NE(row.version, "");
    // gcc and gcc-12 may be one
    const std::string compiler = row.compiler.substr(0, row.compiler.find('-')) + " " + row.version;
    EXPECT_TRUE(tried.insert(compiler + " " + row.options).second) << compiler << " " << row.options;
    of_gcc += row.compiler.starts_with("gcc");
    of_clang += row.compiler.starts_with("clang");
  }
  EXPECT_TRUE(of_gcc % 3 == 0 && of_gcc > 0 && of_clang % 3 == 0 && of_clang > 0) << of_gcc << " " << of_clang;
  EXPECT_EQ(board(rows).target, "Cortex-M4F");
  // at least one instruction for each of 66 weights, and not 50
  EXPECT_GT(board(rows).instructions_per_inference, 66);
  EXPECT_LT(board(rows).instructions_per_inference, 50 * 66);

  // a unit in the last place; minus zero for zero; a NaN
  const NarrowPath path({"gcc", "as", "ld", "timeout"});
  policy::PolicyVectors vectors = vectors_of(toy, 2);
  vectors.action[1] = std::nextafter(vectors.action[1], 10.0F);
  Parity row = proof_of(toy, vectors)[0];
  EXPECT_EQ(row.differing, 1u);
  EXPECT_GT(row.largest_difference, 0);
  EXPECT_LT(row.largest_difference, 1e-6);
  EXPECT_TRUE(row.failed());
  Toy still;
  still.before = "  (void)w;\n  (void)middle;\n  action[0] = action[1] = 0.0F;\n  if (obs[0] < 100.0F) return 0;\n";
  vectors.action = {0, -0.0F, 0, 0};
  row = proof_of(still, vectors)[0];
  EXPECT_EQ(row.differing, 1u);
  EXPECT_EQ(row.largest_difference, 0);
  vectors.action = {NAN, 0, 1, 0};
  row = proof_of(still, vectors)[0];
  EXPECT_EQ(row.differing, 2u);
  EXPECT_EQ(row.largest_difference, INFINITY);
}

TEST(Proof, MissingToolsAreRows) {
  const Toy toy;
  const NarrowPath path({"gcc", "as", "ld", "timeout"});
  const std::vector<Parity> rows = proof_of(toy, vectors_of(toy, 2));
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_EQ(rows[3].why_not, "not installed: clang");
  EXPECT_EQ(rows[4].why_not, "not installed: g++");
  EXPECT_EQ(rows[5].why_not, "not installed: gcc-arm-none-eabi");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].available, i < 3);
    EXPECT_FALSE(rows[i].failed());
  }
  const std::string table = table_of(rows);
  EXPECT_NE(table.find("clang"), table.npos);
  EXPECT_NE(table.find("not installed: gcc-arm-none-eabi\n"), table.npos) << table;

  const io::TemporaryFolder folder;
  toy.write(folder.path());
  for (const auto& row : footprints(folder.path(), "flappy_policy.h")) {
    EXPECT_FALSE(row.available || row.failed());
    EXPECT_EQ(row.why_not, row.target.starts_with("Cortex") ? "not installed: gcc-arm-none-eabi"
                                                            : "not installed: gcc-riscv64-unknown-elf");
  }
}

TEST(Proof, ContractionIsSeen) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Toy toy;
  toy.sum = "weight * x + sum";
  const std::vector<Parity> rows = proof_of(toy, vectors_of(toy, 300, false));
  for (const auto& row : rows) {
    ASSERT_EQ(row.why_not, "") << row.compiler;
    const bool fuses = row.target == "Cortex-M4F" ||
                       (row.options.find("-march=native") != row.options.npos && __builtin_cpu_supports("fma"));
    // a good part of the numbers, by a few units in the last place of something below 1
    EXPECT_EQ(row.differing > 50, fuses) << row.compiler << " " << row.options << " " << row.differing;
    EXPECT_EQ(row.failed(), fuses);
    EXPECT_LT(row.largest_difference, 1e-5);
  }
}

TEST(Proof, WhatGoesWrongIsARow) {
  if (!test::full()) GTEST_SKIP() << "takes ten seconds: with --full";
  Toy wrong;
  wrong.off = 0.01F;
  for (const auto& row : proof_of(wrong, vectors_of(wrong, 3))) {
    EXPECT_EQ(row.policy_selftest, 7) << row.compiler;
    EXPECT_NEAR(row.policy_error, 0.01, 1e-6);
    EXPECT_EQ(row.differing, 0u);
    EXPECT_TRUE(row.failed());
  }
  Toy crashing;
  crashing.before = "if (obs[0] > -3.0F) __builtin_trap();\n";
  for (const auto& row : proof_of(crashing, vectors_of(crashing, 3))) {
    EXPECT_TRUE(row.why_not.starts_with("crashes: exit code ")) << row.compiler << " " << row.why_not;
    EXPECT_TRUE(row.available && row.failed());
  }
  Toy sloppy;
  sloppy.before = "  if (obs[0] * 2.0 > 200.0) return 1;\n";
  for (const auto& row : proof_of(sloppy, vectors_of(sloppy, 3))) {
    EXPECT_TRUE(row.why_not.starts_with("does not compile: flappy_policy.h:")) << row.compiler << " " << row.why_not;
    EXPECT_NE(row.why_not.find("double"), row.why_not.npos);
    EXPECT_TRUE(row.failed());
  }
  Toy colliding;
  colliding.other = "float flappy_scratch = 1.0F;\n";
  for (const auto& row : proof_of(colliding, vectors_of(colliding, 3))) {
    EXPECT_TRUE(row.why_not.starts_with("does not compile: ")) << row.compiler << " " << row.why_not;
    EXPECT_NE(row.why_not.find("multiple definition of `flappy_scratch'"), row.why_not.npos) << row.why_not;
  }
}

TEST(Proof, BadCallsAreRefused) {
  const Toy toy;
  const io::TemporaryFolder folder;
  EXPECT_NE(test::refusal([&] { prove(folder.path(), vectors_of(toy, 2), Reach::everywhere); }).find("flappy_policy.h"),
            std::string::npos);
  EXPECT_NE(test::refusal([&] { footprints(folder.path(), "flappy_policy.h"); }).find("flappy_policy.h"),
            std::string::npos);
  policy::PolicyVectors vectors = vectors_of(toy, 2);
  vectors.observation.pop_back();
  EXPECT_THROW(prove(folder.path(), vectors, Reach::everywhere), std::invalid_argument);

  vectors = vectors_of(toy, 2);
  vectors.outputs = 1;
  vectors.observation.resize(std::size_t{4} * kObs);
  const NarrowPath path({"gcc", "as", "ld", "timeout"});
  const std::vector<Parity> rows = proof_of(toy, vectors);
  EXPECT_NE(rows[0].why_not.find("are not those of the policy"), std::string::npos) << rows[0].why_not;
}

TEST(Proof, ControllerIsTriedToo) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Toy toy;
  const io::TemporaryFolder folder;
  toy.write(folder.path());
  std::ofstream(folder / "flappy_controller.h")
      << "#ifndef CONTROLLER\n#define CONTROLLER\nstatic inline int flappy_controller_selftest(void) { return 3; }\n"
         "static inline float flappy_controller_selftest_error(void) { return 0.25F; }\n#endif\n";
  for (const auto& row : prove(folder.path(), vectors_of(toy, 2), Reach::everywhere)) {
    EXPECT_EQ(row.why_not, "");
    EXPECT_EQ(row.policy_selftest, 0);
    EXPECT_EQ(row.controller_selftest, 3);
    EXPECT_EQ(row.controller_error, 0.25);
    EXPECT_TRUE(row.failed());
  }
  const std::vector<Footprint> rows = footprints(folder.path(), "flappy_controller.h");
  EXPECT_EQ(rows.size(), 20u);
  for (const auto& row : rows) {
    if (row.function == "flappy_controller_period") {  // of which the toy has none
      EXPECT_TRUE(row.failed());
      continue;
    }
    EXPECT_EQ(row.function, "flappy_controller_selftest");
    EXPECT_LE(row.flash_bytes, 16);  // it only returns a number
    EXPECT_EQ(row.ram_bytes, 0);
  }
}

/// A policy that spins: a load, two stores, a count and two instructions a turn; the empty function has the rest as well.
double instructions_of(int turns) {
  Toy toy;
  toy.before =
      "  (void)w;\n  (void)middle;\n  action[0] = action[1] = obs[0];\n#if defined __arm__\n  {\n    int n = " +
      std::to_string(turns) +
      ";\n    __asm__ volatile(\"1: subs %0, %0, #1\\n bne 1b\" : \"+r\"(n) : : \"cc\");\n    return 0;\n  }\n"
      "#endif\n";
  const std::vector<Parity> rows = proof_of(toy, vectors_of(toy, 7));
  EXPECT_EQ(board(rows).why_not, "");
  return board(rows).instructions_per_inference;
}

TEST(Proof, CountsInstructions) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  // two durations are each off by less than a microsecond, which is 1,000 instructions in 1,001 inferences
  EXPECT_NEAR(instructions_of(100), 204, 2);
  EXPECT_NEAR(instructions_of(1100), 2204, 2);
}

/// Compiles one C program for the board and runs it.
io::Finished on_board(const std::string& source, const std::string& input) {
  const io::TemporaryFolder folder;
  write_board(folder.path());
  std::ofstream(folder / "program.c") << source;
  std::vector<std::string> options = strict_options({});
  options.emplace_back("-O2");
  io::Finished built = run_limited(board_build(folder.path(), {folder / "program.c"}, options, folder / "a.elf"));
  if (built.exit_code != 0) return built;
  // the memory of a real one begins with anything
  std::ofstream(folder / "memory") << std::string(4096, '\xa5');
  std::vector<std::string> command = board_run(folder / "a.elf", false);
  append(command, {"-device", "loader,force-raw=on,addr=0x20000000,file=" + (folder / "memory").string()});
  return run_limited(command, input);
}

TEST(Board, SerialLineCarriesEveryByte) {
  std::string all;
  for (int turn = 0; turn < 3; ++turn)
    for (int i = 0; i < 256; ++i) all.push_back(static_cast<char>(i * (2 * turn + 1)));
  const std::string kProgram = R"(#include "board.h"
static uint8_t bytes[768];
int main(void) {
  unsigned i;
  if (!board_read(bytes, 1) || !board_read(bytes + 1, 700) || !board_read(bytes + 701, 67)) return 1;
  for (i = 0; i < 768; ++i)
    if (bytes[i] != (uint8_t)(i * (2 * (i / 256) + 1))) return 2;
  board_write(bytes, 700);
  board_write(bytes + 700, 68);
  return 42;
}
)";
  const io::Finished finished = on_board(kProgram, all);
  EXPECT_EQ(finished.exit_code, 42) << finished.err;
  EXPECT_EQ(finished.out, all);
}

TEST(Board, StartsAsCDoes) {
  // initialised and zeroed data, constants, the floating-point unit, and gcc's own calls
  const io::Finished finished = on_board(R"(#include "board.h"
typedef struct { char c[300]; } Large;
static volatile float third = 1.0F / 3.0F;
static volatile int zero[100], seven = 7;
static Large from, to;
int main(void) {
  const uint32_t begin = board_us();
  unsigned i;
  for (i = 0; i < 300; ++i) from.c[i] = (char)(i % 100);
  to = from;
  for (i = 0; i < 300; ++i) if (to.c[i] != (char)(i % 100)) return 1;
  for (i = 0; i < 100; ++i) if (zero[i] != 0) return 2;
  if (seven != 7 || third * 3.0F < 0.99F || third * 3.0F > 1.01F) return 4;
  while (board_us() - begin < 2000U) {}
  return 0;
}
)",
                                         "");
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(on_board("int main(void) { *(volatile int *)0xF0000000U = 1; return 0; }\n", "").exit_code, 3);
}

Footprint footprint_of(const std::vector<Footprint>& rows, const std::string& target, const std::string& options,
                       const std::string& function) {
  for (const auto& row : rows)
    if (row.target == target && row.options == options && row.function == function) return row;
  return {.why_not = "no such row"};
}

std::vector<Footprint> footprints_of(const Toy& toy) {
  const io::TemporaryFolder folder;
  toy.write(folder.path());
  return footprints(folder.path(), "flappy_policy.h");
}

TEST(Footprints, GrowWithTheWeights) {
  if (!test::full()) GTEST_SKIP() << "takes ten seconds";
  Toy small, large, deep;
  small.hidden = 32;
  large.hidden = 64;
  deep.other =
      "__attribute__((noinline)) static float deeper(float x) {\n  volatile float room[250];\n"
      "  room[0] = x;\n  return room[0];\n}\n";
  deep.hidden = 32;
  deep.sum = "fused(weight, deeper(x), sum)";
  const std::vector<Footprint> few = footprints_of(small), many = footprints_of(large), stacked = footprints_of(deep);
  ASSERT_EQ(few.size(), 20u);  // five targets, two options, two functions
  for (std::size_t i = 0; i < few.size(); ++i) {
    const std::string name = few[i].target + " " + few[i].options + " " + few[i].function;
    EXPECT_FALSE(few[i].failed()) << name << " " << few[i].why_not;
    EXPECT_GT(few[i].flash_bytes, 4 * small.weights()) << name;
    // the code beside the weights may only need other constants
    EXPECT_NEAR(static_cast<double>(many[i].flash_bytes - few[i].flash_bytes), 4 * (large.weights() - small.weights()),
                64)
        << name;
    EXPECT_EQ(few[i].ram_bytes, 0) << name;
    EXPECT_GE(few[i].stack_bytes, 4 * small.hidden) << name;
    // beside the numbers, up to a dozen registers are saved in a frame, in steps of 16 bytes
    const long wider = many[i].stack_bytes - few[i].stack_bytes, deeper = stacked[i].stack_bytes - few[i].stack_bytes;
    EXPECT_NEAR(static_cast<double>(wider), 4 * (large.hidden - small.hidden), 64) << name;
    EXPECT_NEAR(static_cast<double>(deeper), 1000, 128) << name;
  }
  const std::string step = "flappy_policy_step";
  // the arithmetic of the smallest processor is code
  EXPECT_GT(footprint_of(few, "Cortex-M0+", "-Os", step).flash_bytes,
            footprint_of(few, "Cortex-M4F", "-Os", step).flash_bytes + 500);
  EXPECT_GT(footprint_of(few, "RV32IMAC", "-Os", step).flash_bytes,
            footprint_of(few, "RV32IMAFC", "-Os", step).flash_bytes + 500);
  EXPECT_GT(footprint_of(few, "Cortex-M4F", "-Os", "flappy_policy_selftest").flash_bytes,
            footprint_of(few, "Cortex-M4F", "-Os", step).flash_bytes);
}

TEST(Footprints, FindMemoryAndRecursion) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Toy toy;
  toy.other = "static volatile float held[25];\nstatic int calls = 1;\n";
  toy.before = "held[calls++ % 25] = obs[0];\n";
  for (const auto& row : footprints_of(toy)) {
    EXPECT_GE(row.ram_bytes, 104) << row.target << " " << row.why_not;
    EXPECT_LE(row.ram_bytes, 104 + 32) << row.target;  // its three sections begin at multiples of up to 16
  }
  toy.before = "if (turn(obs[0]) > 3.0F) return 0;\n";
  toy.other =
      "__attribute__((noinline)) static float turn(float x) {\n"
      "  volatile float y = x;\n  return x < 1.0F ? y : y + turn(x / 2.0F) * y;\n}\n";
  for (const auto& row : footprints_of(toy)) EXPECT_EQ(row.why_not, "recurses: no bound of its stack") << row.target;
}

TEST(Tables, FitATerminal) {
  std::vector<Parity> rows(3);
  rows[0] = {.compiler = "arm-none-eabi-gcc",
             .version = "12.2.1",
             .options = "-std=gnu99 -O2",
             .machine = "-mthumb",
             .target = "Cortex-M4F",
             .outputs = 4000,
             .differing = 12,
             .largest_difference = 5.9e-8,
             .instructions_per_inference = 12345.4};
  rows[1] = {.compiler = "clang",
             .version = "14.0.6",
             .options = "-std=gnu99 -O3 -march=native",
             .target = "x86_64",
             .controller_selftest = 2,
             .outputs = 120000};
  rows[2] = {.compiler = "gcc",
             .version = "12.2.0",
             .options = "-std=c99 -O0",
             .target = "x86_64",
             .why_not = "does not compile: " + std::string(200, 'x')};
  const std::string table = table_of(rows);
  std::istringstream lines(table);
  std::string line;
  while (std::getline(lines, line)) EXPECT_LE(line.size(), 100u) << line;
  EXPECT_NE(table.find("passed          12    4000  5.9e-08\n"), table.npos) << table;
  EXPECT_NE(table.find("gnu99 -O3 -march=native  control: 2       0  120000        0\n"), table.npos) << table;
  EXPECT_NE(table.find("Cortex-M4F: 12345 instructions per inference\n"), table.npos) << table;
  const auto json = json_of(rows);
  EXPECT_EQ(json.size(), 3u);
  EXPECT_EQ(json[0]["differing"], 12);
  EXPECT_EQ(json[0]["failed"], true);
  EXPECT_EQ(json[2]["why_not"], rows[2].why_not);

  const std::vector<Footprint> prints = {{.function = "flappy_policy_step",
                                          .target = "Cortex-M0+",
                                          .options = "-Os",
                                          .flash_bytes = 12345,
                                          .ram_bytes = 0,
                                          .stack_bytes = 321}};
  EXPECT_NE(table_of(prints).find("flappy_policy_step  Cortex-M0+  -Os        12345      0      321\n"),
            std::string::npos)
      << table_of(prints);
  EXPECT_EQ(json_of(prints)[0]["stack_bytes"], 321);
}

}  // namespace
}  // namespace flappy::deploy
