// Contact of a vehicle's points with the surfaces of the world: gaps, motion of the points, and loads on the vehicle.
// Included by files that are compiled once for each instruction set; the contact law is model/contact.hpp.
#pragma once

#include "model/contact.hpp"
#include "model/vehicle_dynamics.hpp"
#include "sim/rows.hpp"
#include "sim/step.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

using namespace model;

/// Contacts since the steps began, each 0 or 1 in its lanes; now: in the last step.
template <class T>
struct Touched {
  T ground{0.0}, ceiling{0.0}, wall{0.0}, shape{0.0}, now{0.0};
};

template <class T>
FLAPPY_INLINE Gap<T> gap_to(const Shape& shape, const Vec3<T>& p) {
  const Vec3<T> centre{T(shape.centre_m[0]), T(shape.centre_m[1]), T(shape.centre_m[2])};
  const Vec3<T> size{T(shape.half_m[0]), T(shape.half_m[1]), T(shape.half_m[2])};
  const Vec3<T> from_centre = p - centre;
  if (shape.kind == Shape::Kind::sphere) return gap_to_sphere(from_centre, size.x);
  const double* a = shape.attitude;
  const auto m = rotation_matrix(Quaternion<double>{a[0], a[1], a[2], a[3]});
  const auto row = [](const Vec3<double>& r) { return Vec3<T>{T(r.x), T(r.y), T(r.z)}; };
  const Matrix3<T> R{row(m.row_x), row(m.row_y), row(m.row_z)};
  const Vec3<T> at = transpose_times(R, from_centre);
  const Gap<T> gap = shape.kind == Shape::Kind::box ? gap_to_box(at, size) : gap_to_cylinder(at, size.x, size.z);
  return {gap.distance_m, R * gap.normal};
}

/// Pressure of all surfaces of the world on a point at `p` with velocity `v`, both in W.
template <class T>
FLAPPY_INLINE Pressed<T> pressed_by(const StepPlan& world, const ContactConstants<T>& q, const Vec3<T>& p,
                                    const Vec3<T>& v, const T& step_s, Touched<T>& touched) {
  const T zero(0), one(1);
  Pressed<T> pressed = not_pressed<T>();
  const auto meet = [&](const Gap<T>& gap, T& mark, bool pole) {
    mark = where(press(q, gap, pole, v, step_s, pressed), one, mark);
  };
  meet({p.z - T(world.ground_z_m), {zero, zero, one}}, touched.ground, false);
  meet({T(world.ceiling_z_m) - p.z, {zero, zero, T(-one)}}, touched.ceiling, false);
  for (const Wall* w = world.walls; w != world.walls + world.wall_count; ++w) {
    const T x(w->normal_x), y(w->normal_y);
    meet({x * T(p.x - T(w->x_m)) + y * T(p.y - T(w->y_m)), {x, y, zero}}, touched.wall, false);
  }
  for (const Shape* s = world.shapes; s != world.shapes + world.shape_count; ++s)
    meet(gap_to(*s, p), touched.shape, s->kind == Shape::Kind::cylinder);
  return pressed;
}

template <class T>
struct TouchingVehicle {
  const Parameters<T>& p;
  const Sides<WingPose<T>>& pose;
  Matrix3<T> attitude;     // R_WB
  Vec3<T> position_m;      // torso origin, in W
  Vec3<T> velocity_B_m_s;  // velocity of the torso origin, in B
  Vec3<T> body_rate_rad_s;
  Vec3<T> com_m;  // the vehicle's centre of mass from the torso origin, in B
};

/// Position of a point from the torso origin and velocity, in B; its position from the shoulder, in L.
template <class T>
struct PointMotion {
  Vec3<T> arm_B_m, velocity_B_m_s, arm_L_m;
};

template <class T>
FLAPPY_INLINE PointMotion<T> point_on_torso(const TouchingVehicle<T>& s, const Vec3<T>& at_m) {
  return {at_m, s.velocity_B_m_s + cross(s.body_rate_rad_s, at_m), at_m};
}

template <class T>
FLAPPY_INLINE PointMotion<T> point_on_wing(const TouchingVehicle<T>& s, const SideParameters<T>& side,
                                           const WingPose<T>& g, const Vec3<T>& at_m, bool turns) {
  const Vec3<T> arm = turns ? rotate_y(g.theta.sin, g.theta.cos, at_m) : at_m;
  const Vec3<T> relative{T(0), turns ? g.theta_rate : T(0), g.beta_rate};
  const Vec3<T> arm_B = side.shoulder_m + rotate_z(g.beta.sin, g.beta.cos, arm);
  return {arm_B,
          s.velocity_B_m_s + (cross(s.body_rate_rad_s, arm_B) + rotate_z(g.beta.sin, g.beta.cos, cross(relative, arm))),
          arm};
}

/// Adds the loads of the points: a force on the body at each, and its torques about the hinges between point and body.
/// The body feels nothing in lanes that are `held`.
template <class T>
FLAPPY_INLINE void touch(const StepPlan& world, const ContactBlock<Element<T>>& contact, const TouchingVehicle<T>& s,
                         typename T::Mask held, const T& step_s, BodyLoad<T>& body, Sides<SideLoad<T>>& load,
                         Touched<T>& touched) {
  constexpr int kConstants = kRows<ContactConstants>, kMemory = kRows<Bristle>;
  touched.now = T(0);
  for (int i = 0; i < contact.points; ++i) {
    const auto q = load_rows_at<ContactConstants<T>>(contact.rows + i * kConstants * contact.stride, contact.stride);
    Element<T>* const memory = contact.memory + i * kMemory * contact.stride;
    auto bristle = load_rows_at<Bristle<T>>(memory, contact.stride);
    const ContactPoint::Body on = contact.on[i];
    const bool left = on == ContactPoint::Body::left_leading_edge || on == ContactPoint::Body::left_wing;
    const bool turns = on == ContactPoint::Body::left_wing || on == ContactPoint::Body::right_wing;
    const bool on_torso = on == ContactPoint::Body::torso;
    const PointMotion<T> at = on_torso ? point_on_torso(s, q.position_m)
                                       : point_on_wing(s, left ? s.p.left : s.p.right,
                                                       left ? s.pose.left : s.pose.right, q.position_m, turns);
    const Vec3<T> p = s.position_m + s.attitude * at.arm_B_m, v = s.attitude * at.velocity_B_m_s;
    const Pressed<T> pressed = pressed_by(world, q, p, v, step_s, touched);
    const auto near = (pressed.depth_m > T(0)) | (bristle.state > T(0));
    if (!rarely(near)) continue;
    const Vec3<T> force = transpose_times(s.attitude, contact_force(q, pressed, p, v, step_s, bristle));
    store_rows_at(bristle, memory, contact.stride);
    const auto acts = bristle.state > T(0);
    touched.now = where(acts, T(1), touched.now);
    // lanes that do not touch keep their bits: adding 0 would lose the sign of -0
    const auto moves = acts & !held;
    body.force_B = where(moves, body.force_B + force, body.force_B);
    body.moment_B = where(moves, body.moment_B + cross(at.arm_B_m - s.com_m, force), body.moment_B);
    if (on_torso) continue;
    const WingPose<T>& g = left ? s.pose.left : s.pose.right;
    SideLoad<T>& side = left ? load.left : load.right;
    const Vec3<T> moment = cross(at.arm_L_m, rotate_back_z(g.beta.sin, g.beta.cos, force));
    side.stroke_torque_Nm = where(acts, T(side.stroke_torque_Nm + moment.z), side.stroke_torque_Nm);
    if (turns) side.rotation_torque_Nm = where(acts, T(side.rotation_torque_Nm + moment.y), side.rotation_torque_Nm);
  }
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
