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
  Vec3<T> force_L, moment_L;                       // on the wing at the shoulder
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

/// Rates of the hinges at the end of the step, and the accelerations that led there.
template <class T>
struct Motion {
  T stroke_left, stroke_right, rotation_left, rotation_right;  // beta', theta'
  Vec3<T> body_acceleration;                                   // w'
  Vec3<T> force_B;                                             // F
};

/// Angles, stops and friction of one hinge, in the sense of beta or theta.
template <class T>
struct Hinge {
  T rate, lowest_rate, highest_rate, friction;
};

/// The stroke hinge, about beta.
template <int side, class T>
FLAPPY_INLINE Hinge<T> stroke_hinge(const SideParameters<T>& p, const SideState<T>& q, const T& per_step) {
  const T lowest = T(p.stroke_lower_rad - q.stroke_rad) * per_step;
  const T highest = T(p.stroke_upper_rad - q.stroke_rad) * per_step;
  if constexpr (side > 0) return {q.stroke_rate_rad_s, lowest, highest, p.stroke_friction_Nm};
  else return {-q.stroke_rate_rad_s, -highest, -lowest, p.stroke_friction_Nm};
}

template <class T>
FLAPPY_INLINE Hinge<T> rotation_hinge(const SideParameters<T>& p, const SideState<T>& q, const T& per_step) {
  return {q.rotation_rate_rad_s, T(p.rotation_lower_rad - q.rotation_rad) * per_step,
          T(p.rotation_upper_rad - q.rotation_rad) * per_step, p.rotation_friction_Nm};
}

/// Dry friction: the torque that would stop the hinge within the step, no more than the friction.
template <class T>
FLAPPY_INLINE T dry_friction(const T& inertia, const Hinge<T>& q, const T& torque, const T& per_step) {
  return clamp(T(-(inertia * T(q.rate * per_step) + torque)), T(-q.friction), q.friction);
}

template <class T>
FLAPPY_INLINE T clamp_rate(const Hinge<T>& q, const T& rate) {
  return clamp(rate, q.lowest_rate, q.highest_rate);
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
  const Hinge<T> stroke_l = stroke_hinge<+1>(p.left, x.left, per_step);
  const Hinge<T> stroke_r = stroke_hinge<-1>(p.right, x.right, per_step);
  const Hinge<T> rotation_l = rotation_hinge(p.left, x.left, per_step);
  const Hinge<T> rotation_r = rotation_hinge(p.right, x.right, per_step);

  // forces less what the wings' relative motion takes
  const auto in_body = [](const HingedWing<T>& g, const Vec3<T>& a) { return turn_z(g.beta.sin, g.beta.cos, a); };
  const Vec3<T> aero_l = in_body(l, load_l.force_L), aero_r = in_body(r, load_r.force_L);
  const Vec3<T> net_l = aero_l - in_body(l, l.relative_force_L), net_r = aero_r - in_body(r, r.relative_force_L);
  const Vec3<T> moment_l = in_body(l, load_l.moment_L - l.relative_moment_L);
  const Vec3<T> moment_r = in_body(r, load_r.moment_L - r.relative_moment_L);

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
  const auto column = [](const Vec3<T>& spin, const Vec3<T>& arm, const Vec3<T>& e) { return spin + cross(arm, e); };
  const Vec3<T> gsl = column(l.stroke_spin, v.arm_left, l.stroke_column);
  const Vec3<T> gsr = column(r.stroke_spin, v.arm_right, r.stroke_column);
  const Vec3<T> grl = column(l.rotation_spin, v.arm_left, l.rotation_column);
  const Vec3<T> grr = column(r.rotation_spin, v.arm_right, r.rotation_column);
  const Vec3<T> xsl = inverse_inertia * gsl, xsr = inverse_inertia * gsr;
  const Vec3<T> xrl = inverse_inertia * grl, xrr = inverse_inertia * grr;

  // hinges after the body is eliminated
  const auto coupling = [&](const Vec3<T>& e, const Vec3<T>& f) { return T(inverse_mass * dot(e, f)); };
  const Vec3<T>&esl = l.stroke_column, &esr = r.stroke_column, &erl = l.rotation_column, &err = r.rotation_column;
  const Sym2<T> S{(l.stroke_inertia + p.left.rotor_kg_m2 + load_l.stroke_stiffening) - (coupling(esl, esl) + dot(gsl, xsl)),
                  (r.stroke_inertia + p.right.rotor_kg_m2 + load_r.stroke_stiffening) - (coupling(esr, esr) + dot(gsr, xsr)),
                  -(coupling(esl, esr) + dot(gsl, xsr))};
  const Sym2<T> R{(l.rotation_inertia + load_l.rotation_stiffening) - (coupling(erl, erl) + dot(grl, xrl)),
                  (r.rotation_inertia + load_r.rotation_stiffening) - (coupling(err, err) + dot(grr, xrr)),
                  -(coupling(erl, err) + dot(grl, xrr))};
  const T c_ll = l.cross_inertia - (coupling(esl, erl) + dot(gsl, xrl));  // stroke left, rotation left
  const T c_rr = r.cross_inertia - (coupling(esr, err) + dot(gsr, xrr));
  const T c_lr = -(coupling(esl, err) + dot(gsl, xrr));                   // stroke left, rotation right
  const T c_rl = -(coupling(esr, erl) + dot(gsr, xrl));

  T s_l = (load_l.stroke_torque_Nm - l.stroke_bias) - (dot(esl, shoulder_l) + dot(xsl, t));
  T s_r = (load_r.stroke_torque_Nm - r.stroke_bias) - (dot(esr, shoulder_r) + dot(xsr, t));
  const T r_l = (load_l.rotation_torque_Nm - l.rotation_bias) - (dot(erl, shoulder_l) + dot(xrl, t));
  const T r_r = (load_r.rotation_torque_Nm - r.rotation_bias) - (dot(err, shoulder_r) + dot(xrr, t));
  s_l += dry_friction(S.ll, stroke_l, s_l, per_step);
  s_r += dry_friction(S.rr, stroke_r, s_r, per_step);

  // strokes eliminated by K: beta'' = K (s - C theta''), plus what a stop prescribes
  Sym2<T> K = inverse(S);
  T fixed_l(0), fixed_r(0);
  T rate_sl, rate_sr, rate_rl, rate_rr, a_sl, a_sr, a_rl, a_rr;
  const auto eliminate = [&] {
    const T z_ll = K.ll * c_ll + K.lr * c_rl, z_lr = K.ll * c_lr + K.lr * c_rr;
    const T z_rl = K.lr * c_ll + K.rr * c_rl, z_rr = K.lr * c_lr + K.rr * c_rr;
    const T y_l = fixed_l + (K.ll * s_l + K.lr * s_r), y_r = fixed_r + (K.lr * s_l + K.rr * s_r);
    const Sym2<T> A{R.ll - (c_ll * z_ll + c_rl * z_rl), R.rr - (c_lr * z_lr + c_rr * z_rr),
                    R.lr - (c_ll * z_lr + c_rl * z_rr)};
    T b_l = r_l - (c_ll * y_l + c_rl * y_r), b_r = r_r - (c_lr * y_l + c_rr * y_r);
    b_l += dry_friction(A.ll, rotation_l, b_l, per_step);
    b_r += dry_friction(A.rr, rotation_r, b_r, per_step);
    const Sym2<T> N = inverse(A);
    // a rotation on its stop changes the other only through the body; one sweep settles the pair
    const T free_l = rotation_l.rate + step * T(N.ll * b_l + N.lr * b_r);
    const T free_r = rotation_r.rate + step * T(N.lr * b_l + N.rr * b_r);
    const T first_l = clamp_rate(rotation_l, free_l);
    rate_rr = clamp_rate(rotation_r, T(free_r - T(N.lr * T(free_l - first_l)) / N.ll));
    rate_rl = clamp_rate(rotation_l, T(free_l - T(N.lr * T(free_r - rate_rr)) / N.rr));
    a_rl = T(rate_rl - rotation_l.rate) * per_step;
    a_rr = T(rate_rr - rotation_r.rate) * per_step;
    a_sl = y_l - (z_ll * a_rl + z_lr * a_rr);
    a_sr = y_r - (z_rl * a_rl + z_rr * a_rr);
    rate_sl = stroke_l.rate + step * a_sl;
    rate_sr = stroke_r.rate + step * a_sr;
  };
  eliminate();
  const auto out_l = (rate_sl < stroke_l.lowest_rate) | (rate_sl > stroke_l.highest_rate);
  const auto out_r = (rate_sr < stroke_r.lowest_rate) | (rate_sr > stroke_r.highest_rate);
  if (any(out_l | out_r)) {  // a stroke reaches its stop: solve again with its rate given
    const T zero(0);
    const T given_l = T(clamp_rate(stroke_l, rate_sl) - stroke_l.rate) * per_step;
    const T given_r = T(clamp_rate(stroke_r, rate_sr) - stroke_r.rate) * per_step;
    const Sym2<T> free = K;
    K.ll = where(out_l, zero, where(out_r, T(T(1) / S.ll), free.ll));
    K.rr = where(out_r, zero, where(out_l, T(T(1) / S.rr), free.rr));
    K.lr = where(out_l | out_r, zero, free.lr);
    fixed_l = where(out_l, given_l, where(out_r, T(-(T(S.lr / S.ll) * given_r)), zero));
    fixed_r = where(out_r, given_r, where(out_l, T(-(T(S.lr / S.rr) * given_l)), zero));
    eliminate();
    rate_sl = clamp_rate(stroke_l, rate_sl);
    rate_sr = clamp_rate(stroke_r, rate_sr);
  }

  const Vec3<T> hinges = add_scaled(add_scaled(add_scaled(a_sl * gsl, a_sr, gsr), a_rl, grl), a_rr, grr);
  return {rate_sl, rate_sr, rate_rl, rate_rr, inverse_inertia * (t - hinges), (aero_l + aero_r) + body.force_B};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
