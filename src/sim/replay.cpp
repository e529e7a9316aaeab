#include "sim/replay.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "io/parallel.hpp"
#include "sim/storage.hpp"

namespace flappy::sim {
namespace {

constexpr std::size_t kWindows = kLanes<double>;
/// Share of a step: a change this near to the end of a step counts as at its end.
constexpr double kSameShare = 1e-6;

class StepVoltages {
 public:
  StepVoltages(const VoltageScript& script, double begin_s, double step_s)
      : script_(script), begin_s_(begin_s), step_s_(step_s) {
    const auto after = std::ranges::upper_bound(script.t_s, begin_s + kSameShare * step_s);
    next_ = static_cast<std::size_t>(after - script.t_s.begin());
  }
  /// Means over step `i`; steps are to be taken in ascending order.
  void take(int i, double& left_V, double& right_V) {
    const std::size_t now = next_ > 0 ? next_ - 1 : 0;
    left_V = script_.left_V[now];
    right_V = script_.right_V[now];
    double share = 1;  // share of the step after the change to the voltages of `next_`
    const double from_s = begin_s_ + i * step_s_;
    for (; next_ < script_.t_s.size(); ++next_) {
      const double at = (script_.t_s[next_] - from_s) / step_s_;
      if (at > 1 - kSameShare) {
        if (at < 1 + kSameShare) ++next_;  // belongs to the next step
        break;
      }
      share = 1 - std::max(at, 0.0);
      left_V += share * (script_.left_V[next_] - (next_ > 0 ? script_.left_V[next_ - 1] : left_V));
      right_V += share * (script_.right_V[next_] - (next_ > 0 ? script_.right_V[next_ - 1] : right_V));
    }
  }

 private:
  const VoltageScript& script_;
  double begin_s_, step_s_;
  std::size_t next_;
};

/// Corrects the body rate, in B, by the turn that the body made within `carried_s` beyond its record; for small angles.
void correct_rate(const FlapperState& flown, double carried_s, FlapperState& x) {
  const double *a = flown.attitude, *b = x.attitude;
  const double turn[4] = {
      a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2],
      a[0] * b[2] - a[2] * b[0] - a[3] * b[1] + a[1] * b[3], a[0] * b[3] - a[3] * b[0] - a[1] * b[2] + a[2] * b[1]};
  const double scale = std::copysign(2 / carried_s, turn[0]);
  for (int k = 0; k < 3; ++k) x.body_rate_rad_s[k] = flown.body_rate_rad_s[k] + scale * turn[k + 1];
}

void keep_wings(const FlapperState& from, FlapperState& x) {
  for (int side = 0; side < 2; ++side) {
    x.stroke_rad[side] = from.stroke_rad[side];
    x.rotation_rad[side] = from.rotation_rad[side];
    x.stroke_rate_rad_s[side] = from.stroke_rate_rad_s[side];
    x.rotation_rate_rad_s[side] = from.rotation_rate_rad_s[side];
    x.stroke_acceleration_rad_s2[side] = from.stroke_acceleration_rad_s2[side];
    x.rotation_acceleration_rad_s2[side] = from.rotation_acceleration_rad_s2[side];
  }
}

void correct_strokes(const FlapperState& seen, double carried_s, double share, FlapperState& x) {
  for (int side = 0; side < 2; ++side) {
    const double off = seen.stroke_rad[side] - x.stroke_rad[side];
    if (!(std::abs(off) > 0)) continue;  // also if it was not recorded (NaN)
    x.stroke_rad[side] += share * off;
    x.stroke_rate_rad_s[side] += share * share / (2 - share) / carried_s * off;
  }
}

class ReplayBlock {
 public:
  ReplayBlock(const model::Vehicle& vehicle, const ReplayOptions& o)
      : options_(o),
        batch_(kWindows, vehicle, {o.step_s, 1, o.world, o.instruction_set}),
        plan_(storage_of(batch_).plan()) {
    plan_.steps_per_update = 1;
  }

  /// Flies windows [first, first + count); lanes without a window fly a copy of the first.
  void fly(const std::vector<ReplayWindow>& windows, std::size_t first, std::size_t count,
           const std::vector<int>& checkpoints, const RecordedState& recorded, Replayed* results) {
    for (std::size_t i = 0; i < kWindows; ++i) {
      index_[i] = i < count ? first + i : first;
      const ReplayWindow& w = windows[index_[i]];
      start_s_[i] = w.start_s;
      if (vehicles_[i] != w.vehicle) batch_.set_vehicle(i, *w.vehicle);
      vehicles_[i] = w.vehicle;
      batch_.reset(i, {});
    }
    read_voltages(windows, checkpoints.back());
    bring_wings_into_phase(recorded);
    int done = 0;
    for (const int checkpoint : checkpoints) {
      step(checkpoint - done);
      done = checkpoint;
      for (std::size_t i = 0; i < count; ++i) results[i].states.push_back(batch_.state(i));
    }
    for (std::size_t i = 0; i < count; ++i) results[i].status = batch_.status(i);
  }

 private:
  void read_voltages(const std::vector<ReplayWindow>& windows, int last) {
    const int steps = options_.spin_up_steps + last;
    voltages_V_.resize(static_cast<std::size_t>(steps) * 2 * kWindows);
    for (std::size_t i = 0; i < kWindows; ++i) {
      StepVoltages script(*windows[index_[i]].voltages, start_s_[i] - options_.spin_up_steps * options_.step_s,
                          options_.step_s);
      double* to = voltages_V_.data() + i;
      for (int k = 0; k < steps; ++k, to += 2 * kWindows) script.take(k, to[0], to[kWindows]);
    }
    next_V_ = voltages_V_.data();
  }

  void bring_wings_into_phase(const RecordedState& recorded) {
    const int before = options_.spin_up_steps, carry = options_.carry_steps;
    if (before == 0) return put_back(recorded, 0, Wings::recorded, Start::flying);
    if (carry == 0) {
      put_back(recorded, 0, Wings::at_rest, Start::welded);
      step(before);
    }
    int carried = 0;
    for (int k = carry == 0 ? 0 : -before; k < 0; k += carried) {
      put_back(recorded, k, k == -before ? Wings::at_rest : Wings::kept, Start::flying, carried);
      carried = std::min(carry, -k);
      step(carried);
    }
    put_back(recorded, 0, Wings::kept, Start::flying, carried);
  }

  enum class Wings { recorded, at_rest, kept };

  /// Puts torsos to their records `step` steps after the windows' starts; `carried`: steps since the last time.
  void put_back(const RecordedState& recorded, int step, Wings kind, Start start, int carried = 0) {
    for (std::size_t i = 0; i < kWindows; ++i) {
      FlapperState x = recorded(index_[i], start_s_[i] + step * options_.step_s);
      if (kind != Wings::recorded) {
        const FlapperState flown = batch_.state(i), seen = x;
        keep_wings(kind == Wings::kept ? flown : FlapperState{}, x);
        if (carried > 0) {
          correct_rate(flown, carried * options_.step_s, x);
          correct_strokes(seen, carried * options_.step_s, options_.stroke_share, x);
        }
      }
      storage_of(batch_).put_state(i, x, start);  // the memory of effects is kept
    }
  }

  void step(int steps) {
    if (steps == 0) return;
    auto& s = storage_of(batch_);
    BlockEffects<double> in_force = s.effects_of(0);
    in_force.voltages_V = next_V_;
    s.kernel(s.blocks[0], in_force, plan_, 0, steps, {});
    next_V_ += static_cast<std::size_t>(steps) * 2 * kWindows;
  }

  const ReplayOptions& options_;
  Batch<double> batch_;
  StepPlan plan_;
  std::size_t index_[kWindows] = {};
  double start_s_[kWindows] = {};
  const model::Vehicle* vehicles_[kWindows] = {};
  std::vector<double> voltages_V_;  // [step][left, right][lane]
  const double* next_V_ = nullptr;
};

}  // namespace

void step_voltages(const VoltageScript& script, double begin_s, double step_s, std::size_t steps,
                   std::vector<double>& left_V, std::vector<double>& right_V) {
  StepVoltages voltages(script, begin_s, step_s);
  left_V.resize(steps);
  right_V.resize(steps);
  for (std::size_t i = 0; i < steps; ++i) voltages.take(static_cast<int>(i), left_V[i], right_V[i]);
}

std::vector<Replayed> replay(const std::vector<ReplayWindow>& windows, const std::vector<int>& checkpoints,
                             const RecordedState& recorded, const ReplayOptions& options) {
  if (checkpoints.empty() || checkpoints.front() < 0 || !std::ranges::is_sorted(checkpoints))
    throw std::invalid_argument("checkpoints are to ascend from 0");
  if (options.spin_up_steps < 0 || options.carry_steps < 0) throw std::invalid_argument("steps are to be positive");
  for (const ReplayWindow& w : windows)
    if (w.voltages->t_s.empty()) throw std::invalid_argument("a window without voltages");
  std::vector<Replayed> results(windows.size());
  const int threads = io::thread_count(options.threads);
  std::vector<std::unique_ptr<ReplayBlock>> lanes(static_cast<std::size_t>(threads));
  io::parallel_for((windows.size() + kWindows - 1) / kWindows, threads, [&](std::size_t b, int thread) {
    const std::size_t first = b * kWindows;
    std::unique_ptr<ReplayBlock>& own = lanes[static_cast<std::size_t>(thread)];
    if (!own) own = std::make_unique<ReplayBlock>(*windows[first].vehicle, options);
    own->fly(windows, first, std::min(kWindows, windows.size() - first), checkpoints, recorded, &results[first]);
  });
  return results;
}

}  // namespace flappy::sim
