// Flies a policy, or a controller alone, on many randomised vehicles: always the same vehicles, starts and noise for the
// same configuration and numbers, however many threads and in parts of whatever size.
#pragma once

#include "io/ranks.hpp"
#include "rollout/outcome.hpp"
#include "rollout/rollout.hpp"

namespace flappy::rollout {

/// Numbers of the first flapper in the random streams: no vehicle, start or noise is in two of them.
inline constexpr std::uint32_t kTrainingFlappers = 0, kValidationFlappers = std::uint32_t{1} << 30,
                               kTestFlappers = std::uint32_t{1} << 31;

struct EvaluationOptions {
  std::size_t count = 1000;
  std::uint32_t first_flapper = kTestFlappers;
  std::size_t part = 1024;     ///< flights at a time: bounds memory
  io::Ranks* ranks = nullptr;  ///< fly their shares of the flights; all have the outcomes of all
};

/// Who acts on top of the controller. Where it is neither, the controller flies alone, the goal its set point, without
/// hand-back and without the two rules that end flights early (faced_by_s, arrived_by_s).
struct Agent {
  std::shared_ptr<const policy::Actor> actor;
  const policy::Policy* policy = nullptr;
};

enum class Detail {
  success,  ///< only what the fleet itself notes: for validation during training
  full
};

struct Evaluation {
  std::vector<Outcome> flights;  ///< whole parts only where it was stopped
  bool stopped = false;
  double wall_s = 0, steps = 0;  ///< of physics, hover before the start included where it was flown
};

/// Snapshots of each part's flights, once they have hovered; empty until then, and where flights start otherwise.
template <class T>
using Hovers = std::vector<std::vector<flight::Snapshot<T>>>;

class Evaluator {
 public:
  /// Seed, threads and precision are those of `config`, its `actor` is not used. io::InputError where its task says no
  /// success or takes longer than duration_s.
  Evaluator(FlyConfig config, const EvaluationOptions& options);

  /// Each vehicle starts from its own settled hover, flown once for all calls. `keep_going` is asked with the share that is
  /// done; false ends the evaluation. std::invalid_argument for an agent that does not fit the task.
  Evaluation fly(const Agent& agent, Detail detail, const std::function<bool(double done)>& keep_going = {});

  const FlyConfig& config() const { return config_; }

 private:
  FlyConfig config_;
  EvaluationOptions options_;
  Hovers<float> float_hovers_;  // one of the two is used
  Hovers<double> double_hovers_;
};

/// The same flights on the vehicle as it is, all from the middle of the task's start.
FlyConfig nominal(FlyConfig config);

}  // namespace flappy::rollout
