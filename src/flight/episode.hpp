// One episode, lane by lane: observation, action, reward and termination.
#pragma once

#include "flight/pid.hpp"
#include "flight/task.hpp"

#ifdef __clang__  // & and | of lane masks become bitwise operations on bools where there is one lane
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wbitwise-instead-of-logical"
#endif

namespace flappy::flight {
inline namespace FLAPPY_ISA {

/// State of an episode, stored as rows. Elements of an action beyond the task's are 0.
template <class T>
struct Episode {
  T action[kMaxActions];    // from the policy, in [-1, 1]
  T previous[kMaxActions];  // action in the control period before
  T adds[kMaxActions];   // scaled action: offset to the controller's output (V, V, V, split cycle), or motor voltages
  T added[kMaxActions];  // offset to the controller's output that does not come from the policy (Fleet::set_added)
  T handed_back;         // 0 or 1
  T reward;              // in the last control period
  T action_reward;       // sum of rewards since the policy last acted
  T noise[kMaxActions];  // exploration noise, standard deviation 1
  T captured_s;          // time at which the goal was first captured; 0: not yet
  T lost_s;              // time at which the goal was first not kept; 0: never
};

/// Maps [-1, 1] to the task's range: offset to wing-beat input `i`, or voltage of motor `i`.
template <class T>
FLAPPY_INLINE T scaled_action(const TaskConstants<Element<T>>& k, int i, const T& action) {
  const T middle(0.5 * (k.action_low[i] + k.action_high[i])), half(0.5 * (k.action_high[i] - k.action_low[i]));
  // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): no layer has width 0
  return middle + half * clamp(action, T(-1), T(1));
}

/// Controller output plus the policy's offset (until the hand-back) and the offset of Fleet::set_added.
template <class T>
FLAPPY_INLINE WingBeat<T> add_action(const Episode<T>& e, const WingBeat<T>& base) {
  T sum[kMaxActions] = {base.amplitude_V, base.difference_V, base.bias_V, base.split_cycle};
  for (int i = 0; i < kMaxActions; ++i) sum[i] = sum[i] + (e.added[i] + where(e.handed_back > T(0), T(0), e.adds[i]));
  return {sum[0], sum[1], sum[2], sum[3]};
}

/// True state relative to the set point. Vectors are in W; yaw is relative to the set point's heading.
template <class T>
struct Score {
  Vec3<T> position_m, velocity_m_s;
  T roll_rad, pitch_rad, yaw_rad;
  T facing, upright;  // R'_00: R_00 in the set point's heading frame; R_22, the cosine of the tilt
  T heading_cos;      // cosine of the heading error; heading: direction of the body's x axis in the horizontal plane
};

template <class T>
FLAPPY_INLINE Score<T> score_of(const Truth<T>& t, const Setpoint<T>& ref) {
  const Matrix3<T> R = rotation_matrix(t.attitude);
  const T facing = ref.heading.cos * R.row_x.x + ref.heading.sin * R.row_y.x;
  const T aside = ref.heading.cos * R.row_y.x - ref.heading.sin * R.row_x.x;
  return {t.position_m - ref.position_m,
          t.velocity_m_s - ref.velocity_m_s,
          atan2(R.row_z.y, R.row_z.z),
          T(-asin(R.row_z.x)),
          atan2(aside, facing),
          facing,
          R.row_z.z,
          facing / sqrt(max(T(facing * facing + aside * aside), T(1e-12)))};
}

/// Reward of a control period: r of Reward (task.hpp) without the term goal G.
template <class T>
FLAPPY_INLINE T running_reward(const Reward<Element<T>>& k, const Score<T>& s, const Truth<T>& t, const Episode<T>& e) {
  T effort(0), change(0);
  for (int i = 0; i < kMaxActions; ++i) {
    const T step = e.action[i] - e.previous[i];
    effort += e.action[i] * e.action[i];
    change += step * step;
  }
  const auto length = [](const Vec3<T>& v) { return sqrt(dot(v, v)); };
  const T angles = sqrt(T(s.roll_rad * s.roll_rad + (s.pitch_rad * s.pitch_rad + s.yaw_rad * s.yaw_rad)));
  const T c = T(k.action) * effort +
              (T(k.action_change) * change + (T(k.position) * length(s.position_m) +
                                              (T(k.angles) * angles + (T(k.velocity) * length(s.velocity_m_s) +
                                                                       T(k.body_rate) * length(t.body_rate_rad_s)))));
  return T(k.inverse_square) / T(c * c + T(1e-6)) - T(k.cost) * c +
         (T(k.facing) * s.facing + (T(k.upright) * min(T(0), s.upright) +
                                    (T(k.behind) * min(T(0), T(s.position_m.x + T(k.behind_m))) + T(k.alive)))) +
         (T(k.level) * s.upright +
          T(k.near) / T(T(1) + T(k.near_1_m) * T(k.near_1_m) * dot(s.position_m, s.position_m)));
}

/// G of Reward (task.hpp): 1 at rest at the goal, lower for any error.
template <class T>
FLAPPY_INLINE T closeness(const Reward<Element<T>>& k, const Score<T>& s, const Truth<T>& t) {
  const T tilt = T(k.goal_1_tilt) * atan2(sqrt(max(T(T(1) - s.upright * s.upright), T(0))), s.upright);
  const T heading = T(k.goal_1_heading) * s.yaw_rad;
  const T square[] = {T(k.goal_1_m) * T(k.goal_1_m) * dot(s.position_m, s.position_m),
                      T(k.goal_s_m) * T(k.goal_s_m) * dot(s.velocity_m_s, s.velocity_m_s),
                      T(k.goal_s_rad) * T(k.goal_s_rad) * dot(t.body_rate_rad_s, t.body_rate_rad_s), tilt * tilt,
                      heading * heading};
  T product(1);
  for (const T& x : square) product *= T(1) + x;
  return T(1) / product;
}

/// Reward of the control period that ends at `time_s`. `done`: lanes that meet the hand-back condition then. Call after
/// note_success() and before e.handed_back changes, so that the arrival is paid once.
template <class T>
FLAPPY_INLINE T reward_of(const Reward<Element<T>>& k, const Score<T>& s, const Truth<T>& t, const T& time_s,
                          const T& tick_s, auto done, const Episode<T>& e) {
  const auto handed_back = e.handed_back > T(0), captured = e.captured_s > T(0);
  T reward = running_reward(k, s, t, e);
  if (k.goal != 0 || k.arrival != 0) {
    const T arrival = where(done & !handed_back, T(k.arrival), T(0));
    reward += T(T(k.goal) + arrival) * closeness(k, s, t);
  }
  if (k.until_s > 0) {
    const auto then = (time_s > T(k.until_s)) & (time_s < T(T(k.until_s) + tick_s));
    const auto kept = captured & (e.lost_s == T(0));
    reward += where(then & kept, T(k.kept), T(0));
    reward = where(handed_back & !captured, T(0), reward);
  }
  return reward;
}

template <class T>
FLAPPY_INLINE auto shorter(const Vec3<T>& v, const Element<T>& limit) {
  return dot(v, v) < T(limit) * T(limit);
}

/// Lanes that meet the hand-back condition. `touches`: 0 or 1, whether a contact point touches something.
template <class T>
FLAPPY_INLINE auto arrived(const HandBack<Element<T>>& k, const Score<T>& s, const Vec3<T>& body_rate, const T& time_s,
                           const T& touches = T(1)) {
  const auto there = (s.position_m.x > T(k.x_m)) & shorter(s.position_m, k.distance_m) &
                     (abs(s.velocity_m_s.x) < T(k.speed_x_m_s)) & shorter(s.velocity_m_s, k.speed_m_s) &
                     (s.heading_cos > T(k.heading_cos)) & (s.upright > T(k.tilt_cos)) &
                     shorter(body_rate, k.body_rate_rad_s) & (touches >= T(k.touching));
  return (T(k.enabled) > T(0)) & (there | (time_s >= T(k.at_s)));
}

/// Sets e.captured_s at the first capture and e.lost_s when the goal is first not kept.
template <class T>
FLAPPY_INLINE void note_success(const Success<Element<T>>& k, const Score<T>& s, const Vec3<T>& body_rate,
                                const T& time_s, Episode<T>& e, const T& touches = T(1)) {
  const auto captures = shorter(s.position_m, k.distance_m) & shorter(s.velocity_m_s, k.speed_m_s) &
                        shorter(body_rate, k.body_rate_rad_s) & (s.upright > T(k.tilt_cos)) &
                        (s.heading_cos > T(k.heading_cos)) & (touches >= T(k.touching));
  const auto first = (e.captured_s == T(0)) & (time_s < T(k.by_s));
  e.captured_s = where(captures & first, time_s, e.captured_s);
  const auto keeps = shorter(s.position_m, k.keep_distance_m) & (s.upright > T(k.keep_tilt_cos)) &
                     (s.heading_cos > T(k.keep_heading_cos));
  const auto asked = (time_s > T(k.keep_from_s)) & (time_s < T(k.keep_until_s));
  e.lost_s = where(asked & !keeps & (e.lost_s == T(0)), time_s, e.lost_s);
}

/// Calls mark(lanes that end, bit of Ended) for each rule that ends an episode.
template <class T, class Mark>
FLAPPY_INLINE void check_termination(const Limits<Element<T>>& k, const Score<T>& s, const T& time_s,
                                     const Mark& mark) {
  const Vec3<T>& p = s.position_m;
  const T far(k.distance_m);
  mark((p.x < T(k.x_low_m)) | (p.x > T(k.x_high_m)) | (abs(p.y) > T(k.y_m)) | (abs(p.z) > T(k.z_m)) |
           (dot(p, p) > T(far * far)),
       kOutOfBounds);
  mark((time_s > T(k.faced_by_s)) & (s.facing < T(0)), kHeadingLate);
  mark((time_s > T(k.arrived_by_s)) & (p.x < T(k.arrived_x_m)), kArrivalLate);
  mark(time_s >= T(k.time_s), kTimeOut);
}

template <class T>
struct Wings {
  T left_rad, right_rad, left_rad_s, right_rad_s;
};

template <class T>
FLAPPY_INLINE Wings<T> wings_of(const State<T>& x) {
  return {x.left.stroke_rad, x.right.stroke_rad, x.left.stroke_rate_rad_s, x.right.stroke_rate_rad_s};
}

/// Writes the parts; returns the number of rows. `parts`: bits of Part. `actions`: elements of an action.
template <class T>
FLAPPY_INLINE int observe(std::uint32_t parts, int actions, const Estimate<T>& x, const Setpoint<T>& ref,
                          const Episode<T>& e, const T& beat_fraction, const T& time_s, const WingBeat<T>& trim,
                          const Wings<T>& wings, T* row) {
  int n = 0;
  const auto observes = [&](Part part) { return (parts >> static_cast<int>(part) & 1) != 0; };
  const auto add = [&](const Vec3<T>& v) { row[n++] = v.x, row[n++] = v.y, row[n++] = v.z; };
  const Matrix3<T> R = rotation_matrix(x.attitude);
  if (observes(Part::rotation_matrix)) add(R.row_x), add(R.row_y), add(R.row_z);
  if (observes(Part::position_error)) add(x.position_m - ref.position_m);
  if (observes(Part::velocity)) add(x.velocity_m_s - ref.velocity_m_s);
  if (observes(Part::body_rate)) add(x.body_rate_rad_s);
  if (observes(Part::beat_phase)) {
    const SinCos<T> phase = sin_cos_pi(T(beat_fraction + beat_fraction));
    row[n++] = phase.sin, row[n++] = phase.cos;
  }
  if (observes(Part::heading_error)) {
    const SinCos<T> yaw = heading_of(R);
    row[n++] = yaw.sin * ref.heading.cos - yaw.cos * ref.heading.sin;
    row[n++] = yaw.cos * ref.heading.cos + yaw.sin * ref.heading.sin;
  }
  if (observes(Part::previous_action))
    for (int i = 0; i < actions; ++i) row[n++] = e.adds[i];
  if (observes(Part::goal_rotation)) {
    const auto rotated_back = [&](const Vec3<T>& x_row, const Vec3<T>& y_row) {
      return add_scaled(ref.heading.cos * x_row, ref.heading.sin, y_row);
    };
    const Vec3<T> minus_x{-R.row_x.x, -R.row_x.y, -R.row_x.z};
    add(rotated_back(R.row_x, R.row_y)), add(rotated_back(R.row_y, minus_x)), add(R.row_z);
  }
  if (observes(Part::time)) row[n++] = time_s;
  if (observes(Part::trim)) {
    row[n++] = trim.amplitude_V, row[n++] = trim.difference_V;
    row[n++] = trim.bias_V, row[n++] = trim.split_cycle;
  }
  if (observes(Part::wings)) {
    row[n++] = wings.left_rad, row[n++] = wings.right_rad;
    row[n++] = wings.left_rad_s, row[n++] = wings.right_rad_s;
  }
  return n;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight

#ifdef __clang__
#pragma clang diagnostic pop
#endif
