#include "deploy/header/policy_header.hpp"

#include <algorithm>
#include <sstream>
#include <type_traits>

#include "deploy/embedded.hpp"
#include "deploy/header/c_text.hpp"

namespace flappy::deploy {
namespace {

using flight::Signal;

/// Largest accepted difference of a test vector, as a share of each output's range.
constexpr float kTolerance = 1e-5F;

constexpr const char* kSignalType = R"(/* One number of the observation or the action. */
typedef struct {
  const char *name, *unit, *frame;
  float low, high;
} flappy_policy_signal;
)";

constexpr const char* kPolicyCodes = R"(/* What flappy_policy_selftest() finds. */
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

/// The network's numbers: declarations, CRC-32 and bytes, in the order in which C computes the checksum.
class Numbers {
 public:
  template <class N>
  void add(const char* name, const char* count, const std::vector<N>& numbers) {
    const char* type = sizeof(N) == 1 ? "int8_t" : std::is_same_v<N, float> ? "float" : "int32_t";
    using Written = std::conditional_t<std::is_same_v<N, float>, float, std::int32_t>;
    const std::vector<Written> list(numbers.begin(), numbers.end());
    crc_ = crc32(crc_, std::span<const Written>(list));
    bytes_ += sizeof(N) * list.size();
    text_ += c_array<Written>(
        std::string("static const ") + type + " flappy_policy_" + name + "[FLAPPY_POLICY_" + count + "]", list);
  }
  const std::string& text() const { return text_; }
  std::uint32_t crc() const { return crc_; }
  std::size_t bytes() const { return bytes_; }

 private:
  std::string text_;
  std::uint32_t crc_ = 0;
  std::size_t bytes_ = 0;
};

/// The differences between headers with numbers of 32 and of 8 bits.
struct Kind {
  const char *title, *code, *hidden;
  std::size_t scratch_bytes;  ///< scratch memory for each neuron of the widest layer
  std::size_t memory_bytes;   ///< more of it for each unit of the memory
  Numbers numbers;
};

template <class Network>
void add_common(const Network& n, Numbers& to) {
  to.add("mean", "OBS", n.mean);
  to.add("scale", "OBS", n.scale);
  to.add("middle", "ACT", n.middle);
  to.add("half", "ACT", n.half);
}

Kind kind_of(const policy::PolicyNetwork& n) {
  static constexpr const char* kHidden[] = {"flappy_max(x, 0.0F)", "flappy_tanh(x)", "flappy_elu(x)", "flappy_silu(x)"};
  Kind kind{"A trained policy", "policy.h",        kHidden[static_cast<int>(n.hidden)],
            2 * sizeof(float),  6 * sizeof(float), {}};
  add_common(n, kind.numbers);
  kind.numbers.add("weights", "WEIGHTS", n.weights);
  return kind;
}

Kind kind_of(const QuantisedNetwork& n) {
  Kind kind{"A trained policy in whole numbers of 8 bits",
            "policy_int8.h",
            n.relu ? "flappy_max(x, 0.0F)" : "127.0F * flappy_tanh(x)",
            1 + sizeof(std::int32_t),
            3 * sizeof(std::int32_t) + 7 * sizeof(float),
            {}};
  add_common(n, kind.numbers);
  kind.numbers.add("multiplier", "NEURONS", n.multiplier);
  kind.numbers.add("bias", "NEURONS", n.bias);
  kind.numbers.add("weights", "WEIGHTS", n.weights);
  return kind;
}

template <class Network>
std::string header(const rollout::FlyConfig& config, const policy::RunInfo& run, const Network& n,
                   const policy::PolicyVectors& vectors) {
  const Kind kind = kind_of(n);
  const auto inputs = static_cast<std::size_t>(n.inputs()), outputs = static_cast<std::size_t>(n.outputs());
  const int widest = *std::ranges::max_element(n.widths);
  int neurons = 0, multiply_adds = 0;
  std::string widths;
  const int units = n.memory();
  for (std::size_t i = 0; i < n.widths.size(); ++i) widths += (i > 0 ? ", " : "") + std::to_string(n.widths[i]);
  for (const auto& [in, out] : policy::weight_blocks(n.widths, n.recurrent)) neurons += out, multiply_adds += in * out;
  std::ostringstream text;
  const auto define = [&](const char* name, const auto& value) {
    text << "#define FLAPPY_POLICY_" << name << " " << value << "\n";
  };
  text << c_comment(std::string(kind.title) +
                    ", exported by flappy-export. C99 or C++17, gcc or clang; nothing else is needed.\n\n" +
                    contract_text(config, run))
       << "#ifndef FLAPPY_POLICY_H\n#define FLAPPY_POLICY_H\n\n#include <stdint.h>\n\n"
       << kEmbedded.at("begin.h") << "\n"
       << contract_macros("FLAPPY_POLICY_", config, run);
  define("OBS", n.observations());
  define("ACT", n.actions());
  define("MEMORY", units);
  define("IN", inputs);
  define("OUT", outputs);
  define("WEIGHTS", n.weights.size());
  define("MULTIPLY_ADDS", multiply_adds);
  define("CONSTANT_BYTES", kind.numbers.bytes());
  define("SCRATCH_BYTES",
         static_cast<std::size_t>(widest) * kind.scratch_bytes + static_cast<std::size_t>(units) * kind.memory_bytes);
  define("CRC32", std::to_string(kind.numbers.crc()) + "U");
  define("LAYERS", n.widths.size() - 1);
  define("NEURONS", neurons);
  define("WIDTHS", "{" + widths + "}");
  define("WIDEST", widest);
  if constexpr (std::is_same_v<Network, policy::PolicyNetwork>) {
    define("CLIP", c_number(n.clip));
    define("LAYER_NORM", n.layer_norm ? 1 : 0);
    define("OUTPUT(x)", n.linear ? "flappy_clamp(x, -1.0F, 1.0F)" : "flappy_tanh(x)");
  }
  define("HIDDEN(x)", kind.hidden);
  define("VECTORS", vectors.rows());
  text << kPolicyCodes << "\n"
       << kSignalType << "\n"
       << signals("flappy_policy_observation", "FLAPPY_POLICY_OBS", config.fleet.task.observation())
       << signals("flappy_policy_action", "FLAPPY_POLICY_ACT", config.fleet.task.action()) << "\n"
       << kEmbedded.at("arithmetic.h") << "\n"
       << "/* The first layer's input is (observation - mean) scale, clipped; the output is middle + half * the last "
          "layer's. */\n"
       << kind.numbers.text() << "\n"
       << kEmbedded.at("policy_memory.h") << "\n"
       << kEmbedded.at(kind.code)
       << "\n/* Test vectors: observations of flights and corners of their range, and what was computed for them. */\n";
  std::vector<float> tolerance;
  for (const float half : n.half) tolerance.push_back(2 * half * kTolerance);
  tolerance.insert(tolerance.end(), static_cast<std::size_t>(units), 2 * kTolerance);
  text << c_array<float>("static const float flappy_policy_tolerance[FLAPPY_POLICY_OUT]", tolerance);
  const auto table = [&](const char* name, const char* width, const std::vector<float>& numbers, std::size_t columns) {
    text << "static const float flappy_policy_test_" << name << "[FLAPPY_POLICY_VECTORS][" << width << "] = {\n";
    for (std::size_t row = 0; row < vectors.rows(); ++row)
      text << c_row<float>(std::span(numbers).subspan(row * columns, columns)) << ",\n";
    text << "};\n";
  };
  table("obs", "FLAPPY_POLICY_IN", vectors.observation, inputs);
  table("action", "FLAPPY_POLICY_OUT", vectors.action, outputs);
  text << "\n"
       << kEmbedded.at("selftest.h") << "\n"
       << kEmbedded.at("end.h") << "\n"
       << end_of_header("POLICY", kind.numbers.crc());
  return text.str();
}

}  // namespace

std::string policy_header(const rollout::FlyConfig& config, const policy::RunInfo& run,
                          const policy::PolicyNetwork& network, const policy::PolicyVectors& vectors) {
  return header(config, run, network, vectors);
}

std::string policy_header(const rollout::FlyConfig& config, const policy::RunInfo& run, const QuantisedNetwork& network,
                          const policy::PolicyVectors& vectors) {
  return header(config, run, network, vectors);
}

}  // namespace flappy::deploy
