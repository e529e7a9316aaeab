// What the exported C computes, and takes, on compilers and processors other than the one that trained it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "policy/policy_network.hpp"

namespace flappy::deploy {

/// One compiler with one set of options.
struct Parity {
  std::string compiler, version, options, machine, target;  ///< machine: the options that choose the processor
  bool available = true;                                    ///< false: the tool is not installed
  std::string why_not;                                      ///< not installed, does not compile, does not end well
  int policy_selftest = 0, controller_selftest = 0;         ///< codes; 0: passed
  double policy_error = 0, controller_error = 0;            ///< largest differences in the self-tests
  std::size_t outputs = 0, differing = 0;                   ///< numbers compared, and those of which a bit differs
  double largest_difference = 0;                            ///< infinite where a NaN is met
  double instructions_per_inference = 0;                    ///< beyond those of an empty function; 0: not counted

  bool failed() const;
};

enum class Reach {
  here,       ///< the compiler that is called cc, or gcc where there is none
  everywhere  ///< every gcc and clang of PATH, g++, and a Cortex-M4F
};

/// Compiles `folder`/flappy_policy.h, and flappy_controller.h where it is there, and runs it: 1 to 30,000 vectors, whose
/// action has to come out to the bit. A tool that is missing, a header that does not compile and a program that crashes are
/// rows. io::InputError where there is no header.
std::vector<Parity> prove(const std::filesystem::path& folder, const policy::PolicyVectors& vectors, Reach reach);

/// What one function takes of one microcontroller.
struct Footprint {
  std::string function, target, options, machine;
  bool available = true;
  std::string why_not;
  long flash_bytes = 0, ram_bytes = 0;  ///< a program that calls it, less the same program without the call
  /// The deepest path from the call on, the compiler's arithmetic (libgcc) left out: nobody tells its frames.
  long stack_bytes = 0;

  bool failed() const { return available && !why_not.empty(); }
};

/// Of `folder`/`header`, flappy_policy.h or flappy_controller.h: its step, or all that it does in a control period, and its
/// self-test. The observation and the action are the caller's and not counted; padding between sections of RISC-V is.
std::vector<Footprint> footprints(const std::filesystem::path& folder, const std::string& header);

/// For a terminal of 100 columns.
std::string table_of(const std::vector<Parity>& rows);
std::string table_of(const std::vector<Footprint>& rows);
nlohmann::ordered_json json_of(const std::vector<Parity>& rows);
nlohmann::ordered_json json_of(const std::vector<Footprint>& rows);

}  // namespace flappy::deploy
