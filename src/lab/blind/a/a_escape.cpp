#include "lab/blind/a/a_escape.hpp"

#include "lab/blind/a/view.hpp"

namespace flappy::blind {
namespace {

constexpr double kHeight_m = 1;  ///< added to the task's heights, to be far from ground and ceiling

model::Vec3<double> vec3(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

flight::Estimate<double> estimate(const Torso& t) {
  flight::Estimate<double> e{};
  e.position_m = vec3(t.position_m);
  e.attitude = {t.attitude.w(), t.attitude.x(), t.attitude.y(), t.attitude.z()};
  e.velocity_m_s = vec3(t.velocity_m_s);
  e.body_rate_rad_s = vec3(t.rate_rad_s);
  return e;
}

flight::Setpoint<double> hold(const Vector3d& position_m, double heading_rad) {
  const SinCos heading = sin_cos(heading_rad);
  flight::Setpoint<double> s{};
  s.position_m = vec3(position_m);
  s.heading = {heading.sin, heading.cos};
  return s;
}

Waypoint start_of(const flight::StartRange& range, std::uint64_t seed, std::uint64_t number) {
  Random random(seed, Purpose::escape_start, number);
  const auto draw = [&](const flight::Spread& s) { return s.centre + s.half * (2 * random.uniform() - 1); };
  Waypoint w;
  for (int i = 0; i < 3; ++i) w.position_m[i] = draw(range.position_m[i]);
  w.heading_rad = draw(range.rotation_rad[2]);
  w.position_m.x() = std::clamp(w.position_m.x(), range.x_low_m, range.x_high_m);
  w.position_m.z() += kHeight_m;
  return w;
}

/// Hovers, then lets the policy act until it hands back.
class Escaper {
 public:
  Escaper(const Case& c, std::size_t number, const EscapeRules& rules, const Waypoint& start)
      : rules_(rules),
        driver_(c.vehicle.driver),
        view_(c.seed, flight_number(c.session, number)),
        start_(hold(start.position_m, start.heading_rad)) {
    const auto& at = rules.task.path.front().coefficients;
    goal_ = hold({at[0][0], at[1][0], at[2][0] + kHeight_m}, at[3][0]);
    for (int i = 0; i < rules.task.actions(); ++i) episode_.adds[i] = flight::scaled_action(rules.constants, i, 0.0);
  }

  Inputs steer(double t_s, double beat, const Torso& torso) {
    const flight::Estimate<double> seen = estimate(view_.see(torso));
    const bool begun = t_s > -kControl_s / 2;
    if (begun && tick_ > 0) note_outcome(torso, seen, t_s);
    const flight::Pid<double> before = pid_;
    model::WingBeat<double> u = flight::PidController::update(rules_.controller, pid_, seen, begun ? goal_ : start_);
    if (begun) {
      const model::WingBeat<double> learnt = flight::PidController::trim(rules_.controller, before);
      if (episode_.handed_back == 0) {
        if (tick_ % rules_.task.action_repeat == 0) act(seen, beat, t_s, learnt);
        if (rules_.constants.holds_trim > 0) {
          u = learnt;
          flight::PidController::unlearn(true, before, pid_);
        }
      }
      u = flight::add_action(episode_, u);
      ++tick_;
    }
    return clipped({u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle}, driver_);
  }

  void finish(Escape& e) const {
    e.captured_s = episode_.captured_s, e.lost_s = episode_.lost_s;
    e.ended = ended_;
  }

 private:
  void act(const flight::Estimate<double>& seen, double beat, double t_s, const model::WingBeat<double>& learnt) {
    double row[flight::kMaxObservation];
    const double fraction = beat < 0.5 ? beat : beat - 1;
    const int n = flight::observe(rules_.task.parts, rules_.task.actions(), seen, goal_, episode_, fraction,
                                  std::max(t_s, 0.0), learnt, flight::Wings<double>{}, row);
    std::vector<double> now(row, row + n);
    if (past_.empty())
      for (std::uint32_t ago = 1; ago < rules_.task.history; ++ago) past_.insert(past_.end(), row, row + n);
    now.insert(now.end(), past_.begin(), past_.end());
    past_.assign(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(past_.size()));
    const std::array<double, 4> adds = rules_.policy(now);
    std::ranges::copy(adds, episode_.adds);
  }

  /// Judges on the true state, except the hand-back, which the task may base on the estimate.
  void note_outcome(const Torso& torso, const flight::Estimate<double>& seen, double t_s) {
    const flight::TaskConstants<double>& k = rules_.constants;
    const flight::Estimate<double> truth = estimate(torso);
    const auto score = flight::score_of(truth, goal_);
    const auto& by = k.hand_back.on_estimate > 0 ? seen : truth;
    const bool done = flight::arrived(k.hand_back, flight::score_of(by, goal_), by.body_rate_rad_s, t_s) != 0;
    flight::note_success(k.success, score, truth.body_rate_rad_s, t_s, episode_);
    if (done) episode_.handed_back = 1;
    flight::check_termination(k.limits, score, t_s, [&](bool over, std::uint32_t bit) { ended_ |= over ? bit : 0; });
  }

  const EscapeRules& rules_;
  const model::Driver driver_;
  View view_;
  flight::Setpoint<double> start_, goal_{};
  flight::Pid<double> pid_{};
  flight::Episode<double> episode_{};
  std::vector<double> past_;            // earlier observations, one for each action, newest first
  std::uint32_t tick_ = 0, ended_ = 0;  ///< control periods since the manoeuvre began
};

}  // namespace

Escape escape(const Case& c, std::size_t number, const EscapeRules& rules) {
  const Waypoint at = start_of(rules.task.start, c.seed, flight_number(c.session, number));
  Torso start;
  start.position_m = at.position_m;
  start.attitude = turned_by({0, 0, at.heading_rad});
  Escaper escaper(c, number, rules, at);
  Escape e;
  constexpr double kAnyWayUp = -2;  // no crash for tumbling: the task's limits decide
  e.flight = fly(c, number, start, rules.constants.limits.time_s, kAnyWayUp,
                 [&](double t_s, double beat, const Torso& torso) { return escaper.steer(t_s, beat, torso); });
  escaper.finish(e);
  return e;
}

}  // namespace flappy::blind
