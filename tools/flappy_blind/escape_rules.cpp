#include "escape_rules.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

#include "flight/constants.hpp"
#include "io/files.hpp"
#include "io/toml_writer.hpp"
#include "policy/policy.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;

/// A trained actor evaluated from its weights, or a policy in TorchScript or a C header. Each copy of what it returns has a
/// memory of its own.
ObservationPolicy policy_of(const fs::path& path, const rollout::FlyConfig& config) {
  if (const auto& actor = config.actor) {
    const auto units = static_cast<std::size_t>(actor->recurrent ? actor->widths[1] : 0);
    return [actor, task = config.fleet.task.constants,
            memory = std::vector<double>(units, 0)](const std::vector<double>& observation) mutable {
      const auto view = policy::view_of(*actor, actor->weights.data(), actor->mean.data(), actor->scale.data());
      double action[flight::kMaxActions];
      policy::evaluate(view, observation.data(), action, memory.data());
      std::array<double, flight::kMaxActions> adds{};
      for (int i = 0; i < flight::kMaxActions; ++i)
        adds[static_cast<std::size_t>(i)] = flight::scaled_action(task, i, action[i]);
      return adds;
    };
  }
  const std::shared_ptr<const policy::Policy> policy =
      policy::load_policy(path, static_cast<int>(config.fleet.task.observation().size()), flight::kMaxActions);
  const auto one_at_a_time = std::make_shared<std::mutex>();
  return [policy, one_at_a_time, task = config.fleet.task.constants,
          memory = std::vector<float>(static_cast<std::size_t>(policy->memory()), 0)](
             const std::vector<double>& observation) mutable {
    std::vector<float> row(observation.begin(), observation.end());
    row.insert(row.end(), memory.begin(), memory.end());
    std::vector<float> action(flight::kMaxActions + memory.size());
    {
      const std::scoped_lock lock(*one_at_a_time);
      policy->act(1, row.data(), action.data());
    }
    std::copy(action.begin() + flight::kMaxActions, action.end(), memory.begin());
    std::array<double, flight::kMaxActions> adds{};
    for (std::size_t i = 0; i < adds.size(); ++i)
      adds[i] = std::clamp<double>(action[i], task.action_low[i], task.action_high[i]);
    return adds;
  };
}

/// Bound in m, m/s and rad/s that no robot exceeds.
constexpr double kUnbounded = 1e3;

/// Angle of a limit given by its cosine; -2, no limit, becomes pi, which no angle exceeds.
double angle(double cosine) { return std::acos(std::max(-1.0, cosine)); }

}  // namespace

EscapeRules read_escape_rules(const fs::path& policy_file, const fs::path& config_file) {
  const std::string kind = policy_file.extension().string();
  io::read_text(policy_file);  // throws an error with the file's name
  if (kind != ".json" && !policy::is_policy_file(policy_file))
    throw io::InputError(policy_file.string() + ": is no policy; accepted: " + policy::kPolicyFiles);
  std::vector<std::string> overrides;
  if (kind == ".json") overrides.push_back("actor=" + io::toml_string(fs::absolute(policy_file).string()));
  rollout::FlyConfig config = rollout::read_fly_config(config_file, overrides);
  if (config.fleet.task.action_late_drawn) config.fleet.task.action_late_most = 0;  // they act at once
  const flight::FleetOptions& fleet = config.fleet;
  const bool sees_wings = fleet.task.parts >> static_cast<int>(flight::Part::wings) & 1;
  if (fleet.controller.kind != flight::kind_of<flight::PidController>() || fleet.task.path.size() != 1 || sees_wings ||
      fleet.task.constants.success.by_s <= 0 || std::abs(fleet.control_hz * kControl_s - 1) > 1e-9)
    throw io::InputError(config_file.string() +
                         ": is nothing that this robot can fly; accepted: a PID at 500 Hz, a task with a goal "
                         "that stands still and a success");
  const flight::FlightConstants k = flight::flight_constants(fleet);
  return {fleet.task, k.task, k.controller.of<flight::PidController>(), policy_of(policy_file, config)};
}

EscapeRules hover_rules(EscapeRules r) {
  flight::StartRange& start = r.task.start;
  for (flight::Spread& s : start.position_m) s = {};
  for (flight::Spread& s : start.rotation_rad) s = {};
  start.x_low_m = -kUnbounded, start.x_high_m = kUnbounded;
  r.policy = [](const std::vector<double>&) { return std::array<double, flight::kMaxActions>{}; };
  r.constants.hand_back.at_s = kControl_s;
  flight::Success<double>& s = r.constants.success;
  s.distance_m = s.keep_distance_m, s.speed_m_s = s.body_rate_rad_s = kUnbounded;
  s.tilt_cos = s.keep_tilt_cos, s.heading_cos = s.keep_heading_cos;
  return r;
}

EscapeAssignment escape_assignment(const EscapeRules& r, const fs::path& config) {
  const auto require = [&](bool holds, const char* accepted) {
    if (!holds)
      throw io::InputError(config.string() +
                           ": is nothing that robots of families b and c can fly; accepted: " + accepted);
  };
  const flight::HandBack<double>& back = r.constants.hand_back;
  require(r.task.history == 1, "a task without history");
  require(r.task.action_late_most == 0, "a task without action.jitter_s");
  require(r.constants.holds_trim > 0, "a task of base = \"trim\"");
  require(back.enabled > 0 && back.on_estimate > 0, "a hand-back with on = \"estimate\"");
  require(back.x_m < -kUnbounded && back.speed_x_m_s > kUnbounded, "a hand-back without x_m and speed_x_m_s");
  EscapeAssignment a;
  for (const auto& [name, signals] : r.task.observed_parts()) a.observation.push_back(name);
  a.policy = r.policy;
  a.action_period_s = r.task.action_repeat * kControl_s;
  const flight::StartRange& start = r.task.start;
  for (std::size_t i = 0; i < 3; ++i)
    a.start_m[i] = start.position_m[i].centre, a.start_half_m[i] = start.position_m[i].half;
  a.heading_rad = start.rotation_rad[2].centre, a.heading_half_rad = start.rotation_rad[2].half;
  a.x_low_m = start.x_low_m, a.x_high_m = start.x_high_m;
  const flight::HandBack<double>& h = r.constants.hand_back;
  a.hand_back = {h.distance_m, h.speed_m_s, h.body_rate_rad_s, angle(h.tilt_cos), angle(h.heading_cos)};
  a.hand_back_at_s = h.at_s;
  const flight::Success<double>& s = r.constants.success;
  a.capture = {s.distance_m, s.speed_m_s, s.body_rate_rad_s, angle(s.tilt_cos), angle(s.heading_cos)};
  a.capture_by_s = s.by_s;
  a.keep = {s.keep_distance_m, 0, 0, angle(s.keep_tilt_cos), angle(s.keep_heading_cos)};
  a.keep_from_s = s.keep_from_s, a.keep_until_s = s.keep_until_s;
  return a;
}

rollout::Outcome outcome_of(const Escape& escape) {
  rollout::Outcome outcome;
  outcome.captured_s = escape.captured_s, outcome.lost_s = escape.lost_s;
  outcome.ended = escape.ended;
  outcome.status = escape.flight.crashed ? std::uint32_t{sim::kFrozen} : 0;
  return outcome;
}

}  // namespace flappy::blind
