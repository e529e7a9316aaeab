// Exports the estimator and feedback controller of a run as one header in C99 that tests itself.
#pragma once

#include "deploy/header/contract.hpp"
#include "deploy/header/controller_trace.hpp"

namespace flappy::deploy {

/// The reason why no flappy_controller.h can be exported for this configuration; empty where it can.
std::string no_controller(const rollout::FlyConfig& config);

/// The text of flappy_controller.h, the same to the byte for the same arguments. io::InputError where it cannot be
/// exported (no_controller()), or for a period that is not a whole number of microseconds.
std::string controller_header(const rollout::FlyConfig& config, const policy::RunInfo& run,
                              const ControllerTrace& trace);

}  // namespace flappy::deploy
