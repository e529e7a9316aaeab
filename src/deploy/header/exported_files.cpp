#include "deploy/header/exported_files.hpp"

#include "deploy/header/controller_header.hpp"
#include "deploy/header/policy_header.hpp"

namespace flappy::deploy {

std::map<std::string, std::string> exported_files(const rollout::FlyConfig& config, const policy::RunInfo& run,
                                                  const policy::PolicyNetwork& network, policy::PolicyVectors tests) {
  tests.action = evaluate(network, tests.observation);
  std::map<std::string, std::string> files = {{"flappy_policy.h", policy_header(config, run, network, tests)}};
  ExportedCrc crc{crc_of_header(files["flappy_policy.h"]), {}};
  const bool with_controller = no_controller(config).empty();
  if (with_controller) {
    const std::string& header = files["flappy_controller.h"] =
        controller_header(config, run, record_controller(config));
    crc.controller = crc_of_header(header);
  }
  files["contract.json"] = contract_json(config, run, network, tests, crc);
  files["README.md"] = wiring_text(config, run, with_controller);
  return files;
}

std::map<std::string, std::string> exported_files(const rollout::FlyConfig& config, const policy::RunInfo& run) {
  const policy::PolicyNetwork network = network_of(config);
  return exported_files(config, run, network, corners(network, config.fleet.task.observation()));
}

}  // namespace flappy::deploy
