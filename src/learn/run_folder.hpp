// A finished training run, as it lies on disk.
#pragma once

#include <filesystem>

#include "deploy/run_info.hpp"
#include "flight/fly_config.hpp"

namespace flappy::learn {

struct FinishedRun {
  deploy::RunInfo info;
  flight::FlyConfig fly;  ///< with the run's best actor
};

/// io::InputError, one line, where `folder` is no run, the run has not come to its end, or one of its files was changed,
/// damaged or belongs to another run.
FinishedRun read_finished_run(const std::filesystem::path& folder);

}  // namespace flappy::learn
