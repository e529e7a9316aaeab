// flappy-export: a finished run as TorchScript and as C headers that prove themselves.
#include <cmath>
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

void run(const fs::path& from, const fs::path& out, bool int8, const io::Program& program) {
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
  if (int8) {
    const deploy::PolicyVectors fit = deploy::roll_out(run.fly, 1000, 512);
    const deploy::QuantisedNetwork whole = deploy::quantise(network, fit.observation);
    deploy::PolicyVectors v = vectors;
    v.action = deploy::evaluate(whole, v.observation);
    files["flappy_policy_int8.h"] = deploy::policy_header(run.fly, run.info, whole, v);
    std::printf("%zu rows\n", fit.observation.size() / 29);
    const auto out8 = deploy::evaluate(whole, rollouts.observation);
    double most[4] = {}, sum[4] = {};
    for (std::size_t i = 0; i < out8.size(); ++i) {
      const double d = (double(out8[i]) - double(rollouts.action[i])) / (2 * double(network.half[i % 4]));
      most[i % 4] = std::max(most[i % 4], std::abs(d));
      sum[i % 4] += d * d;
    }
    for (int k = 0; k < 4; ++k)
      std::printf("max %.4f rms %.4f\n", most[k], std::sqrt(sum[k] / double(out8.size() / 4)));
  }
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
  bool int8 = false;
  program.app().add_flag("--int8", int8, "the policy in whole numbers of 8 bits too: flappy_policy_int8.h");
  return program.run(argc, argv, [&] { exports::run(from, out, int8, program); });
}
