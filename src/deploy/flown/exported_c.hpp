// The exported C as a library in this process: what a robot's processor runs, to be replayed on its logs.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "io/shared_library.hpp"

namespace flappy::deploy {

/// How the headers are compiled.
enum class Build {
  exact,       ///< as they ask for
  contracted,  ///< by clang with -ffp-contract=fast, which no pragma overrides
  int8         ///< with flappy_policy_int8.h
};

/// Observation and action of the exported policy: contract.json.
struct Contract {
  struct Signal {
    std::string name, unit;
    double low = 0, high = 0;
  };
  /// Input of a robot without motors: neutral and mix times the four actions, within low to high.
  struct Input {
    std::string name;
    double neutral = 0, low = 0, high = 0;
    std::array<double, 4> mix{};
  };
  std::string task;
  std::uint32_t policy_crc32 = 0, controller_crc32 = 0;
  double control_s = 0, policy_s = 0, driver_s = 0;
  double imu_Hz = 0, mocap_Hz = 0, imu_latency_s = 0, mocap_latency_s = 0;
  std::uint32_t history = 1;
  int memory = 0;  ///< numbers that a recurrent policy remembers
  std::vector<Signal> observation, action;
  std::vector<Input> inputs;       ///< empty: two motors
  std::vector<float> mean, scale;  ///< [observation]
};

/// Reads contract.json of an exported folder. io::InputError where it is missing, damaged, or of an export without
/// controller.
Contract read_contract(const std::filesystem::path& folder);

/// flappy_policy.h and flappy_controller.h of a folder, compiled. Not thread-safe: constants() are those of the library.
class ExportedC {
 public:
  using Pose = std::array<float, 7>;  ///< position in m, attitude as w, x, y, z
  /// io::InputError where a header is missing or does not compile, or the compiler is missing.
  ExportedC(const std::filesystem::path& folder, Build build);
  ExportedC(const ExportedC&) = delete;
  ExportedC& operator=(const ExportedC&) = delete;

  /// The controller's numbers by name, such as "driver_bias_V"; gains have several. They may be changed.
  const std::map<std::string, std::vector<float*>>& constants() const { return constants_; }

  std::uint32_t (*policy_crc32)();  ///< FLAPPY_POLICY_CRC32; the next: FLAPPY_CONTROLLER_CRC32
  std::uint32_t (*controller_crc32)();
  // The functions of the headers; `state` has state_bytes().
  std::size_t state_bytes() const;
  void (*start)(void* state, std::uint32_t now_us, const float* pose);
  unsigned (*remembered)();  ///< numbers of OnboardLog::start_memory
  void (*recall)(void* state, const float* memory, std::uint32_t phase);
  void (*hover)(void* state);
  void (*stay)(void* state);
  void (*begin)(void* state);
  int (*imu)(void* state, std::uint32_t taken_us, const float* rate_and_force);
  int (*pose)(void* state, std::uint32_t taken_us, const float* pose);
  int (*tick)(void* state, std::uint32_t now_us);
  int (*handed_back)(const void* state);
  void (*set_handed_back)(void* state, int handed_back);
  std::uint32_t (*ticks)(const void* state);  ///< control periods since begin()
  void (*observe)(const void* state, float* observation);
  void (*forget)(void* state);  ///< the history
  void (*reset)(void* state);   ///< the memory of a recurrent policy
  /// Only the memory of `state` is used.
  int (*policy)(void* state, const float* observation, float* action);
  void (*act)(void* state, const float* action);
  void (*steer)(void* state, float* input);  ///< V, V, V, split cycle, before they are clipped
  void (*drive)(void* state, const float* input,
                float* volts);  ///< left, right, or the robot's inputs; with this input

 private:
  ExportedC(const std::filesystem::path& folder, Build build, const std::string& controller);
  const io::SharedLibrary library_;
  std::map<std::string, std::vector<float*>> constants_;
};

}  // namespace flappy::deploy
