// Flies episodes of many flappers and collects transitions. A step is one action of every flapper. Its blocks may be
// flown on any thread, while a learner works. Transitions enter the replay memory only in end(). Each rank flies its
// share of the blocks; every rank's memory gets all transitions.
#pragma once

#include "flight/fleet.hpp"
#include "learn/checkpoint.hpp"
#include "learn/replay_buffer.hpp"
#include "learn/train_config.hpp"

namespace flappy::learn {

/// Sums over the episodes since the last take_sums(): count, returns, captures, hand-backs, terminations.
struct EpisodeSums {
  double episodes = 0, returns = 0, captured = 0, handed_back = 0, terminated = 0;
};

class Collector {
 public:
  /// If the task starts settled, flies the training vehicles to settled hover first.
  explicit Collector(const TrainConfig& config, io::Ranks* ranks = nullptr);

  /// Plans a step in which `actor` acts. Then call run(k) for each k below items(), on any threads, and end().
  void begin(const std::shared_ptr<const policy::Actor>& actor);
  std::size_t items() const { return last_item_ - first_item_; }
  void run(std::size_t k);
  /// Closes the step and adds its transitions to `replay`. Returns whether `wants_end` is true on any rank.
  bool end(Replay& replay, bool wants_end = false);

  /// Exchanges the states and records of flappers between ranks. Call it before take_sums() and save().
  void share();

  /// Returns the sums, added in the order of flappers, and resets them.
  EpisodeSums take_sums();
  std::uint64_t episodes() const;   ///< episodes ended since the beginning of the run
  std::uint64_t env_steps() const;  ///< control periods, summed over flappers
  double seconds() const;           ///< time spent in run(), summed over threads
  std::size_t vehicles() const { return pool_.size(); }

  void save(CheckpointWriter& to);
  void restore(const Checkpoint& from);

 private:
  /// Actions of a flapper that are not yet emitted as transitions, and its sums.
  struct Pending {
    std::uint32_t count = 0;  // pending actions, at most `return_steps`
    std::uint32_t episode = 0;
    // waits: 1 after the hand-back while rewards still count (up to reward.until_s), else 0; 64 bits against padding
    std::uint64_t episodes = 0, waits = 0;
    EpisodeSums sums;
    double episode_return = 0;
  };
  void start(std::size_t i);
  void gather(std::size_t i, std::size_t item);
  void emit(std::size_t i, std::size_t item, const float* next, bool terminated);
  float* observation(std::size_t i, std::size_t step) { return observations_.data() + (i * kept_ + step) * inputs_; }

  const TrainConfig& config_;
  io::Ranks* ranks_;
  rollout::FlyConfig fly_;
  flight::Fleet<float> fleet_;
  std::size_t first_item_ = 0, last_item_ = 0;  // blocks that this rank flies
  std::vector<flight::Snapshot<float>> pool_;
  std::size_t inputs_, outputs_, kept_;
  std::uint32_t paid_ticks_;
  std::vector<Pending> pending_;            // [flapper]
  std::vector<float> observations_;         // [flapper][kept_][inputs_]: observation before each pending action
  std::vector<float> actions_, rewards_;    // [flapper][kept_][outputs_], [flapper][kept_]
  std::vector<std::vector<float>> staged_;  // [block]: transitions of this step, in rows of Replay's layout
  std::vector<double> seconds_;             // [block]: time spent in run()
};

}  // namespace flappy::learn
