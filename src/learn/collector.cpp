#include "learn/collector.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>
#include <utility>

#include "rollout/rollout.hpp"

namespace flappy::learn {
namespace {

rollout::FlyConfig of_training(const TrainConfig& config) {
  rollout::FlyConfig fly = config.fly;
  fly.fleet.seed = config.seed;
  fly.fleet.first_flapper = 0;
  fly.fleet.batch.threads = config.threads;
  return fly;
}

}  // namespace

Collector::Collector(const TrainConfig& config, io::Ranks* ranks)
    : config_(config),
      ranks_(ranks),
      fly_(of_training(config)),
      fleet_(config.flappers, fly_.roomy_vehicle(), fly_.fleet),
      inputs_(fly_.fleet.task.observation().size()),
      outputs_(static_cast<std::size_t>(fly_.fleet.task.actions())),
      kept_(config.return_steps),
      paid_ticks_(static_cast<std::uint32_t>(
          std::ceil(fly_.fleet.task.constants.reward.until_s * fly_.fleet.control_hz - 1e-6))),
      pending_(config.flappers),
      observations_(config.flappers * kept_ * inputs_),
      actions_(config.flappers * kept_ * outputs_),
      rewards_(config.flappers * kept_),
      staged_(fleet_.blocks()),
      seconds_(fleet_.blocks()) {
  std::tie(first_item_, last_item_) = io::own_share(ranks_, fleet_.blocks());
  if (fly_.fleet.task.start.settled)
    pool_ = rollout::settle<float>(fly_.fleet, config.vehicles, rollout::kHover_s,
                                   [&](std::uint32_t flapper) { return fly_.vehicle_of(flapper); });
  fleet_.set_exploration(config.exploration);
  for (std::size_t i = 0; i < fleet_.size(); ++i) start(i);
}

/// Starts the next episode: from a random snapshot of pool_, or with the episode's vehicle if there is no pool.
void Collector::start(std::size_t i) {
  Pending& p = pending_[i];
  ++p.episode;
  const sim::RandomKey key{config_.seed, static_cast<std::uint32_t>(i), p.episode, sim::Stream::snapshot};
  const auto place = sim::uniform_pair(key, 0).first * static_cast<double>(pool_.size());
  rollout::Rollout<float>::start(fleet_, fly_, i, p.episode,
                                 pool_.empty() ? nullptr : &pool_[static_cast<std::size_t>(place)]);
  p.count = 0;
  p.waits = 0;
  p.episode_return = 0;
  fleet_.observation(i, observation(i, 0));
}

void Collector::begin(const std::shared_ptr<const policy::Actor>& actor) {
  fleet_.set_actor(actor);
  fleet_.begin(static_cast<int>(fly_.fleet.task.action_repeat));
}

void Collector::run(std::size_t k) {
  const std::size_t item = first_item_ + k;
  const auto from = std::chrono::steady_clock::now();
  fleet_.fly_block(item);
  staged_[item].clear();
  const auto [first, last] = fleet_.flappers(item);
  for (std::size_t i = first; i < last; ++i) gather(i, item);
  seconds_[item] += std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
}

/// Records the result of a flapper's last action; emits transitions and starts the next episode where due.
void Collector::gather(std::size_t i, std::size_t item) {
  Pending& p = pending_[i];
  const float reward = static_cast<float>(config_.reward_scale) * fleet_.action_reward(i);
  p.episode_return += reward;
  if (p.waits == 0) {
    const auto action = fleet_.action(i);
    std::copy_n(action.begin(), outputs_, &actions_[(i * kept_ + p.count) * outputs_]);
    rewards_[i * kept_ + p.count] = reward;
    ++p.count;
  } else {
    rewards_[i * kept_ + p.count - 1] += reward;  // after the hand-back, rewards go to the last action
  }

  float next[flight::kMaxHistory * flight::kMaxObservation];
  fleet_.observation(i, next);
  const std::uint32_t ended = fleet_.ended(i);
  const bool handed_back = fleet_.handed_back(i);
  const bool terminated = handed_back || (ended & ~std::uint32_t{flight::kTimeOut}) != 0;
  p.waits = handed_back && ended == 0 && fleet_.tick(i) < paid_ticks_;
  if (p.waits != 0) return;
  if (terminated || ended != 0) {
    while (p.count > 0) emit(i, item, next, terminated);
    ++p.episodes;
    p.sums.episodes += 1;
    p.sums.returns += p.episode_return;
    p.sums.captured += fleet_.captured_s(i) > 0;
    p.sums.handed_back += handed_back;
    p.sums.terminated += terminated && !handed_back;
    start(i);
    return;
  }
  if (p.count == kept_) emit(i, item, next, false);
  std::copy_n(next, inputs_, observation(i, p.count));
}

/// Emits the transition of the oldest of n pending actions: its return, sum over k < n of discount^k r_k, and the
/// weight of the present observation's value: discount^n, 0 if the episode terminated.
void Collector::emit(std::size_t i, std::size_t item, const float* next, bool terminated) {
  Pending& p = pending_[i];
  const auto discount = static_cast<float>(config_.discount);
  float* action = &actions_[i * kept_ * outputs_];
  float* reward = &rewards_[i * kept_];
  float n_step_return = 0, weight = 1;
  for (std::uint32_t k = 0; k < p.count; ++k) {
    n_step_return += weight * reward[k];
    weight *= discount;
  }
  std::vector<float>& to = staged_[item];
  to.insert(to.end(), observation(i, 0), observation(i, 1));
  to.insert(to.end(), action, action + outputs_);
  to.push_back(n_step_return);
  to.push_back(terminated ? 0 : weight);
  to.insert(to.end(), next, next + inputs_);
  --p.count;
  std::copy_n(observation(i, 1), p.count * inputs_, observation(i, 0));
  std::copy_n(action + outputs_, p.count * outputs_, action);
  std::copy_n(reward + 1, p.count, reward);
}

bool Collector::end(Replay& replay, bool wants_end) {
  fleet_.end();
  if (fly_.watch) rollout::show(*fly_.watch, fleet_);
  const TransitionLayout& at = replay.layout();
  const auto add = [&](std::span<const float> rows) {
    for (const float* row = rows.data(); row != rows.data() + rows.size(); row += at.row)
      replay.add({row + at.observation, row + at.action, row + at.next_observation, row[at.reward], row[at.discount]});
  };
  if (ranks_ == nullptr) {
    for (const std::vector<float>& rows : staged_) add(rows);
    return wants_end;
  }
  std::vector<float> mine = {wants_end ? 1.0F : 0.0F};
  for (std::size_t item = first_item_; item < last_item_; ++item)
    mine.insert(mine.end(), staged_[item].begin(), staged_[item].end());
  bool ends = false;
  for (const std::vector<std::byte>& bytes : ranks_->gather(std::as_bytes(std::span(mine)))) {
    const std::span all(reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float));
    ends |= all[0] > 0;
    add(all.subspan(1));
  }
  return ends;
}

void Collector::share() {
  if (ranks_ == nullptr) return;
  for (const std::span<std::byte> bytes : fleet_.memory())
    ranks_->share(bytes.data(), fleet_.blocks(), bytes.size() / fleet_.blocks());
  // lists by flapper: the last block may have fewer flappers, so shares are computed from flappers
  const auto of_flappers = [&](auto& list) {
    const std::size_t each = list.size() / fleet_.size() * sizeof list[0],
                      first = fleet_.flappers(first_item_).first * each;
    const std::size_t last = last_item_ > first_item_ ? fleet_.flappers(last_item_ - 1).second * each : first;
    auto* const bytes = reinterpret_cast<std::byte*>(list.data());
    std::size_t at = 0;
    for (const std::vector<std::byte>& part : ranks_->gather({bytes + first, bytes + last})) {
      std::ranges::copy(part, bytes + at);
      at += part.size();
    }
  };
  of_flappers(pending_);
  of_flappers(observations_);
  of_flappers(actions_);
  of_flappers(rewards_);
}

EpisodeSums Collector::take_sums() {
  EpisodeSums all;
  for (Pending& p : pending_) {
    const EpisodeSums s = std::exchange(p.sums, {});
    all.episodes += s.episodes, all.returns += s.returns, all.captured += s.captured;
    all.handed_back += s.handed_back, all.terminated += s.terminated;
  }
  return all;
}

std::uint64_t Collector::episodes() const {
  std::uint64_t sum = 0;
  for (const Pending& p : pending_) sum += p.episodes;
  return sum;
}

std::uint64_t Collector::env_steps() const { return static_cast<std::uint64_t>(fleet_.periods()) * fleet_.size(); }

double Collector::seconds() const {
  double sum = 0;
  for (const double s : seconds_) sum += s;
  return sum;
}

void Collector::save(CheckpointWriter& to) {
  std::size_t k = 0;
  for (const std::span<std::byte> bytes : fleet_.memory()) to.put_bytes("fleet_" + std::to_string(k++), bytes);
  to.put("periods", fleet_.periods());
  to.put_bytes("pending", std::as_bytes(std::span(pending_)));
  to.put("pending_observations", observations_);
  to.put("pending_actions", actions_);
  to.put("pending_gains", rewards_);
}

void Collector::restore(const Checkpoint& from) {
  std::size_t k = 0;
  for (const std::span<std::byte> bytes : fleet_.memory()) from.get_bytes("fleet_" + std::to_string(k++), bytes);
  std::int64_t periods = 0;
  from.get("periods", periods);
  fleet_.restored(periods);
  from.get_bytes("pending", std::as_writable_bytes(std::span(pending_)));
  from.get("pending_observations", observations_);
  from.get("pending_actions", actions_);
  from.get("pending_gains", rewards_);
}

}  // namespace flappy::learn
