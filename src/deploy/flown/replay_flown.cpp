#include "deploy/flown/replay_flown.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

namespace flappy::deploy {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

Vector4d product(const Vector4d& p, const Vector4d& q) {
  return {p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
          p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3], p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1]};
}

/// Multiplies constants of the controller while it lives.
class Factors {
 public:
  Factors(const ExportedC& c, const Wiring& w) {
    for (const auto& [name, factor] : w.constants) scale(c, name, static_cast<float>(factor));
    if (w.clipped) return;
    constexpr float kFar = 1e6F;
    for (const char* name :
         {"driver_amplitude_V", "driver_difference_V", "driver_bias_V", "left_limit_V", "right_limit_V"})
      scale(c, name, kFar);
  }
  ~Factors() {
    for (auto it = before_.rbegin(); it != before_.rend(); ++it) *it->first = it->second;
  }
  Factors(const Factors&) = delete;
  Factors& operator=(const Factors&) = delete;

 private:
  void scale(const ExportedC& c, const std::string& name, float factor) {
    const std::size_t bracket = name.find('[');
    const auto found = c.constants().find(name.substr(0, bracket));
    if (found == c.constants().end()) return;
    const std::size_t only = bracket == std::string::npos ? found->second.size() : std::stoul(name.substr(bracket + 1));
    for (std::size_t i = 0; i < found->second.size(); ++i) {
      if (bracket != std::string::npos && i != only) continue;
      before_.emplace_back(found->second[i], *found->second[i]);
      *found->second[i] *= factor;
    }
  }
  std::vector<std::pair<float*, float>> before_;
};

class Loop {
 public:
  Loop(const ExportedC& c, const Contract& contract, const OnboardLog& log, const Wiring& wiring)
      : c_(c),
        contract_(contract),
        log_(log),
        w_(wiring),
        factors_(c, wiring),
        state_(c.state_bytes() / sizeof(std::max_align_t) + 1),
        slack_s_(std::clamp(log.time_step_s / 2, 1e-9, 1e-6)),
        period_s_(contract.control_s * wiring.loop_scale),
        drives_often_(contract.driver_s < 1.001 * contract.control_s),
        observation_(contract.observation.size()) {
    for (std::size_t i = 0; i < contract.observation.size(); ++i)
      if (contract.observation[i].name.starts_with("x_error")) errors_.push_back(i);
  }

  Replay fly(double until_s) {
    Replay out;
    const auto first = std::ranges::lower_bound(log_.commands, log_.start_s - slack_s_, {}, &OnboardLog::Command::t_s);
    // before the start, motors are off
    out.volts.assign(static_cast<std::size_t>(first - log_.commands.begin()), {0, 0});
    c_.start(state(), stamp(log_.start_s), start_pose().data());
    if (log_.start_memory.size() == c_.remembered()) c_.recall(state(), log_.start_memory.data(), log_.start_phase);
    if (log_.mode == OnboardLog::Mode::hover) c_.hover(state());
    if (log_.mode == OnboardLog::Mode::stay) c_.stay(state());
    auto next = first;
    for (std::uint32_t tick = 0; next != log_.commands.end() && next->t_s <= until_s; ++tick) {
      const double due_s = log_.start_s + tick * period_s_, end_s = due_s + period_s_;
      const double now_s = drives_often_ && next->t_s < end_s - slack_s_ ? std::max(due_s, next->t_s) : due_s;
      if (tick > 0) end_period(due_s, now_s);
      steer(now_s);
      // drives fall on multiples of the driver's period
      for (; next != log_.commands.end() && next->t_s <= until_s && next->t_s < end_s - slack_s_; ++next)
        out.volts.push_back(drive(next->t_s));
      advance_beat(end_s);
    }
    out.inferences = std::move(inferences_);
    return out;
  }

 private:
  void* state() { return state_.data(); }
  /// The robot's clock, at a time of the log.
  std::uint32_t stamp(double t_s) const {
    return static_cast<std::uint32_t>(
        static_cast<std::int64_t>(std::llround((t_s - log_.start_s) / w_.loop_scale * 1e6)) + kOrigin_us);
  }
  std::uint32_t sample_stamp(double t_s) const {
    return static_cast<std::uint32_t>(
        static_cast<std::int64_t>(std::llround((t_s - log_.start_s) * w_.stamp_scale / w_.loop_scale * 1e6)) +
        kOrigin_us);
  }

  ExportedC::Pose wired(const OnboardLog::Pose& pose) const {
    const Vector3d position = w_.position * Vector3d(pose.position_m[0], pose.position_m[1], pose.position_m[2]);
    Vector4d q(pose.attitude[0], pose.attitude[1], pose.attitude[2], pose.attitude[3]);
    q = product(product(w_.attitude_before, q), w_.attitude_after);
    if (w_.attitude_inverse) q.tail<3>() *= -1;
    ExportedC::Pose to;
    for (int i = 0; i < 3; ++i) to[static_cast<std::size_t>(i)] = static_cast<float>(position[i]);
    for (std::size_t i = 0; i < 4; ++i) to[3 + i] = static_cast<float>(q[w_.attitude_order[i]]);
    return to;
  }

  ExportedC::Pose start_pose() const {
    OnboardLog::Pose at{0, {0, 0, 0}, {1, 0, 0, 0}};
    if (log_.start_pose) {
      std::copy_n(log_.start_pose->begin(), 3, at.position_m.begin());
      std::copy_n(log_.start_pose->begin() + 3, 4, at.attitude.begin());
    } else if (!log_.poses.empty()) {
      const auto after =
          std::ranges::upper_bound(log_.poses, log_.start_s + slack_s_, {}, &OnboardLog::Pose::arrived_s);
      at = after == log_.poses.begin() ? *after : *(after - 1);
    }
    return wired(at);
  }

  static bool skipped(std::size_t sample, int hold, int first) {
    return sample % static_cast<std::size_t>(hold) != static_cast<std::size_t>(first);
  }

  /// Takes what has arrived by now, then estimates.
  void end_period(double due_s, double now_s) {
    for (; imu_ < log_.imu.size() && log_.imu[imu_].arrived_s <= now_s + slack_s_; ++imu_) {
      const OnboardLog::Imu& s = log_.imu[imu_];
      if (s.arrived_s < log_.start_s - slack_s_ || skipped(imu_, w_.hold_imu, w_.first_imu)) continue;
      const Vector3d rate = w_.rate * Vector3d(s.rate_rad_s.data()), force = w_.force * Vector3d(s.force_m_s2.data());
      float x[6];
      for (int i = 0; i < 3; ++i) x[i] = static_cast<float>(rate[i]), x[3 + i] = static_cast<float>(force[i]);
      c_.imu(state(), sample_stamp(s.arrived_s - log_.imu_latency_s), x);
    }
    for (; pose_ < log_.poses.size() && log_.poses[pose_].arrived_s <= now_s + slack_s_; ++pose_) {
      const OnboardLog::Pose& s = log_.poses[pose_];
      if (s.arrived_s < log_.start_s - slack_s_ || skipped(pose_, w_.hold_pose, w_.first_pose)) continue;
      c_.pose(state(), sample_stamp(s.arrived_s - log_.pose_latency_s), wired(s).data());
    }
    c_.tick(state(), stamp(due_s));
  }

  void steer(double now_s) {
    if (log_.begin_s && !begun_ && now_s > *log_.begin_s - slack_s_) {
      c_.begin(state());
      begun_ = true;
      acted_ = 0;
    }
    if (begun_ && w_.hand_back_s) {
      if (!std::isfinite(*w_.hand_back_s)) c_.set_handed_back(state(), 0);
      else if (now_s > *log_.begin_s + *w_.hand_back_s - slack_s_) c_.set_handed_back(state(), 1);
      else c_.set_handed_back(state(), 0);
    }
    if (begun_ && c_.handed_back(state()) == 0) act(now_s);
    float input[4];
    c_.steer(state(), input);
    const Eigen::Vector4f mixed = w_.input.cast<float>() * Eigen::Vector4f(input);
    std::copy_n(mixed.data(), 4, input_);
  }

  void act(double now_s) {
    const auto repeat =
        static_cast<std::uint32_t>(std::max(1L, std::lround(contract_.policy_s / contract_.control_s)) * w_.every);
    if (c_.ticks(state()) % repeat == 0) {
      float action[4];
      if (!w_.history) c_.forget(state());
      if (!w_.memory) c_.reset(state());
      c_.observe(state(), observation_.data());
      std::vector<float> seen = observed();
      c_.policy(state(), otherwise_normalised(seen).data(), action);
      if (!log_.policy_numbers.empty()) {
        seen.insert(seen.end(), action, action + contract_.action.size());
        inferences_.push_back({now_s, {}});
        for (const std::size_t i : log_.policy_numbers)
          inferences_.back().numbers.push_back(static_cast<double>(seen[i]));
      }
      const Eigen::Vector4f mixed = w_.action.cast<float>() * Eigen::Vector4f(action);
      waiting_.push_back({acted_ + static_cast<std::uint32_t>(w_.late), {mixed[0], mixed[1], mixed[2], mixed[3]}});
    }
    for (; !waiting_.empty() && waiting_.front().due <= acted_; waiting_.pop_front())
      c_.act(state(), waiting_.front().action.data());
    ++acted_;
  }

  /// The observation as the firmware makes it.
  std::vector<float> observed() const {
    std::vector<float> row(observation_.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto from = w_.order.empty() ? i : static_cast<std::size_t>(w_.order[i]);
      row[i] = observation_[from];
    }
    for (const std::size_t first : errors_)
      for (std::size_t k = 0; k < 3; ++k) row[first + k] += static_cast<float>(w_.goal_m[k]);
    for (std::size_t i = 0; i < row.size(); ++i)
      if (!w_.zero.empty() && w_.zero[i] != 0) row[i] = 0;
    return row;
  }

  /// With mean or scale left out, an observation that the policy's normalisation turns into the same numbers.
  std::vector<float> otherwise_normalised(std::vector<float> row) const {
    for (std::size_t i = 0; i < row.size(); ++i) {
      float& x = row[i];
      const float mean = contract_.mean[i], scale = contract_.scale[i];
      if (!w_.mean && w_.scale) x += mean;
      else if (w_.mean && !w_.scale) x = (x - mean) / scale + mean;
      else if (!w_.mean && !w_.scale) x = x / scale + mean;
    }
    return row;
  }

  /// Until it has been called so often since the start.
  void call_driver(std::uint64_t calls) {
    for (; driven_ < calls; ++driven_) c_.drive(state(), input_, volts_);
  }

  /// Makes the driver's calls up to the end of a period that the log lacks, as the beat goes on in them.
  void advance_beat(double end_s) {
    const auto calls =
        static_cast<std::uint64_t>(std::ceil((end_s - log_.start_s) / (contract_.driver_s * w_.loop_scale) - 1e-3));
    call_driver(calls);
  }

  std::array<double, 2> drive(double t_s) {
    // calls that the log lacks advance the beat all the same
    const auto call =
        static_cast<std::uint64_t>(std::floor((t_s - log_.start_s) / (contract_.driver_s * w_.loop_scale) + 1e-3));
    call_driver(call + 1);
    const Eigen::Vector2d v = w_.voltage * Eigen::Vector2d(volts_[0], volts_[1]);
    return {std::clamp(v[0], -w_.clip_V, w_.clip_V), std::clamp(v[1], -w_.clip_V, w_.clip_V)};
  }

  struct Waiting {
    std::uint32_t due;
    std::array<float, 4> action;
  };
  static constexpr std::int64_t kOrigin_us = 1000000;

  const ExportedC& c_;
  const Contract& contract_;
  const OnboardLog& log_;
  const Wiring& w_;
  const Factors factors_;
  std::vector<std::max_align_t> state_;
  const double slack_s_;  ///< times of a log are rounded
  const double period_s_;
  const bool drives_often_;  ///< the driver is called at least once per control period, and its call starts the period
  std::vector<float> observation_;
  std::vector<std::size_t> errors_;  ///< first of the three errors of the position, now and in the past
  std::size_t imu_ = 0, pose_ = 0;
  bool begun_ = false;
  std::uint32_t acted_ = 0;
  std::deque<Waiting> waiting_;
  std::vector<OnboardLog::Inference> inferences_;
  std::uint64_t driven_ = 0;
  float input_[4] = {0, 0, 0, 0}, volts_[2] = {0, 0};
};

}  // namespace

Replay replay(const ExportedC& c, const Contract& contract, const OnboardLog& log, const Wiring& wiring,
              double until_s) {
  return Loop(c, contract, log, wiring).fly(until_s);
}

}  // namespace flappy::deploy
