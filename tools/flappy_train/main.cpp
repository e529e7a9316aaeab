// flappy-train: trains a policy, and leaves a run folder.
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "io/log.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/schema.hpp"
#include "learn/checkpoint.hpp"
#include "learn/learning_curve.hpp"
#include "learn/trainer.hpp"

namespace flappy::train {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using namespace learn;

const auto started = std::chrono::steady_clock::now();

/// "3", "0-4"
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
  std::printf("\n  simulation %.0f %%, learning %.0f %%, the rest %.0f %% of the time of all threads\n",
              100 * s.share_simulation, 100 * s.share_learning, 100 * (1 - s.share_simulation - s.share_learning));
  std::printf("  policy %s, last checkpoint's payload %s\n", (folder / "best.json").c_str(), s.payload_sha256.c_str());
  if (s.stopped) std::printf("  go on: flappy-train --resume %s\n", folder.c_str());
}

/// The configuration that a run was started with.
fs::path config_of(const fs::path& run) {
  fs::path config = run / "config" / "train.toml";
  if (!fs::is_regular_file(config))
    throw io::InputError(run.string() + ": is no run folder; accepted: a folder that flappy-train left");
  return config;
}

TrainSummary train_one(const TrainConfig& config, TrainOptions options) {
  io::ProgressLine line("trained");
  bool said = false;
  options.keep_going = [&](const TrainProgress& p) {
    if (!std::exchange(said, true)) {
      io::log_into(options.folder);
      const TrainCosts costs = costs_of(config);
      std::printf("%s: seed %llu, %d threads, %.0f MB of memory, at most %.0f MB on disk\n", options.folder.c_str(),
                  static_cast<unsigned long long>(config.seed), config.threads,
                  static_cast<double>(costs.memory_bytes) / 1e6, static_cast<double>(costs.disk_bytes) / 1e6);
      std::fflush(stdout);
    }
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

}  // namespace
}  // namespace flappy::train

int main(int argc, char** argv) {
  using namespace flappy;
  namespace fs = std::filesystem;
  io::Program program("flappy-train", "Trains a policy; leaves a run folder.",
                      {"instruction set " + sim::best_instruction_set()});
  const io::Command& app = program.app();
  std::string config_name, out, resume, from, init, seeds;
  std::vector<std::string> overrides;
  int threads = 0;
  app.option("config", config_name, "what to train: configs/train/*.toml");
  io::Option placed =
      app.option("--out", out, "run folder, or folder of runs with --seeds (runs/ and the configuration's name)");
  io::Option resumed =
      app.option("--resume", resume, "run folder to go on with, from its newest checkpoint").excludes(placed);
  app.option("--seeds", seeds, "several runs: 0-4; writes their learning curve").excludes(resumed);
  app.option("--from", from, "another checkpoint of that folder").needs(resumed);
  app.option("--init", init, "actor, or run folder whose best one, to start with").excludes(resumed);
  app.option("--threads", threads, "0: all").range(0, 1024);
  app.option("--set", overrides, "override a key: learn.updates=1000, task.reward.goal=1")
      .one_at_a_time()
      .excludes(resumed);
  return program.run(argc, argv, [&] {
    if (config_name.empty() == resume.empty())
      throw io::InputError("flappy-train: what to train is not clear; accepted: a configuration, or --resume RUN");
    io::stop_on_interrupt();
    learn::TrainOptions options;
    options.commit = io::commit();
    options.started = train::started;
    const auto with_threads = [&](std::vector<std::string> list) {
      if (threads > 0) list.push_back("threads=" + std::to_string(threads));
      return list;
    };
    if (!resume.empty()) {
      const learn::TrainConfig config =
          io::read_of_run(resume, [&] { return learn::read_train_config(train::config_of(resume), with_threads({})); });
      options.folder = resume;
      options.from = from.empty() ? learn::newest_checkpoint(resume).path() : fs::path(resume) / from;
      program.write_json(learn::json_of(train::train_one(config, options)));
      return;
    }
    if (!init.empty()) {
      const fs::path file = fs::is_directory(init) ? fs::path(init) / "best.json" : fs::path(init);
      options.init = std::make_shared<policy::Actor>(policy::read_actor(file));
    }
    const fs::path folder = out.empty() ? fs::path("runs") / fs::path(config_name).stem() : fs::path(out);
    if (seeds.empty()) {
      options.folder = folder;
      program.write_json(
          learn::json_of(train::train_one(learn::read_train_config(config_name, with_threads(overrides)), options)));
      return;
    }
    std::vector<learn::SeedCurve> curves;
    train::Json all = train::Json::array();
    const auto folder_of = [&](std::uint64_t seed) { return folder / ("seed_" + std::to_string(seed)); };
    for (const std::uint64_t seed : train::seeds_of(seeds)) learn::refuse_run_in(folder_of(seed));
    for (const std::uint64_t seed : train::seeds_of(seeds)) {
      std::vector<std::string> list = with_threads(overrides);
      list.push_back("seed=" + std::to_string(seed));
      options.folder = folder_of(seed);
      options.started = curves.empty() ? train::started : std::chrono::steady_clock::now();
      const learn::TrainSummary s = train::train_one(learn::read_train_config(config_name, list), options);
      all.push_back(learn::json_of(s));
      if (s.stopped) break;
      curves.push_back(learn::read_seed_curve(options.folder, seed, "success_rate"));
    }
    program.write_json(all);
    if (curves.size() < all.size()) return;
    const learn::LearningCurve curve = learn::learning_curve(curves);
    learn::write_curve_csv(folder / "curve.csv", curve);
    learn::write_curve_svg(folder / "curve.svg", curve, "success_rate");
    std::printf("%s and curve.svg: learning curve of %zu seeds\n", (folder / "curve.csv").c_str(), curves.size());
  });
}
