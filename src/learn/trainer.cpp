#include "learn/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "io/parallel.hpp"
#include "io/sha256.hpp"
#include "learn/collector.hpp"
#include "learn/student.hpp"
#include "rollout/evaluation.hpp"

namespace flappy::learn {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr char kSeedFolder[] = "seed_";

const MetricsColumns kColumns = {
    {"update", "env_steps", "episodes", "return_mean", "captured_share", "handed_back_share", "terminated_share",
     "critic_loss", "mean_q", "actor_q", "replay", "success_rate", "capture_rate", "time_to_capture_median_s"},
    {"wall_s", "evaluation_s", "updates_per_s", "env_steps_per_s", "share_simulation", "share_learning"}};

class Trainer {
 public:
  Trainer(const TrainConfig& config, const TrainOptions& options)
      : config_(config),
        options_(options),
        names_(config.blank_actor()),
        ranks_(options.ranks),
        engine_(make_engine(config.engine, with_ranks(config.learner, options.ranks))),
        learner_(*engine_),
        replay_(config.learner.shape, config.replay),
        evaluator_(rollout::unwatched(config.fly),
                   {config.evaluate_vehicles, rollout::kValidationFlappers, 1024, options.ranks}),
        collector_(config, options.ranks) {
    if (options.init && !options.from) start_from(*options.init);
    actor_ = std::make_shared<policy::Actor>(named(learner_.actor()));
    average_ = actor_->weights;
  }

  TrainSummary run() {
    const fs::path& folder = options_.folder;
    if (options_.from) resume(Checkpoint(*options_.from));
    else if (writes()) write_config(config_, folder);
    if (writes()) {
      Metrics::check(folder, kColumns, records_);  // what is refused removes nothing
      if (options_.from) forget_after(updates());  // before records are cut that later checkpoints need
      metrics_.emplace(folder, kColumns, records_);
      fs::remove(folder / "summary.json");  // that of a stop: the run goes on
    }
    if (options_.init && !options_.from) {  // evaluate the initial policy, so that no worse one becomes the best
      const auto from = Clock::now();
      judge();
      evaluation_s_ += seconds_since(from);
    }
    publish();
    if (!options_.from) save();  // from now on the run can be resumed if it is killed
    if (writes() && !fs::exists(folder / "run.json")) write_start(config_, options_, learner_.describe());
    start_ = last_ = mark();
    bool going = true;
    while (going && updates() < config_.updates) {
      const bool ends = !step();
      const bool evaluates = passed(config_.evaluate_every);
      if (evaluates) evaluate();
      if (passed(config_.checkpoint_every) && updates() < config_.updates) save();
      going = !options_.keep_going || options_.keep_going(progress(evaluates));
      wants_end_ = !going;
      if (ranks_ != nullptr) going = !ends;  // all ranks stop at the same step
    }
    if (saved_step_ != steps_) save();
    return summarise();
  }

 private:
  /// Start of a period over which rates are measured; seconds: time that this process has spent in steps.
  struct Mark {
    double seconds;
    std::uint64_t updates, env_steps;
  };
  Mark mark() const { return {learning_s_ + warming_s_, updates(), collector_.env_steps()}; }
  std::pair<double, double> rates_since(const Mark& from) const {
    const Mark now = mark();
    const double s = std::max(now.seconds - from.seconds, 1e-9);
    return {static_cast<double>(now.updates - from.updates) / s,
            static_cast<double>(now.env_steps - from.env_steps) / s};
  }

  std::uint64_t updates() const { return learner_.counters().updates; }
  /// Whether the last step did updates and reached a multiple of `every`, or the end.
  bool passed(std::uint64_t every) const {
    return updates() > 0 && (updates() % every == 0 || updates() == config_.updates) && learnt_;
  }

  policy::Actor named(policy::Actor actor) const {
    actor.task = names_.task, actor.observation = names_.observation, actor.action = names_.action;
    return actor;
  }

  void start_from(const TrainInit& init) {
    try {
      if (init.checkpoint) {
        const Checkpoint from(*init.checkpoint);
        load_learner(from);
        learner_.counters().updates = 0;
      }
      learner_.set_actor(init.actor);
    } catch (const std::invalid_argument& e) {
      throw io::InputError("--init: " + std::string(e.what()) + "; accepted: a policy of the same networks");
    }
  }

  /// Loads the learner's numbers. Throws std::invalid_argument if the learner has other numbers.
  void load_learner(const Checkpoint& from) {
    std::vector<float> numbers = learner_.save();
    from.get("numbers", numbers);
    learner_.load(numbers);
    from.get_bytes("counters", std::as_writable_bytes(std::span(&learner_.counters(), 1)));
  }

  static LearnerOptions with_ranks(LearnerOptions options, io::Ranks* ranks) {
    options.ranks = ranks;
    return options;
  }
  bool writes() const { return io::writes(ranks_); }
  /// One action of every flapper and, in parallel, the step's updates. False: a rank wants this to be the last step.
  bool step() {
    const auto from = Clock::now();
    io::together(config_.threads, [&] { fly_and_learn(); });
    const bool ends = collector_.end(replay_, wants_end_);
    ++steps_;
    (learnt_ ? learning_s_ : warming_s_) += seconds_since(from);
    return !ends;
  }

  void fly_and_learn() {
    collector_.begin(actor_);
    const std::size_t items = collector_.items();
    learnt_ = replay_.size() >= config_.learner.batch && steps_ >= config_.steps_before;
    if (learnt_) {
      const std::uint64_t n = config_.updates_per_step;
      for (std::uint64_t u = 0; u < n; ++u) {
        const std::size_t first = items * u / n, last = items * (u + 1) / n;
        const double rate = config_.rate_share(updates());
        const bool actor_learns = updates() >= config_.actor_after;
        learner_.update(replay_, actor_learns ? rate * config_.actor_rate : 0, rate * config_.critic_rate,
                        {last - first, [&](std::size_t i) { collector_.run(first + i); }});
      }
      if (!std::isfinite(learner_.metrics().critic_loss))
        throw io::InputError("the critics diverged at update " + std::to_string(updates()) +
                             "; accepted: lower learn.critic_rate, reward.scale or reward.discount");
      losses_ += learner_.metrics().critic_loss, values_ += learner_.metrics().mean_q;
      ++samples_;
      if (updates() % static_cast<std::uint64_t>(config_.learner.policy_delay) == 0)
        actor_values_ += learner_.metrics().actor_q, ++actor_samples_;
      actor_ = std::make_shared<policy::Actor>(named(learner_.actor()));
      for (std::size_t k = 0; k < average_.size(); ++k)
        average_[k] += config_.policy_averaging * (actor_->weights[k] - average_[k]);
    } else {
      io::parallel_for(items, config_.threads, [&](std::size_t i) { collector_.run(i); });
    }
  }

  RunTimes times() const {
    RunTimes t = before_;
    const double threads = config_.threads, own_s = seconds_since(options_.started) - evaluation_s_;
    const double simulation_s = collector_.seconds();
    t.wall_s += own_s;
    t.threads_s += threads * own_s;
    t.simulation_s += simulation_s;
    t.learning_s += std::max(0.0, threads * (learning_s_ + warming_s_) - simulation_s);
    t.evaluation_s += evaluation_s_;
    if (ranks_ != nullptr) t.exchange_s += ranks_->costs().seconds, t.exchanged_bytes += ranks_->costs().bytes;
    return t;
  }

  /// Evaluates the present policy, and keeps it if it is the best so far.
  rollout::Summary judge() {
    policy_ = averaged();
    const rollout::Evaluation e =
        evaluator_.fly({std::make_shared<policy::Actor>(policy_), nullptr}, rollout::Detail::success);
    const rollout::Summary flown = rollout::summarise(e.flights);
    success_ = flown.success.value;
    if (success_ > best_success_) {
      best_success_ = success_;
      best_update_ = updates();
      best_ = policy_;
    }
    return flown;
  }

  void evaluate() {
    const auto from = Clock::now();
    const RunTimes t = times();
    const rollout::Summary flown = judge();
    publish();

    collector_.share();
    const EpisodeSums sums = collector_.take_sums();
    const double samples = static_cast<double>(samples_);
    const auto share = [&](double count) { return count / sums.episodes; };
    const double figures[] = {static_cast<double>(updates()),
                              static_cast<double>(collector_.env_steps()),
                              static_cast<double>(collector_.episodes()),
                              share(sums.returns),
                              share(sums.captured),
                              share(sums.handed_back),
                              share(sums.terminated),
                              losses_ / samples,
                              values_ / samples,
                              actor_values_ / static_cast<double>(actor_samples_),
                              static_cast<double>(replay_.size()),
                              success_,
                              flown.captured.value,
                              flown.capture_s.median.value_or(std::numeric_limits<double>::quiet_NaN())};
    return_mean_ = share(sums.returns);
    losses_ = values_ = actor_values_ = 0, samples_ = actor_samples_ = 0;
    evaluation_s_ += seconds_since(from);
    const auto [updates_per_s, env_steps_per_s] = rates_since(last_);
    const double timing[] = {t.wall_s,        before_.evaluation_s + evaluation_s_, updates_per_s,
                             env_steps_per_s, t.simulation_s / t.threads_s,         t.learning_s / t.threads_s};
    if (metrics_) metrics_->record(figures, timing);
    last_ = mark();
  }

  /// The policy: the actor's moving average over steps, rounded to float, the precision in which it flies.
  policy::Actor averaged() const {
    policy::Actor policy = *actor_;
    std::ranges::transform(average_, policy.weights.begin(), [](double w) { return static_cast<float>(w); });
    return policy;
  }

  /// Writes best.json and last.json.
  void publish() {
    if (policy_.widths.empty()) policy_ = averaged();
    if (best_.widths.empty()) best_ = policy_;
    if (!writes()) return;
    policy::write_actor(options_.folder / "best.json", best_);
    policy::write_actor(options_.folder / "last.json", policy_);
  }

  void save() {
    collector_.share();
    saved_step_ = steps_;
    if (!writes()) return;
    records_ = metrics_->sync();
    CheckpointWriter to(
        options_.folder / checkpoint_name(updates()),
        {updates(), config_.sha256, processor(), sim::best_instruction_set(), options_.commit, times()});
    to.put("numbers", learner_.save());
    to.put_bytes("counters", std::as_bytes(std::span(&learner_.counters(), 1)));
    to.put("replay_size", static_cast<std::uint64_t>(replay_.size()));
    to.put("replay_cursor", static_cast<std::uint64_t>(replay_.cursor()));
    to.put("replay", replay_.rows());
    collector_.save(to);
    to.put("steps", steps_);
    to.put("records", records_);
    to.put("sums", std::array<double, 5>{losses_, values_, actor_values_, success_, best_success_});
    to.put("samples", std::array<std::uint64_t, 2>{samples_, actor_samples_});
    to.put("best_update", best_update_);
    to.put("average", average_);
    to.put("best_weights", best_.weights);
    to.put("policy_weights", policy_.weights);
    payload_sha256_ = to.commit();
    keep_newest(options_.folder, config_.keep);
  }

  void resume(const Checkpoint& from) {
    if (from.header().config_sha256 != config_.sha256)
      throw io::InputError(from.path().string() + ": is of another configuration than " +
                           (options_.folder / "config").string() + "; accepted: a checkpoint of this run");
    before_ = from.header().times;
    try {
      load_learner(from);
    } catch (const std::invalid_argument& e) {
      throw io::InputError(from.path().string() + ": " + e.what() +
                           "; accepted: a checkpoint of this run, as it was written");
    }
    std::uint64_t size = 0, cursor = 0;
    from.get("replay_size", size);
    from.get("replay_cursor", cursor);
    std::vector<float> rows(size * replay_.layout().row);
    from.get("replay", rows);
    replay_.restore(rows, cursor);
    collector_.restore(from);
    from.get("steps", steps_);
    from.get("records", records_);
    std::array<double, 5> sums{};
    from.get("sums", sums);
    losses_ = sums[0], values_ = sums[1], actor_values_ = sums[2], success_ = sums[3], best_success_ = sums[4];
    std::array<std::uint64_t, 2> samples{};
    from.get("samples", samples);
    samples_ = samples[0], actor_samples_ = samples[1];
    from.get("best_update", best_update_);
    actor_ = std::make_shared<policy::Actor>(named(learner_.actor()));
    policy_ = best_ = averaged();
    from.get("average", average_);
    from.get("best_weights", best_.weights);
    from.get("policy_weights", policy_.weights);
    saved_step_ = steps_;
    payload_sha256_ = from.payload_sha256();
  }

  /// Removes checkpoints after `update`, which is redone: newest first, so that a killed run can be resumed.
  void forget_after(std::uint64_t update) const {
    for (const fs::path& path : checkpoints_in(options_.folder)) {
      if (path.filename() <= checkpoint_name(update)) break;
      fs::remove(path);
    }
  }

  TrainProgress progress(bool evaluated) const {
    const auto [updates_per_s, env_steps_per_s] = rates_since(start_);
    return {updates(),    config_.updates, collector_.episodes(), collector_.env_steps(),
            return_mean_, success_,        updates_per_s,         env_steps_per_s,
            evaluated};
  }

  TrainSummary summarise() const {
    TrainSummary s;
    s.seed = config_.seed;
    s.updates = updates(), s.env_steps = collector_.env_steps(), s.episodes = collector_.episodes();
    s.stopped = updates() < config_.updates;
    const RunTimes t = times();
    s.wall_s = t.wall_s, s.evaluation_s = t.evaluation_s;
    s.share_simulation = t.simulation_s / t.threads_s, s.share_learning = t.learning_s / t.threads_s;
    if (best_success_ >= 0) s.best_success = best_success_;
    s.best_update = best_update_;
    if (ranks_ != nullptr) s.ranks = ranks_->size();
    s.exchange_s = t.exchange_s, s.exchanged_bytes = t.exchanged_bytes;
    s.payload_sha256 = payload_sha256_;
    if (records_ == 0) return s;
    const std::vector<double> success = read_metrics(options_.folder / "metrics.jsonl").column("success_rate");
    const std::vector<double> wall = read_metrics(options_.folder / "timing.jsonl").column("wall_s");
    for (std::size_t level = 0; level < std::size(kSuccessLevels); ++level)
      for (std::size_t i = 0; i + 1 < success.size() && !s.time_to_s[level]; ++i)
        if (success[i] >= kSuccessLevels[level] && success[i + 1] >= kSuccessLevels[level])
          s.time_to_s[level] = wall[i];
    return s;
  }

  const TrainConfig& config_;
  const TrainOptions& options_;
  const policy::Actor names_;  // holds only the names of task, inputs and outputs
  io::Ranks* const ranks_;
  std::unique_ptr<LearnerEngine> engine_;
  LearnerEngine& learner_;
  Replay replay_;
  rollout::Evaluator evaluator_;
  Collector collector_;
  bool wants_end_ = false;
  std::optional<Metrics> metrics_;

  bool learnt_ = false;  // whether the last step did updates
  std::uint64_t steps_ = 0, records_ = 0, saved_step_ = ~std::uint64_t{0};
  double losses_ = 0, values_ = 0, actor_values_ = 0, return_mean_ = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t samples_ = 0, actor_samples_ = 0;
  double success_ = -1, best_success_ = -1;
  std::uint64_t best_update_ = 0;
  std::shared_ptr<const policy::Actor> actor_;  // actor that flies in collection
  std::vector<double> average_;                 // moving average of its weights over steps
  policy::Actor policy_, best_;                 // policies of the last and of the best evaluation
  std::string payload_sha256_;

  Mark start_{}, last_{};  // at the start of this process, and at the last evaluation
  RunTimes before_;        // of the processes before this one
  double evaluation_s_ = 0, learning_s_ = 0, warming_s_ = 0;
};

}  // namespace

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(':') + 2, line.size()));
  return "unknown";
}

nlohmann::ordered_json json_of(const TrainSummary& s) {
  const auto or_null = [](const std::optional<double>& x) {
    return x ? nlohmann::ordered_json(*x) : nlohmann::ordered_json(nullptr);
  };
  return {{"seed", s.seed},
          {"wall_s", s.wall_s},
          {"env_steps", s.env_steps},
          {"updates", s.updates},
          {"episodes", s.episodes},
          {"time_to_50_s", or_null(s.time_to_s[0])},
          {"time_to_80_s", or_null(s.time_to_s[1])},
          {"time_to_90_s", or_null(s.time_to_s[2])},
          {"time_to_95_s", or_null(s.time_to_s[3])},
          {"share_simulation", s.share_simulation},
          {"share_learning", s.share_learning},
          {"evaluation_s", s.evaluation_s},
          {"best_success_rate", or_null(s.best_success)},
          {"best_update", s.best_update},
          {"stopped", s.stopped},
          {"ranks", s.ranks},
          {"exchange_s", s.exchange_s},
          {"exchanged_bytes", s.exchanged_bytes},
          {"payload_sha256", s.payload_sha256},
          {"policy_sha256", s.policy_sha256}};
}

fs::path seed_folder(const fs::path& folder, std::uint64_t seed) {
  return folder / (kSeedFolder + std::to_string(seed));
}

void refuse_run_in(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return;
  const auto left = checkpoints_in(folder);
  if (fs::exists(folder / "run.json", error) || (!left.empty() && left.front().filename() != checkpoint_name(0)))
    throw io::InputError(folder.string() + ": holds a run; accepted: a new folder, or --resume " + folder.string());
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with(kSeedFolder) && fs::exists(entry.path() / "run.json", error))
      throw io::InputError(folder.string() + ": holds runs of several seeds; accepted: a new folder, or --seeds");
}

void refuse_run_beside_seeds(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "run.json", error))
    throw io::InputError(folder.string() +
                         ": holds a run of its own; accepted with --seeds: a new folder, or one of --seeds");
}

static void refuse_recurrent(const fs::path& path, const policy::Actor& actor) {
  if (actor.recurrent)
    throw io::InputError(path.string() + ": is a policy with a memory, from which TD3 does not learn on; accepted: " +
                         "ancestor/ of its run, or a policy without memory");
}

std::shared_ptr<const TrainInit> read_train_init(const fs::path& path) {
  if (!fs::is_directory(path)) {
    const std::string text = io::read_text(path), ending = path.extension().string();
    if (text.substr(0, text.find_first_not_of(" \t\r\n") + 1).find('{') == std::string::npos)
      throw io::InputError(path.string() + ": is " +
                           (ending == ".flappy" ? "a checkpoint"
                            : ending == ".onnx" ? "an ONNX model"
                            : ending == ".pt"   ? "a TorchScript file"
                                                : "no actor") +
                           "; accepted: a run folder (its best actor and its critics), or an actor, as best.json of a "
                           "run");
    policy::Actor actor = policy::read_actor(path);
    refuse_recurrent(path, actor);
    const NetworkKeys keys = network_keys(actor);
    return std::make_shared<TrainInit>(TrainInit{std::move(actor), std::nullopt, io::sha256(text), keys});
  }
  const fs::path best = path / "best.json", config = path / "config" / "train.toml";
  if (fs::exists(best)) refuse_recurrent(path, policy::read_actor(best));
  const Checkpoint newest = newest_checkpoint(path);
  policy::Actor actor = policy::read_actor(best);
  const NetworkKeys keys = fs::exists(config) ? network_keys(io::Config::load(config).root()) : network_keys(actor);
  return std::make_shared<TrainInit>(
      TrainInit{std::move(actor), newest.path(), io::sha256(io::read_text(best) + newest.payload_sha256()), keys});
}

void refuse_other_networks(const TrainConfig& config, const TrainInit& init) {
  const NetworkKeys own = network_keys(io::Config::parse(config.resolved.at("train.toml"), "train.toml").root());
  for (const auto& [key, there] : init.networks)
    if (const auto here = std::ranges::find(own, key, &NetworkKeys::value_type::first);
        here != own.end() && here->second != there)
      throw io::InputError("--init: " + key + " is " + there + " there, " + here->second +
                           " in this configuration; accepted: the same networks, as by --set '" + key + "=" + there +
                           "'");
  const policy::Actor names = config.blank_actor();
  if (init.actor.observation != names.observation || init.actor.action != names.action)
    throw io::InputError("--init: the policy observes or does something else than task " + names.task +
                         "; accepted: a policy of this task");
  const Normaliser& input = config.learner.input;
  if (init.actor.mean != input.mean || init.actor.scale != input.scale || init.actor.clip != input.clip)
    throw io::InputError(
        "--init: the policy scales its observations in another way; accepted: the same [observation] as its run");
}

void refuse_other_run_in(const fs::path& folder, const TrainConfig& config, const TrainInit* init) {
  if (!fs::exists(folder / "run.json")) return refuse_run_in(folder);
  const auto run = nlohmann::json::parse(io::read_text(folder / "run.json"), nullptr, false);
  if (!run.is_object() || run.value("config_sha256", "") != config.sha256 ||
      run.value("init_sha256", "") != (init != nullptr ? init->sha256 : ""))
    throw io::InputError(folder.string() +
                         ": holds a run of another configuration; accepted: a new folder, or the same options");
}

nlohmann::ordered_json finished_run_in(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "run.json", error) || !fs::exists(folder / "summary.json", error)) return nullptr;
  auto summary = nlohmann::ordered_json::parse(io::read_text(folder / "summary.json"), nullptr, false);
  const bool finished = summary.is_object() && !summary.value("stopped", true);
  return finished ? summary : nlohmann::ordered_json(nullptr);
}

std::optional<fs::path> unfinished_run_in(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "run.json", error) || !finished_run_in(folder).is_null()) return std::nullopt;
  return newest_checkpoint(folder).path();
}

void write_summary(const fs::path& folder, TrainSummary& summary) {
  summary.policy_sha256 = io::sha256(io::read_text(folder / "best.json"));
  io::write_atomically(folder / "summary.json", json_of(summary).dump(2) + "\n");
}

const MetricsColumns& train_columns() { return kColumns; }

void write_config(const TrainConfig& config, const fs::path& folder) {
  fs::create_directories(folder / "config");
  for (const auto& [name, text] : config.resolved) io::write_atomically(folder / "config" / name, text);
}

void write_start(const TrainConfig& config, const TrainOptions& options, const std::string& engine) {
  const TrainCosts costs = costs_of(config);
  const nlohmann::ordered_json run = {{"schema", 1},
                                      {"task", config.fly.fleet.task.name},
                                      {"seed", config.seed},
                                      {"commit", options.commit},
                                      {"processor", processor()},
                                      {"instruction_set", sim::best_instruction_set()},
                                      {"engine", engine},
                                      {"config_sha256", config.sha256},
                                      {"init", options.init != nullptr},
                                      {"init_sha256", options.init ? options.init->sha256 : ""},
                                      {"memory_bytes", costs.memory_bytes},
                                      {"disk_bytes", costs.disk_bytes}};
  io::write_atomically(options.folder / "run.json", run.dump(2) + "\n");
}

TrainSummary train(const TrainConfig& config, const TrainOptions& options) {
  if (config.student) return train_student(config, options);
  if (options.init && !options.from) refuse_other_networks(config, *options.init);
  io::make_folder(options.folder);
  const bool writes = io::writes(options.ranks);
  std::optional<io::FolderLock> lock;
  if (writes) lock.emplace(options.folder);
  if (writes && !options.from) refuse_run_in(options.folder);
  Trainer trainer(config, options);
  TrainSummary summary = trainer.run();
  if (writes) write_summary(options.folder, summary);
  return summary;
}

TrainCosts costs_of(const TrainConfig& config) {
  const TransitionLayout layout(config.learner.shape);
  const std::size_t replay = config.replay * layout.row * sizeof(float);
  constexpr std::size_t kFlapper = 2500, kRest = 10'000'000;  // bytes, rounded up: for a flapper; for records
  const LearnerOptions& l = config.learner;
  const auto weights = [&](int inputs, std::vector<int> widths, int outputs) {
    widths.insert(widths.begin(), inputs);
    widths.push_back(outputs);
    return policy::weight_count(widths, l.layer_norm);
  };
  const auto inputs = static_cast<std::size_t>(l.shape.observation);
  const std::size_t numbers = (weights(l.shape.observation, l.actor_hidden, l.shape.action) +
                               2 * weights(l.shape.observation + l.shape.action, l.critic_hidden, 1)) *
                              sizeof(float);
  const std::size_t history = inputs * sizeof(float), pending = (config.return_steps + 1) * history;
  std::size_t effects = 0;  // parameters and memory of those that may be drawn
  if (config.fly.drawn_effects)
    for (const auto& [effect, weight] : config.fly.drawn_effects->of)
      effects += (effect->parameters.size() + static_cast<std::size_t>(effect->states)) * sizeof(float);
  const std::size_t flapper = kFlapper + effects;
  const std::size_t own = config.flappers * (flapper + history + pending);
  const std::size_t others = (1024 + config.vehicles + config.evaluate_vehicles) * (flapper + history);
  constexpr std::size_t kParts = 16 + 4 + 4;  // gradients at most; weights, targets, moments; text of the actor
  return {replay + own + others + kParts * numbers + kRest, (config.keep + 1) * (replay + own + 8 * numbers + kRest)};
}

}  // namespace flappy::learn
