#include "training.hpp"

#include <nlohmann/json.hpp>

#include "io/installation.hpp"
#include "io/progress.hpp"
#include "io/run_program.hpp"
#include "learn/trainer.hpp"

namespace flappy {
namespace {

namespace fs = std::filesystem;

/// Runs a program beside this one.
void run(const std::string& name, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), io::beside_program("bin/" + name));
  const io::Finished done = io::run(arguments);
  if (done.exit_code == 0 || io::interrupted()) return;
  throw io::InputError(name + ": " + done.err.substr(0, done.err.find('\n')));
}

}  // namespace

design::Policy trained(const fs::path& folder, const fs::path& config) {
  const fs::path run_folder = folder / "policy", found = folder / "policy.json";
  const auto file = [&](const char* key) {
    return std::string(key) + "=" + fs::absolute(folder / (std::string(key) + ".toml")).string();
  };
  learn::refuse_other_run_in(run_folder, learn::read_train_config(config, {file("vehicle"), file("controller")}),
                             nullptr);
  const bool starts = !fs::exists(run_folder / "run.json");
  const bool goes_on = !starts && learn::unfinished_run_in(run_folder).has_value();
  if (starts || goes_on) fs::remove(found);
  if (starts) run("flappy-train", {config, "--out", run_folder, "--set", file("vehicle"), "--set", file("controller")});
  else if (goes_on) run("flappy-train", {"--resume", run_folder});
  if (!io::interrupted() && !fs::exists(found)) run("flappy-eval", {run_folder, "--no-baselines", "--json", found});
  if (!fs::exists(found)) return {};
  const auto json = nlohmann::ordered_json::parse(io::read_text(found));
  return {json.at("success_rate"), json.at("success_low"), json.at("success_high")};
}

}  // namespace flappy
