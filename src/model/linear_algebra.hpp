// Three-vectors, symmetric tensors and quaternions over a scalar type, restricted to what the physics needs.
#pragma once

#include "model/scalar.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct Vec3 {
  T x, y, z;

  friend FLAPPY_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend FLAPPY_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend FLAPPY_INLINE Vec3 operator*(const T& s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
};

/// The vector z x h = (-h_y, h_x, 0), which is never formed; its products are written out.
template <class T>
struct AcrossZ {
  const Vec3<T>& h;
};

template <class T>
FLAPPY_INLINE T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + (a.y * b.y + a.z * b.z);
}
template <class T>
FLAPPY_INLINE T dot(const AcrossZ<T>& a, const Vec3<T>& b) {
  return a.h.x * b.y - a.h.y * b.x;
}
template <class T>
FLAPPY_INLINE T dot(const AcrossZ<T>& a, const AcrossZ<T>& b) {
  return a.h.x * b.h.x + a.h.y * b.h.y;
}

template <class T>
FLAPPY_INLINE Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
FLAPPY_INLINE Vec3<T> plus_cross(const Vec3<T>& base, const Vec3<T>& a, const AcrossZ<T>& b) {
  return {base.x - a.z * b.h.x, base.y - a.z * b.h.y, base.z + T(a.x * b.h.x + a.y * b.h.y)};
}

/// a + s b, fused.
template <class T>
FLAPPY_INLINE Vec3<T> add_scaled(const Vec3<T>& a, const T& s, const Vec3<T>& b) {
  return {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

template <class T>
FLAPPY_INLINE Vec3<T> where(auto condition, const Vec3<T>& yes, const Vec3<T>& no) {
  return {where(condition, yes.x, no.x), where(condition, yes.y, no.y), where(condition, yes.z, no.z)};
}

template <class T>
struct Sym3 {
  T xx, yy, zz, xy, yz, xz;

  friend FLAPPY_INLINE Sym3 operator+(const Sym3& a, const Sym3& b) {
    return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.yz + b.yz, a.xz + b.xz};
  }
  friend FLAPPY_INLINE Sym3 operator*(const T& s, const Sym3& m) {
    return {s * m.xx, s * m.yy, s * m.zz, s * m.xy, s * m.yz, s * m.xz};
  }
  friend FLAPPY_INLINE Vec3<T> operator*(const Sym3& m, const Vec3<T>& v) {
    return {m.xx * v.x + (m.xy * v.y + m.xz * v.z), m.xy * v.x + (m.yy * v.y + m.yz * v.z),
            m.xz * v.x + (m.yz * v.y + m.zz * v.z)};
  }
};

/// An inverse as adjugate and 1 / determinant, not multiplied out: later products need not wait for the division.
template <class M, class T>
struct Inverse {
  M adjugate;
  T scale;
};

/// The power of two that brings a positive number into [1, 2). To multiply by it rounds nothing.
template <class T>
FLAPPY_INLINE T to_one(const T& x) {
  return half_to(exponent(x));
}

/// The same of the geometric mean of two positive numbers, to a factor of 2.
template <class T>
FLAPPY_INLINE T to_one_between(const T& x, const T& y) {
  return half_to(nearest(T(T(0.5) * T(exponent(x) + exponent(y)))));
}

/// Of a positive definite matrix. The adjugate is that of m / tr(m), but for a power of two: products of three inertias
/// of an insect would leave the range of single precision.
template <class T>
FLAPPY_INLINE Inverse<Sym3<T>, T> inverse(const Sym3<T>& original) {
  const T s = to_one(T(T(original.xx + original.yy) + original.zz));
  const Sym3<T> m = s * original;
  const Sym3<T> a{m.yy * m.zz - m.yz * m.yz, m.xx * m.zz - m.xz * m.xz, m.xx * m.yy - m.xy * m.xy,
                  m.xz * m.yz - m.xy * m.zz, m.xy * m.xz - m.xx * m.yz, m.xy * m.yz - m.xz * m.yy};
  return {a, s / T(m.xx * a.xx + (m.xy * a.xy + m.xz * a.xz))};
}

/// Inertia tensor of a second-moment tensor (integral of r r^T): tr(P) 1 - P.
template <class T>
FLAPPY_INLINE Sym3<T> inertia_of(const Sym3<T>& p) {
  return {p.yy + p.zz, p.xx + p.zz, p.xx + p.yy, -p.xy, -p.yz, -p.xz};
}

template <class T>
FLAPPY_INLINE Vec3<T> rotate_z(const T& s, const T& c, const Vec3<T>& v) {
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}
/// Rotates (x, 0, z).
template <class T>
FLAPPY_INLINE Vec3<T> rotate_z(const T& s, const T& c, const T& x, const T& z) {
  return {c * x, s * x, z};
}
template <class T>
FLAPPY_INLINE Vec3<T> rotate_back_z(const T& s, const T& c, const Vec3<T>& v) {
  return {c * v.x + s * v.y, c * v.y - s * v.x, v.z};
}

template <class T>
FLAPPY_INLINE Vec3<T> rotate_x(const T& s, const T& c, const Vec3<T>& v) {
  return {v.x, c * v.y - s * v.z, s * v.y + c * v.z};
}
template <class T>
FLAPPY_INLINE Vec3<T> rotate_back_x(const T& s, const T& c, const Vec3<T>& v) {
  return {v.x, c * v.y + s * v.z, c * v.z - s * v.y};
}
template <class T>
FLAPPY_INLINE Vec3<T> rotate_y(const T& s, const T& c, const Vec3<T>& v) {
  return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}
template <class T>
FLAPPY_INLINE Vec3<T> rotate_back_y(const T& s, const T& c, const Vec3<T>& v) {
  return {c * v.x - s * v.z, v.y, s * v.x + c * v.z};
}

/// R P R^T for a rotation about z: the xy block rotates by the double angle.
template <class T>
FLAPPY_INLINE Sym3<T> rotate_z(const T& s, const T& c, const Sym3<T>& p) {
  const T twice = s + s, s2 = twice * c, c2 = T(1) - twice * s;
  const T mean = T(0.5) * T(p.xx + p.yy), half = T(0.5) * T(p.xx - p.yy);
  const T d = half * c2 - p.xy * s2;
  return {mean + d, mean - d, p.zz, half * s2 + p.xy * c2, s * p.xz + c * p.yz, c * p.xz - s * p.yz};
}

template <class T>
FLAPPY_INLINE Sym3<T> rotate_y(const T& s, const T& c, const Sym3<T>& p) {
  const T twice = s + s, s2 = twice * c, c2 = T(1) - twice * s;
  const T mean = T(0.5) * T(p.xx + p.zz), half = T(0.5) * T(p.xx - p.zz);
  const T d = half * c2 + p.xz * s2;
  return {mean + d, p.yy, mean - d, c * p.xy + s * p.yz, c * p.yz - s * p.xy, p.xz * c2 - half * s2};
}

template <class T>
FLAPPY_INLINE Sym3<T> rotate_x(const T& s, const T& c, const Sym3<T>& p) {
  const T twice = s + s, s2 = twice * c, c2 = T(1) - twice * s;
  const T mean = T(0.5) * T(p.yy + p.zz), half = T(0.5) * T(p.yy - p.zz);
  const T d = half * c2 - p.yz * s2;
  return {p.xx, mean + d, mean - d, c * p.xy - s * p.xz, half * s2 + p.yz * c2, s * p.xy + c * p.xz};
}

/// Unit quaternion, body to world.
template <class T>
struct Quaternion {
  T w, x, y, z;
};

template <class T>
struct Matrix3 {
  Vec3<T> row_x, row_y, row_z;

  friend FLAPPY_INLINE Vec3<T> operator*(const Matrix3& m, const Vec3<T>& v) {
    return {dot(m.row_x, v), dot(m.row_y, v), dot(m.row_z, v)};
  }
};

template <class T>
FLAPPY_INLINE Vec3<T> transpose_times(const Matrix3<T>& m, const Vec3<T>& v) {
  return {m.row_x.x * v.x + (m.row_y.x * v.y + m.row_z.x * v.z), m.row_x.y * v.x + (m.row_y.y * v.y + m.row_z.y * v.z),
          m.row_x.z * v.x + (m.row_y.z * v.y + m.row_z.z * v.z)};
}

template <class T>
FLAPPY_INLINE Matrix3<T> rotation_matrix(const Quaternion<T>& q) {
  const T x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const T wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  const T xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
  return {{T(1) - (yy + zz), q.x * y2 - wz, q.x * z2 + wy},
          {q.x * y2 + wz, T(1) - (xx + zz), q.y * z2 - wx},
          {q.x * z2 - wy, q.y * z2 + wx, T(1) - (xx + yy)}};
}

/// Attitude after a rotation by the small rotation vector 2 e in body axes: q (1, e), brought back to unit length by
/// one Newton step, exact to |e|^4 and free of drift.
template <class T>
FLAPPY_INLINE Quaternion<T> rotated(const Quaternion<T>& q, const Vec3<T>& e) {
  const Quaternion<T> r{q.w - (q.x * e.x + (q.y * e.y + q.z * e.z)), q.x + (q.w * e.x + (q.y * e.z - q.z * e.y)),
                        q.y + (q.w * e.y + (q.z * e.x - q.x * e.z)), q.z + (q.w * e.z + (q.x * e.y - q.y * e.x))};
  const T norm2 = r.w * r.w + (r.x * r.x + (r.y * r.y + r.z * r.z));
  const T scale = T(1.5) - T(0.5) * norm2;
  return {scale * r.w, scale * r.x, scale * r.y, scale * r.z};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
