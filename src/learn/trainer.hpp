// Training: collection and learning side by side, evaluation at fixed updates, checkpoints, and what a run leaves behind.
//
//   RUN/config/          the resolved configuration; config/fly.toml flies the best policy
//   RUN/run.json         commit, processor, instruction set, seed, memory
//   RUN/metrics.*, timing.jsonl, events.out.tfevents.flappy   (metrics.hpp), a record for each evaluation
//   RUN/checkpoint_N.flappy
//   RUN/best.json, last.json   actors: of the best evaluation so far, and of the last one
//   RUN/summary.json
//   RUN/log.txt          what flappy-train notes
//
// Of several ranks, each flies its share of the flappers and of the validation vehicles, and takes its share of every batch; the
// first writes the folder.
//
// In every step, the actor as it was after the step before flies, while the learner samples from what was flown before: the
// lag is one step, whoever is faster. All but timing.jsonl, summary.json, run.json, the events and log.txt is the same for
// any number of threads, and after any number of resumptions.
#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "learn/train_config.hpp"

namespace flappy::learn {

/// What the person who waits is told.
struct TrainProgress {
  std::uint64_t update = 0, updates = 0, episodes = 0, env_steps = 0;
  double mean_return = 0;  ///< of the episodes since the last evaluation
  double success = -1;     ///< of the last evaluation; -1: none yet
  double updates_per_s = 0, env_steps_per_s = 0;
  bool evaluated = false;  ///< just now
};

/// What a run begins with instead of random weights.
struct TrainInit {
  policy::Actor actor;
  /// Critics, and what Adam remembers of every weight; nothing: they begin anew.
  std::optional<std::filesystem::path> checkpoint;
  std::string sha256;  ///< of all of it
};

/// Of a file the actor alone; of a run folder its best actor and what its newest checkpoint knows. io::InputError where one of them
/// cannot be read.
std::shared_ptr<const TrainInit> read_train_init(const std::filesystem::path& path);

struct TrainOptions {
  std::filesystem::path folder;
  /// Goes on from this checkpoint; nothing: the run starts.
  std::optional<std::filesystem::path> from;
  std::shared_ptr<const TrainInit> init;
  io::Ranks* ranks = nullptr;  ///< that train together; the first writes
  std::string commit;          ///< of the program
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();  ///< when the process did
  std::function<bool(const TrainProgress&)> keep_going;  ///< asked after each step; false: checkpoint and stop
};

struct TrainSummary {
  std::uint64_t seed = 0, updates = 0, env_steps = 0, episodes = 0;
  bool stopped = false;  ///< before its last update
  double wall_s = 0;     ///< since the process started, evaluations excluded
  double evaluation_s = 0;
  double share_simulation = 0, share_learning = 0;  ///< of the time of all threads; waiting counts as learning
  std::optional<double> best_success;               ///< nothing: never evaluated
  std::uint64_t best_update = 0;
  /// When 50, 80, 90, 95 % success were reached: the wall_s of the first evaluation at which, and at the next one, that many
  /// vehicles succeeded. Nothing: not reached.
  std::optional<double> time_to_s[4];
  int ranks = 1;
  double exchange_s = 0, exchanged_bytes = 0;  ///< of this rank, waiting for others included
  std::string payload_sha256;                  ///< of the last checkpoint
  std::string policy_sha256;                   ///< of best.json
};
inline constexpr double kSuccessLevels[4] = {0.5, 0.8, 0.9, 0.95};

/// Memory of replay and flappers, and the most that a run leaves on disk.
struct TrainCosts {
  std::size_t memory_bytes = 0, disk_bytes = 0;
};

/// io::InputError where a folder holds a run already.
void refuse_run_in(const std::filesystem::path& folder);
/// The same, but for a run of this configuration that began as this one.
void refuse_other_run_in(const std::filesystem::path& folder, const TrainConfig& config, const TrainInit* init);
/// The newest checkpoint of a run that did not reach its end; nothing where there is none.
std::optional<std::filesystem::path> unfinished_run_in(const std::filesystem::path& folder);
/// io::InputError where the run folder is taken, a checkpoint does not fit, the disk is full, or learning diverged.
TrainSummary train(const TrainConfig& config, const TrainOptions& options);
TrainCosts costs_of(const TrainConfig& config);
/// This machine's, as /proc/cpuinfo names it.
std::string processor();
/// What summary.json holds.
nlohmann::ordered_json json_of(const TrainSummary& summary);

}  // namespace flappy::learn
