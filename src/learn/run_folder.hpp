// A finished training run, as it lies on disk.
#pragma once

#include <filesystem>

#include "policy/run_info.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::learn {

struct FinishedRun {
  policy::RunInfo info;
  rollout::FlyConfig fly;  ///< with the run's best actor
};

/// io::InputError, one line, where `folder` is no run, the run has not come to its end, or one of its files was changed,
/// damaged or belongs to another run.
FinishedRun read_finished_run(const std::filesystem::path& folder);

}  // namespace flappy::learn
