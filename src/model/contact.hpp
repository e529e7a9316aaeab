// Contact of a point with a surface: a compliant normal force with Hunt and Crossley's damping, friction by one
// bristle, and distances to simple solids. With d the depth of the point, n the surface's normal, u = d' the speed at
// which the point sinks:
//   F_n = k d max(0, 1 + a u)            a = 3/2 c                                          [1]
//   F_t = -(k_t s + c_t v_t)             |F_t| <= mu F_n                                    [2]
// s: stretch of the bristle along the surface from its anchor. An anchor that is pulled harder than mu F_n follows the
// point; at rest the stretch holds the load without creep. k_t = 0.8 k, for Poisson's ratio 1/3 [3]; c_t = 2 sqrt(k_t /
// w), critical for the mass 1/w below. The exponent of d is 1, as for a pad of constant area. Without other forces, a
// ball that lands on a plane with the speed u leaves with e u, where
//   a u (1 + e) = ln((1 + a u)/(1 - a e u))         e = 1 - c u + O((c u)^2)
// for any k, mass and exponent: u du/(1 + a u) = -(k/m) d dd, integrated from d = 0 to d = 0. F_n >= 0, so nothing
// sticks, except points that grasp: a point that meets a pole (a cylinder) more slowly than its limit is held by its
// bristle in all three directions, however hard it is pulled, until a reset.
//
// Time step h, leapfrog: positions are half a step ahead of rates. Springs are explicit, damping is implicit. u in the
// middle of the step is u - h w F/2, where only the contact force F changes it; the same for v_t:
//   F_n = k d max(0, 1 + a u)/(1 + h w k d a/2)     F_t = -(k_t s + c_t v_t)/(1 + h w c_t/2)
// This is first order in h if other forces act, and damping never reverses a speed. w, 1/kg, is at least the inverse
// mass of the point in any direction while its body flies alone: hinges only add to that mass. An explicit spring is
// stable for h^2 omega^2 < 4; omega^2 is at most the largest eigenvalue of M^-1 sum k J^T J of one body with all its
// points, because a vehicle's kinetic energy is the sum of those of its bodies (Rayleigh). contact_fault() accepts h^2
// omega^2 <= 1.
//
// Assumes points, whose friction resists no spin, rigid solids, and depths well below the thickness of the solids.
// Where several surfaces meet, each presses independently; the bristle acts on the one in which the point is deepest.
// [1] Hunt, Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42(2), 440-445,
// 1975.
// [2] Cundall, Strack, A discrete numerical model for granular assemblies, Geotechnique 29(1), 47-65, 1979.
// [3] Mindlin, Compliance of elastic bodies in contact, J. Appl. Mech. 16, 259-268, 1949: k_t/k = 2 (1 - nu)/(2 - nu).
#pragma once

#include <optional>
#include <vector>

#include "flappy/vehicle.hpp"
#include "model/linear_algebra.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// Distance of a point to the surface of a solid, negative inside it, and the outward normal of the surface there.
template <class T>
struct Gap {
  T distance_m;
  Vec3<T> normal;
};

/// Length below which a vector has no defined direction, m.
inline constexpr double kNoLength_m = 1e-12;

/// Gap between a point and a sphere; `p`: the point relative to the sphere's centre.
template <class T>
FLAPPY_INLINE Gap<T> gap_to_sphere(const Vec3<T>& p, const T& radius_m) {
  const T length = sqrt(dot(p, p));
  const T scale = T(1) / max(length, T(kNoLength_m));
  const auto apart = length > T(kNoLength_m);
  return {length - radius_m, where(apart, scale * p, Vec3<T>{T(0), T(0), T(1)})};
}

/// Gap to a box; `p`: in its frame. Outside, the nearest point of a face, edge or corner counts; inside, the nearest
/// face.
template <class T>
FLAPPY_INLINE Gap<T> gap_to_box(const Vec3<T>& p, const Vec3<T>& half_m) {
  const T zero(0), one(1);
  const Vec3<T> q{abs(p.x) - half_m.x, abs(p.y) - half_m.y, abs(p.z) - half_m.z};
  const Vec3<T> out{max(q.x, zero), max(q.y, zero), max(q.z, zero)};
  const T length = sqrt(dot(out, out)), nearest = max(q.x, max(q.y, q.z));
  const auto outside = nearest > zero;
  const T scale = one / max(length, T(kNoLength_m));
  const T face_x = where(q.x >= nearest, one, zero), face_y = where(q.y >= nearest, T(one - face_x), zero);
  const Vec3<T> n = where(outside, scale * out, Vec3<T>{face_x, face_y, T(one - face_x) - face_y});
  const auto along = [](const T& size, const T& side) { return where(side < T(0), T(-size), size); };
  return {where(outside, length, nearest), {along(n.x, p.x), along(n.y, p.y), along(n.z, p.z)}};
}

/// Gap between a point and a cylinder about z; `p`: in the frame of the cylinder.
template <class T>
FLAPPY_INLINE Gap<T> gap_to_cylinder(const Vec3<T>& p, const T& radius_m, const T& half_length_m) {
  const T zero(0), one(1);
  const T across = sqrt(T(p.x * p.x + p.y * p.y)), per_across = one / max(across, T(kNoLength_m));
  const auto aside = across > T(kNoLength_m);
  const T x = where(aside, T(p.x * per_across), one), y = where(aside, T(p.y * per_across), zero);
  const T qr = across - radius_m, qz = abs(p.z) - half_length_m;
  const T out_r = max(qr, zero), out_z = max(qz, zero);
  const T length = sqrt(T(out_r * out_r + out_z * out_z)), nearest = max(qr, qz);
  const auto outside = nearest > zero;
  const T scale = one / max(length, T(kNoLength_m));
  const T side = where(qr >= nearest, one, zero);
  const T nr = where(outside, T(scale * out_r), side), nz = where(outside, T(scale * out_z), T(one - side));
  return {where(outside, length, nearest), {nr * x, nr * y, where(p.z < zero, T(-nz), nz)}};
}

template <class T>
struct ContactConstants {
  Vec3<T> position_m;                      // in the frame of its body
  T stiffness_N_m, damping_s_m, friction;  // k, a, mu
  T tangential_N_m, tangential_Ns_m;       // k_t, c_t
  T inverse_mass_1_kg;                     // w
  T grasp_m_s;
};

template <class T>
struct Bristle {
  Vec3<T> anchor_m;  // in W, while the point touches
  T state;           // 0: apart, 1: touches, 2: grasps
};

/// Pressure on a point: the sum of all normal forces, in W, and the surface in which the point is deepest.
template <class T>
struct Pressed {
  Vec3<T> force_N;
  T depth_m, normal_N;
  Vec3<T> normal;
  T pole;  // 1 if that surface belongs to a pole, which can be grasped; 0 otherwise
};

template <class T>
FLAPPY_INLINE Pressed<T> not_pressed() {
  const T zero(0);
  return {{zero, zero, zero}, zero, zero, {zero, zero, T(1)}, zero};
}

/// Adds the normal force of a surface on a point with velocity `v` in W. True in lanes where they touch.
template <class T>
FLAPPY_INLINE auto press(const ContactConstants<T>& q, const Gap<T>& gap, bool pole, const Vec3<T>& v, const T& step_s,
                         Pressed<T>& pressed) {
  const T depth = -gap.distance_m, sinks = -dot(gap.normal, v), elastic = q.stiffness_N_m * depth;
  const T damped = T(1) + T(T(0.5) * step_s * T(q.inverse_mass_1_kg * q.damping_s_m)) * elastic;
  const auto touches = depth > T(0);
  const T force = where(touches, T(T(elastic * max(T(0), T(T(1) + q.damping_s_m * sinks))) / damped), T(0));
  pressed.force_N = add_scaled(pressed.force_N, force, gap.normal);
  const auto deeper = depth > pressed.depth_m;
  pressed.depth_m = where(deeper, depth, pressed.depth_m);
  pressed.normal_N = where(deeper, force, pressed.normal_N);
  pressed.normal = where(deeper, gap.normal, pressed.normal);
  pressed.pole = where(deeper, T(pole ? 1 : 0), pressed.pole);
  return touches;
}

/// Force on a point at `p` with velocity `v`, both in W, including friction and grasp. Updates its bristle.
template <class T>
FLAPPY_INLINE Vec3<T> contact_force(const ContactConstants<T>& q, const Pressed<T>& pressed, const Vec3<T>& p,
                                    const Vec3<T>& v, const T& step_s, Bristle<T>& bristle) {
  const T zero(0);
  const Vec3<T>& n = pressed.normal;
  const auto touches = pressed.depth_m > zero;
  const auto held = bristle.state > T(1.5);
  const auto fresh = touches & (bristle.state == zero);
  const auto grasps = held | (fresh & (pressed.pole > zero) & (dot(v, v) < q.grasp_m_s * q.grasp_m_s));
  const Vec3<T> anchor = where(fresh, p, bristle.anchor_m);

  const auto along = [&](const Vec3<T>& a) { return where(grasps, a, add_scaled(a, T(-dot(n, a)), n)); };
  const Vec3<T> s = along(p - anchor), slip = along(v);
  const T damped = T(1) / T(T(1) + T(T(0.5) * step_s) * T(q.inverse_mass_1_kg * q.tangential_Ns_m));
  const Vec3<T> pull = damped * add_scaled(q.tangential_Ns_m * slip, q.tangential_N_m, s);
  const T limit = q.friction * pressed.normal_N;
  const auto share_of = [&](const T& size) { return where(size > limit, T(limit / max(size, T(1e-30))), T(1)); };
  const T share = share_of(T(sqrt(dot(pull, pull)))),
          kept = share_of(T(T(damped * q.tangential_N_m) * sqrt(dot(s, s))));
  const auto slips = touches & (kept < T(1)) & !grasps;

  bristle.anchor_m = where(touches | held, where(slips, add_scaled(p, T(-kept), s), anchor), Vec3<T>{zero, zero, zero});
  bristle.state = where(grasps, T(2), where(touches, T(1), zero));
  const Vec3<T> rubbed = add_scaled(pressed.force_N, T(-share), pull);
  return where(grasps, T(-1) * pull, where(touches, rubbed, Vec3<T>{zero, zero, zero}));
}

}  // namespace FLAPPY_ISA

inline constexpr std::size_t kMaxContactPoints = 16;

std::vector<ContactConstants<double>> contact_constants(const Vehicle& vehicle);

/// Largest h^2 omega^2 that contact_fault() accepts by default; explicit springs are stable below 4.
inline constexpr double kStiffestContact = 1;

/// The first body whose points are too stiff for steps of `step_s`, reported by its stiffest point, if any.
std::optional<PhysicalFault> contact_fault(const Vehicle& vehicle, double step_s, double limit = kStiffestContact);

}  // namespace flappy::model
