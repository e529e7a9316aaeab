#include "rollout/evaluation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "flight/fleet.hpp"
#include "io/parallel.hpp"
#include "io/toml_writer.hpp"
#include "rollout/recorder.hpp"
#include "rollout/settle.hpp"
#include "sim/storage.hpp"

namespace flappy::rollout {
namespace {

using flight::Fleet;
using flight::kActions;
using flight::Task;
using rollout::FlyConfig;

constexpr double kNever_s = 1e9;

/// Snapshots of each part, once it has hovered; empty until then, and where flights start otherwise.
template <class T>
using Hovers = std::vector<std::vector<flight::Snapshot<T>>>;

/// The controller alone: not even the middle of the action's range is added.
Task without_policy(Task task) {
  task.forbid_actions();
  auto& k = task.constants;
  k.holds_trim = k.hand_back.enabled = 0;
  k.limits.faced_by_s = k.limits.arrived_by_s = kNever_s;
  return task;
}

/// Flights that are flown together.
template <class T>
class Part {
 public:
  Part(const FlyConfig& config, const flight::FleetOptions& options, std::size_t count,
       const std::vector<flight::Snapshot<T>>& hover, const Pilot& pilot, Detail detail)
      : fleet_(count, config.vehicle, options),
        pilot_(pilot),
        outcomes_(count),
        action_repeat_(options.task.action_repeat) {
    for (std::size_t i = 0; i < count; ++i) {
      if (!hover.empty()) {
        fleet_.start(i, 0, hover[i]);
      } else {
        fleet_.set_vehicle(i, vehicle(config, i));
        fleet_.start(i, 0);
      }
    }
    fleet_.set_actor(pilot.actor);
    for (std::size_t i = 0; i < count && detail == Detail::full; ++i) {
      followers_.emplace_back(options.task, fleet_.truth(i), fleet_.target(i));
    }
    drawn_J_.resize(count);
  }

  void step() {
    if (pilot_.policy != nullptr && tick_ % action_repeat_ == 0) act();
    fleet_.step();
    ++tick_;
    if (followers_.empty()) return;
    const double t_s = static_cast<double>(tick_) * fleet_.period_s();
    const flight::Target goal = fleet_.target(0);  // of all, as they started together
    io::parallel_for(followers_.size(), fleet_.batch().storage().threads, [&](std::size_t i) {
      note(i);
      const double drawn_J = fleet_.batch().energy_J(i), more_J = drawn_J - std::exchange(drawn_J_[i], drawn_J);
      if (followers_[i].manoeuvring(t_s)) followers_[i].spend(more_J, fleet_.period_s(), fleet_.handed_back(i));
      followers_[i].see(fleet_.truth(i), goal, t_s, outcomes_[i]);
    });
  }

  void finish(Evaluation& result) {
    for (std::size_t i = 0; i < outcomes_.size(); ++i) {
      note(i);
      outcomes_[i].hash = fleet_.batch().hash(i, i + 1);
      if (!followers_.empty()) followers_[i].finish(outcomes_[i]);
    }
    result.flights.insert(result.flights.end(), outcomes_.begin(), outcomes_.end());
    result.steps += static_cast<double>(fleet_.batch().storage().steps) * static_cast<double>(outcomes_.size());
  }

 private:
  model::Vehicle vehicle(const FlyConfig& config, std::size_t i) const {
    return config.vehicle_of(fleet_.options().first_flapper + static_cast<std::uint32_t>(i));
  }

  /// What the fleet has seen so far; its times are whole ticks, but for their rounding.
  void note(std::size_t i) {
    const auto whole = [&](double t_s) { return std::round(t_s / fleet_.period_s()) * fleet_.period_s(); };
    Outcome& o = outcomes_[i];
    o.captured_s = whole(fleet_.captured_s(i));
    o.lost_s = whole(fleet_.lost_s(i));
    o.status = fleet_.batch().status(i);
    o.ended = fleet_.ended(i);
  }

  /// A policy from elsewhere sees what the task shows and says what is added.
  void act() {
    const auto inputs = static_cast<std::size_t>(pilot_.policy->observations());
    acting_.clear(), observation_.clear();
    for (std::size_t i = 0; i < fleet_.size(); ++i) {
      if (fleet_.handed_back(i)) continue;
      acting_.push_back(i);
      for (const double x : fleet_.observation(i)) observation_.push_back(static_cast<float>(x));
    }
    if (acting_.empty()) return;
    if (observation_.size() != acting_.size() * inputs || pilot_.policy->actions() != kActions)
      throw std::invalid_argument("the policy's observation or action is not that of the task");
    action_.resize(acting_.size() * kActions);
    pilot_.policy->act(acting_.size(), observation_.data(), action_.data());
    for (std::size_t row = 0; row < acting_.size(); ++row) {
      const float* a = &action_[row * kActions];
      fleet_.set_adds(acting_[row], {a[0], a[1], a[2], a[3]});
    }
  }

  Fleet<T> fleet_;
  const Pilot& pilot_;
  std::vector<Outcome> outcomes_;
  std::vector<Follower> followers_;
  std::vector<double> drawn_J_;  // by the motors, until the last tick
  std::vector<std::size_t> acting_;
  std::vector<float> observation_, action_;
  std::int64_t tick_ = 0, action_repeat_;
};

template <class T>
Evaluation fly_all(const FlyConfig& config, const EvaluationOptions& options, Hovers<T>& hovers, const Pilot& pilot,
                   Detail detail, const std::function<bool(double)>& keep_going) {
  const auto start = std::chrono::steady_clock::now();
  const bool alone = !pilot.actor && pilot.policy == nullptr, settled = config.fleet.task.start.settled;
  flight::FleetOptions o = config.fleet;
  if (alone) o.task = without_policy(o.task);
  const int threads = io::thread_count(o.batch.threads);

  const auto ticks = std::max<std::int64_t>(1, std::llround(config.duration_s * o.control_hz));
  const double hover_ticks = settled ? rollout::kHover_s * o.control_hz : 0;
  const std::size_t parts = (options.count + options.part - 1) / options.part;
  hovers.resize(parts);
  double ticks_done = 0;
  const double all_ticks = static_cast<double>(options.count) * (static_cast<double>(ticks) + hover_ticks);

  Evaluation result;
  const auto done = [&](double more) {
    ticks_done += more;
    result.stopped = result.stopped || (keep_going && !keep_going(std::min(1.0, ticks_done / all_ticks)));
  };
  for (std::size_t p = 0; p < parts && !result.stopped; ++p) {
    const std::size_t first = p * options.part, count = std::min(options.part, options.count - first);
    const auto flappers = static_cast<double>(count);
    o.first_flapper = options.first_flapper + static_cast<std::uint32_t>(first);
    // threads that share a few blocks wait for each other more than they fly
    o.batch.threads = static_cast<int>(std::clamp<std::size_t>(count / 64, 1, static_cast<std::size_t>(threads)));
    if (settled && hovers[p].empty()) {
      hovers[p] =
          rollout::settle<T>(o, count, rollout::kHover_s, [&](std::uint32_t i) { return config.vehicle_of(i); });
      result.steps += flappers * rollout::kHover_s / o.batch.step_s;
    }
    done(flappers * hover_ticks);
    if (result.stopped) break;
    Part<T> part(config, o, count, hovers[p], pilot, detail);
    for (std::int64_t tick = 0; tick < ticks && !result.stopped; ++tick) {
      part.step();
      done(flappers);
    }
    if (!result.stopped) part.finish(result);
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

struct Evaluator::Flights {
  FlyConfig config;
  EvaluationOptions options;
  std::tuple<Hovers<float>, Hovers<double>> hovers;  // one of them is used

  template <class T>
  Evaluation fly(const Pilot& pilot, Detail detail, const std::function<bool(double)>& keep_going) {
    return fly_all<T>(config, options, std::get<Hovers<T>>(hovers), pilot, detail, keep_going);
  }
};

Evaluator::Evaluator(FlyConfig config, const EvaluationOptions& options)
    : flights_(new Flights{std::move(config), options, {}}) {
  const FlyConfig& c = flights_->config;
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
}
Evaluator::~Evaluator() = default;
Evaluator::Evaluator(Evaluator&&) noexcept = default;
Evaluator& Evaluator::operator=(Evaluator&&) noexcept = default;

const FlyConfig& Evaluator::config() const { return flights_->config; }

Evaluation Evaluator::fly(const Pilot& pilot, Detail detail, const std::function<bool(double)>& keep_going) {
  return config().precision == "float" ? flights_->fly<float>(pilot, detail, keep_going)
                                       : flights_->fly<double>(pilot, detail, keep_going);
}

FlyConfig nominal(FlyConfig config) {
  config.randomisation.reset();
  flight::StartRange& start = config.fleet.task.start;
  for (auto* list : {&start.position_m, &start.rotation_rad, &start.velocity_m_s, &start.body_rate_rad_s})
    for (flight::Spread& s : *list) s.half = 0;
  return config;
}

}  // namespace flappy::rollout
