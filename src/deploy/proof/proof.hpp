// Proves the exported C on compilers and processors other than those of the training.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "policy/policy_network.hpp"

namespace flappy::deploy {

/// The result of one compiler with one set of options.
struct Parity {
  std::string compiler, version, options, machine, target;  ///< machine: the options that choose the processor
  bool available = true;                                    ///< false: the tool is not installed
  std::string why_not;                                      ///< not installed, does not compile, or crashes
  int policy_selftest = 0, controller_selftest = 0;         ///< return codes of the self-tests; 0: passed
  double policy_error = 0, controller_error = 0;            ///< largest differences in the self-tests
  std::size_t outputs = 0, differing = 0;                   ///< outputs compared, and those that differ in any bit
  double largest_difference = 0;                            ///< infinite where a NaN occurs
  double instructions_per_inference = 0;                    ///< more than an empty function; 0: not counted

  bool failed() const;
};

enum class Reach {
  here,       ///< only cc, or gcc where there is no cc
  everywhere  ///< every gcc and clang in PATH, g++, and a Cortex-M4F
};

/// Compiles flappy_policy.h, and flappy_controller.h if any, and runs them on 1 to 30,000 vectors, whose actions must
/// match to the bit. Missing tools, compile errors and crashes are rows. io::InputError without a header.
std::vector<Parity> prove(const std::filesystem::path& folder, const policy::PolicyVectors& vectors, Reach reach);

/// The memory that one function takes on one microcontroller.
struct Footprint {
  std::string function, target, options, machine;
  bool available = true;
  std::string why_not;
  long flash_bytes = 0, ram_bytes = 0;  ///< a program that calls it, less the same program without the call
  /// Stack of the deepest call path; excludes the compiler's arithmetic (libgcc), whose frames are unknown.
  long stack_bytes = 0;

  bool failed() const { return available && !why_not.empty(); }
};

/// Footprints of flappy_policy.h or flappy_controller.h: of the step (a control period's work) and the self-test. They
/// exclude the caller's observation and action and include padding between sections of RISC-V.
std::vector<Footprint> footprints(const std::filesystem::path& folder, const std::string& header);

/// A text table for a terminal of 100 columns.
std::string table_of(const std::vector<Parity>& rows);
std::string table_of(const std::vector<Footprint>& rows);
nlohmann::ordered_json json_of(const std::vector<Parity>& rows);
nlohmann::ordered_json json_of(const std::vector<Footprint>& rows);

}  // namespace flappy::deploy
