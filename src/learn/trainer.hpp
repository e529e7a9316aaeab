// Training: collection and learning in parallel, evaluation at fixed updates, checkpoints. A run writes this folder:
//
//   RUN/config/          the resolved configuration; config/fly.toml flies the best policy
//   RUN/run.json         commit, processor, instruction set, seed, memory
//   RUN/metrics.*, timing.jsonl, events.out.tfevents.flappy   a record for each evaluation (metrics.hpp)
//   RUN/checkpoint_N.flappy
//   RUN/best.json, last.json   actors of the best and of the last evaluation
//   RUN/summary.json
//   RUN/log.txt          messages of flappy-train
//
// Each rank flies its share of flappers and validation vehicles and does its share of every batch; the first one writes
// the folder. In every step, the actor of the step before flies while the learner samples earlier steps' transitions:
// the lag is always one step, so results do not depend on speed. All files but timing.jsonl, summary.json, run.json,
// events, log.txt and the heads of checkpoints are the same for any number of threads and resumptions.
#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "learn/metrics.hpp"
#include "learn/train_config.hpp"

namespace flappy::learn {

/// Progress of a run, for display.
struct TrainProgress {
  std::uint64_t update = 0, updates = 0, episodes = 0, env_steps = 0;
  double mean_return = 0;  ///< mean over the episodes between the last two evaluations
  double success = -1;     ///< success rate in the last evaluation; -1: none yet
  double updates_per_s = 0, env_steps_per_s = 0;
  bool evaluated = false;  ///< the last step was followed by an evaluation
};

/// Initial networks of a run, instead of random weights.
struct TrainInit {
  policy::Actor actor;
  /// Checkpoint for the critics and Adam's moments of all weights; empty: critics and moments start fresh.
  std::optional<std::filesystem::path> checkpoint;
  std::string sha256;  ///< SHA-256 over all of it
  NetworkKeys networks = {};
};

/// Reads from a file the actor, from a run its best actor with critics and moments of its newest checkpoint. Throws
/// io::InputError if one cannot be read, and for files of other kinds, as a checkpoint or an exported policy.
std::shared_ptr<const TrainInit> read_train_init(const std::filesystem::path& path);

struct TrainOptions {
  std::filesystem::path folder;
  /// Checkpoint from which the run resumes; empty: a new run.
  std::optional<std::filesystem::path> from;
  std::shared_ptr<const TrainInit> init;
  io::Ranks* ranks = nullptr;  ///< ranks that train together; the first one writes the folder
  std::string commit;          ///< commit of the program
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();  ///< start of the process
  std::function<bool(const TrainProgress&)> keep_going;  ///< called after each step; false: save a checkpoint and stop
  bool goes_on = false;  ///< with a student only: go on with the run that the folder holds
};

struct TrainSummary {
  std::uint64_t seed = 0, updates = 0, env_steps = 0, episodes = 0;
  bool stopped = false;  ///< stopped before its last update
  double wall_s = 0;     ///< wall-clock time of the run in all its processes, without evaluations
  double evaluation_s = 0;
  double share_simulation = 0, share_learning = 0;  ///< shares of all threads' time; waiting counts as learning
  std::optional<double> best_success;               ///< empty: never evaluated
  std::uint64_t best_update = 0;
  /// Times at which success rates of kSuccessLevels were reached: wall_s of the first of two consecutive evaluations
  /// with at least that rate. Empty: not reached.
  std::optional<double> time_to_s[4];
  int ranks = 1;
  double exchange_s = 0, exchanged_bytes = 0;  ///< exchange of this rank with others, waiting included
  std::string payload_sha256;                  ///< Checkpoint::payload_sha256() of the last checkpoint
  std::string policy_sha256;                   ///< SHA-256 of best.json
};
inline constexpr double kSuccessLevels[4] = {0.5, 0.8, 0.9, 0.95};

/// Columns of a run's records.
const MetricsColumns& train_columns();
/// Writes summary.json, with the hash of best.json.
void write_summary(const std::filesystem::path& folder, TrainSummary& summary);
/// Write config/, and run.json. `engine`: LearnerEngine::describe().
void write_config(const TrainConfig& config, const std::filesystem::path& folder);
void write_start(const TrainConfig& config, const TrainOptions& options, const std::string& engine);

/// Memory of a run, and upper bound of its files on disk.
struct TrainCosts {
  std::size_t memory_bytes = 0, disk_bytes = 0;
};

/// Folder of the run of one seed in a folder of runs (flappy-train --seeds).
std::filesystem::path seed_folder(const std::filesystem::path& folder, std::uint64_t seed);
/// Throws io::InputError if the folder holds a run already, or runs of seeds.
void refuse_run_in(const std::filesystem::path& folder);
/// Throws io::InputError if a folder for runs of seeds holds a run of its own.
void refuse_run_beside_seeds(const std::filesystem::path& folder);
/// Throws io::InputError, with the key that differs, for an `init` of other networks, of another task or other scales.
void refuse_other_networks(const TrainConfig& config, const TrainInit& init);
/// Throws io::InputError if the folder holds a run of another configuration or with other initial networks.
void refuse_other_run_in(const std::filesystem::path& folder, const TrainConfig& config, const TrainInit* init);
/// The summary of a finished run; null if there is none.
nlohmann::ordered_json finished_run_in(const std::filesystem::path& folder);
/// The newest checkpoint of a run that is not finished; empty if there is none.
std::optional<std::filesystem::path> unfinished_run_in(const std::filesystem::path& folder);
/// Throws io::InputError for another run in the folder, an unfit checkpoint, a full disk, or diverged learning. Of a
/// configuration with a student, train_student() (student.hpp).
TrainSummary train(const TrainConfig& config, const TrainOptions& options);
TrainCosts costs_of(const TrainConfig& config);
/// Processor type of this machine, as in /proc/cpuinfo.
std::string processor();
/// The content of summary.json.
nlohmann::ordered_json json_of(const TrainSummary& summary);

}  // namespace flappy::learn
