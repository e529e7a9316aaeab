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

/// Policies that every robot flies. The last was trained on with the robot's corrected vehicle; a robot without one flies
/// the policy before it.
enum Policy { kAsShipped, kFile, kCorrected, kPolicies };
constexpr std::array<const char*, kPolicies> kNames = {"as_shipped", "file", "corrected"};

/// Parts of a benchmark whose robots have an effect and are diagnosed from rich flights. Each robot occurs once in them.
constexpr std::string_view kParts[] = {"singles",         "withheld",      "outside", "pairs",
                                       "changed_outside", "changed_pairs", "changed"};

/// A scored benchmark. The constructor checks the hashes of its predictions and opens the labels.
struct Scored {
  explicit Scored(const fs::path& at) : folder(at), manifest(benchmark::read_manifest(at)) {
    benchmark::check_engine(folder, manifest.family, manifest.engine);
    benchmark::check_predictions(folder, manifest);
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
  const Scored* of;
  const benchmark::Label* label;
  benchmark::Prediction said;
  Assignment made;  ///< as its maker made it, with its effects
  fs::path own;     ///< folder of this robot's results
};

class Loop {
 public:
  explicit Loop(const LoopCommand& command) : command_(command), start_(learn::read_train_init(command.run)) {
    for (const auto& [file, text] : rollout::read_fly_config(command.config).resolved) escape_text_ += text;
    for (const std::string& folder : command.folders) {
      const Scored& s = *scored_.emplace_back(std::make_unique<Scored>(folder));
      if (s.labels.empty())
        throw io::InputError(folder + ": no robot with an effect and rich flights; accepted: a benchmark with " +
                             io::joined({std::begin(kParts), std::end(kParts)}));
      if (s.manifest.vehicle_sha256 != scored_.front()->manifest.vehicle_sha256)
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
  /// Chooses the robots, in the order of their cases; false if it was interrupted.
  bool choose() {
    const fs::path policy = fs::path(command_.run) / "best.json";
    const EscapeRules shipped = read_escape_rules(policy, command_.config), hover = hover_rules(shipped);
    std::map<std::string, std::size_t> benches;
    io::ProgressLine progress("choosing robots");
    for (const auto& s : scored_) {
      const std::string& family = s->manifest.family;
      const std::size_t before = benches[family]++;  // benchmarks of the same family
      const std::string name = family + (before > 0 ? std::to_string(before + 1) : "") + "_";
      std::size_t robots = 0, seen = 0;
      for (const auto& [number, label] : s->labels) {
        if (command_.robots > 0 && robots == command_.robots) break;
        if (io::interrupted()) return false;
        progress.show(static_cast<double>(seen++) / static_cast<double>(s->labels.size()), "family " + family);
        Robot r{s.get(), &label, s->prediction(number), label.robot(s->manifest.vehicle),
                command_.out / fs::path(name + benchmark::number_text(number))};
        if (!escapes_of(family, r.made, hover)(0)) {
          ++unsteady_[family];
          continue;
        }
        if (command_.costly) {
          io::make_folder(r.own);
          const std::optional<std::size_t> with = succeeded(r, kNames[kAsShipped], r.made, policy);
          if (!with) return false;
          std::optional<std::size_t> without = *with;
          if (*with < command_.escapes) {
            Assignment healthy = r.made;
            healthy.effects.clear();
            without = succeeded(r, "without_effect", healthy, policy);
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

  /// Flies the escapes of `flown`, which is the robot of `r` or a variant of it, and counts those that succeed. The count is kept in
  /// the folder of `r` as NAME.json, with a hash of its inputs, and is read from there the next time. Empty after Ctrl-C.
  std::optional<std::size_t> succeeded(const Robot& r, const std::string& name, const Assignment& flown,
                                       const fs::path& policy) const {
    const fs::path file = r.own / (name + ".json");
    const std::string of = io::sha256(io::read_text(r.of->folder / "manifest.json") + io::read_text(policy) +
                                      std::to_string(command_.escapes) + escape_text_);
    if (fs::exists(file))
      if (const Json kept = benchmark::read_json(file); kept.value("of", "") == of)
        return kept.at("succeeded").get<std::size_t>();
    const auto succeeds = escapes_of(r.of->manifest.family, flown, read_escape_rules(policy, command_.config));
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
    const fs::path declared = scored_.front()->manifest.vehicle;
    if (!train_on(declared, without(), 0)) return false;
    std::vector<fs::path> runs;
    for (const Robot& r : robots_) {
      if (r.said.corrected.empty()) continue;
      runs.push_back(r.own / kNames[kCorrected]);
      io::make_folder(r.own);
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
    const learn::TrainConfig config = learn::read_train_config(command_.train, overrides);
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
  std::optional<std::size_t> flown(const Robot& r, Policy p) const {
    if (p == kCorrected && r.said.corrected.empty()) p = kFile;  // its logs were faulty
    const fs::path run = p == kAsShipped ? fs::path(command_.run) : p == kFile ? without() : r.own / kNames[p];
    return succeeded(r, kNames[p], r.made, run / "best.json");
  }

  bool fly() {
    const bool all = benchmark::work_through("flying", robots_.size(), command_.threads, nullptr, [&](std::size_t i) {
      for (int p = 0; p < kPolicies; ++p) flown(robots_[i], static_cast<Policy>(p));
    });
    return all && !io::interrupted();
  }

  /// A function that flies the escape of a number and returns whether it succeeds.
  std::function<bool(std::size_t)> escapes_of(const std::string& family, const Assignment& a,
                                              const EscapeRules& rules) const {
    if (family == "a")
      return [robot = case_of(a), rules](std::size_t n) {
        return outcome_of(escape(robot, n, EscapeRules(rules))).success();
      };
    return [&of = benchmark::family_named(family), a, asked = escape_assignment(rules, command_.config)](
               std::size_t n) { return of.escape(a, n, EscapeAssignment(asked)).success; };
  }

  struct Row {
    std::size_t robots = 0, escapes = 0;
    std::array<std::size_t, kPolicies> succeeded{}, better{}, worse{};  ///< better and worse than kFile
    /// Share of the robots that fly better with the policy than with kFile; ties count half.
    double ties_half(Policy p) const {
      return 0.5 +
             (static_cast<double>(better[p]) - static_cast<double>(worse[p])) / (2.0 * static_cast<double>(robots));
    }
  };

  Json told() const {
    std::map<std::string, Row> rows;
    std::string lines = "family,case,part,effects,verdict,named,escapes," +
                        io::joined({kNames.begin(), kNames.end()}, ",") + ",seed,draw\n";
    for (const Robot& r : robots_) {
      std::array<std::size_t, kPolicies> count{};
      for (int p = 0; p < kPolicies; ++p) count[p] = *flown(r, static_cast<Policy>(p));
      const benchmark::Label& label = *r.label;
      const std::string& family = r.of->manifest.family;
      const benchmark::Answer said = answer_of(r.said);
      lines += family + "," + std::to_string(label.planned.number) + "," + label.planned.part + "," +
               io::joined(label.truth().effects, "+") + "," + said.kind + "," + io::joined(said.effects, "+") + "," +
               std::to_string(command_.escapes);
      for (Row* row : {&rows[family], &rows["all"]}) {
        ++row->robots;
        row->escapes += command_.escapes;
        for (int p = 0; p < kPolicies; ++p) {
          row->succeeded[p] += count[p];
          row->better[p] += count[p] > count[kFile];
          row->worse[p] += count[p] < count[kFile];
        }
      }
      for (const std::size_t c : count) lines += "," + std::to_string(c);
      lines += "," + std::to_string(label.planned.seed) + "," + std::to_string(label.draw) + "\n";
    }
    std::string text =
        "| family | robots | better with the diagnosis (95 %) | as good | worse | better, ties half | success as "
        "shipped "
        "| trained on with the file | with the corrected vehicle |\n"
        "|---|---|---|---|---|---|---|---|---|\n";
    Json all = Json::object();
    for (const auto& [family, row] : rows) {
      const std::size_t better = row.better[kCorrected], worse = row.worse[kCorrected];
      const rollout::Rate rate = rollout::rate_of(better, row.robots);
      const auto share = [&row = row](Policy p) {
        return static_cast<double>(row.succeeded[p]) / static_cast<double>(row.escapes);
      };
      char line[300];
      std::snprintf(line, sizeof line, "| %s | %zu | %.3f (%.3f to %.3f) | %zu | %zu | %.3f | %.3f | %.3f | %.3f |\n",
                    family.c_str(), row.robots, rate.value, rate.low, rate.high, row.robots - better - worse, worse,
                    row.ties_half(kCorrected), share(kAsShipped), share(kFile), share(kCorrected));
      text += line;
      all[family] = {
          {"robots", row.robots}, {"better", better}, {"worse", worse}, {"ties_half", row.ties_half(kCorrected)}};
      for (int p = 0; p < kPolicies; ++p) all[family][kNames[p]] = share(static_cast<Policy>(p));
    }
    text += "\nleft out, for they do not hover at the goal for three seconds without a policy:";
    for (const auto& [family, count] : unsteady_) text += " " + family + " " + std::to_string(count);
    text += unsteady_.empty() ? " none\n" : "\n";
    if (command_.costly) text += "left out, for they escape as often as without their effect:";
    for (const auto& [family, count] : as_good_) text += " " + family + " " + std::to_string(count);
    if (command_.costly) text += as_good_.empty() ? " none\n" : "\n";
    std::fputs(text.c_str(), stdout);
    io::write_atomically(fs::path(command_.out) / "loop.csv", lines);
    io::write_atomically(fs::path(command_.out) / "loop.md", text);
    return all;
  }

  const LoopCommand& command_;
  std::vector<std::unique_ptr<Scored>> scored_;
  std::vector<Robot> robots_;
  std::map<std::string, std::size_t> unsteady_;  ///< by family: robots that fail hover_rules()
  std::map<std::string, std::size_t> as_good_;   ///< by family: robots whose effect costs no escape
  std::shared_ptr<const learn::TrainInit> start_;
  std::string escape_text_;  ///< all files of command_.config, resolved
};

}  // namespace

Json run_loop(const LoopCommand& command) { return Loop(command).run(); }

}  // namespace flappy::blind
