// Exact dynamics of the five bodies: torso, two leading edges, two wings.
//
// Coordinates: momentum through the velocity of the whole vehicle's centre of mass C, body rate w, and the hinge rates
// q' = (beta_l', beta_r', theta_l', theta_r'). About C the translation decouples exactly:
//   M dv_C/dt = F + M g
//   | I   G | | w' |   | t |     I: inertia about C           t: external minus relative inertial moment, - w x I w
//   | G^T H | | q''| = | r |     G: angular momentum about C per unit hinge rate
//                                H: hinge inertias, rotor included, minus what the motion of C takes (e_i . e_j / M)
// A hinge also feels its shoulder's acceleration, A = (F - F_rel)/M + w x (w x d), d from C to the shoulder.
// Elimination goes body, strokes, rotations; the rotations come last so that a wing landing on its stop is one 2x2 solve.
//
// Time step: velocities first, then positions with the new velocities. Positions so lead velocities by half a step
// (a leapfrog): forces of position are second order. Linear damping is taken at the mean of old and new rate,
// M_rd at |old| new (exact for pure quadratic drag). Dry friction is the torque that would stop the hinge within the
// step, limited to the friction: it sticks. A stop prescribes the rate that lands on it exactly: no penetration, and
// the impulse only ever takes energy.
#pragma once

#include "model/hinged_wing.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// What acts on one side during a step.
template <class T>
struct SideLoad {
  T force_x_N, force_z_N;                          // on the wing at the shoulder, in L; none along the span
  Vec3<T> moment_Nm;                               // the same
  T stroke_torque_Nm, rotation_torque_Nm;          // about beta and theta, dry friction and inertia excluded
  T stroke_stiffening, rotation_stiffening;        // implicit damping, as inertia added to the hinge
};

template <class T>
struct BodyLoad {
  Vec3<T> force_B, moment_B;  // besides the wings; the moment is about the vehicle's centre of mass
};

/// The whole vehicle about its centre of mass C.
template <class T>
struct WholeVehicle {
  Vec3<T> com, com_rate;        // C from the torso origin, and its velocity relative to B
  Vec3<T> arm_left, arm_right;  // shoulders from C
};

template <class T>
FLAPPY_INLINE WholeVehicle<T> whole_vehicle(const Parameters<T>& p, const HingedWing<T>& l, const HingedWing<T>& r) {
  const Vec3<T> com = p.inverse_mass_1_kg * (p.fixed_moment_kg_m + (l.moment + r.moment));
  return {com, p.inverse_mass_1_kg * (l.momentum + r.momentum), p.left.shoulder_m - com, p.right.shoulder_m - com};
}

/// The vehicle's centre of mass from the torso origin, in B.
template <class T>
FLAPPY_INLINE Vec3<T> centre_of_mass(const Parameters<T>& p, const State<T>& x) {
  return p.inverse_mass_1_kg * (p.fixed_moment_kg_m + (moment_about_shoulder<+1>(p.left, x.left) +
                                                       moment_about_shoulder<-1>(p.right, x.right)));
}

/// Second moment that an assembly of first moment h, hung at s, adds about the origin besides its own: s h^T + h s^T.
template <class T>
FLAPPY_INLINE Sym3<T> hung_at(const Vec3<T>& s, const Vec3<T>& h) {
  const T xx = s.x * h.x, yy = s.y * h.y, zz = s.z * h.z;
  return {xx + xx, yy + yy, zz + zz, s.x * h.y + s.y * h.x, s.y * h.z + s.z * h.y, s.x * h.z + s.z * h.x};
}

/// Inertia about C in B.
template <class T>
FLAPPY_INLINE Sym3<T> second_moment_about_com(const Parameters<T>& p, const HingedWing<T>& l, const HingedWing<T>& r,
                                              const Vec3<T>& com) {
  const Sym3<T> o = p.fixed_second_kg_m2 + ((l.second + hung_at(p.left.shoulder_m, l.moment)) +
                                            (r.second + hung_at(p.right.shoulder_m, r.moment)));
  const Vec3<T> m = p.fixed_moment_kg_m + (l.moment + r.moment);
  return {o.xx - m.x * com.x, o.yy - m.y * com.y, o.zz - m.z * com.z,
          o.xy - m.x * com.y, o.yz - m.y * com.z, o.xz - m.x * com.z};
}

/// What a step does to the vehicle.
template <class T>
struct Motion {
  T stroke_left, stroke_right, rotation_left, rotation_right;  // turns of beta and theta in this step, rad
  Vec3<T> body_acceleration;                                   // w'
  Vec3<T> force_B;                                             // F
};

/// Rate, stops and friction of one hinge, about beta or theta. Stops as the turns in one step that just reach them.
template <class T>
struct Hinge {
  T rate, lowest_turn, highest_turn, friction;
};

template <int side, class T>
FLAPPY_INLINE Hinge<T> stroke_hinge(const SideParameters<T>& p, const SideState<T>& q) {
  const T lowest = p.stroke_lower_rad - q.stroke_rad, highest = p.stroke_upper_rad - q.stroke_rad;
  if constexpr (side > 0) return {q.stroke_rate_rad_s, lowest, highest, p.stroke_friction_Nm};
  else return {-q.stroke_rate_rad_s, -highest, -lowest, p.stroke_friction_Nm};
}

template <class T>
FLAPPY_INLINE Hinge<T> rotation_hinge(const SideParameters<T>& p, const SideState<T>& q) {
  return {q.rotation_rate_rad_s, p.rotation_lower_rad - q.rotation_rad, p.rotation_upper_rad - q.rotation_rad,
          p.rotation_friction_Nm};
}

/// Dry friction: the torque that would stop the hinge within the step, no more than the friction.
template <class T>
FLAPPY_INLINE T dry_friction(const T& inertia, const Hinge<T>& q, const T& torque, const T& per_step) {
  return clamp(T(-(inertia * T(q.rate * per_step) + torque)), T(-q.friction), q.friction);
}

template <class T>
FLAPPY_INLINE T stopped(const Hinge<T>& q, const T& turn) {
  return clamp(turn, q.lowest_turn, q.highest_turn);
}

/// A symmetric 2x2 matrix, left and right.
template <class T>
struct Sym2 {
  T ll, rr, lr;
};
template <class T>
FLAPPY_INLINE Sym2<T> inverse(const Sym2<T>& m) {
  const T scale = T(1) / T(m.ll * m.rr - m.lr * m.lr);
  return {scale * m.rr, scale * m.ll, -(scale * m.lr)};
}

/// `against_gravity_B`: what a body at rest accelerates by relative to free fall, in B, m/s^2.
template <class T>
FLAPPY_INLINE Motion<T> solve(const Parameters<T>& p, const State<T>& x, const HingedWing<T>& l,
                              const HingedWing<T>& r, const WholeVehicle<T>& v, const Vec3<T>& against_gravity_B,
                              const SideLoad<T>& load_l, const SideLoad<T>& load_r, const BodyLoad<T>& body,
                              const T& step, const T& per_step) {
  const Vec3<T>& w = x.body_rate_rad_s;
  const Hinge<T> stroke_l = stroke_hinge<+1>(p.left, x.left), stroke_r = stroke_hinge<-1>(p.right, x.right);
  const Hinge<T> rotation_l = rotation_hinge(p.left, x.left), rotation_r = rotation_hinge(p.right, x.right);

  // forces less what the wings' relative motion takes
  const auto in_body = [](const HingedWing<T>& g, const Vec3<T>& a) { return turn_z(g.beta.sin, g.beta.cos, a); };
  const Vec3<T> aero_l = turn_z(l.beta.sin, l.beta.cos, load_l.force_x_N, load_l.force_z_N);
  const Vec3<T> aero_r = turn_z(r.beta.sin, r.beta.cos, load_r.force_x_N, load_r.force_z_N);
  const Vec3<T> net_l = aero_l - in_body(l, l.relative_force_L), net_r = aero_r - in_body(r, r.relative_force_L);
  const Vec3<T> moment_l = in_body(l, load_l.moment_Nm - l.relative_moment_L);
  const Vec3<T> moment_r = in_body(r, load_r.moment_Nm - r.relative_moment_L);

  const Sym3<T> second = second_moment_about_com(p, l, r, v.com);
  Sym3<T> inverse_inertia = inverse(inertia_of(second));
  T inverse_mass = p.inverse_mass_1_kg;
  const Vec3<T> t = ((moment_l + moment_r) + (cross(v.arm_left, net_l) + cross(v.arm_right, net_r))) +
                    (body.moment_B - cross(second * w, w));

  // acceleration of the shoulders less gravity
  const T w2 = dot(w, w);
  const Vec3<T> common = inverse_mass * ((net_l + net_r) + body.force_B);
  const auto shoulder = [&](const Vec3<T>& d) { return common + (dot(w, d) * w - w2 * d); };
  Vec3<T> shoulder_l = shoulder(v.arm_left), shoulder_r = shoulder(v.arm_right);

  const auto held = x.support > T(0);
  if (any(held)) {  // standing or welded: the body does not move, so its inertia is infinite
    const T zero(0);
    inverse_mass = where(held, zero, inverse_mass);
    inverse_inertia = {where(held, zero, inverse_inertia.xx), where(held, zero, inverse_inertia.yy),
                       where(held, zero, inverse_inertia.zz), where(held, zero, inverse_inertia.xy),
                       where(held, zero, inverse_inertia.yz), where(held, zero, inverse_inertia.xz)};
    shoulder_l = where(held, against_gravity_B, shoulder_l);
    shoulder_r = where(held, against_gravity_B, shoulder_r);
  }

  // G, and I^-1 G
  const auto& esl = l.stroke_column;
  const auto& esr = r.stroke_column;
  const auto& erl = l.rotation_column;
  const auto& err = r.rotation_column;
  const Vec3<T> gsl = l.stroke_spin + cross(v.arm_left, esl), gsr = r.stroke_spin + cross(v.arm_right, esr);
  const Vec3<T> grl = l.rotation_spin + cross(v.arm_left, erl), grr = r.rotation_spin + cross(v.arm_right, err);
  const Vec3<T> xsl = inverse_inertia * gsl, xsr = inverse_inertia * gsr;
  const Vec3<T> xrl = inverse_inertia * grl, xrr = inverse_inertia * grr;

  // hinges after the body is eliminated: S strokes, R rotations, C between them (stroke, rotation)
  const auto taken = [&](const auto& e, const auto& f, const Vec3<T>& g, const Vec3<T>& y) {
    return T(inverse_mass * dot(e, f) + dot(g, y));
  };
  const Sym2<T> S{T(l.stroke_inertia + (p.left.rotor_kg_m2 + load_l.stroke_stiffening)) - taken(esl, esl, gsl, xsl),
                  T(r.stroke_inertia + (p.right.rotor_kg_m2 + load_r.stroke_stiffening)) - taken(esr, esr, gsr, xsr),
                  -taken(esl, esr, gsl, xsr)};
  const Sym2<T> R{T(l.rotation_inertia + load_l.rotation_stiffening) - taken(erl, erl, grl, xrl),
                  T(r.rotation_inertia + load_r.rotation_stiffening) - taken(err, err, grr, xrr),
                  -taken(erl, err, grl, xrr)};
  const T C_ll = l.cross_inertia - taken(esl, erl, gsl, xrl), C_rr = r.cross_inertia - taken(esr, err, gsr, xrr);
  const T C_lr = -taken(esl, err, gsl, xrr), C_rl = -taken(esr, erl, gsr, xrl);

  T s_l = (load_l.stroke_torque_Nm - l.stroke_bias) - (dot(esl, shoulder_l) + dot(xsl, t));
  T s_r = (load_r.stroke_torque_Nm - r.stroke_bias) - (dot(esr, shoulder_r) + dot(xsr, t));
  const T r_l = (load_l.rotation_torque_Nm - l.rotation_bias) - (dot(erl, shoulder_l) + dot(xrl, t));
  const T r_r = (load_r.rotation_torque_Nm - r.rotation_bias) - (dot(err, shoulder_r) + dot(xrr, t));
  s_l += dry_friction(S.ll, stroke_l, s_l, per_step);
  s_r += dry_friction(S.rr, stroke_r, s_r, per_step);

  // strokes: beta'' = given + K (s - C theta''); K loses the row of a stroke that its stop prescribes
  Sym2<T> K = inverse(S);
  T given_l(0), given_r(0);
  T a_sl, a_sr, a_rl, a_rr;  // beta'', theta''
  Motion<T> m;
  const T step2 = step * step, per_step2 = per_step * per_step;
  const auto accelerate = [&] {
    const T z_ll = K.ll * C_ll + K.lr * C_rl, z_lr = K.ll * C_lr + K.lr * C_rr;
    const T z_rl = K.lr * C_ll + K.rr * C_rl, z_rr = K.lr * C_lr + K.rr * C_rr;
    const T y_l = given_l + (K.ll * s_l + K.lr * s_r), y_r = given_r + (K.lr * s_l + K.rr * s_r);
    const Sym2<T> A{R.ll - (C_ll * z_ll + C_rl * z_rl), R.rr - (C_lr * z_lr + C_rr * z_rr),
                    R.lr - (C_ll * z_lr + C_rl * z_rr)};
    T b_l = r_l - (C_ll * y_l + C_rl * y_r), b_r = r_r - (C_lr * y_l + C_rr * y_r);
    b_l += dry_friction(A.ll, rotation_l, b_l, per_step);
    b_r += dry_friction(A.rr, rotation_r, b_r, per_step);
    const Sym2<T> N = inverse(A);
    const T coast_l = step * rotation_l.rate, coast_r = step * rotation_r.rate;
    const T free_l = coast_l + step2 * T(N.ll * b_l + N.lr * b_r);
    const T free_r = coast_r + step2 * T(N.lr * b_l + N.rr * b_r);
    // what one stop takes from its wing moves the other, through the body: by N_lr / N_ll = -A_lr / A_rr of it
    const T coupling = A.lr / T(A.ll * A.rr);
    const T taken_l = free_l - stopped(rotation_l, free_l), taken_r = free_r - stopped(rotation_r, free_r);
    m.rotation_left = stopped(rotation_l, T(free_l + T(coupling * A.rr) * taken_r));
    m.rotation_right = stopped(rotation_r, T(free_r + T(coupling * A.ll) * taken_l));
    a_rl = T(m.rotation_left - coast_l) * per_step2;
    a_rr = T(m.rotation_right - coast_r) * per_step2;
    a_sl = y_l - (z_ll * a_rl + z_lr * a_rr);
    a_sr = y_r - (z_rl * a_rl + z_rr * a_rr);
    m.stroke_left = step * stroke_l.rate + step2 * a_sl;
    m.stroke_right = step * stroke_r.rate + step2 * a_sr;
  };
  accelerate();
  const auto out_l = (m.stroke_left < stroke_l.lowest_turn) | (m.stroke_left > stroke_l.highest_turn);
  const auto out_r = (m.stroke_right < stroke_r.lowest_turn) | (m.stroke_right > stroke_r.highest_turn);
  if (any(out_l | out_r)) {  // a stroke reaches its stop: once more, with its turn given
    const T zero(0);
    const T stop_l = T(stopped(stroke_l, m.stroke_left) - step * stroke_l.rate) * per_step2;
    const T stop_r = T(stopped(stroke_r, m.stroke_right) - step * stroke_r.rate) * per_step2;
    const Sym2<T> free = K;
    K.ll = where(out_l, zero, where(out_r, T(T(1) / S.ll), free.ll));
    K.rr = where(out_r, zero, where(out_l, T(T(1) / S.rr), free.rr));
    K.lr = where(out_l | out_r, zero, free.lr);
    given_l = where(out_l, stop_l, where(out_r, T(-(T(S.lr / S.ll) * stop_r)), zero));
    given_r = where(out_r, stop_r, where(out_l, T(-(T(S.lr / S.rr) * stop_l)), zero));
    accelerate();
    m.stroke_left = stopped(stroke_l, m.stroke_left);
    m.stroke_right = stopped(stroke_r, m.stroke_right);
  }

  const Vec3<T> hinges = add_scaled(add_scaled(add_scaled(a_sl * gsl, a_sr, gsr), a_rl, grl), a_rr, grr);
  m.body_acceleration = inverse_inertia * (t - hinges);
  m.force_B = (aero_l + aero_r) + body.force_B;
  return m;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
