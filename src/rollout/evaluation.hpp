// Flies a policy, or a controller alone, on many randomised vehicles. Vehicles, starts and noise depend only on the
// configuration and the numbers of the flappers, not on the number of threads or the size of the parts.
#pragma once

#include "io/ranks.hpp"
#include "rollout/outcome.hpp"
#include "rollout/rollout.hpp"

namespace flappy::rollout {

/// First flapper number of training, validation and test: they share no vehicle, start or noise.
inline constexpr std::uint32_t kTrainingFlappers = 0, kValidationFlappers = std::uint32_t{1} << 30,
                               kTestFlappers = std::uint32_t{1} << 31;

struct EvaluationOptions {
  std::size_t count = 1000;
  std::uint32_t first_flapper = kTestFlappers;
  std::size_t part = 1024;     ///< flights that are flown at a time, to bound memory
  io::Ranks* ranks = nullptr;  ///< each rank flies its share of the flights and gets the outcomes of all
};

/// An actor or a policy, on top of the controller. With neither, the controller flies to the set point, without
/// hand-back to it and without the two rules that end flights early (faced_by_s, arrived_by_s).
struct Agent {
  std::shared_ptr<const policy::Actor> actor;
  const policy::Policy* policy = nullptr;
};

enum class Detail {
  success,  ///< only the results that the fleet records itself; for validation during training
  full
};

struct Evaluation {
  std::vector<Outcome> flights;  ///< if stopped: flights of the parts that were finished
  bool stopped = false;
  double wall_s = 0, steps = 0;  ///< wall-clock time, and number of physics steps; both with the hover if it was flown
};

/// [part][flight]: snapshots of settled hover; empty before it is flown, and for tasks that do not start settled.
template <class T>
using Hovers = std::vector<std::vector<flight::Snapshot<T>>>;

class Evaluator {
 public:
  /// Uses seed, threads and precision of `config`, but not its actor. Throws io::InputError if the task defines no
  /// success, is judged for longer than duration_s, is flown on a stand, or has an excitation.
  Evaluator(FlyConfig config, const EvaluationOptions& options);

  /// Flies all vehicles; their hovers are flown once for all calls. `keep_going` gets the share done; false ends the
  /// evaluation. Throws std::invalid_argument for an agent that does not fit the task.
  Evaluation fly(const Agent& agent, Detail detail, const std::function<bool(double done)>& keep_going = {});

  const FlyConfig& config() const { return config_; }

 private:
  FlyConfig config_;
  EvaluationOptions options_;
  Hovers<float> float_hovers_;  // only the one of config_.precision is used
  Hovers<double> double_hovers_;
};

/// The configuration without randomisation and drawn effects: the nominal vehicle, from the middle of the task's start
/// range.
FlyConfig nominal(FlyConfig config);

}  // namespace flappy::rollout
