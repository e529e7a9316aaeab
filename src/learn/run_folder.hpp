#pragma once

#include <filesystem>

#include "policy/run_info.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::learn {

struct FinishedRun {
  policy::RunInfo info;
  rollout::FlyConfig fly;  ///< resolved configuration, with the run's best actor
};

/// Throws io::InputError, one line, unless `folder` is a finished run whose files are its own and undamaged.
FinishedRun read_finished_run(const std::filesystem::path& folder);

}  // namespace flappy::learn
