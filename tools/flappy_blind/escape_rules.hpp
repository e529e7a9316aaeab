// Reads the escape that a policy was trained for, in the form in which robots of all families fly it.
#pragma once

#include <filesystem>

#include "lab/blind/a/a_escape.hpp"
#include "lab/blind/family.hpp"
#include "rollout/outcome.hpp"

namespace flappy::blind {

/// `policy_file`: one of policy::kPolicyFiles. `config`: the configuration of flappy-fly that it was trained with. Throws InputError
/// if the policy cannot be read, or a blind robot cannot fly the configuration.
EscapeRules read_escape_rules(const std::filesystem::path& policy_file, const std::filesystem::path& config);

/// Replaces the escape by hover at its goal without a policy, to be judged by the bounds that hold after the escape.
EscapeRules hover_rules(EscapeRules rules);

/// Converts the rules for the interface of all families, which supports hand-back by distance, speeds, attitude and time only, and no
/// termination. Throws InputError, with the name `config`, for other rules.
EscapeAssignment escape_assignment(const EscapeRules& rules, const std::filesystem::path& config);

rollout::Outcome outcome_of(const Escape& escape);

}  // namespace flappy::blind
