// The escape that a policy was trained for, as robots of all families fly it.
#pragma once

#include <filesystem>

#include "blind/a/escape.hpp"
#include "blind/family.hpp"
#include "rollout/outcome.hpp"

namespace flappy::blind {

/// Of a policy (an actor, TorchScript or a C header) and the configuration of flappy-fly that it was trained with. InputError where
/// there is no such policy, or the configuration is nothing that a blind robot can fly.
EscapeRules read_escape_rules(const std::filesystem::path& policy, const std::filesystem::path& config);

/// In place of the escape, hover at its goal without a policy, as good as it has to be after the escape.
EscapeRules hover_rules(EscapeRules rules);

/// The same for robots of a family. They know no other hand-back than by distance, speeds, attitude and time, and no end.
EscapeAssignment escape_assignment(const EscapeRules& rules);

rollout::Outcome outcome_of(const Escape& escape);

}  // namespace flappy::blind
