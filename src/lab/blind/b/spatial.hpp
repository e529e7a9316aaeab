// Twists, wrenches and inertias at one reference point, the torso's origin, in B:
//   momentum of a body        h = I V:  n = J w + c x v,  f = m v - c x w      c = m r, J about the point
//   rate of a moving vector   dS/dt = V x S:  (w x Sw, w x Sv + v x Sw)
//   rate of a moving wrench   dF/dt = V x* F: (w x n + v x f, w x f)
// Newton-Euler about a point that need neither be fixed nor be the centre of mass.
#pragma once

#include <Eigen/Dense>

namespace flappy::blind::b {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

struct Twist {
  Vector3d w, v;
  Twist operator+(const Twist& o) const { return {w + o.w, v + o.v}; }
  Twist operator*(double k) const { return {w * k, v * k}; }
};

struct Wrench {
  Vector3d n, f;
  Wrench operator+(const Wrench& o) const { return {n + o.n, f + o.f}; }
  Wrench operator-(const Wrench& o) const { return {n - o.n, f - o.f}; }
  Wrench operator*(double k) const { return {n * k, f * k}; }
};

inline double dot(const Twist& s, const Wrench& f) { return s.w.dot(f.n) + s.v.dot(f.f); }
inline Twist cross(const Twist& v, const Twist& s) { return {v.w.cross(s.w), v.w.cross(s.v) + v.v.cross(s.w)}; }
inline Wrench cross(const Twist& v, const Wrench& f) { return {v.w.cross(f.n) + v.v.cross(f.f), v.w.cross(f.f)}; }
inline Wrench at_point(const Vector3d& point, const Vector3d& force) { return {point.cross(force), force}; }

struct Inertia {
  double m = 0;
  Vector3d c = Vector3d::Zero();
  Matrix3d j = Matrix3d::Zero();

  Wrench operator*(const Twist& t) const { return {j * t.w + c.cross(t.v), m * t.v - c.cross(t.w)}; }
  Inertia operator+(const Inertia& o) const { return {m + o.m, c + o.c, j + o.j}; }
};

/// Inertia of a body whose frame is at `place` and rotated by `turn`.
inline Inertia inertia_at(double mass, const Vector3d& com, const Matrix3d& about_com, const Matrix3d& turn,
                          const Vector3d& place) {
  const Vector3d r = place + turn * com;
  Matrix3d j = turn * about_com * turn.transpose();
  j.diagonal().array() += mass * r.squaredNorm();
  j -= mass * r * r.transpose();
  return {mass, mass * r, j};
}

}  // namespace flappy::blind::b
