#include "policy/policy.hpp"

#include <algorithm>
#include <cctype>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "io/files.hpp"
#include "io/plugin.hpp"
#include "io/refuse.hpp"
#include "io/run_program.hpp"
#include "io/shared_library.hpp"
#include "io/temporary_folder.hpp"
#include "policy/onnx.hpp"
#include "policy/torch_script.hpp"

namespace flappy::policy {
namespace {

namespace fs = std::filesystem;
using io::refuse;

/// C code that is compiled after the header. It wraps the header's names, so that they may be static, inline or macros.
constexpr const char* kWrapper = R"(#if !defined FLAPPY_POLICY_OBS || !defined FLAPPY_POLICY_ACT
#error FLAPPY_POLICY_OBS or FLAPPY_POLICY_ACT is missing
#endif
#ifndef FLAPPY_POLICY_MEMORY
#define FLAPPY_POLICY_MEMORY 0
#endif
const int flappy_loaded_observations = FLAPPY_POLICY_OBS, flappy_loaded_actions = FLAPPY_POLICY_ACT;
const int flappy_loaded_memory = FLAPPY_POLICY_MEMORY;
void flappy_loaded_step(const float *observation, float *action) {
#if FLAPPY_POLICY_MEMORY > 0
  flappy_policy_of(observation, action);
#else
  flappy_policy_step(observation, action);
#endif
}
int flappy_loaded_selftest(void) { return flappy_policy_selftest(); }
)";

bool is_of_name(char c) { return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0; }

/// The prefix of a header's names: the text before "_POLICY_OBS", in lower case; kPrefix if there is none.
std::string prefix_of(const std::string& header) {
  const std::size_t end = header.find("_POLICY_OBS ");
  std::size_t begin = end == std::string::npos ? 0 : end;
  while (begin > 0 && is_of_name(header[begin - 1])) --begin;
  if (end == std::string::npos || begin == end) return std::string(kPrefix);
  std::string prefix = header.substr(begin, end - begin);
  std::ranges::transform(prefix, prefix.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return prefix;
}

/// Compiles the header into a library. Returns the compiler's messages, or "" on success.
std::string compile(const fs::path& header, const fs::path& source, const fs::path& library) {
  try {
    // -Werror: with these warnings, C code could call another function than the intended one
    const io::Finished finished = io::run({"cc", "-O2", "-shared", "-fPIC", "-Werror=implicit-function-declaration",
                                           "-Werror=incompatible-pointer-types", "-include", header.string(),
                                           source.string(), "-o", library.string(), "-lm"});
    return finished.exit_code == 0 ? "" : finished.err + "\n";
  } catch (const std::system_error& e) {
    refuse(header, "cannot be compiled: cc: " + e.code().message(), "a C compiler of this name in PATH");
  }
}

std::string first_error(const fs::path& header, const std::string& complaints) {
  constexpr std::string_view kMark = "error: ";
  const std::size_t mark = complaints.find(kMark);
  const std::size_t begin = mark == std::string::npos ? 0 : complaints.rfind('\n', mark) + 1;
  std::string line = complaints.substr(begin, complaints.find('\n', begin) - begin);
  if (line.starts_with(header.string() + ":")) return line;
  return header.string() +
         ": does not compile: " + (mark == std::string::npos ? line : line.substr(mark - begin + kMark.size()));
}

class Header : public Policy {
 public:
  using Step = void (*)(const float*, float*);
  Header(io::SharedLibrary library, int observations, int actions, int memory, Step step)
      : Policy(observations, actions, memory), library_(std::move(library)), step_(step) {}

  void act(std::size_t count, const float* observation, float* action) const override {
    for (std::size_t i = 0; i < count; ++i)
      step_(observation + i * static_cast<std::size_t>(observations() + memory()),
            action + i * static_cast<std::size_t>(actions() + memory()));
  }

 private:
  io::SharedLibrary library_;
  Step step_;
};

std::unique_ptr<const Policy> load_header(const fs::path& path, int observations, int actions) {
  const std::string prefix = prefix_of(io::read_text(path));
  const fs::path header = fs::absolute(path);
  const io::TemporaryFolder folder;
  const fs::path source = folder / "wrapper.c", library = folder / "policy.so";
  io::write_atomically(source, with_prefix(kWrapper, prefix));
  const std::string complaints = compile(header, source, library);
  if (!complaints.empty())
    throw io::InputError(first_error(header, complaints) + "; accepted: a C header that cc compiles");

  std::optional<io::SharedLibrary> loaded;
  try {
    loaded.emplace(library);
  } catch (const std::runtime_error& e) {
    refuse(header, std::string("cannot be loaded: ") + e.what(), "a header that defines all it calls");
  }
  const auto symbol = [&, &from = *loaded](const char* name) { return from.symbol((prefix + name).c_str()); };
  const auto number = [&](const char* name) { return *static_cast<const int*>(symbol(name)); };
  const int has_observations = number("_loaded_observations"), has_actions = number("_loaded_actions"),
            memory = number("_loaded_memory");
  const auto step = reinterpret_cast<Header::Step>(symbol("_loaded_step"));
  const auto selftest = reinterpret_cast<int (*)()>(symbol("_loaded_selftest"));
  if (memory < 0 || memory > kMaxRemembered)
    refuse(header, "remembers " + std::to_string(memory) + " numbers",
           "FLAPPY_POLICY_MEMORY from 0 to " + std::to_string(kMaxRemembered));
  auto policy = std::make_unique<Header>(std::move(*loaded), has_observations, has_actions, memory, step);
  if (policy->observations() != observations || policy->actions() != actions)
    refuse(header,
           "has " + std::to_string(policy->observations()) + " inputs and " + std::to_string(policy->actions()) +
               " outputs",
           std::to_string(observations) + " and " + std::to_string(actions) + ", as the task has");
  const int failed = selftest();
  if (failed != 0) refuse(header, "fails its self-test: " + std::to_string(failed), "flappy_policy_selftest() of 0");
  return policy;
}

constexpr const char* kPlugin = "torch_script";

const TorchFunctions& torch() {
  static const auto* const functions =
      io::plugin<TorchFunctions>(kPlugin, "flappy_torch_functions", "this build has no LibTorch");
  return *functions;
}

}  // namespace

std::string with_prefix(std::string_view text, std::string_view prefix) {
  std::string capital(prefix), changed;
  std::ranges::transform(capital, capital.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  for (std::size_t at = 0; at < text.size();) {
    const bool begins = at == 0 || (!is_of_name(text[at - 1]) && text[at - 1] != '/');
    const std::string_view rest = text.substr(at);
    if (begins && (rest.starts_with("flappy_") || rest.starts_with("FLAPPY_"))) {
      changed += rest[0] == 'f' ? prefix : std::string_view(capital);
      at += kPrefix.size();
    } else {
      changed += text[at++];
    }
  }
  return changed;
}

std::unique_ptr<const Policy> load_policy(const fs::path& path, int observations, int actions) {
  if (path.extension() == ".pt") return load_torch_script(path, observations, actions);
  if (path.extension() == ".onnx") return load_onnx(path, observations, actions);
  if (path.extension() == ".h") return load_header(path, observations, actions);
  refuse(path, "is no policy", "a TorchScript file (.pt), an ONNX file (.onnx) or a C header (.h)");
}

bool is_policy_file(const fs::path& path) {
  const fs::path kind = path.extension();
  return kind == ".pt" || kind == ".onnx" || kind == ".h";
}

bool reads_torch_script() { return io::has_plugin(kPlugin); }

std::string torch_script(const PolicyNetwork& network, const std::string& contract) {
  if (!reads_torch_script()) throw std::invalid_argument("TorchScript is not written by a build without LibTorch");
  return torch().write(network, contract);
}

std::unique_ptr<const Policy> load_torch_script(const fs::path& path, int observations, int actions) {
  if (reads_torch_script()) return torch().load(path, observations, actions);
  io::read_text(path);
  refuse(path, "cannot be read by this build, which has no LibTorch",
         "a C header (.h), the package flappy-torch, or a build with libtorch-dev installed");
}

}  // namespace flappy::policy
