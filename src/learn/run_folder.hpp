// Reading of a finished training run from its folder.
#pragma once

#include <filesystem>

#include "policy/run_info.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::learn {

struct FinishedRun {
  policy::RunInfo info;
  rollout::FlyConfig fly;  ///< resolved configuration, with the run's best actor
};

/// Throws io::InputError, one line, if `folder` is not a run, the run is not finished, or one of its files is changed,
/// damaged or from another run.
FinishedRun read_finished_run(const std::filesystem::path& folder);

}  // namespace flappy::learn
