#include "deploy/policy_header.hpp"

#include <algorithm>
#include <sstream>

#include "deploy/c_text.hpp"
#include "deploy/embedded.hpp"

namespace flappy::deploy {
namespace {

using flight::Signal;

/// Differences that a test vector may show, of the range of each output.
constexpr float kTolerance = 1e-5F;

constexpr const char* kSignalType = R"(/* One number of the observation or the action. */
typedef struct {
  const char *name, *unit, *frame;
  float low, high;
} flappy_policy_signal;
)";

constexpr const char* kCodes = R"(/* What flappy_policy_selftest() finds. */
#define FLAPPY_POLICY_FAILED_CRC 1    /* the numbers are not those of the run */
#define FLAPPY_POLICY_FAILED_VECTOR 2 /* a test vector comes out otherwise */
#define FLAPPY_POLICY_FAILED_NAN 3    /* an observation with a NaN in it is not refused */
)";

std::string signals(const std::string& name, const char* count, const std::vector<Signal>& list) {
  std::string text = "static const flappy_policy_signal " + name + "[" + count + "] = {\n";
  for (const Signal& s : list)
    text += "    {" + c_string(s.name) + ", " + c_string(s.unit) + ", " + c_string(s.frame) + ", " +
            c_number(static_cast<float>(s.low)) + ", " + c_number(static_cast<float>(s.high)) + "},\n";
  return text + "};\n";
}

}  // namespace

std::string policy_header(const flight::FlyConfig& config, const RunInfo& run, const PolicyNetwork& n,
                          const PolicyVectors& vectors) {
  const flight::Task& task = config.fleet.task;
  const std::size_t rows = vectors.observation.size() / static_cast<std::size_t>(n.inputs());
  std::uint32_t crc = 0;
  std::size_t constants = 0;
  for (const auto* part : {&n.mean, &n.scale, &n.middle, &n.half, &n.weights}) {
    crc = crc32(crc, *part);
    constants += part->size() * sizeof(float);
  }
  const std::size_t layers = n.widths.size() - 1;
  const int widest = *std::ranges::max_element(n.widths);
  std::size_t multiply_adds = 0;
  std::string widths;
  for (std::size_t i = 0; i <= layers; ++i) {
    widths += (i > 0 ? ", " : "") + std::to_string(n.widths[i]);
    if (i > 0) multiply_adds += static_cast<std::size_t>(n.widths[i - 1]) * static_cast<std::size_t>(n.widths[i]);
  }
  std::ostringstream text;
  const auto define = [&](const char* name, const auto& value) {
    text << "#define FLAPPY_POLICY_" << name << " " << value << "\n";
  };
  text << c_comment(
              "A trained policy, exported by flappy-export. C99 or C++17, gcc or clang; nothing else is needed.\n\n" +
              contract_text(config, run))
       << "#ifndef FLAPPY_POLICY_H\n#define FLAPPY_POLICY_H\n\n#include <stdint.h>\n\n"
       << kEmbedded.at("begin.h") << "\n"
       << contract_macros("FLAPPY_POLICY_", config, run);
  define("OBS", n.inputs());
  define("ACT", n.outputs());
  define("WEIGHTS", n.weights.size());
  define("MULTIPLY_ADDS", multiply_adds);
  define("CONSTANT_BYTES", constants);
  define("SCRATCH_BYTES", 2 * static_cast<std::size_t>(widest) * sizeof(float));
  define("CRC32", std::to_string(crc) + "U");
  define("LAYERS", layers);
  define("WIDTHS", "{" + widths + "}");
  define("WIDEST", widest);
  define("CLIP", c_number(n.clip));
  define("HIDDEN(x)", n.relu ? "flappy_max(x, 0.0F)" : "flappy_tanh(x)");
  define("VECTORS", rows);
  text << kCodes << "\n"
       << kSignalType << "\n"
       << signals("flappy_policy_observation", "FLAPPY_POLICY_OBS", task.observation())
       << signals("flappy_policy_action", "FLAPPY_POLICY_ACT", task.action()) << "\n"
       << kEmbedded.at("arithmetic.h") << "\n";
  const auto array = [&](const char* name, const char* count, const std::vector<float>& numbers) {
    text << c_array<float>(std::string("static const float flappy_policy_") + name + "[" + count + "]", numbers);
  };
  text << "/* input = clamp((observation - mean) scale, +-clip); output = middle + half * the network's */\n";
  array("mean", "FLAPPY_POLICY_OBS", n.mean);
  array("scale", "FLAPPY_POLICY_OBS", n.scale);
  array("middle", "FLAPPY_POLICY_ACT", n.middle);
  array("half", "FLAPPY_POLICY_ACT", n.half);
  array("weights", "FLAPPY_POLICY_WEIGHTS", n.weights);
  text << "\n"
       << kEmbedded.at("policy.h")
       << "\n/* Test vectors: observations of flights and corners of their range, and what was computed for them. */\n";
  std::vector<float> tolerance;
  for (const float half : n.half) tolerance.push_back(2 * half * kTolerance);
  array("tolerance", "FLAPPY_POLICY_ACT", tolerance);
  const auto table = [&](const char* name, const char* width, const std::vector<float>& numbers, std::size_t columns) {
    text << "static const float flappy_policy_test_" << name << "[FLAPPY_POLICY_VECTORS][" << width << "] = {\n";
    for (std::size_t row = 0; row < rows; ++row)
      text << c_row<float>(std::span(numbers).subspan(row * columns, columns)) << ",\n";
    text << "};\n";
  };
  table("obs", "FLAPPY_POLICY_OBS", vectors.observation, static_cast<std::size_t>(n.inputs()));
  table("action", "FLAPPY_POLICY_ACT", vectors.action, static_cast<std::size_t>(n.outputs()));
  text << "\n" << kEmbedded.at("selftest.h") << "\n" << kEmbedded.at("end.h") << "\n#endif\n";
  return text.str();
}

}  // namespace flappy::deploy
