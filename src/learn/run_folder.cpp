#include "learn/run_folder.hpp"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "io/refuse.hpp"
#include "io/schema.hpp"
#include "io/sha256.hpp"
#include "learn/train_config.hpp"

namespace flappy::learn {
namespace {

namespace fs = std::filesystem;
using io::refuse;
using Json = nlohmann::ordered_json;

/// Calls `read` with the file's JSON. Turns JSON errors into an io::InputError of one line.
template <class Read>
void read_json(const fs::path& path, const Read& read) {
  try {
    read(Json::parse(io::read_text(path)));
  } catch (const Json::exception& e) {
    refuse(path, "is damaged: " + std::string(e.what()), "the file as flappy-train left it");
  }
}

}  // namespace

FinishedRun read_finished_run(const fs::path& folder) {
  const fs::path start = folder / "run.json", end = folder / "summary.json", actor = folder / "best.json";
  std::error_code ignored;
  if (!fs::is_regular_file(start, ignored) || !fs::is_directory(folder / "config", ignored))
    refuse(folder, "is no run folder", "a folder that flappy-train left");
  FinishedRun run;
  read_json(start, [&](const Json& json) {
    if (const Json& schema = json.at("schema"); schema != 1)
      refuse(start, "schema " + io::other_schema(schema.get<std::int64_t>(), 1, json.value("commit", "")), "schema 1");
    run.info.task = json.at("task").get<std::string>();
    run.info.config_sha256 = json.at("config_sha256").get<std::string>();
    run.info.commit = json.at("commit").get<std::string>();
    // both are written into exported C code, so other characters could break it
    if (!std::ranges::all_of(run.info.config_sha256 + run.info.commit,
                             [](unsigned char c) { return std::isalnum(c) || c == '-'; }))
      refuse(start, "has letters in its hashes that no hash has", "the file as flappy-train left it");
  });
  constexpr std::string_view kDirty = "-dirty";
  run.info.dirty = run.info.commit.ends_with(kDirty);
  if (run.info.dirty) run.info.commit.resize(run.info.commit.size() - kDirty.size());

  const std::string go_on = "a run that is, after flappy-train --resume " + folder.string();
  if (!fs::exists(end, ignored) || !fs::exists(actor, ignored)) refuse(folder, "is not finished", go_on);
  read_json(end, [&](const Json& json) {
    if (json.at("stopped").get<bool>())
      refuse(folder, "is not finished: stopped at update " + json.at("updates").dump(), go_on);
    const std::string sha256 = json.at("policy_sha256").get<std::string>();
    if (io::sha256(io::read_text(actor)) != sha256)
      refuse(actor, "is not the policy of the run",
             "the one with SHA-256 " + sha256 + ", as " + end.string() + " says");
  });

  const auto policy = std::make_shared<const policy::Actor>(policy::read_actor(actor));
  const TrainConfig config =
      io::read_of_run(folder, [&] { return read_train_config(folder / "config" / "train.toml"); });
  if (config.sha256 != run.info.config_sha256)
    refuse(folder / "config", "is not the configuration of the run: SHA-256 " + config.sha256,
           "the one with " + run.info.config_sha256 + ", as " + start.string() + " says");
  run.fly = io::read_of_run(folder, [&] { return rollout::read_fly_config(folder / "config" / "fly.toml"); });
  run.fly.actor = policy;
  if (policy->task != run.info.task || run.fly.fleet.task.name != run.info.task)
    refuse(actor, "is of task " + policy->task, "a policy of the run's task " + run.info.task);
  return run;
}

}  // namespace flappy::learn
