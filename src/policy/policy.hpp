// Policies from elsewhere: a TorchScript file, or an exported C header compiled on the spot.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace flappy::policy {

/// A policy from raw physical observations to what it adds to the controller's output, volts and split cycle in fractions of a
/// beat, or to the voltages of both motors.
class Policy {
 public:
  virtual ~Policy() = default;

  int observations() const { return observations_; }
  int actions() const { return actions_; }
  /// `observation`: float[count][observations()]; `action`: float[count][actions()]. One thread at a time.
  virtual void act(std::size_t count, const float* observation, float* action) const = 0;

 protected:
  Policy(int observations, int actions) : observations_(observations), actions_(actions) {}

 private:
  int observations_, actions_;
};

/// A TorchScript file (.pt) whose forward(float[n][observations]) is float[n][actions], or a C header (.h) that defines
///   FLAPPY_POLICY_OBS, FLAPPY_POLICY_ACT
///   void flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT])
///   int flappy_policy_selftest(void)    0: passed; it runs first
/// or the same with another prefix.
/// io::InputError, one line, where it is neither, has other sizes, does not compile or fails its test.
std::unique_ptr<const Policy> load_policy(const std::filesystem::path& path, int observations, int actions);

/// The prefix of names that flappy-export writes unless it is given another.
inline constexpr std::string_view kPrefix = "flappy";

/// C text in which names that begin with "flappy_" and "FLAPPY_" begin with `prefix` instead, in small and in capital letters; paths stay as they are.
std::string with_prefix(std::string_view text, std::string_view prefix);

/// Whether this build or installation reads and writes TorchScript.
bool reads_torch_script();

}  // namespace flappy::policy
