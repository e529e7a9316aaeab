// Exact dynamics of the five bodies: torso, two leading edges, two wings. Coordinates: the velocity of the whole
// vehicle's centre of mass C (its momentum / mass), body rate w, and the hinge rates q' = (beta_l', beta_r', theta_l',
// theta_r'). About C the translation decouples exactly:
//   M dv_C/dt = F + M g
//   | I    G | | w'  |   | t |     I: inertia about C
//   | G^T  H | | q'' | = | r |     G: angular momentum about C per unit hinge rate
//                                  H: hinge inertias, rotor included, less the share of the motion of C, e_i . e_j / M
// e_i: momentum per unit hinge rate; t: external less relative inertial moment, less w x I w. A hinge also feels the
// acceleration of its shoulder, A = (F - F_rel)/M + w x (w x d), d from C to the shoulder. Elimination order: body,
// strokes, rotations, so that a wing that lands on its stop is one 2x2 solve.
//
// Time step h: rates first, then positions with the new rates, a leapfrog in which positions lead by h/2. Terms that
// depend on rates are taken in the middle of the step, where positions already are (sim/physics_step.hpp): with the
// rates at its start, the method would be first order in h even without stops. Linear damping acts at the mean of old
// and new rate, M_rd at |old| new (exact for pure quadratic drag). Dry friction is the torque that would stop the hinge
// within the step, limited to the friction, so the hinge sticks. What reaches a stroke through the rotation of its wing
// is first order in h.
//
// A landing takes two steps. In the first, the stop prescribes the turn d that lands on it exactly, which leaves d/h =
// tau u of the rate u. In the second the hinge would be held, and the rest of its momentum goes. Angles lead rates by
// h/2, so the landing was (3/2 - tau) h before the rates at the end of the second step, and a torque that pulls the
// stroke off its stop acts from then on: it leaves with the rate (3/2 - tau) h a, a the acceleration without the stop;
// not if another hinge lands in the same step, because its impulse is no such torque. No penetration, and the impulse
// never adds energy.
#pragma once

#include "model/hinged_wing.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class S>
struct Sides {
  S left, right;
};

template <class T>
struct SideLoad {
  T force_x_N, force_z_N;                  // on the wing at the shoulder, in L; the force along the span is 0
  Vec3<T> moment_Nm;                       // on the wing about the shoulder, in L
  T stroke_torque_Nm, rotation_torque_Nm;  // about beta and theta, dry friction and inertia excluded
  T rotation_stiffening_kg_m2;             // inertia about theta that stands for implicit damping
};

template <class T>
struct BodyLoad {
  Vec3<T> force_B, moment_B;  // in addition to the wings; the moment is about the vehicle's centre of mass
};

/// The whole vehicle about its centre of mass C.
template <class T>
struct WholeVehicle {
  Vec3<T> com, com_rate;        // C from the torso origin, and its velocity relative to B
  Vec3<T> arm_left, arm_right;  // shoulders from C
};

template <class T>
FLAPPY_INLINE WholeVehicle<T> whole_vehicle(const Parameters<T>& p, const Sides<WingPose<T>>& pose) {
  const Vec3<T> com = p.inverse_mass_1_kg * (p.fixed_moment_kg_m + (pose.left.moment + pose.right.moment));
  return {com, p.inverse_mass_1_kg * (pose.left.momentum + pose.right.momentum), p.left.shoulder_m - com,
          p.right.shoulder_m - com};
}

template <class T>
FLAPPY_INLINE Vec3<T> centre_of_mass(const Parameters<T>& p, const State<T>& x) {
  return p.inverse_mass_1_kg * (p.fixed_moment_kg_m + (moment_about_shoulder<+1>(p.left, x.left) +
                                                       moment_about_shoulder<-1>(p.right, x.right)));
}

/// Second moment that an assembly with first moment h, hung at s, adds about the origin to its own: s h^T + h s^T.
template <class T>
FLAPPY_INLINE Sym3<T> hung_at(const Vec3<T>& s, const Vec3<T>& h) {
  const T xx = s.x * h.x, yy = s.y * h.y, zz = s.z * h.z;
  return {xx + xx, yy + yy, zz + zz, s.x * h.y + s.y * h.x, s.y * h.z + s.z * h.y, s.x * h.z + s.z * h.x};
}

template <class T>
FLAPPY_INLINE Sym3<T> second_moment_about_com(const Parameters<T>& p, const Sides<WingPose<T>>& pose,
                                              const Sides<WingInertia<T>>& wing, const Vec3<T>& com) {
  const Sym3<T> o = p.fixed_second_kg_m2 +
                    (hung_at(p.left.shoulder_m, pose.left.moment) + hung_at(p.right.shoulder_m, pose.right.moment));
  const Vec3<T> m = p.fixed_moment_kg_m + (pose.left.moment + pose.right.moment);
  const Sym3<T> placed{o.xx - m.x * com.x, o.yy - m.y * com.y, o.zz - m.z * com.z,
                       o.xy - m.x * com.y, o.yz - m.y * com.z, o.xz - m.x * com.z};
  return placed + (wing.left.second + wing.right.second);
}

/// Rates of this step and the previous one, stops and friction of one hinge, about beta or theta. A stop is given as
/// the turn within one step that just reaches it.
template <class T>
struct Hinge {
  T rate, before, lowest_turn, highest_turn, friction;
};

template <int side, class T>
FLAPPY_INLINE Hinge<T> stroke_hinge(const SideParameters<T>& p, const SideState<T>& q, const T& friction) {
  const T lowest = p.stroke_lower_rad - q.stroke_rad, highest = p.stroke_upper_rad - q.stroke_rad;
  if constexpr (side > 0) return {q.stroke_rate_rad_s, q.stroke_rate_before_rad_s, lowest, highest, friction};
  else return {-q.stroke_rate_rad_s, -q.stroke_rate_before_rad_s, -highest, -lowest, friction};
}

template <class T>
FLAPPY_INLINE Hinge<T> rotation_hinge(const SideParameters<T>& p, const SideState<T>& q, const T& friction) {
  return {q.rotation_rate_rad_s, q.rotation_rate_before_rad_s, p.rotation_lower_rad - q.rotation_rad,
          p.rotation_upper_rad - q.rotation_rad, friction};
}

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

  friend FLAPPY_INLINE Sym2 operator*(const T& s, const Sym2& m) { return {s * m.ll, s * m.rr, s * m.lr}; }
};
template <class T>
FLAPPY_INLINE Inverse<Sym2<T>, T> inverse(const Sym2<T>& m) {
  return {{m.rr, m.ll, -m.lr}, T(1) / T(m.ll * m.rr - m.lr * m.lr)};
}

/// Inertia of the body against forces and moments about C; infinite for a body that is held.
template <class T>
struct BodyInertia {
  T inverse_mass;
  Sym3<T> second_moment;        // of the whole vehicle about C, wings frozen
  Inverse<Sym3<T>, T> inverse;  // of the inertia tensor
};

template <class T>
FLAPPY_INLINE BodyInertia<T> body_inertia(const Parameters<T>& p, const State<T>& x, const Sides<WingPose<T>>& pose,
                                          const Sides<WingInertia<T>>& wing, const WholeVehicle<T>& v) {
  const Sym3<T> second = second_moment_about_com(p, pose, wing, v.com);
  BodyInertia<T> b{p.inverse_mass_1_kg, second, inverse(inertia_of(second))};
  const auto held = x.support > T(0);
  if (rarely(held)) {
    b.inverse_mass = where(held, T(0), b.inverse_mass);
    b.inverse.scale = where(held, T(0), b.inverse.scale);
  }
  return b;
}

/// Loads on the body, and accelerations of the shoulders while the hinges do not accelerate.
template <class T>
struct BodyDrive {
  Vec3<T> force, moment;                  // F, and t about C
  Vec3<T> shoulder_left, shoulder_right;  // A
};

/// `up_B`: the vertical in B; `gravity`: m/s^2.
template <class T>
FLAPPY_INLINE BodyDrive<T> drive_body(const Parameters<T>& p, const State<T>& x, const Sides<WingPose<T>>& pose,
                                      const Sides<WingInertia<T>>& wing, const WholeVehicle<T>& v,
                                      const BodyInertia<T>& inertia, const Sides<SideLoad<T>>& load,
                                      const BodyLoad<T>& body, const Vec3<T>& up_B, const T& gravity) {
  const Vec3<T>& w = x.body_rate_rad_s;
  const auto to_B = [](const WingPose<T>& g, const Vec3<T>& a) { return rotate_z(g.beta.sin, g.beta.cos, a); };
  const auto air = [](const WingPose<T>& g, const SideLoad<T>& a) {
    return rotate_z(g.beta.sin, g.beta.cos, a.force_x_N, a.force_z_N);
  };
  const Vec3<T> air_l = air(pose.left, load.left), air_r = air(pose.right, load.right);
  const Vec3<T> net_l = air_l - to_B(pose.left, wing.left.relative_force_L);
  const Vec3<T> net_r = air_r - to_B(pose.right, wing.right.relative_force_L);
  const Vec3<T> moment_l = to_B(pose.left, load.left.moment_Nm - wing.left.relative_moment_L);
  const Vec3<T> moment_r = to_B(pose.right, load.right.moment_Nm - wing.right.relative_moment_L);
  const Vec3<T> t = ((moment_l + moment_r) + (cross(v.arm_left, net_l) + cross(v.arm_right, net_r))) +
                    (body.moment_B - cross(inertia.second_moment * w, w));

  const T w2 = dot(w, w);
  const Vec3<T> common = p.inverse_mass_1_kg * ((net_l + net_r) + body.force_B);
  const auto shoulder = [&](const Vec3<T>& d) { return common + (dot(w, d) * w - w2 * d); };
  BodyDrive<T> drive{(air_l + air_r) + body.force_B, t, shoulder(v.arm_left), shoulder(v.arm_right)};
  const auto held = x.support > T(0);
  if (rarely(held)) {
    const Vec3<T> rest = gravity * up_B;
    drive.shoulder_left = where(held, rest, drive.shoulder_left);
    drive.shoulder_right = where(held, rest, drive.shoulder_right);
  }
  return drive;
}

/// The hinges after the body is eliminated. Inertias and torques are multiplied by `scale`, a power of two that brings
/// the inertias near 1: products of three of an insect's would leave the range of single precision.
template <class T>
struct HingeSystem {
  Vec3<T> stroke_l, stroke_r, rotation_l, rotation_r;  // columns of G, not scaled
  T scale;
  Sym2<T> strokes, rotations;  // blocks of H - G^T I^-1 G
  T ll, rr, lr, rl;            // coupling of strokes and rotations: (stroke, rotation)
  T s_l, s_r, r_l, r_r;        // torques on strokes and rotations, without dry friction
};

template <class T>
FLAPPY_INLINE HingeSystem<T> eliminate_body(const Parameters<T>& p, const Sides<WingPose<T>>& pose,
                                            const Sides<WingInertia<T>>& wing, const WholeVehicle<T>& v,
                                            const BodyInertia<T>& body, const BodyDrive<T>& drive,
                                            const Sides<SideLoad<T>>& load) {
  const WingInertia<T>&l = wing.left, &r = wing.right;
  HingeSystem<T> h;
  const AcrossZ<T> esl{pose.left.moment}, esr{pose.right.moment};
  h.stroke_l = plus_cross(l.stroke_spin, v.arm_left, esl);
  h.stroke_r = plus_cross(r.stroke_spin, v.arm_right, esr);
  h.rotation_l = l.rotation_spin + cross(v.arm_left, l.rotation_column);
  h.rotation_r = r.rotation_spin + cross(v.arm_right, r.rotation_column);
  // columns of adj(I) G; the division by the determinant of I comes last
  const Sym3<T>& adjugate = body.inverse.adjugate;
  const T& scale = body.inverse.scale;
  const Vec3<T> xsl = adjugate * h.stroke_l, xsr = adjugate * h.stroke_r;
  const Vec3<T> xrl = adjugate * h.rotation_l, xrr = adjugate * h.rotation_r;

  const auto& erl = l.rotation_column;
  const auto& err = r.rotation_column;
  const auto left = [&](const T& own, const auto& e, const auto& f, const Vec3<T>& g, const Vec3<T>& x) {
    return T((own - body.inverse_mass * dot(e, f)) - scale * dot(g, x));
  };
  const SideParameters<T>&pl = p.left, &pr = p.right;
  const Sym2<T> strokes{
      left(l.stroke_inertia + (pl.rotor_kg_m2 + pl.stroke_stiffening_kg_m2), esl, esl, h.stroke_l, xsl),
      left(r.stroke_inertia + (pr.rotor_kg_m2 + pr.stroke_stiffening_kg_m2), esr, esr, h.stroke_r, xsr),
      left(T(0), esl, esr, h.stroke_l, xsr)};
  const Sym2<T> rotations{left(l.rotation_inertia + load.left.rotation_stiffening_kg_m2, erl, erl, h.rotation_l, xrl),
                          left(r.rotation_inertia + load.right.rotation_stiffening_kg_m2, err, err, h.rotation_r, xrr),
                          left(T(0), erl, err, h.rotation_l, xrr)};
  const T s = h.scale = to_one_between(T(strokes.ll + strokes.rr), T(rotations.ll + rotations.rr));
  h.strokes = s * strokes;
  h.rotations = s * rotations;
  h.ll = s * left(l.cross_inertia, esl, erl, h.stroke_l, xrl);
  h.rr = s * left(r.cross_inertia, esr, err, h.stroke_r, xrr);
  h.lr = s * left(T(0), esl, err, h.stroke_l, xrr);
  h.rl = s * left(T(0), esr, erl, h.stroke_r, xrl);

  const auto driven = [&](const T& torque, const auto& e, const Vec3<T>& shoulder, const Vec3<T>& x) {
    return T(s * T((torque - dot(e, shoulder)) - scale * dot(x, drive.moment)));
  };
  h.s_l = driven(load.left.stroke_torque_Nm - l.stroke_bias, esl, drive.shoulder_left, xsl);
  h.s_r = driven(load.right.stroke_torque_Nm - r.stroke_bias, esr, drive.shoulder_right, xsr);
  h.r_l = driven(load.left.rotation_torque_Nm - l.rotation_bias, erl, drive.shoulder_left, xrl);
  h.r_r = driven(load.right.rotation_torque_Nm - r.rotation_bias, err, drive.shoulder_right, xrr);
  return h;
}

/// The rotations after the strokes are eliminated by beta'' = given + K (s - C theta''). K is the inverse of the
/// strokes' block; a stroke whose turn is prescribed by its stop has a zero row in it.
template <class T>
struct RotationSystem {
  T z_ll, z_rr, z_lr, z_rl;  // adj(K) C
  Sym2<T> A;
  Inverse<Sym2<T>, T> inverse;       // of A
  T left_per_right, right_per_left;  // turn of this side per turn that a stop takes from the other side: A_lr / A_own
};

template <class T>
FLAPPY_INLINE RotationSystem<T> eliminate_strokes(const HingeSystem<T>& h, const Inverse<Sym2<T>, T>& K) {
  RotationSystem<T> e;
  const Sym2<T>& k = K.adjugate;
  e.z_ll = k.ll * h.ll + k.lr * h.rl, e.z_lr = k.ll * h.lr + k.lr * h.rr;
  e.z_rl = k.lr * h.ll + k.rr * h.rl, e.z_rr = k.lr * h.lr + k.rr * h.rr;
  e.A = {h.rotations.ll - K.scale * T(h.ll * e.z_ll + h.rl * e.z_rl),
         h.rotations.rr - K.scale * T(h.lr * e.z_lr + h.rr * e.z_rr),
         h.rotations.lr - K.scale * T(h.ll * e.z_lr + h.rl * e.z_rr)};
  e.inverse = inverse(e.A);
  const T ratio = e.A.lr / T(e.A.ll * e.A.rr);
  e.left_per_right = ratio * e.A.rr;
  e.right_per_left = ratio * e.A.ll;
  return e;
}

template <class T>
struct Motion {
  T stroke_left, stroke_right, rotation_left, rotation_right;  // turns of beta and theta in this step, rad
  Vec3<T> body_acceleration;                                   // w'
};

template <class T>
FLAPPY_INLINE Motion<T> move(const Parameters<T>& p, const State<T>& x, const BodyInertia<T>& body,
                             const BodyDrive<T>& drive, const HingeSystem<T>& h, const T& step, const T& per_step) {
  const Hinge<T> stroke_l = stroke_hinge<+1>(p.left, x.left, T(h.scale * p.left.stroke_friction_Nm));
  const Hinge<T> stroke_r = stroke_hinge<-1>(p.right, x.right, T(h.scale * p.right.stroke_friction_Nm));
  const Hinge<T> rotation_l = rotation_hinge(p.left, x.left, T(h.scale * p.left.rotation_friction_Nm));
  const Hinge<T> rotation_r = rotation_hinge(p.right, x.right, T(h.scale * p.right.rotation_friction_Nm));
  const T s_l = h.s_l + dry_friction(h.strokes.ll, stroke_l, h.s_l, per_step);
  const T s_r = h.s_r + dry_friction(h.strokes.rr, stroke_r, h.s_r, per_step);

  T a_sl, a_sr, a_rl, a_rr;  // beta'', theta''
  Motion<T> m;
  const T step2 = step * step, per_step2 = per_step * per_step;
  const auto accelerate = [&](const Inverse<Sym2<T>, T>& K, const T& given_l, const T& given_r)
      __attribute__((always_inline)) {
    const RotationSystem<T> e = eliminate_strokes(h, K);
    const Sym2<T>&k = K.adjugate, &a = e.inverse.adjugate;
    const T y_l = given_l + K.scale * T(k.ll * s_l + k.lr * s_r), y_r = given_r + K.scale * T(k.lr * s_l + k.rr * s_r);
    T b_l = h.r_l - (h.ll * y_l + h.rl * y_r), b_r = h.r_r - (h.lr * y_l + h.rr * y_r);
    b_l += dry_friction(e.A.ll, rotation_l, b_l, per_step);
    b_r += dry_friction(e.A.rr, rotation_r, b_r, per_step);
    const T coast_l = step * rotation_l.rate, coast_r = step * rotation_r.rate, scale = step2 * e.inverse.scale;
    const T free_l = coast_l + scale * T(a.ll * b_l + a.lr * b_r);
    const T free_r = coast_r + scale * T(a.lr * b_l + a.rr * b_r);
    const T taken_l = free_l - stopped(rotation_l, free_l), taken_r = free_r - stopped(rotation_r, free_r);
    m.rotation_left = stopped(rotation_l, T(free_l + e.left_per_right * taken_r));
    m.rotation_right = stopped(rotation_r, T(free_r + e.right_per_left * taken_l));
    a_rl = T(m.rotation_left - coast_l) * per_step2;
    a_rr = T(m.rotation_right - coast_r) * per_step2;
    a_sl = y_l - K.scale * T(e.z_ll * a_rl + e.z_lr * a_rr);
    a_sr = y_r - K.scale * T(e.z_rl * a_rl + e.z_rr * a_rr);
    m.stroke_left = step * stroke_l.rate + step2 * a_sl;
    m.stroke_right = step * stroke_r.rate + step2 * a_sr;
  };
  const Inverse<Sym2<T>, T> free = inverse(h.strokes);
  accelerate(free, T(0), T(0));
  const auto beyond = [](const Hinge<T>& q, const T& turn) { return (turn < q.lowest_turn) | (turn > q.highest_turn); };
  const auto lands = [&](const Hinge<T>& q, const T& turn) { return beyond(q, turn) | beyond(q, T(step * q.rate)); };
  auto out_l = lands(stroke_l, m.stroke_left), out_r = lands(stroke_r, m.stroke_right);
  if (rarely(out_l | out_r)) {  // a stroke reaches its stop: once more, with its turn given and its row of K gone
    const T zero(0);
    const Sym2<T>& S = h.strokes;
    const auto prescribe = [&](const T& stop_l, const T& stop_r) __attribute__((always_inline)) {
      const auto row = [&](const auto& out, const auto& other_out, const T& own, const T& pair) {
        return where(out, zero, where(other_out, T(T(1) / own), pair));
      };
      const Inverse<Sym2<T>, T> K{{row(out_l, out_r, S.ll, free.adjugate.ll), row(out_r, out_l, S.rr, free.adjugate.rr),
                                   where(out_l | out_r, zero, free.adjugate.lr)},
                                  where(out_l | out_r, T(1), free.scale)};
      accelerate(K, where(out_l, stop_l, where(out_r, T(-(T(S.lr / S.ll) * stop_r)), zero)),
                 where(out_r, stop_r, where(out_l, T(-(T(S.lr / S.rr) * stop_l)), zero)));
    };
    const auto hits = [&](const Hinge<T>& q, const T& turn) {
      return ((turn == q.lowest_turn) | (turn == q.highest_turn)) & !(q.rate == zero);
    };
    const auto hit = hits(rotation_l, m.rotation_left) | hits(rotation_r, m.rotation_right);
    out_l = out_l & !(hit & !beyond(stroke_l, m.stroke_left));
    out_r = out_r & !(hit & !beyond(stroke_r, m.stroke_right));
    const auto landing = [&](const Hinge<T>& q, const T& turn, const auto& pushed) {
      const T coast = step * q.rate;
      const auto second = ((q.lowest_turn == zero) & (q.rate < zero)) | ((q.highest_turn == zero) & (q.rate > zero));
      const T tau = clamp(T(q.rate / where(second, q.before, T(1))), zero, T(1));
      const T pulled_off = where(pushed, turn, T(T(T(1.5) - tau) * T(turn - coast)));
      return T(T(stopped(q, where(second, pulled_off, turn)) - coast) * per_step2);
    };
    T stop_l = landing(stroke_l, m.stroke_left, hit), stop_r = landing(stroke_r, m.stroke_right, hit);
    prescribe(stop_l, stop_r);
    // the landing of one may throw the other out; lanes where it does not get the same numbers again
    const auto also_l = beyond(stroke_l, m.stroke_left) & !out_l, also_r = beyond(stroke_r, m.stroke_right) & !out_r;
    if (rarely(also_l | also_r)) {
      stop_l = where(also_l, landing(stroke_l, m.stroke_left, out_r), stop_l);
      stop_r = where(also_r, landing(stroke_r, m.stroke_right, out_l), stop_r);
      out_l = out_l | also_l;
      out_r = out_r | also_r;
      prescribe(stop_l, stop_r);
    }
    m.stroke_left = stopped(stroke_l, m.stroke_left);  // what is left is rounding
    m.stroke_right = stopped(stroke_r, m.stroke_right);
  }

  const Vec3<T> hinges =
      add_scaled(add_scaled(add_scaled(a_sl * h.stroke_l, a_sr, h.stroke_r), a_rl, h.rotation_l), a_rr, h.rotation_r);
  m.body_acceleration = body.inverse.scale * (body.inverse.adjugate * (drive.moment - hinges));
  return m;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
