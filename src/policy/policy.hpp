// Policies in files of other formats: TorchScript, ONNX, or an exported C header that is compiled when it is loaded.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace flappy::policy {

/// Maps observations in physical units to offsets to the controller's output (V, V, V, split cycle in fractions of a
/// beat), or to the voltages of both motors.
class Policy {
 public:
  virtual ~Policy() = default;

  int observations() const { return observations_; }
  int actions() const { return actions_; }
  int memory() const { return memory_; }  ///< numbers that a recurrent policy remembers; 0 before a flight
  /// `observation`: float[count][observations() + memory()]; `action`: float[count][actions() + memory()], behind each
  /// action the next memory. Call it from one thread at a time.
  virtual void act(std::size_t count, const float* observation, float* action) const = 0;

 protected:
  Policy(int observations, int actions, int memory = 0)
      : observations_(observations), actions_(actions), memory_(memory) {}

  int observations_, actions_, memory_;
};

/// Loads a TorchScript file (.pt) whose forward(float[n][observations]) gives float[n][actions], an ONNX file (.onnx,
/// load_onnx()) or a C header (.h). A recurrent TorchScript has an integer attribute "memory", and its
/// forward(float[n][observations], float[n][memory]) gives action and next memory. A header defines
///   FLAPPY_POLICY_OBS, FLAPPY_POLICY_ACT
///   void flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT])
///   int flappy_policy_selftest(void)    0: passed; it is run on loading
/// or these names with another prefix than "flappy". A recurrent one has FLAPPY_POLICY_MEMORY above 0 and, in place of the
/// step, flappy_policy_of(const float in[OBS + MEMORY], float out[ACT + MEMORY]). Throws io::InputError, one line, if the file is of no such kind,
/// has other sizes, does not compile or fails its self-test.
std::unique_ptr<const Policy> load_policy(const std::filesystem::path& path, int observations, int actions);

/// Whether load_policy() reads files with this one's ending.
bool is_policy_file(const std::filesystem::path& path);
/// Those and actors, for messages.
inline constexpr const char* kPolicyFiles = "an actor (.json), TorchScript (.pt), ONNX (.onnx) or a C header (.h)";

/// Most numbers that a policy of a file may remember.
inline constexpr int kMaxRemembered = 1 << 16;

inline constexpr std::string_view kPrefix = "flappy";

/// Replaces the prefix "flappy_" or "FLAPPY_" of names by `prefix` in the same case; not in paths.
std::string with_prefix(std::string_view text, std::string_view prefix);

/// Whether this build or installation has the LibTorch plugin, which reads and writes TorchScript.
bool reads_torch_script();

}  // namespace flappy::policy
