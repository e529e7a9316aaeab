// The diagnosing side of the blind benchmark. It reads the flights and files that a Question names, or the default
// files of configs, and never a label.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::benchmark {

/// The answer of a simple method that the diagnosis is compared with (rivals.hpp).
struct Rival {
  std::vector<std::string> named;    ///< ids of the effects that it says are present, or kSomething; empty: none
  std::vector<std::string> ranking;  ///< ids of effects, the most likely first; may lack effects that it cannot judge
  double strength = 0;               ///< of what it says; 0: it has nothing to say
};
/// What a rival names that sees a change, but no cause.
inline constexpr const char* kSomething = "something";

/// The prediction of a case, made before its label is opened.
struct Prediction {
  gap::Diagnosis diagnosis;
  std::map<std::string, Rival> rivals;  ///< by name; empty: not asked for, or the logs are faulty
  std::string corrected;                ///< text of the corrected vehicle file; empty if the logs are faulty
  bool crashed = false;                 ///< the robot crashed in the proposed flight, so nothing was predicted
};

/// Whether a verdict gives no single answer: it is a group, or its probability is below one half.
bool abstains(const gap::Verdict& verdict);

struct Question {
  std::vector<std::filesystem::path> flights;    ///< folders of logs
  std::vector<std::filesystem::path> reference;  ///< folders of reference logs; empty: no contrast
  /// TOML files. All but the vehicle may be empty: gap::DiagnosisSettings.
  std::filesystem::path vehicle, priors, discrepancy, verdict, sessions;
  std::vector<std::string> withheld;  ///< effects to leave out of the catalogue
  bool rivals = true;                 ///< also compute Prediction::rivals
  /// Folder of manoeuvres (*.toml), one of which is proposed if the verdict abstains; empty: none.
  std::filesystem::path experiments;
};
using Predictor = std::function<Prediction(const Question&)>;

/// Diagnoses on one thread, as flappy-gap does (gap/diagnose/diagnose.hpp). Throws io::InputError for a file or log
/// that is not accepted.
Prediction predict(const Question& question);

}  // namespace flappy::benchmark
