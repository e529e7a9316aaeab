#include "rollout/evaluation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "io/parallel.hpp"
#include "io/toml_writer.hpp"
#include "sim/storage.hpp"

namespace flappy::rollout {
namespace {

using flight::Fleet;
using flight::Task;

constexpr double kNever_s = 1e9;

/// Without a policy: no held trim, no hand-back unless to rest, no rules that end flights early.
void leave_alone(Task& task) {
  auto& k = task.constants;
  k.holds_trim = 0;
  if (k.hand_back.rests == 0) k.hand_back.enabled = 0;
  k.limits.faced_by_s = k.limits.arrived_by_s = kNever_s;
}

template <class T>
class Part {
 public:
  Part(FlyConfig config, std::size_t count, const policy::Policy* policy, std::vector<flight::Snapshot<T>>& hover,
       Detail detail)
      : electrical_(!config.vehicle.beat_averaged),
        flights_(std::move(config), count, policy, &hover),
        fleet_(flights_.fleet()),
        outcomes_(count),
        drawn_J_(count) {
    for (std::size_t i = 0; i < count && detail == Detail::full; ++i)
      monitors_.emplace_back(fleet_.options().task, fleet_.truth(i), fleet_.target(i));
  }

  bool over() const { return flights_.over(); }

  void step() {
    flights_.step();
    if (monitors_.empty()) return;
    const double t_s = flights_.t_s();
    const flight::Target goal = fleet_.target(0);  // the same for all, because they started together
    flights_.each([&](std::size_t i) {
      note(i);
      const double drawn_J = electrical_ ? fleet_.batch().energy_J(i) : std::numeric_limits<double>::quiet_NaN(),
                   more_J = drawn_J - std::exchange(drawn_J_[i], drawn_J);
      if (monitors_[i].manoeuvring(t_s)) monitors_[i].spend(more_J, fleet_.period_s(), fleet_.handed_back(i));
      monitors_[i].see(fleet_.truth(i), goal, t_s, outcomes_[i]);
    });
  }

  void finish(Evaluation& result) {
    for (std::size_t i = 0; i < outcomes_.size(); ++i) {
      note(i);
      outcomes_[i].hash = fleet_.batch().hash(i, i + 1);
      if (!monitors_.empty()) monitors_[i].finish(outcomes_[i]);
    }
    result.flights.insert(result.flights.end(), outcomes_.begin(), outcomes_.end());
    result.steps += flights_.physics_steps();
  }

 private:
  /// Copies the fleet's records of flight `i`. Its times are rounded to whole ticks, to undo the rounding to type T.
  void note(std::size_t i) {
    const auto whole = [&](double t_s) { return std::round(t_s / fleet_.period_s()) * fleet_.period_s(); };
    Outcome& o = outcomes_[i];
    o.captured_s = whole(fleet_.captured_s(i));
    o.lost_s = whole(fleet_.lost_s(i));
    o.status = fleet_.events(i);
    o.ended = fleet_.ended(i);
  }

  bool electrical_;  // whether energy is modelled: not for beat-averaged vehicles
  Rollout<T> flights_;
  Fleet<T>& fleet_;
  std::vector<Outcome> outcomes_;
  std::vector<OutcomeMonitor> monitors_;
  std::vector<double> drawn_J_;  // energy of each flight up to the last tick
};

/// Gathers the outcomes of all ranks; `stopped` if any rank stopped.
void share(io::Ranks& ranks, Evaluation& e) {
  const auto gather = [&](const auto& list) { return ranks.gather(std::as_bytes(std::span(list))); };
  const double own[] = {e.stopped ? 1.0 : 0.0, e.steps};
  std::vector<Outcome> all;
  for (const std::vector<std::byte>& of_rank : gather(e.flights)) {
    const auto* flights = reinterpret_cast<const Outcome*>(of_rank.data());
    all.insert(all.end(), flights, flights + of_rank.size() / sizeof(Outcome));
  }
  e.flights = std::move(all);
  e.steps = 0;
  for (const std::vector<std::byte>& of_rank : gather(own)) {
    const auto* figures = reinterpret_cast<const double*>(of_rank.data());
    e.stopped |= figures[0] > 0;
    e.steps += figures[1];
  }
}

template <class T>
Evaluation fly_all(FlyConfig config, const EvaluationOptions& options, Hovers<T>& hovers, const Agent& agent,
                   Detail detail, const std::function<bool(double)>& keep_going) {
  const auto start = std::chrono::steady_clock::now();
  if (!agent.actor && agent.policy == nullptr) leave_alone(config.fleet.task);
  config.fleet.batch.meters_energy = true;
  config.actor = agent.actor;
  const double hover_s = config.fleet.task.start.settled ? kHover_s : 0;
  const double hover_ticks = hover_s * config.fleet.control_hz;
  hovers.resize((options.count + options.part - 1) / options.part);
  Progress progress{
      keep_going, static_cast<double>(options.count) * (static_cast<double>(Rollout<T>::ticks(config)) + hover_ticks)};
  Evaluation result;
  for (std::size_t p = 0; p < hovers.size() && !result.stopped; ++p) {
    const std::size_t first = p * options.part, count = std::min(options.part, options.count - first);
    const auto flappers = static_cast<double>(count);
    config.fleet.first_flapper = options.first_flapper + static_cast<std::uint32_t>(first);
    if (hovers[p].empty()) result.steps += flappers * hover_s / config.fleet.batch.step_s;
    Part<T> part(config, count, agent.policy, hovers[p], detail);
    result.stopped = !progress.add(flappers * hover_ticks);
    io::together(config.fleet.batch.threads, [&] {
      while (!part.over() && !result.stopped) {
        part.step();
        result.stopped = !progress.add(flappers);
      }
    });
    if (!result.stopped) part.finish(result);
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

Evaluator::Evaluator(FlyConfig config, const EvaluationOptions& options)
    : config_(std::move(config)), options_(options) {
  const FlyConfig& c = config_;
  const Task& task = c.fleet.task;
  const flight::Success<double>& k = task.constants.success;
  const auto refuse = [&](const std::string& what, const std::string& accepted) {
    throw io::InputError("task " + io::toml_string(task.name) + " " + what + "; accepted: " + accepted);
  };
  if (c.welded) refuse("would be flown on a stand", "flight.support = \"task\"");
  if (c.excitation.acts())
    refuse("would be flown without its excitation, which flappy-fly alone adds", "a configuration without");
  if (!(k.by_s > 0)) refuse("does not say what a success is", "a task with [success.capture] and [success.keep]");
  const double needs_s = std::max(k.by_s, k.keep_until_s);
  if (c.duration_s < needs_s - 1e-9)
    refuse("is judged until " + io::shortest_digits(needs_s) + " s, but flown for " + io::shortest_digits(c.duration_s),
           "flight.duration_s of " + io::shortest_digits(needs_s) + " or more");
  const auto [first, last] = io::own_share(options_.ranks, options_.count);
  options_.count = last - first;
  options_.first_flapper += static_cast<std::uint32_t>(first);
}

Evaluation Evaluator::fly(const Agent& agent, Detail detail, const std::function<bool(double done)>& keep_going) {
  Evaluation e = config_.precision == "float" ? fly_all(config_, options_, float_hovers_, agent, detail, keep_going)
                                              : fly_all(config_, options_, double_hovers_, agent, detail, keep_going);
  if (options_.ranks != nullptr) share(*options_.ranks, e);
  return e;
}

FlyConfig nominal(FlyConfig config) {
  config.draw_no_vehicles();
  flight::StartRange& start = config.fleet.task.start;
  for (auto* list : {&start.position_m, &start.rotation_rad, &start.velocity_m_s, &start.body_rate_rad_s})
    for (flight::Spread& s : *list) s.half = 0;
  return config;
}

}  // namespace flappy::rollout
