#include "rollout/environments.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "io/parallel.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"

namespace flappy::rollout {
namespace {

/// Vehicles flown to hover, from which episodes after the first start.
constexpr std::uint32_t kSettledVehicles = 256;
/// Observations are clamped to this multiple of a flying vehicle's range, so that only a lost vehicle is clamped.
constexpr double kObservationRoom = 10;
constexpr std::size_t kMaxLanes = 64;

FlyConfig checked(FlyConfig config) {
  if (config.excitation.changes())
    throw io::InputError(
        "excitation: belongs to flights and not to environments, whose actions take its place; accepted: none");
  config.actor = nullptr;
  return config;
}

}  // namespace

Environments::Environments(const FlyConfig& config, const EnvironmentOptions& options)
    : options_(options),
      observed_(config.fleet.task.observation()),
      actions_(config.fleet.task.action()),
      step_s_(config.fleet.task.action_repeat / config.fleet.control_hz),
      ended_(std::make_unique<bool[]>(options.count)),
      episodes_(options.count),
      final_observation_(options.count * observed_.size()) {
  for (flight::Signal& s : observed_) {
    const double most = kObservationRoom * std::max(std::abs(s.low), std::abs(s.high));
    s.low = -most, s.high = most;
  }
}

Environments::Environments(const Environments& other)
    : options_(other.options_),
      observed_(other.observed_),
      actions_(other.actions_),
      step_s_(other.step_s_),
      ended_(std::make_unique<bool[]>(other.count())),
      episodes_(other.episodes_),
      final_observation_(other.final_observation_) {
  std::ranges::copy(other.ended(), ended_.get());
}

namespace {

template <class T>
class EnvironmentsOf final : public Environments {
 public:
  EnvironmentsOf(FlyConfig config, const EnvironmentOptions& options)
      : Environments(config, options),
        config_(checked(std::move(config))),
        paid_ticks_(static_cast<std::uint32_t>(
            std::ceil(config_.fleet.task.constants.reward.until_s * config_.fleet.control_hz - 1e-6))),
        lives_(options.count) {
    for (const flight::Signal& s : observed_) bounds_.push_back(static_cast<T>(s.high));
    prepare();
  }

  std::unique_ptr<Environments> copy() const override {
    auto twin = std::make_unique<EnvironmentsOf>(*this);
    twin->config_.watch = nullptr;
    return twin;
  }

  const FlyConfig& config() const override { return config_; }

  void reset(std::optional<std::uint64_t> seed, float* observation) override {
    if (seed && *seed != config_.fleet.seed) {
      config_.fleet.seed = *seed;
      prepare();
    }
    fleet_->restored(0);
    io::parallel_for(fleet_->blocks(), fleet_->options().batch.threads, [&](std::size_t block) {
      const auto [first, last] = fleet_->flappers(block);  // they share the block's set of effects
      for (std::size_t i = first; i < last; ++i) {
        lives_[i].episode = seed ? 0 : lives_[i].episode + 1;
        start(i);
        observe(i, observation + i * observed_.size());
      }
    });
    std::fill_n(ended_.get(), count(), false);
  }

  void reset(std::span<const bool> which, float* observation) override {
    for (std::size_t i = 0; i < count(); ++i) {
      if (!which[i]) continue;
      ++lives_[i].episode;
      start(i);
      observe(i, observation + i * observed_.size());
    }
  }

  std::size_t step(const float* action, const Transitions& to) override {
    const std::size_t actions = actions_.size();
    std::atomic<std::size_t> ended = 0;
    fleet_->begin(static_cast<int>(config_.fleet.task.action_repeat));
    io::parallel_for(fleet_->blocks(), fleet_->options().batch.threads, [&](std::size_t block) {
      const auto [first, last] = fleet_->flappers(block);
      T clamped[kMaxLanes * flight::kMaxActions];
      for (std::size_t k = 0; k < (last - first) * actions; ++k)
        clamped[k] = static_cast<T>(std::min(std::max(action[first * actions + k], -1.0F), 1.0F));
      fleet_->set_actions(block, clamped);
      fleet_->fly_block(block);
      const flight::Shown<T> shown = fleet_->shown(block);
      std::size_t over = 0;
      for (std::size_t i = first; i < last; ++i) over += gather(i, i - first, shown, to);
      if (over > 0) ended += over;
    });
    fleet_->end();
    if (config_.watch) show(*config_.watch, *fleet_);
    return ended;
  }

  flight::Motion truth(std::size_t i) const override { return fleet_->truth(i); }
  flight::Motion estimate(std::size_t i) const override { return fleet_->estimate(i); }
  flight::Target target(std::size_t i) const override { return fleet_->target(i); }
  sim::FlapperState state(std::size_t i) const override { return fleet_->batch().state(i); }
  double time_s(std::size_t i) const override { return fleet_->tick(i) * fleet_->period_s(); }
  std::uint32_t episode(std::size_t i) const override { return lives_[i].episode; }
  std::uint64_t hash(std::size_t first, std::size_t last) const override {
    std::uint64_t hash = 0;
    for (std::size_t i = first; i < last; ++i) hash = sim::mixed(hash, fleet_->batch().hash(i, i + 1));
    return hash;
  }

 private:
  struct Hovers {
    std::vector<flight::Snapshot<T>> own, others;
  };
  struct Life {
    std::uint32_t episode = 0, steps = 0;
    double episode_return = 0;
    bool over = false;  ///< the episode has ended, and the next has not started
  };

  /// Makes the fleet for the seed, and the hovers from which its episodes start.
  void prepare() {
    flight::FleetOptions o = config_.fleet;
    // few blocks on many threads: waiting would take longer than flying
    const auto most = static_cast<std::size_t>(io::thread_count(o.batch.threads));
    o.batch.threads = static_cast<int>(std::clamp<std::size_t>(count() / 64, 1, most));
    fleet_.emplace(count(), config_.vehicle, o);
    if (config_.fleet.task.start.settled) {
      const auto vehicle = [&](std::uint32_t flapper) { return config_.vehicle_of(flapper); };
      Hovers hovers;
      hovers.own = settle<T>(o, count(), kHover_s, vehicle);
      o.first_flapper = 0;
      hovers.others = settle<T>(o, kSettledVehicles, kHover_s, vehicle);
      hovers_ = std::make_shared<const Hovers>(std::move(hovers));
    }
    for (std::size_t i = 0; i < count(); ++i) {
      lives_[i].episode = 0;
      start(i);
    }
  }

  /// Episode 0 starts as in flappy-fly; if the task starts settled, later ones start from a random one of Hovers::others.
  void start(std::size_t i) {
    Life& life = lives_[i];
    const flight::Snapshot<T>* hover = nullptr;
    if (hovers_) {
      const sim::RandomKey key{config_.fleet.seed, config_.fleet.first_flapper + static_cast<std::uint32_t>(i),
                               life.episode, sim::Stream::snapshot};
      const auto place =
          static_cast<std::size_t>(sim::uniform_pair(key, 0).first * static_cast<double>(hovers_->others.size()));
      hover = life.episode == 0 ? &hovers_->own[i] : &hovers_->others[place];
    }
    Rollout<T>::start(*fleet_, config_, i, life.episode, hover);
    if (config_.excitation.acts()) fleet_->set_added(i, config_.excitation.at(0));
    life = {life.episode};
  }

  float bounded(std::size_t k, T x) const { return static_cast<float>(std::min(std::max(x, -bounds_[k]), bounds_[k])); }

  void observe(std::size_t i, float* row) const {
    T seen[flight::kMaxHistory * flight::kMaxObservation];
    fleet_->observation(i, seen);
    for (std::size_t k = 0; k < bounds_.size(); ++k) row[k] = bounded(k, seen[k]);
  }

  /// Writes the results of the last step for an environment, and restarts it if due. Returns whether its episode ended.
  bool gather(std::size_t i, std::size_t lane, const flight::Shown<T>& shown, const Transitions& to) {
    Life& life = lives_[i];
    float* const row = to.observation + i * observed_.size();
    ended_[i] = false;
    if (life.over && options_.autoreset == Autoreset::next_step) {
      ++life.episode;
      start(i);
      observe(i, row);
      to.reward[i] = 0;
      to.terminated[i] = to.truncated[i] = false;
      return false;
    }
    if (config_.fleet.task.history > 1) observe(i, row);
    else
      for (std::size_t k = 0; k < bounds_.size(); ++k) row[k] = bounded(k, shown.observation[k * shown.lanes + lane]);
    const auto reward = static_cast<float>(shown.action_reward[lane]);
    const std::uint32_t causes = shown.ended[lane];
    const bool crashed = (causes & ~std::uint32_t{flight::kTimeOut}) != 0;
    const bool paid = shown.handed_back[lane] > 0 && shown.tick[lane] >= paid_ticks_;
    to.reward[i] = reward;
    to.terminated[i] = paid || crashed;
    to.truncated[i] = !to.terminated[i] && causes != 0;
    if (life.over) return false;
    ++life.steps;
    life.episode_return += reward;
    if (!to.terminated[i] && !to.truncated[i]) return false;
    life.over = ended_[i] = true;
    const bool has_success = config_.fleet.task.constants.success.by_s > 0;
    const bool kept = fleet_->captured_s(i) > 0 && fleet_->lost_s(i) == 0;
    episodes_[i] = {static_cast<float>(life.episode_return), static_cast<float>(life.steps),
                    !crashed && (!has_success || kept), causes};
    std::copy_n(row, observed_.size(), &final_observation_[i * observed_.size()]);
    if (options_.autoreset != Autoreset::same_step) return true;
    ++life.episode;
    start(i);
    observe(i, row);
    return true;
  }

  FlyConfig config_;
  std::uint32_t paid_ticks_;
  std::optional<flight::Fleet<T>> fleet_;
  std::shared_ptr<const Hovers> hovers_;  // null where episodes do not start settled; shared with copies
  std::vector<T> bounds_;
  std::vector<Life> lives_;
};

}  // namespace

std::unique_ptr<Environments> make_environments(FlyConfig config, const EnvironmentOptions& options) {
  if (config.precision == "float") return std::make_unique<EnvironmentsOf<float>>(std::move(config), options);
  return std::make_unique<EnvironmentsOf<double>>(std::move(config), options);
}

}  // namespace flappy::rollout
