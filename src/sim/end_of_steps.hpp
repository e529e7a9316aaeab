// End of the steps of every kernel: contact events, and freezing of implausible states.
#pragma once

#include "sim/rows.hpp"
#include "sim/step.hpp"
#include "sim/touch.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

using namespace model;

/// A flapper that moves faster than this does not fly but diverges. A small vehicle turns fast, and is flown with short
/// steps: its rates may also turn it by kPlausibleBodyTurn_rad, or a hinge by kPlausibleHingeTurn_rad, within a step.
inline constexpr double kPlausibleSpeed_m_s = 100;
inline constexpr double kPlausibleBodyRate_rad_s = 1000, kPlausibleBodyTurn_rad = 0.1;
// the published limit of the rotation joint is 2000 rad/s
inline constexpr double kPlausibleHingeRate_rad_s = 20000, kPlausibleHingeTurn_rad = 2;
inline constexpr double kPlausiblePosition_m = 10000;
/// A flapper that rose by this height has left its support: from then on, touching the ground is an event.
inline constexpr double kTakeOffClearance_m = 0.005;

/// Marks flappers that touched a surface, and returns flappers to their support that fell back before they took off.
template <class T, class L>
FLAPPY_INLINE void look_around(State<L>& x, const Parameters<L>& p, const StepPlan& plan, Block<T>& block, int first) {
  const auto mark = [&](typename L::Mask mask, std::uint32_t bit) {
    if (!any(mask)) return;
    for (int i = 0; i < kWidth<T>; ++i)
      if (mask.raw[i]) block.status[first + i] |= bit;
  };
  const auto flying = x.support <= L(0);
  const L height = x.position_m.z - (L(plan.ground_z_m) + p.below_m);
  const auto lifting = x.support < L(0);
  if (rarely(lifting)) {
    const auto fell_back = lifting & (height < L(0));
    const L zero(0);
    x.position_m.z = where(fell_back, L(x.position_m.z - height), x.position_m.z);
    x.body_rate_rad_s = where(fell_back, Vec3<L>{zero, zero, zero}, x.body_rate_rad_s);
    // else what carried it off would do so again at once
    x.lift_N = where(fell_back, L(L(plan.gravity_m_s2) / p.inverse_mass_1_kg), x.lift_N);
    x.support = where(fell_back, L(1), where(lifting & (height > L(kTakeOffClearance_m)), zero, x.support));
  }
  mark(flying & !lifting & (height < L(0)), kTouchedGround);
  mark(flying & (x.position_m.z + p.above_m > L(plan.ceiling_z_m)), kTouchedCeiling);
  for (const Wall* wall = plan.walls; wall != plan.walls + plan.wall_count; ++wall) {
    const Wall& w = *wall;
    const L clearance = L(w.normal_x) * L(x.position_m.x - L(w.x_m)) + L(w.normal_y) * L(x.position_m.y - L(w.y_m));
    mark(flying & (clearance < p.around_m), kTouchedWall);
  }
  for (const Shape* shape = plan.shapes; shape != plan.shapes + plan.shape_count; ++shape)
    mark(flying & (gap_to(*shape, x.position_m).distance_m < p.around_m), kTouchedShape);
}

template <class L>
FLAPPY_INLINE typename L::Mask plausible(const State<L>& x, double step_s) {
  const double body_rad_s = max(kPlausibleBodyRate_rad_s, kPlausibleBodyTurn_rad / step_s);
  const double hinge_rad_s = max(kPlausibleHingeRate_rad_s, kPlausibleHingeTurn_rad / step_s);
  const auto within = [](const L& v, double limit) { return abs(v) <= L(limit); };  // false for NaN
  const auto all = [&](const Vec3<L>& v, double limit) {
    return within(v.x, limit) & within(v.y, limit) & within(v.z, limit);
  };
  const auto side = [&](const SideState<L>& q) {
    return within(q.stroke_rad, kLargestAngle_rad) & within(q.rotation_rad, kLargestAngle_rad) &
           within(q.stroke_rate_rad_s, hinge_rad_s) & within(q.rotation_rate_rad_s, hinge_rad_s);
  };
  return all(x.position_m, kPlausiblePosition_m) & all(x.com_velocity_m_s, kPlausibleSpeed_m_s) &
         all(x.body_rate_rad_s, body_rad_s) & within(x.attitude.w, 2) & side(x.left) & side(x.right);
}

/// Marks implausible flappers as frozen; true for lanes that are not frozen.
template <class T, class L>
FLAPPY_INLINE typename L::Mask freeze_implausible(const State<L>& x, double step_s, Block<T>& block, int first) {
  typename L::Mask moves = plausible(x, step_s);
  std::uint32_t any_status = 0;
  for (int i = 0; i < kWidth<T>; ++i) any_status |= block.status[first + i];
  if (!any(!moves) && !(any_status & kFrozen)) return moves;
  for (int i = 0; i < kWidth<T>; ++i) {
    std::uint32_t& status = block.status[first + i];
    if (!moves.raw[i]) status |= kFrozen;
    if (status & kFrozen) moves.raw[i] = 0;
  }
  return moves;
}

template <class L>
FLAPPY_INLINE void keep(const typename L::Mask& lanes, const State<L>& before, State<L>& x) {
  const L* from = reinterpret_cast<const L*>(&before);
  L* to = reinterpret_cast<L*>(&x);
  for (int i = 0; i < kStateRows; ++i) to[i] = where(lanes, from[i], to[i]);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
