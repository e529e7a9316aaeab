// flappy-train: trains a policy and writes a run folder.
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "io/config.hpp"
#include "io/log.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/read_files.hpp"
#include "io/schema.hpp"
#include "io/sha256.hpp"
#include "io/toml_writer.hpp"
#include "learn/checkpoint.hpp"
#include "learn/learning_curve.hpp"
#include "learn/trainer.hpp"
#include "server/telemetry/telemetry.hpp"

namespace flappy::train {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using namespace learn;

const auto started = std::chrono::steady_clock::now();

/// Parses seeds: "3" or "0-4".
std::vector<std::uint64_t> seeds_of(const std::string& text) {
  std::array<std::uint64_t, 2> ends{};
  const char *at = text.data(), *end = at + text.size();
  std::from_chars_result read = std::from_chars(at, end, ends[0]);
  ends[1] = ends[0];
  if (read.ec == std::errc{} && read.ptr != end && *read.ptr == '-') read = std::from_chars(read.ptr + 1, end, ends[1]);
  if (read.ec != std::errc{} || read.ptr != end || ends[1] < ends[0] || ends[1] - ends[0] >= 1000 ||
      ends[1] > INT32_MAX)
    throw io::InputError("--seeds " + text + ": is no range of seeds; accepted: 0-4");
  std::vector<std::uint64_t> list;
  for (std::uint64_t seed = ends[0]; seed <= ends[1]; ++seed) list.push_back(seed);
  return list;
}

std::string words(const TrainProgress& p) {
  char text[200];
  int n = std::snprintf(text, sizeof text, "%llu episodes", static_cast<unsigned long long>(p.episodes));
  const auto add = [&](const char* format, double value) {
    n += std::snprintf(text + n, sizeof text - static_cast<std::size_t>(n), format, value);
  };
  if (std::isfinite(p.mean_return)) add(", return %.2f", p.mean_return);
  if (p.success >= 0) add(", success %.1f %%", 100 * p.success);
  add(", %.2f M env steps/s", p.env_steps_per_s / 1e6);
  add(", %.0f updates/s", p.updates_per_s);
  return text;
}

void print(const fs::path& folder, const TrainSummary& s) {
  std::printf("%s: seed %llu, %llu updates in %.1f s (and %.1f s of evaluation), %.1f million environment steps\n",
              s.stopped ? "stopped" : "trained", static_cast<unsigned long long>(s.seed),
              static_cast<unsigned long long>(s.updates), s.wall_s, s.evaluation_s,
              static_cast<double>(s.env_steps) / 1e6);
  if (s.best_success)
    std::printf("  best success on validation vehicles: %.2f %%, at update %llu\n", 100 * *s.best_success,
                static_cast<unsigned long long>(s.best_update));
  std::printf("  time to 50, 80, 90, 95 %% success:");
  for (const auto& t : s.time_to_s) t ? std::printf(" %.1f s", *t) : std::printf(" -");
  std::printf("\n");
  if (s.share_learning > 0)
    std::printf("  simulation %.0f %%, learning %.0f %%, the rest %.0f %% of the time of all threads\n",
                100 * s.share_simulation, 100 * s.share_learning, 100 * (1 - s.share_simulation - s.share_learning));
  if (s.ranks > 1)
    std::printf("  %d ranks: %.0f kB came from others for each update, %.0f %% of the time in exchanges\n", s.ranks,
                s.exchanged_bytes / 1e3 / static_cast<double>(std::max<std::uint64_t>(1, s.updates)),
                100 * s.exchange_s / s.wall_s);
  std::printf("  policy %s", (folder / "best.json").c_str());
  if (!s.payload_sha256.empty()) std::printf(", last checkpoint's payload %s", s.payload_sha256.c_str());
  std::printf("\n");
  if (s.stopped) std::printf("  go on: flappy-train --resume %s\n", folder.c_str());
  std::printf("%s\n", io::shown_by(folder.string()).c_str());
}

/// The configuration file that a run was started with.
fs::path config_of(const fs::path& run) {
  fs::path config = run / "config" / "train.toml";
  if (!fs::is_regular_file(config))
    throw io::InputError(run.string() + ": is no run folder; accepted: a folder that flappy-train left");
  return config;
}

/// A vehicle's name without what a correction appends.
std::string uncorrected(std::string name) {
  const std::string appended = "_corrected";
  while (name.ends_with(appended)) name.resize(name.size() - appended.size());
  return name;
}

/// Updates of --adapt, as an override. Choice: the escape of a robot that had changed succeeded in 89.4 % of flights after
/// so many, and in 89.8 % after 60,000.
constexpr const char* kAdaptUpdates = "learn.updates=8000";

/// The vehicle that a diagnosis corrected, as an override for training on from `run`. Throws io::InputError unless the
/// diagnosis was of the run's vehicle.
std::string adapted_vehicle(const fs::path& diagnosis, const fs::path& run) {
  const std::string accepted = "; accepted: the folder of a finished flappy-gap diagnose --out";
  if (!fs::is_regular_file(diagnosis / "diagnosis.json"))
    throw io::InputError(diagnosis.string() + ": has no diagnosis.json" + accepted);
  const fs::path vehicle = diagnosis / "vehicle_corrected.toml";
  if (!fs::is_regular_file(vehicle))
    throw io::InputError(diagnosis.string() +
                         ": has no vehicle_corrected.toml: its data are faulty, or it was stopped" + accepted);
  const auto name = [](const fs::path& file) { return uncorrected(io::Config::load(file).root().string("name")); };
  const std::string of = name(vehicle), flown = name(run / "config" / "vehicle.toml");
  if (of != flown)
    throw io::InputError(diagnosis.string() + ": is a diagnosis of vehicle " + io::toml_string(of) + ", but " +
                         run.string() + " flies " + io::toml_string(flown) +
                         "; accepted: a diagnosis of that vehicle, or --set vehicle in place of --adapt");
  return "vehicle=" + io::toml_string(fs::absolute(vehicle).string());
}

server::TrainingSample sample_of(const fs::path& run, const TrainProgress& p) {
  return {run.filename().string(), p.update,  p.updates,       p.episodes,       p.env_steps,
          p.mean_return,           p.success, p.updates_per_s, p.env_steps_per_s};
}

TrainSummary train_one(TrainConfig config, TrainOptions options) {
  const auto telemetry =
      io::writes(options.ranks) ? server::telemetry_of(config.fly.dds, config.fly.fleet.sensors) : nullptr;
  config.fly.watch = telemetry;
  io::ProgressLine line("trained");
  bool said = false;
  options.keep_going = [&](const TrainProgress& p) {
    if (!std::exchange(said, true)) {
      if (io::writes(options.ranks)) io::log_into(options.folder);
      const TrainCosts costs = costs_of(config);
      std::printf("%s: seed %llu, %d threads, %.0f MB of memory, at most %.0f MB on disk\n", options.folder.c_str(),
                  static_cast<unsigned long long>(config.seed), config.threads,
                  static_cast<double>(costs.memory_bytes) / 1e6, static_cast<double>(costs.disk_bytes) / 1e6);
      std::fflush(stdout);
    }
    if (telemetry) telemetry->show(sample_of(options.folder, p));
    if (p.evaluated) io::log(io::LogLevel::info, "update " + std::to_string(p.update) + ": " + words(p));
    if (line.due()) line.show(static_cast<double>(p.update) / static_cast<double>(p.updates), words(p));
    return !io::interrupted();
  };
  TrainSummary summary = learn::train(config, options);
  line.clear();
  io::log(io::LogLevel::info,
          (summary.stopped ? "stopped at update " : "trained, update ") + std::to_string(summary.updates));
  print(options.folder, summary);
  std::fflush(stdout);
  return summary;
}

/// Trains runs of several seeds, dealt out to the ranks; resumes unfinished runs and skips finished ones. Then writes their learning curve.
void train_seeds(io::Program& program, const std::vector<std::uint64_t>& seeds, const fs::path& folder,
                 TrainOptions options, const std::function<TrainConfig(std::uint64_t)>& config_of) {
  const auto folder_of = [&](std::uint64_t seed) { return seed_folder(folder, seed); };
  refuse_run_beside_seeds(folder);
  std::string agreed;
  for (const std::uint64_t seed : seeds) {
    const TrainConfig config = config_of(seed);
    refuse_other_run_in(folder_of(seed), config, options.init.get());
    agreed += "configuration: " + config.sha256 + "\n";
  }
  io::Ranks* const ranks = program.ranks(agreed);
  for (std::size_t i = 0; i < seeds.size() && !io::interrupted(); ++i) {
    if (!io::is_own(ranks, i)) continue;
    options.folder = folder_of(seeds[i]);
    if (!finished_run_in(options.folder).is_null()) continue;
    const TrainConfig config = config_of(seeds[i]);
    options.goes_on = config.student && fs::exists(options.folder / "run.json");
    if (!config.student) options.from = unfinished_run_in(options.folder);
    train_one(config, options);
    options.started = std::chrono::steady_clock::now();
  }
  io::wait(ranks);
  if (!program.writes()) return;
  std::vector<SeedCurve> curves;
  Json all = Json::array();
  for (const std::uint64_t seed : seeds) {
    const fs::path summary = folder_of(seed) / "summary.json";
    if (!fs::exists(summary)) continue;
    all.push_back(Json::parse(io::read_text(summary)));
    if (all.back().at("stopped").get<bool>()) continue;
    curves.push_back(read_seed_curve(folder_of(seed), seed, "success_rate"));
  }
  program.write_json(all);
  if (curves.size() < seeds.size()) {
    std::printf("stopped with %zu of %zu seeds; go on: the same command\n", curves.size(), seeds.size());
    return;
  }
  const LearningCurve curve = learning_curve(curves);
  write_curve_csv(folder / "curve.csv", curve);
  write_curve_svg(folder / "curve.svg", curve, "success_rate");
  std::printf("%s and curve.svg: learning curve of %zu seeds\n%s\n", (folder / "curve.csv").c_str(), curves.size(),
              io::shown_by(folder.string()).c_str());
}

}  // namespace
}  // namespace flappy::train

int main(int argc, char** argv) {
  using namespace flappy;
  namespace fs = std::filesystem;
  io::Program program("flappy-train", "Trains a policy; leaves a run folder.",
                      {"instruction set " + sim::best_instruction_set()});
  const io::Command& app = program.app();
  std::string config_name, out, resume, from, init, adapt, seeds;
  std::vector<std::string> overrides;
  int threads = 0;
  app.option("config", config_name, "what to train: configs/train/*.toml");
  io::Option placed =
      app.option("--out", out, "run folder, or folder of runs with --seeds (runs/ and the configuration's name)");
  io::Option resumed =
      app.option("--resume", resume, "run folder to go on with, from its newest checkpoint").excludes(placed);
  app.option("--seeds", seeds, "several runs: 0-4; writes their learning curve").excludes(resumed);
  app.option("--from", from, "another checkpoint of that folder").needs(resumed);
  const io::Option initial =
      app.option("--init", init, "what to start with: a run folder (its best actor and its critics), or an actor alone")
          .excludes(resumed);
  app.option("--adapt", adapt,
             "folder of a diagnosis: trains the run of --init on, with its configuration and the corrected vehicle, "
             "for 8,000 updates")
      .needs(initial)
      .excludes(resumed);
  const io::Option of_threads = app.option("--threads", threads, "0: all").range(0, 1024);
  app.option("--set", overrides, "override a key: learn.updates=1000, task.reward.goal=1")
      .one_at_a_time()
      .excludes(resumed);
  program.takes_ranks();
  return program.run(argc, argv, [&] {
    if (!adapt.empty()) {  // a short name for CONFIG, --init, --set vehicle and --set learn.updates
      if (!config_name.empty())
        throw io::InputError(config_name + ": --adapt trains on with the configuration of the run " + init +
                             "; accepted: no other one");
      for (const std::string& text : overrides)
        if (text.starts_with("vehicle=") || text.starts_with("vehicle ="))
          throw io::InputError("--set " + text + ": --adapt sets the vehicle; accepted: other keys");
      config_name = train::config_of(init).string();
      overrides.insert(overrides.begin(), train::adapted_vehicle(adapt, init));
      overrides.insert(overrides.begin(), train::kAdaptUpdates);  // a --set of the user comes later and overrides it
      if (out.empty())
        out = (fs::path("runs") / (fs::absolute(init).lexically_normal().filename().string() + "_adapted")).string();
    }
    if (config_name.empty() == resume.empty())
      throw io::InputError(
          "flappy-train: what to train is not clear; accepted: a configuration, --resume RUN, or --adapt DIAGNOSIS "
          "--init RUN");
    io::stop_on_interrupt();
    learn::TrainOptions options;
    options.commit = io::commit();
    options.started = train::started;
    const auto train_it = [&](const learn::TrainConfig& config) {
      if (!options.from && !options.goes_on)
        learn::refuse_run_in(options.folder);  // refuse on all ranks, before they meet
      std::string agreed =
          "configuration: " + config.sha256 + "\ninit: " + (options.init ? options.init->sha256 : "") + "\n";
      if (options.from) agreed += "checkpoint: " + learn::Checkpoint(*options.from).payload_sha256() + "\n";
      // with LibTorch each rank steps its own replica, so the processors must compute the same
      if (config.engine == learn::EngineKind::libtorch) agreed += "processor: " + learn::processor() + "\n";
      options.ranks = program.ranks(agreed);
      program.write_json(learn::json_of(train::train_one(config, options)));
    };
    const auto with_threads = [&](std::vector<std::string> list) {
      if (of_threads.given()) list.push_back("threads=" + std::to_string(threads));
      return list;
    };
    if (!resume.empty()) {
      const fs::path config_file = train::config_of(resume);
      if (const auto summary = learn::finished_run_in(resume); from.empty() && !summary.is_null()) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(resume))
          io::note_read(entry.path());  // no output replaces what is left as it is
        std::printf("%s: is finished: seed %s, %s updates; nothing is left to do\n%s\n", resume.c_str(),
                    summary.value("seed", train::Json()).dump().c_str(),
                    summary.value("updates", train::Json()).dump().c_str(), io::shown_by(resume).c_str());
        return program.write_json(summary);
      }
      const learn::TrainConfig config =
          io::read_of_run(resume, [&] { return learn::read_train_config(config_file, with_threads({})); });
      options.folder = resume;
      options.goes_on = config.student.has_value();
      if (options.goes_on && !from.empty())
        throw io::InputError("--from " + from + ": a student has no checkpoints; accepted: --resume " + resume +
                             " alone");
      if (!options.goes_on)
        options.from = from.empty() ? learn::newest_checkpoint(resume).path() : fs::path(resume) / from;
      return train_it(config);
    }
    if (!init.empty()) options.init = learn::read_train_init(init);
    const fs::path folder = out.empty() ? fs::path("runs") / fs::path(config_name).stem() : fs::path(out);
    if (seeds.empty()) {
      options.folder = folder;
      return train_it(learn::read_train_config(config_name, with_threads(overrides)));
    }
    train::train_seeds(program, train::seeds_of(seeds), folder, options, [&](std::uint64_t seed) {
      std::vector<std::string> list = with_threads(overrides);
      list.push_back("seed=" + std::to_string(seed));
      return learn::read_train_config(config_name, list);
    });
  });
}
