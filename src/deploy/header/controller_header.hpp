// The estimator and feedback controller of a run as one header in C99 that tests itself.
#pragma once

#include "deploy/header/contract.hpp"
#include "deploy/header/controller_trace.hpp"

namespace flappy::deploy {

/// Why a policy of this task flies without flappy_controller.h; empty: it does not.
std::string no_controller(const rollout::FlyConfig& config);

/// Text of flappy_controller.h: the same bytes for the same arguments. io::InputError where the controller is none that can
/// be exported, there is none, or a period is no whole number of microseconds.
std::string controller_header(const rollout::FlyConfig& config, const policy::RunInfo& run,
                              const ControllerTrace& trace);

}  // namespace flappy::deploy
