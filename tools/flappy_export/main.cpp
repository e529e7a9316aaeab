// flappy-export: a finished run as TorchScript and as C headers that prove themselves.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "deploy/policy_header.hpp"
#include "deploy/rollout.hpp"
#include "deploy/torch_script.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "learn/run_folder.hpp"

namespace flappy::exports {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kSelftestVectors = 24, kRolloutFlights = 64;

void write_all(const fs::path& folder, const std::map<std::string, std::string>& files) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw io::InputError(folder.string() + ": cannot be written: " + error.message());
  for (const auto& [name, text] : files) io::write_atomically(folder / name, text);
  io::sync_folder(folder);
}

void run(const fs::path& from, const fs::path& out, const io::Program& program) {
  const learn::FinishedRun run = learn::read_finished_run(from);
  const deploy::PolicyNetwork network = deploy::network_of(run.fly);
  const deploy::PolicyVectors rollouts = deploy::roll_out(run.fly, 0, kRolloutFlights);
  deploy::PolicyVectors vectors = deploy::every_nth(rollouts, network.inputs(), network.outputs(), kSelftestVectors);
  const deploy::PolicyVectors corners = deploy::corners(network, run.fly.fleet.task.observation());
  vectors.observation.insert(vectors.observation.end(), corners.observation.begin(), corners.observation.end());
  vectors.action.insert(vectors.action.end(), corners.action.begin(), corners.action.end());

  std::map<std::string, std::string> files;
  files["flappy_policy.h"] = deploy::policy_header(run.fly, run.info, network, vectors);
  if (deploy::reads_torch_script())
    files["policy.pt"] = deploy::torch_script(network, deploy::contract_text(run.fly, run.info));
  write_all(out, files);
  Json json = {{"run", from.string()}};
  program.write_json(json);
}

}  // namespace
}  // namespace flappy::exports

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-export", "Exports a finished run as TorchScript and as C headers that prove themselves.",
                      {std::string("TorchScript ") + (deploy::reads_torch_script() ? "yes" : "no")});
  std::string from, out;
  program.app().add_option("run", from, "run folder that flappy-train left")->required();
  program.app().add_option("--out", out, "folder for the exported files")->required();
  return program.run(argc, argv, [&] { exports::run(from, out, program); });
}
