#include "rollout/rollout.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

namespace flappy::rollout {
namespace {

flight::FleetOptions options_of(const FlyConfig& config, std::size_t count, bool has_policy) {
  flight::FleetOptions o = config.fleet;
  if (!config.actor && !has_policy) o.task.forbid_actions();
  // few blocks on many threads: waiting would take longer than flying
  const auto most = static_cast<std::size_t>(io::thread_count(o.batch.threads));
  o.batch.threads = static_cast<int>(std::clamp<std::size_t>(count / 64, 1, most));
  return o;
}

}  // namespace

template <class T>
Rollout<T>::Rollout(FlyConfig config, std::size_t count, const policy::Policy* policy, Hover* hover)
    : config_(std::move(config)),
      fleet_(count, config_.vehicle, options_of(config_, count, policy != nullptr)),
      policy_(policy),
      memory_(policy == nullptr ? 0 : count * static_cast<std::size_t>(policy->memory()), 0) {
  Hover own;
  if (hover == nullptr) hover = &own;
  const bool settled = config_.fleet.task.start.settled;
  if (settled && hover->empty())
    *hover = settle<T>(fleet_.options(), count, kHover_s,
                       [&](std::uint32_t flapper) { return config_.vehicle_of(flapper); });
  for (std::size_t i = 0; i < count; ++i) start(fleet_, config_, i, 0, settled ? &(*hover)[i] : nullptr);
  fleet_.set_actor(config_.actor);
}

template <class T>
void Rollout<T>::start(flight::Fleet<T>& fleet, const FlyConfig& config, std::size_t i, std::uint32_t episode,
                       const flight::Snapshot<T>* hover) {
  if (hover != nullptr) return fleet.start(i, episode, *hover);
  const sim::RandomKey key{fleet.options().seed, fleet.options().first_flapper + static_cast<std::uint32_t>(i),
                           episode};
  if (config.draws_vehicles() || config.changes.any() || !config.added_effects.empty())
    fleet.set_vehicle(i, config.vehicle_of(key.flapper, episode));
  const flight::Task& task = fleet.options().task;
  fleet.start(i, episode, task.sample_start(key), config.welded ? sim::Start::welded : task.start.kind);
}

template <class T>
model::Vehicle Rollout<T>::vehicle(std::size_t i) const {
  return config_.vehicle_of(config_.fleet.first_flapper + static_cast<std::uint32_t>(i));
}

template <class T>
void Rollout<T>::record() {
  for (std::size_t i = 0; i < fleet_.size(); ++i) recorders_.emplace_back(config_, fleet_, i, vehicle(i));
  fleet_.record(true);
}

template <class T>
void Rollout<T>::step() {
  if (tick_ == 0 || config_.excitation.changes()) {
    const sim::Input input = config_.excitation.at(t_s());
    for (std::size_t i = 0; i < fleet_.size(); ++i) fleet_.set_added(i, input);
  }
  if (policy_ != nullptr && tick_ % config_.fleet.task.action_repeat == 0) act();
  fleet_.step();
  ++tick_;
  if (config_.watch) show(*config_.watch, fleet_);
  if (!recorders_.empty()) each([&](std::size_t i) { recorders_[i].record(); });
}

template <class T>
void Rollout<T>::act() {
  std::vector<std::size_t> acting;
  std::vector<float> observation;
  const auto units = static_cast<std::size_t>(policy_->memory());
  for (std::size_t i = 0; i < fleet_.size(); ++i) {
    if (fleet_.handed_back(i)) continue;
    acting.push_back(i);
    for (const double x : fleet_.observation(i)) observation.push_back(static_cast<float>(x));
    const float* const memory = memory_.data() + i * units;
    observation.insert(observation.end(), memory, memory + units);
  }
  if (acting.empty()) return;
  if (observation.size() != acting.size() * (static_cast<std::size_t>(policy_->observations()) + units) ||
      policy_->actions() != config_.fleet.task.actions())
    throw std::invalid_argument("the policy's observation or action is not that of the task");
  const auto actions = static_cast<std::size_t>(policy_->actions()), outputs = actions + units;
  std::vector<float> action(acting.size() * outputs);
  policy_->act(acting.size(), observation.data(), action.data());
  for (std::size_t row = 0; row < acting.size(); ++row) {
    const float* const from = action.data() + row * outputs;
    fleet_.set_adds(acting[row], std::vector<double>(from, from + actions));
    std::copy_n(from + actions, units, memory_.data() + acting[row] * units);
  }
}

template <class T>
std::int64_t Rollout<T>::ticks(const FlyConfig& config) {
  return std::max<std::int64_t>(1, std::llround(config.duration_s * config.fleet.control_hz));
}

template <class T>
double Rollout<T>::physics_steps() const {
  const flight::FleetOptions& o = fleet_.options();
  return static_cast<double>(tick_) * std::round(fleet_.period_s() / o.batch.step_s) *
         static_cast<double>(fleet_.size());
}

template class Rollout<float>;
template class Rollout<double>;

}  // namespace flappy::rollout
