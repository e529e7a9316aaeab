#include "escapes.hpp"

#include <cstdio>
#include <memory>
#include <mutex>

#include "blind/escape.hpp"
#include "flight/constants.hpp"
#include "io/parallel.hpp"
#include "io/progress.hpp"
#include "io/toml_writer.hpp"
#include "policy/policy.hpp"
#include "rollout/fly_config.hpp"
#include "rollout/outcome.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A trained actor as it is on disk, or a policy from elsewhere.
ObservationPolicy policy_of(const fs::path& path, const rollout::FlyConfig& config) {
  if (const auto& actor = config.actor) {
    return [actor, task = config.fleet.task.constants](const std::vector<double>& observation) {
      const auto view = policy::view_of(*actor, actor->weights.data(), actor->mean.data(), actor->scale.data());
      double action[flight::kMaxActions];
      policy::evaluate(view, observation.data(), action);
      std::array<double, flight::kMaxActions> adds{};
      for (int i = 0; i < flight::kMaxActions; ++i)
        adds[static_cast<std::size_t>(i)] = flight::scaled_action(task, i, action[i]);
      return adds;
    };
  }
  const std::shared_ptr<const policy::Policy> policy =
      policy::load_policy(path, static_cast<int>(config.fleet.task.observation().size()), flight::kMaxActions);
  const auto one_at_a_time = std::make_shared<std::mutex>();
  return [policy, one_at_a_time, task = config.fleet.task.constants](const std::vector<double>& observation) {
    const std::vector<float> row(observation.begin(), observation.end());
    float action[flight::kMaxActions];
    {
      const std::scoped_lock lock(*one_at_a_time);
      policy->act(1, row.data(), action);
    }
    std::array<double, flight::kMaxActions> adds{};
    for (std::size_t i = 0; i < adds.size(); ++i)
      adds[i] = std::clamp<double>(action[i], task.action_low[i], task.action_high[i]);
    return adds;
  };
}

EscapeRules rules_of(const EscapeOptions& o) {
  const fs::path path = o.policy;
  const std::string kind = path.extension().string();
  io::read_text(path);  // or a complaint that names it
  if (kind != ".json" && kind != ".pt" && kind != ".h")
    throw io::InputError(o.policy + ": is no policy; accepted: an actor (.json), TorchScript (.pt) or a C header (.h)");
  std::vector<std::string> overrides;
  if (kind == ".json") overrides.push_back("actor=" + io::toml_string(fs::absolute(path).string()));
  const rollout::FlyConfig config = rollout::read_fly_config(o.config, overrides);
  const flight::FleetOptions& fleet = config.fleet;
  const bool sees_wings = fleet.task.parts >> static_cast<int>(flight::Part::wings) & 1;
  if (fleet.controller.kind != flight::kind_of<flight::PidController>() || fleet.task.path.size() != 1 || sees_wings ||
      fleet.task.constants.success.by_s <= 0 || std::abs(fleet.control_hz * kControl_s - 1) > 1e-9)
    throw io::InputError(o.config +
                         ": is nothing that this robot can fly; accepted: a PID at 500 Hz, a task with a goal "
                         "that stands still and a success");
  const flight::FlightConstants k = flight::flight_constants(fleet);
  return {fleet.task, k.task, k.controller.of<flight::PidController>(), policy_of(path, config)};
}

rollout::Outcome outcome_of(const Escape& e) {
  rollout::Outcome outcome;
  outcome.captured_s = e.captured_s, outcome.lost_s = e.lost_s;
  outcome.ended = e.ended;
  outcome.status = e.flight.crashed ? std::uint32_t{sim::kFrozen} : 0;
  return outcome;
}

}  // namespace

Json fly_escapes(const EscapeOptions& o) {
  const EscapeRules rules = rules_of(o);
  const Case robot = Robots(o.robot).robot(o.draw);
  if (!o.robot.out.empty()) io::make_folder(o.robot.out);
  std::vector<Escape> escapes(o.count);
  io::ProgressLine progress("escapes");
  io::stop_on_interrupt();
  std::size_t done = 0;
  std::mutex mutex;
  try {
    io::parallel_for(o.count, 0, [&](std::size_t i) {
      if (io::interrupted()) return;
      escapes[i] = escape(robot, i, rules);
      const std::scoped_lock lock(mutex);
      progress.show(static_cast<double>(++done) / static_cast<double>(o.count));
    });
  } catch (const std::exception& e) {  // of the policy
    throw io::InputError(o.policy + ": " + e.what() + "; accepted: a policy for every observation");
  }
  progress.clear();
  if (io::interrupted()) throw io::InputError("stopped: no escape was judged; accepted: all of them");
  std::vector<rollout::Outcome> outcomes;
  std::size_t crashed = 0, out_of_bounds = 0;
  for (std::size_t i = 0; i < o.count; ++i) {
    const Escape& e = escapes[i];
    outcomes.push_back(outcome_of(e));
    crashed += e.flight.crashed;
    out_of_bounds += (e.ended & flight::kOutOfBounds) != 0;
    if (!o.robot.out.empty() && !e.flight.log.mocap.t_s.empty())
      write(e.flight, fs::path(o.robot.out) / ("escape_" + std::to_string(i + 1)), !o.robot.no_truth);
  }
  const rollout::Summary s = rollout::summarise(outcomes);
  std::printf("%zu escapes: success %.1f %% (%.1f to %.1f), captured the goal %.1f %%\n", s.flights,
              100 * s.success.value, 100 * s.success.low, 100 * s.success.high, 100 * s.captured.value);
  if (s.capture_s.median)
    std::printf("  time to capture, 10 / 50 / 90 %%: %.3f %.3f %.3f s\n", *s.capture_s.p10, *s.capture_s.median,
                *s.capture_s.p90);
  std::printf("  out of bounds: %zu; crashed: %zu\n", out_of_bounds, crashed);
  const auto or_null = [](std::optional<double> x) { return x ? Json(*x) : Json(nullptr); };
  return {{"policy", o.policy},
          {"seed", o.robot.seed},
          {"draw", o.draw},
          {"escapes", s.flights},
          {"success_rate", s.success.value},
          {"success_low", s.success.low},
          {"success_high", s.success.high},
          {"captured_rate", s.captured.value},
          {"time_to_capture_p10_s", or_null(s.capture_s.p10)},
          {"time_to_capture_median_s", or_null(s.capture_s.median)},
          {"time_to_capture_p90_s", or_null(s.capture_s.p90)},
          {"out_of_bounds", out_of_bounds},
          {"crashed", crashed}};
}

}  // namespace flappy::blind
