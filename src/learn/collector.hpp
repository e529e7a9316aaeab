// Episodes of many flappers, and the transitions that they leave for the critics. One step is one action of every flapper;
// its blocks may be flown on any thread, beside a learner. What a step adds reaches the replay memory only in end().
// Of several ranks, each flies its share of the blocks; what they add reaches the memories of all.
#pragma once

#include "flight/fleet.hpp"
#include "learn/checkpoint.hpp"
#include "learn/replay_buffer.hpp"
#include "learn/train_config.hpp"

namespace flappy::learn {

/// Sums over the episodes that ended since they were last taken.
struct EpisodeSums {
  double episodes = 0, returns = 0, captured = 0, handed_back = 0, terminated = 0;
};

class Collector {
 public:
  /// Settles the vehicles of training where the task starts settled.
  explicit Collector(const TrainConfig& config, io::Ranks* ranks = nullptr);

  /// begin() plans a step in which `actor` acts, run() takes one of items() blocks through it, end() closes it.
  void begin(const std::shared_ptr<const policy::Actor>& actor);
  std::size_t items() const { return last_item_ - first_item_; }
  void run(std::size_t k);
  /// Whether any rank `wants_end`.
  bool end(Replay& replay, bool wants_end = false);

  /// Hands all ranks what the others' flappers are and did: before sums are taken and before save().
  void share();

  /// Sums in the order of flappers; then they start from nothing again.
  EpisodeSums take_sums();
  std::uint64_t episodes() const;   ///< since the beginning
  std::uint64_t env_steps() const;  ///< control periods of all flappers
  double seconds() const;           ///< of processor time in run(), all threads
  std::size_t vehicles() const { return pool_.size(); }

  void save(CheckpointWriter& to);
  void restore(const Checkpoint& from);

 private:
  /// What a flapper has done in its episode and not yet told.
  struct Pending {
    std::uint32_t count = 0;  // actions, at most `return_steps`
    std::uint32_t episode = 0;
    std::uint64_t episodes = 0, waits = 0;  // 1: handed back, and paid until the task's reward ends
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
  std::size_t first_item_ = 0, last_item_ = 0;  // blocks that are flown here
  std::vector<flight::Snapshot<float>> pool_;
  std::size_t inputs_, outputs_, kept_;
  std::uint32_t paid_ticks_;
  std::vector<Pending> pending_;            // of each flapper
  std::vector<float> observations_;         // [flapper][kept_][inputs_]: before each action that is pending
  std::vector<float> actions_, rewards_;    // [flapper][kept_][outputs_], [flapper][kept_]
  std::vector<std::vector<float>> staged_;  // of each block: transitions, row after row as Replay has them
  std::vector<double> seconds_;             // of each block
};

}  // namespace flappy::learn
