#include "loop.hpp"

#include <atomic>
#include <cstdio>
#include <functional>
#include <map>
#include <optional>

#include "escape_rules.hpp"
#include "io/append_file.hpp"
#include "io/files.hpp"
#include "io/parallel.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/sha256.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "lab/benchmark/families.hpp"
#include "lab/benchmark/records.hpp"
#include "lab/benchmark/work.hpp"
#include "lab/blind/a/family_a.hpp"
#include "learn/trainer.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Policies of a run that is trained on, by their place in Loop::names_; after them come those of LoopCommand::also.
/// kCorrected was trained on with the robot's corrected vehicle; a robot without one flies kFile in its place.
enum Policy : std::size_t { kAsShipped, kFile, kCorrected, kPolicies };

/// Parts of a benchmark whose robots have an effect and are diagnosed from rich flights. Each robot occurs once in them.
constexpr std::string_view kParts[] = {"singles",         "withheld",      "outside", "pairs",
                                       "changed_outside", "changed_pairs", "changed"};

/// A benchmark. The constructor opens the labels; with `scored`, it first checks the hashes of its predictions.
struct Benchmark {
  Benchmark(const fs::path& at, bool scored) : folder(at), manifest(benchmark::read_manifest(at)) {
    benchmark::check_engine(folder, manifest.family, manifest.engine);
    if (scored) benchmark::check_predictions(folder, manifest);
    if (io::sha256(io::read_text(manifest.vehicle)) != manifest.vehicle_sha256)
      throw io::InputError(manifest.vehicle + ": has changed since " + at.string() +
                           " was made; accepted: the vehicle that was diagnosed");
    const Json sealed = benchmark::open_labels(folder, manifest);
    for (const Json& json : sealed.at("cases")) {
      benchmark::Label l = benchmark::label_from(json);
      if (std::ranges::count(kParts, l.planned.part) > 0) labels.emplace(l.planned.number, std::move(l));
    }
  }
  benchmark::Prediction prediction(std::size_t number) const {
    return benchmark::read_prediction(benchmark::prediction_file(folder, number));
  }
  fs::path folder;
  benchmark::Manifest manifest;
  std::map<std::size_t, benchmark::Label> labels;  ///< by the case's number
};

struct Robot {
  const Benchmark* of;
  const benchmark::Label* label;
  benchmark::Prediction said;  ///< empty where nothing is trained
  Assignment made;             ///< as its maker made it, with its effects
  fs::path own;                ///< folder of this robot's results
};

class Loop {
 public:
  explicit Loop(const LoopCommand& command) : command_(command) {
    if (trains()) {
      start_ = learn::read_train_init(command.run);
      names_ = {"as_shipped", "file", "corrected"};
    } else if (command.also.empty()) {
      throw io::InputError("loop: no policy to fly; accepted: --run, --also or both");
    }
    for (const std::string& also : command.also) {
      const std::string name = (fs::absolute(also) / "best.json").lexically_normal().parent_path().filename().string();
      if (std::ranges::count(names_, name) > 0)
        throw io::InputError("--also " + also + ": another policy is called " + name +
                             "; accepted: run folders of different names");
      names_.push_back(name);
    }
    if (!command.costly.empty()) read_rules(as_it_is(command.costly));  // throws, before anything is flown
    for (const std::string& also : command.also) read_rules(as_it_is(also));
    for (const std::string& folder : command.folders) {
      const Benchmark& s = *benchmarks_.emplace_back(std::make_unique<Benchmark>(folder, trains()));
      if (s.labels.empty())
        throw io::InputError(folder + ": no robot with an effect and rich flights; accepted: a benchmark with " +
                             io::joined({std::begin(kParts), std::end(kParts)}));
      if (s.manifest.vehicle_sha256 != benchmarks_.front()->manifest.vehicle_sha256)
        throw io::InputError(folder + ": is of another vehicle; accepted: benchmarks of one vehicle");
    }
  }

  Json run() {
    io::make_folder(command_.out);
    const io::FolderLock lock(command_.out);
    io::stop_on_interrupt();
    if (!choose() || !train() || !fly()) {
      std::printf("stopped; what is done stays: the same command goes on\n");
      return nullptr;
    }
    return told();
  }

 private:
  /// Whether a policy is trained on, for which the diagnoses are read.
  bool trains() const { return !command_.run.empty(); }
  /// Number of the policies before those of LoopCommand::also.
  std::size_t own_policies() const { return trains() ? std::size_t{kPolicies} : 0; }

  /// Chooses the robots, in the order of their cases; false if it was interrupted.
  bool choose() {
    const Flown any = as_it_is(trains() ? command_.run : command_.also[0]);
    const EscapeRules hover = hover_rules(read_rules(any));
    std::map<std::string, std::size_t> benches;
    io::ProgressLine progress("choosing robots");
    for (const auto& s : benchmarks_) {
      const std::string& family = s->manifest.family;
      const std::size_t before = benches[family]++;  // benchmarks of the same family
      const std::string name = family + (before > 0 ? std::to_string(before + 1) : "") + "_";
      std::size_t robots = 0, seen = 0;
      for (const auto& [number, label] : s->labels) {
        if (command_.robots > 0 && robots == command_.robots) break;
        if (io::interrupted()) return false;
        progress.show(static_cast<double>(seen++) / static_cast<double>(s->labels.size()), "family " + family);
        Robot r{s.get(), &label, trains() ? s->prediction(number) : benchmark::Prediction(),
                label.robot(s->manifest.vehicle), command_.out / fs::path(name + benchmark::number_text(number))};
        if (!escapes_of(family, r.made, hover, any.config())(0)) {
          ++unsteady_[family];
          continue;
        }
        io::make_folder(r.own);
        if (!command_.costly.empty()) {
          const Flown by = as_it_is(command_.costly);
          const std::optional<std::size_t> with = succeeded(r, name_of_costly(), r.made, by);
          if (!with) return false;
          std::optional<std::size_t> without = *with;
          if (*with < command_.escapes) {
            Assignment healthy = r.made;
            healthy.effects.clear();
            without = succeeded(r, "without_effect", healthy, by);
          }
          if (!without) return false;
          if (*with >= *without) {
            ++as_good_[family];
            continue;
          }
        }
        ++robots;
        robots_.push_back(std::move(r));
      }
    }
    return true;
  }

  /// The best policy of one run, with the task and the controller of another, which may be the same.
  struct Flown {
    fs::path run, rules;
    fs::path policy() const { return run / "best.json"; }
    fs::path config() const { return rules / "config" / "fly.toml"; }
  };
  static Flown as_it_is(const fs::path& run) { return {run, run}; }
  /// Name of the counts by which robots are chosen: of the same policy, where that is one of those that fly.
  std::string name_of_costly() const {
    const auto is = [&](const fs::path& run) {
      return fs::weakly_canonical(command_.costly) == fs::weakly_canonical(run);
    };
    if (trains() && is(command_.run)) return names_[kAsShipped];
    for (std::size_t k = 0; k < command_.also.size(); ++k)
      if (is(command_.also[k])) return names_[own_policies() + k];
    return "with_effect";
  }
  static EscapeRules read_rules(const Flown& by) { return read_escape_rules(by.policy(), by.config()); }

  /// Flies the escapes of `flown`, which is the robot of `r` or a variant of it, and counts those that succeed. The count is kept in
  /// the folder of `r` as NAME.json, with a hash of its inputs, and is read from there the next time. Empty after Ctrl-C.
  std::optional<std::size_t> succeeded(const Robot& r, const std::string& name, const Assignment& flown,
                                       const Flown& by) const {
    const fs::path file = r.own / (name + ".json");
    std::string inputs =
        io::read_text(r.of->folder / "manifest.json") + io::read_text(by.policy()) + std::to_string(command_.escapes);
    for (const auto& [path, text] : rollout::read_fly_config(by.config()).resolved) inputs += text;
    const std::string of = io::sha256(inputs);
    if (fs::exists(file))
      if (const Json kept = benchmark::read_json(file); kept.value("of", "") == of)
        return kept.at("succeeded").get<std::size_t>();
    const auto succeeds = escapes_of(r.of->manifest.family, flown, read_rules(by), by.config());
    std::atomic<std::size_t> count = 0;
    io::parallel_for(command_.escapes, command_.threads, [&](std::size_t n) {
      if (!io::interrupted()) count += succeeds(n);
    });
    if (io::interrupted()) return std::nullopt;
    io::write_atomically(file,
                         Json{{"of", of}, {"escapes", command_.escapes}, {"succeeded", count.load()}}.dump(1) + "\n");
    return count;
  }

  fs::path without() const { return fs::path(command_.out) / "file"; }

  /// Trains by the predictions alone, without the labels' effects.
  bool train() {
    if (!trains()) return true;
    const fs::path declared = benchmarks_.front()->manifest.vehicle;
    if (!train_on(declared, without(), 0)) return false;
    std::vector<fs::path> runs;
    for (const Robot& r : robots_) {
      if (r.said.corrected.empty()) continue;
      runs.push_back(r.own / names_[kCorrected]);
      io::write_atomically(vehicle_of(runs.back()), r.said.corrected);
    }
    return benchmark::work_through("training", runs.size(), command_.threads, nullptr,
                                   [&](std::size_t i) { train_on(vehicle_of(runs[i]), runs[i], 1); });
  }

  static fs::path vehicle_of(const fs::path& run) { return run.string() + ".toml"; }

  /// Resumes an unfinished run in the folder; false if it was interrupted.
  bool train_on(const fs::path& vehicle, const fs::path& folder, int threads) const {
    std::vector<std::string> overrides = command_.overrides;
    overrides.push_back("vehicle=" + io::toml_string(fs::absolute(vehicle).string()));
    if (threads > 0) overrides.push_back("threads=" + std::to_string(threads));
    const learn::TrainConfig config =
        learn::read_train_config(fs::path(command_.run) / "config" / "train.toml", overrides);
    learn::refuse_other_run_in(folder, config, start_.get());
    learn::TrainOptions options;
    options.folder = folder;
    options.from = learn::unfinished_run_in(folder);
    if (fs::exists(folder / "summary.json") && !options.from) return true;
    options.init = start_;
    options.commit = io::commit();
    options.keep_going = [](const learn::TrainProgress&) { return !io::interrupted(); };
    return !learn::train(config, options).stopped;
  }

  /// Flies the escapes of a robot with a policy; empty after Ctrl-C.
  std::optional<std::size_t> flown(const Robot& r, std::size_t p) const {
    if (p >= own_policies()) return succeeded(r, names_[p], r.made, as_it_is(command_.also[p - own_policies()]));
    if (p == kCorrected && r.said.corrected.empty()) p = kFile;  // its logs were faulty
    const fs::path run = p == kAsShipped ? fs::path(command_.run) : p == kFile ? without() : r.own / names_[p];
    return succeeded(r, names_[p], r.made, {run, command_.run});
  }

  bool fly() {
    const bool all = benchmark::work_through("flying", robots_.size(), command_.threads, nullptr, [&](std::size_t i) {
      for (std::size_t p = 0; p < names_.size(); ++p) flown(robots_[i], p);
    });
    return all && !io::interrupted();
  }

  /// A function that flies the escape of a number and returns whether it succeeds. `config`: the file of the rules.
  static std::function<bool(std::size_t)> escapes_of(const std::string& family, const Assignment& a,
                                                     const EscapeRules& rules, const fs::path& config) {
    if (family == "a")
      return [robot = case_of(a), rules](std::size_t n) {
        return outcome_of(escape(robot, n, EscapeRules(rules))).success();
      };
    return [&of = benchmark::family_named(family), a, asked = escape_assignment(rules, config)](std::size_t n) {
      return of.escape(a, n, EscapeAssignment(asked)).success;
    };
  }

  struct Row {
    std::size_t robots = 0, escapes = 0;
    std::size_t better = 0, worse = 0;   ///< robots by kCorrected, beside kFile
    std::vector<std::size_t> succeeded;  ///< by policy
    /// Share of the robots that fly better with kCorrected than with kFile; ties count half.
    double ties_half() const {
      return 0.5 + (static_cast<double>(better) - static_cast<double>(worse)) / (2.0 * static_cast<double>(robots));
    }
  };

  Json told() const {
    std::map<std::string, Row> rows;
    // where nothing was diagnosed, effects stay sealed, so that the benchmark can still be scored
    std::string lines = std::string("family,case,part,") + (trains() ? "effects,verdict,named," : "") + "escapes," +
                        io::joined(names_, ",") + ",seed,draw\n";
    for (const Robot& r : robots_) {
      std::vector<std::size_t> count;
      for (std::size_t p = 0; p < names_.size(); ++p) count.push_back(*flown(r, p));
      const benchmark::Label& label = *r.label;
      const std::string& family = r.of->manifest.family;
      lines += family + "," + std::to_string(label.planned.number) + "," + label.planned.part + ",";
      if (trains()) {
        const benchmark::Answer said = answer_of(r.said);
        lines += io::joined(label.truth().effects, "+") + "," + said.kind + "," + io::joined(said.effects, "+") + ",";
      }
      lines += std::to_string(command_.escapes);
      for (Row* row : {&rows[family], &rows["all"]}) {
        ++row->robots;
        row->escapes += command_.escapes;
        if (trains()) {
          row->better += count[kCorrected] > count[kFile];
          row->worse += count[kCorrected] < count[kFile];
        }
        row->succeeded.resize(count.size());
        for (std::size_t p = 0; p < count.size(); ++p) row->succeeded[p] += count[p];
      }
      for (const std::size_t c : count) lines += "," + std::to_string(c);
      lines += "," + std::to_string(label.planned.seed) + "," + std::to_string(label.draw) + "\n";
    }
    std::string text = "| family | robots |";
    if (trains())
      text +=
          " better with the diagnosis (95 %) | as good | worse | better, ties half | success as shipped | trained on "
          "with the file | with the corrected vehicle |";
    for (std::size_t p = own_policies(); p < names_.size(); ++p) text += " " + names_[p] + " |";
    text += "\n|";
    for (std::size_t column = 0; column < (trains() ? 6 : 2) + names_.size(); ++column) text += "---|";
    text += "\n";
    Json all = Json::object();
    for (const auto& [family, row] : rows) {
      text += io::format("| %s | %zu |", family.c_str(), row.robots);
      all[family] = {{"robots", row.robots}};
      if (trains()) {
        const rollout::Rate rate = rollout::rate_of(row.better, row.robots);
        text += io::format(" %.3f (%.3f to %.3f) | %zu | %zu | %.3f |", rate.value, rate.low, rate.high,
                           row.robots - row.better - row.worse, row.worse, row.ties_half());
        all[family].update({{"better", row.better}, {"worse", row.worse}, {"ties_half", row.ties_half()}});
      }
      for (std::size_t p = 0; p < names_.size(); ++p) {
        const double share = static_cast<double>(row.succeeded[p]) / static_cast<double>(row.escapes);
        text += io::format(" %.3f |", share);
        all[family][names_[p]] = share;
      }
      text += "\n";
    }
    text += "\nleft out, for they do not hover at the goal for three seconds without a policy:";
    for (const auto& [family, count] : unsteady_) text += " " + family + " " + std::to_string(count);
    text += unsteady_.empty() ? " none\n" : "\n";
    if (!command_.costly.empty()) text += "left out, for they escape as often as without their effect:";
    for (const auto& [family, count] : as_good_) text += " " + family + " " + std::to_string(count);
    if (!command_.costly.empty()) text += as_good_.empty() ? " none\n" : "\n";
    std::fputs(text.c_str(), stdout);
    io::write_atomically(fs::path(command_.out) / "loop.csv", lines);
    io::write_atomically(fs::path(command_.out) / "loop.md", text);
    return all;
  }

  const LoopCommand& command_;
  std::vector<std::unique_ptr<Benchmark>> benchmarks_;
  std::vector<Robot> robots_;
  std::map<std::string, std::size_t> unsteady_;  ///< by family: robots that fail hover_rules()
  std::map<std::string, std::size_t> as_good_;   ///< by family: robots whose effect costs no escape
  std::shared_ptr<const learn::TrainInit> start_;
  std::vector<std::string> names_;  ///< [policy] name of its column and of its counts' files
};

}  // namespace

Json run_loop(const LoopCommand& command) { return Loop(command).run(); }

}  // namespace flappy::blind
