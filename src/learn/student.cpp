#include "learn/student.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "io/parallel.hpp"
#include "io/temporary_folder.hpp"
#include "learn/checkpoint.hpp"
#include "learn/torch/torch_learner.hpp"
#include "policy/policy_network.hpp"
#include "rollout/evaluation.hpp"
#include "rollout/rollout.hpp"
#include "sim/random.hpp"
#include "sim/storage.hpp"

namespace flappy::learn {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Lane = model::Lanes<float, 1>;

constexpr std::size_t kTeacherEvaluations = 1000;  // flights by which it keeps the better of before and after
constexpr double kWellFlown = 0.98;       // success of the ancestor with an effect, from which it teaches itself
constexpr double kFewest = 0.02;          // share of a round's flights; with fewer still going on, the round ends
constexpr std::size_t kEvaluations = 20;  // so often a run evaluates its student

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

MetricsColumns columns() {
  MetricsColumns all = train_columns();
  all.metrics.emplace_back("imitation_loss");
  return all;
}

/// Robots with one effect, `k` of those that may be drawn.
TrainConfig of_teacher(const TrainConfig& config, std::size_t k) {
  TrainConfig c = config;
  c.student.reset();
  c.fly.drawn_effects->none = 0;
  c.fly.drawn_effects->most = 1;
  c.fly.drawn_effects->of = {config.fly.drawn_effects->of[k]};
  c.updates = config.student->teacher_updates;
  c.evaluate_every = c.checkpoint_every = c.updates;
  c.evaluate_vehicles = std::min(config.evaluate_vehicles, kTeacherEvaluations);
  c.seed = c.learner.seed = sim::mixed(config.seed, 1 + k) % INT32_MAX;
  return c;
}

double success_of(const TrainConfig& config, const std::shared_ptr<const policy::Actor>& actor) {
  rollout::Evaluator evaluator(rollout::unwatched(config.fly),
                               {config.evaluate_vehicles, rollout::kValidationFlappers, 1024, nullptr});
  return rollout::summarise(evaluator.fly({actor, nullptr}, rollout::Detail::success).flights).success.value;
}

/// An actor in single precision, for one observation at a time.
class Mind {
 public:
  explicit Mind(const policy::Actor& a)
      : numbers_(a.weights.begin(), a.weights.end()),
        mean_(a.mean.begin(), a.mean.end()),
        scale_(a.scale.begin(), a.scale.end()),
        view_(policy::view_of(a, numbers_.data(), mean_.data(), scale_.data())) {}
  Mind(Mind&&) = default;

  std::size_t units() const { return static_cast<std::size_t>(view_.memory()); }
  /// `memory`: of units(), changed.
  void act(const float* observation, float* memory, float* action) const {
    Lane in[flight::kMaxHistory * flight::kMaxObservation], kept[policy::kMaxMemory], out[policy::kMaxActions];
    for (int i = 0; i < view_.widths[0]; ++i) in[i] = Lane::load(observation + i);
    for (std::size_t k = 0; k < units(); ++k) kept[k] = Lane::load(memory + k);
    policy::evaluate(view_, in, out, kept);
    for (std::size_t k = 0; k < units(); ++k) kept[k].store(memory + k);
    for (int k = 0; k < view_.widths[view_.layers]; ++k) out[k].store(action + k);
  }

 private:
  std::vector<float> numbers_, mean_, scale_;
  policy::ActorView<float> view_;
};

struct Teacher {
  Mind mind;
  double gain;  ///< in success, over the ancestor
};

/// Flies many robots at once, each by the student or led by its teacher, and notes what its teacher would have done.
class School {
 public:
  /// `teachers`: for each effect that may be drawn.
  School(const TrainConfig& config, Mind ancestor, std::vector<Teacher> teachers)
      : config_(config),
        fly_(config.fly),
        ancestor_(std::move(ancestor)),
        teachers_(std::move(teachers)),
        fleet_(make_fleet()) {
    const flight::Task& task = fly_.fleet.task;
    inputs_ = task.observation().size(), outputs_ = static_cast<std::size_t>(task.actions());
    const auto periods = static_cast<std::size_t>(std::ceil(fly_.duration_s * fly_.fleet.control_hz - 1e-6));
    actions_ = (periods + task.action_repeat - 1) / task.action_repeat;
  }

  std::size_t flights() const { return config_.student->flights; }

  /// Flies a round; `led`: share of the flights in which the teacher acts.
  Lessons fly(std::size_t round, const Mind& student, double led) {
    const std::size_t n = flights();
    Lessons all{0, n, {}, {}, {}};
    const auto resize = [&](std::size_t actions) {
      all.actions = actions;
      all.observation.resize(actions * n * inputs_);
      all.wanted.resize(actions * n * outputs_);
      all.counts.resize(actions * n);
    };
    if (round % config_.student->redraw == 0) draw(static_cast<std::uint32_t>(round / config_.student->redraw));
    start(static_cast<std::uint32_t>(round));
    std::vector<float> memory(n * student.units(), 0), done(n * outputs_);
    for (std::size_t t = 0; t < actions_; ++t) {
      resize(t + 1);
      io::parallel_for(n, config_.threads, [&](std::size_t i) {
        float* const seen = &all.observation[(t * n + i) * inputs_];
        float* const wanted = &all.wanted[(t * n + i) * outputs_];
        float* const action = &done[i * outputs_];
        const bool counts = fleet_.ended(i) == 0 && !fleet_.handed_back(i);
        if (!counts) return;
        all.counts[t * n + i] = 1;
        fleet_.observation(i, seen);
        teaches_[i]->act(seen, nullptr, wanted);
        student.act(seen, memory.data() + i * student.units(), action);
        const sim::RandomKey key{config_.seed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(round),
                                 sim::Stream::exploration};
        if (sim::uniform_pair(key, 0).first < led) std::copy_n(wanted, outputs_, action);
      });
      const auto going = std::ranges::count(std::span(all.counts).subspan(t * n, n), 1.0F);
      if (static_cast<double>(going) < kFewest * static_cast<double>(n)) {
        resize(t);
        break;
      }
      for (std::size_t b = 0; b < fleet_.blocks(); ++b)
        fleet_.set_actions(b, &done[fleet_.flappers(b).first * outputs_]);
      for (std::uint32_t k = 0; k < fly_.fleet.task.action_repeat; ++k) fleet_.step();
    }
    for (std::vector<float>* list : {&all.observation, &all.wanted, &all.counts}) list->shrink_to_fit();
    return all;
  }

 private:
  flight::Fleet<float> make_fleet() {
    fly_.fleet.seed = config_.seed;
    fly_.fleet.first_flapper = kStudentFlappers;
    fly_.fleet.batch.threads = config_.threads;
    return {flights(), fly_.roomy_vehicle(), fly_.fleet};
  }

  /// New robots, settled if the task starts so, and who teaches them.
  void draw(std::uint32_t generation) {
    robots_.clear(), teaches_.clear();
    for (std::size_t i = 0; i < flights(); ++i) {
      robots_.push_back(fly_.vehicle_of(kStudentFlappers + static_cast<std::uint32_t>(i), generation));
      const Mind* best = &ancestor_;
      double gain = 0;
      for (std::size_t k = 0; k < teachers_.size(); ++k) {
        const std::string id = fly_.drawn_effects->of[k].effect->info.id;
        const bool has = robots_[i].effects.contains(id) && !fly_.vehicle.effects.contains(id);
        if (has && teachers_[k].gain > gain) best = &teachers_[k].mind, gain = teachers_[k].gain;
      }
      teaches_.push_back(best);
    }
    if (fly_.fleet.task.start.settled)
      hover_ = rollout::settle<float>(fleet_.options(), flights(), rollout::kHover_s,
                                      [&](std::uint32_t flapper) { return robots_[flapper - kStudentFlappers]; });
    else
      for (std::size_t i = 0; i < flights(); ++i) fleet_.set_vehicle(i, robots_[i]);
  }

  void start(std::uint32_t round) {
    const flight::Task& task = fleet_.options().task;
    for (std::size_t i = 0; i < flights(); ++i) {
      const std::uint32_t flapper = kStudentFlappers + static_cast<std::uint32_t>(i);
      if (hover_.empty()) fleet_.start(i, round, task.sample_start({config_.seed, flapper, round}), task.start.kind);
      else fleet_.start(i, round, hover_[i]);
    }
  }

  const TrainConfig& config_;
  rollout::FlyConfig fly_;
  const Mind ancestor_;
  const std::vector<Teacher> teachers_;
  flight::Fleet<float> fleet_;
  std::vector<model::Vehicle> robots_;
  std::vector<const Mind*> teaches_;  // [flight]
  std::vector<flight::Snapshot<float>> hover_;
  std::size_t inputs_ = 0, outputs_ = 0, actions_ = 0;
};

/// The student before it has learnt anything.
policy::Actor beginner(const TrainConfig& config) {
  policy::Actor a = config.blank_actor();
  const StudentOptions& s = *config.student;
  a.recurrent = s.memory > 0;
  a.widths = {config.learner.shape.observation};
  if (a.recurrent) a.widths.push_back(s.memory);
  a.widths.insert(a.widths.end(), s.hidden.begin(), s.hidden.end());
  a.widths.push_back(config.learner.shape.action);
  a.hidden = config.learner.actor_activation;
  a.mean = config.learner.input.mean, a.scale = config.learner.input.scale, a.clip = config.learner.input.clip;
  const auto blocks = policy::weight_blocks(a.widths, a.recurrent);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const auto [inputs, outputs] = blocks[b];
    const double scale = b + 1 == blocks.size() ? config.learner.last_layer_scale : 1;
    std::uint32_t number = 0;
    for (int o = 0; o < outputs; ++o) {
      a.weights.push_back(0);
      for (int k = 0; k < inputs; ++k)
        a.weights.push_back(first_weight(config.seed, 0, static_cast<int>(b), inputs, number++, scale));
    }
  }
  return a;
}

class StudentTrainer {
 public:
  StudentTrainer(const TrainConfig& config, const TrainOptions& options)
      : config_(config), options_(options), of_(*config.student), folder_(options.folder) {}

  TrainSummary run() {
    summary_.seed = config_.seed;
    const auto init = ancestor();
    if (init && teach(init)) learn(init->actor);
    summary_.stopped = !finished_;
    summary_.wall_s = seconds_since(options_.started) - summary_.evaluation_s;
    if (io::writes(options_.ranks) && finished_) write_summary(folder_, summary_);
    return summary_;
  }

 private:
  /// The run from which all teachers learn on: given, found or trained; null if its training was stopped.
  std::shared_ptr<const TrainInit> ancestor() {
    const fs::path folder = folder_ / "ancestor", best = folder / "best.json";
    const bool copied = fs::exists(best) && !fs::exists(folder / "run.json");
    bool stopped = false;
    if (io::writes(options_.ranks) && !copied) {
      if (options_.init) copy(*options_.init, folder);
      else if (finished_run_in(folder).is_null()) stopped = train_ancestor(folder);
    }
    if (io::any(options_.ranks, stopped)) return nullptr;
    return read_train_init(checkpoints_in(folder).empty() ? best : folder);
  }

  /// The actor last: with it, the copy is whole.
  static void copy(const TrainInit& init, const fs::path& folder) {
    io::make_folder(folder);
    if (init.checkpoint)
      fs::copy_file(*init.checkpoint, folder / init.checkpoint->filename(), fs::copy_options::overwrite_existing);
    policy::write_actor(folder / "best.json", init.actor);
  }

  /// Whether it was stopped.
  bool train_ancestor(const fs::path& folder) {
    TrainConfig config = config_;
    config.student.reset();
    TrainOptions options = options_;
    options.folder = folder;
    options.from = unfinished_run_in(folder);
    options.ranks = nullptr;
    if (!options.from) fs::remove_all(folder);  // stopped before its first checkpoint
    return train(config, options).stopped;
  }

  std::string name_of(std::size_t teacher) const { return config_.fly.drawn_effects->of[teacher].effect->info.id; }
  std::size_t teachers() const { return config_.fly.drawn_effects->of.size(); }
  fs::path file_of(std::size_t teacher) const { return folder_ / "teachers" / (name_of(teacher) + ".json"); }
  fs::path gain_of(std::size_t teacher) const { return folder_ / "teachers" / (name_of(teacher) + "_gain.json"); }

  /// Lets this rank's share of the teachers learn. False: stopped.
  bool teach(const std::shared_ptr<const TrainInit>& ancestor) {
    io::make_folder(folder_ / "teachers");
    const auto actor = std::make_shared<policy::Actor>(ancestor->actor);
    bool going = true;
    for (std::size_t k = 0; k < teachers() && going; ++k) {
      if (fs::exists(gain_of(k)) || !io::is_own(options_.ranks, k)) continue;
      const TrainConfig config = of_teacher(config_, k);
      const double before = success_of(config, actor);
      double after = before;
      if (before < kWellFlown) {
        const io::TemporaryFolder work;
        TrainOptions options;
        options.folder = work / "teacher";
        options.init = ancestor;
        options.commit = options_.commit;
        options.keep_going = [&](const TrainProgress& p) { return going = keep_going(k, p.update, 0, false); };
        const TrainSummary learnt = train(config, options);
        if (learnt.stopped) break;
        after = *learnt.best_success;
        fs::copy_file(options.folder / "best.json", file_of(k), fs::copy_options::overwrite_existing);
      } else {
        policy::write_actor(file_of(k), *actor);
        going = keep_going(k + 1, 0, 0, false);
      }
      io::write_atomically(gain_of(k), nlohmann::ordered_json{{"before", before}, {"after", after}}.dump() + "\n");
    }
    if (io::any(options_.ranks, !going)) return false;
    for (std::size_t k = 0; k < teachers(); ++k)
      if (!fs::exists(gain_of(k)))
        throw io::InputError(gain_of(k).string() + ": is not there; accepted: a folder that all ranks share");
    return true;
  }

  void learn(const policy::Actor& ancestor) {
    if (!io::writes(options_.ranks)) {
      finished_ = true;
      return;
    }
    std::vector<Teacher> all;
    for (std::size_t k = 0; k < teachers(); ++k) {
      const auto success = nlohmann::json::parse(io::read_text(gain_of(k)), nullptr, false);
      if (!success.is_object() || !success.value("before", nlohmann::json()).is_number() ||
          !success.value("after", nlohmann::json()).is_number())
        throw io::InputError(gain_of(k).string() + ": is damaged; accepted: the file as flappy-train left it");
      const double gain = success["after"].get<double>() - success["before"].get<double>();
      all.push_back({Mind(policy::read_actor(file_of(k))), gain});
    }
    School school(config_, Mind(ancestor), std::move(all));
    policy::Actor student = beginner(config_);
    const auto learner = torch_functions().make_student(student);
    rollout::Evaluator evaluator(rollout::unwatched(config_.fly),
                                 {config_.evaluate_vehicles, rollout::kValidationFlappers, 1024, nullptr});
    Metrics metrics(folder_, columns(), 0);
    std::vector<Lessons> kept;
    double loss = 0, best = -1;
    std::size_t losses = 0;
    const std::size_t every = (of_.rounds + kEvaluations - 1) / kEvaluations;
    for (std::size_t round = 0; round < of_.rounds; ++round) {
      const double led = round < of_.led ? 1 - static_cast<double>(round) / static_cast<double>(of_.led) : 0;
      Lessons flown = school.fly(round, Mind(student), led);
      for (const float x : flown.counts) summary_.env_steps += x > 0 ? config_.fly.fleet.task.action_repeat : 0;
      summary_.episodes += school.flights();
      if (kept.size() < of_.kept) kept.push_back(std::move(flown));
      else kept[round % of_.kept] = std::move(flown);
      for (std::size_t step = 0; step < of_.steps; ++step) {
        const double done = (static_cast<double>(round) + static_cast<double>(step) / static_cast<double>(of_.steps)) /
                            static_cast<double>(of_.rounds);
        loss += learner->learn(some_of(kept), of_.rate * (1 + (of_.last_rate - 1) * done));
        ++losses;
        ++summary_.updates;
      }
      student.weights = learner->weights();
      const bool evaluates = (round + 1) % every == 0 || round + 1 == of_.rounds;
      if (evaluates) {
        const auto from = Clock::now();
        const rollout::Summary s = rollout::summarise(
            evaluator.fly({std::make_shared<policy::Actor>(student), nullptr}, rollout::Detail::success).flights);
        summary_.evaluation_s += seconds_since(from);
        record(metrics, s, loss / static_cast<double>(losses));
        loss = 0, losses = 0;
        policy::write_actor(folder_ / "last.json", student);
        if (s.success.value > best) {
          best = s.success.value;
          policy::write_actor(folder_ / "best.json", student);
          summary_.best_success = best, summary_.best_update = summary_.updates;
        }
        success_ = s.success.value;
      }
      if (!keep_going(teachers(), 0, round + 1, evaluates)) return;
    }
    metrics.sync();
    finished_ = true;
  }

  void record(Metrics& metrics, const rollout::Summary& s, double loss) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    const MetricsColumns names = columns();
    const auto row = [&](const std::vector<std::string>& of, const std::map<std::string, double>& known) {
      std::vector<double> values;
      for (const std::string& name : of) values.push_back(known.contains(name) ? known.at(name) : none);
      return values;
    };
    metrics.record(row(names.metrics, {{"update", static_cast<double>(summary_.updates)},
                                       {"env_steps", static_cast<double>(summary_.env_steps)},
                                       {"episodes", static_cast<double>(summary_.episodes)},
                                       {"success_rate", s.success.value},
                                       {"capture_rate", s.captured.value},
                                       {"time_to_capture_median_s", s.capture_s.median.value_or(none)},
                                       {"imitation_loss", loss}}),
                   row(names.timing, {{"wall_s", seconds_since(options_.started) - summary_.evaluation_s},
                                      {"evaluation_s", summary_.evaluation_s}}));
  }

  /// A batch of flights, drawn from all that are kept.
  Lessons some_of(const std::vector<Lessons>& kept) const {
    const Lessons& first = kept.front();
    const std::size_t inputs = first.observation.size() / first.counts.size(),
                      outputs = first.wanted.size() / first.counts.size(), b = of_.batch;
    Lessons some{std::ranges::max(kept, {}, &Lessons::actions).actions, b, {}, {}, {}};
    some.observation.resize(some.actions * b * inputs);
    some.wanted.resize(some.actions * b * outputs);
    some.counts.resize(some.actions * b);
    for (std::size_t k = 0; k < b; ++k) {
      const auto draw = sim::uniform_pair({config_.seed, static_cast<std::uint32_t>(k),
                                           static_cast<std::uint32_t>(summary_.updates), sim::Stream::replay},
                                          0);
      const auto index = [](double share, std::size_t count) {
        return std::min(static_cast<std::size_t>(share * static_cast<double>(count)), count - 1);
      };
      const Lessons& from = kept[index(draw.first, kept.size())];
      const std::size_t i = index(draw.second, from.flights);
      for (std::size_t t = 0; t < from.actions; ++t) {
        const std::size_t there = t * from.flights + i, here = t * b + k;
        some.counts[here] = from.counts[there];
        std::copy_n(&from.observation[there * inputs], inputs, &some.observation[here * inputs]);
        std::copy_n(&from.wanted[there * outputs], outputs, &some.wanted[here * outputs]);
      }
    }
    return some;
  }

  /// Shows how far teachers and rounds are, as one count of updates. `updates`: of the next teacher. False: stop.
  bool keep_going(std::size_t done, std::uint64_t updates, std::size_t rounds, bool evaluated) const {
    if (!options_.keep_going) return true;
    TrainProgress p;
    p.updates = teachers() * of_.teacher_updates + of_.rounds * of_.steps;
    p.update = done * of_.teacher_updates + updates + rounds * of_.steps;
    p.episodes = summary_.episodes, p.env_steps = summary_.env_steps;
    p.mean_return = std::numeric_limits<double>::quiet_NaN();
    p.success = success_;
    p.evaluated = evaluated;
    return options_.keep_going(p);
  }

  const TrainConfig& config_;
  const TrainOptions& options_;
  const StudentOptions& of_;
  const fs::path folder_;
  TrainSummary summary_;
  bool finished_ = false;
  double success_ = -1;
};

}  // namespace

TrainSummary train_student(const TrainConfig& config, const TrainOptions& options) {
  if (!has_libtorch())
    throw io::InputError(
        "student: learns by LibTorch, which this build has not; accepted: the package flappy-torch, or a build with "
        "libtorch-dev installed");
  if (options.init) refuse_other_networks(config, *options.init);
  io::make_folder(options.folder);
  std::optional<io::FolderLock> lock;
  if (io::writes(options.ranks)) {
    lock.emplace(options.folder);
    if (options.goes_on) {
      const auto run = nlohmann::json::parse(io::read_text(options.folder / "run.json"), nullptr, false);
      if (!run.is_object() || run.value("config_sha256", "") != config.sha256)
        throw io::InputError(options.folder.string() + ": holds a run of another configuration; accepted: its own");
    } else {
      refuse_run_in(options.folder);
      write_config(config, options.folder);
      for (const char* name : {"best.json", "last.json"})  // the configuration names it, and so has to find one
        policy::write_actor(options.folder / name, beginner(config));
      write_start(config, options, "TD3 by lanes, then imitation by libtorch " + torch_functions().version());
    }
  }
  return StudentTrainer(config, options).run();
}

}  // namespace flappy::learn
