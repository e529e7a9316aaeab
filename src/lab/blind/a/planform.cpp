// With c the chord over the mean chord, x the distance over the wing length, <> the mean over the span:
//   r_kk = <c x^k>,  k = 0..3      z_cpk = <c^2 x^k>,  k = 0..2      z_rd = <c^4>      c = sum of a_n x^n, n = 0..3
// The coefficients a_n are found by Gauss-Newton.
#include "lab/blind/a/planform.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace flappy::blind {

Strips cut_into_strips(const model::Planform& p) {
  constexpr int kMoments = 8, kFine = 256;
  using Coefficients = Eigen::Vector4d;
  const Eigen::Matrix<double, kMoments, 1> wanted{p.r00, p.r11, p.r22, p.r33, p.z_cp0, p.z_cp1, p.z_cp2, p.z_rd};
  Coefficients a(p.r00, 0, 0, 0);
  for (int pass = 0; pass < 20; ++pass) {
    Eigen::Matrix<double, kMoments, 4> slope = decltype(slope)::Zero();
    Eigen::Matrix<double, kMoments, 1> miss = wanted;
    for (int i = 0; i < kFine; ++i) {
      const double x = (i + 0.5) / kFine;
      const Coefficients powers(1, x, x * x, x * x * x);
      const double c = a.dot(powers);
      for (int m = 0; m < kMoments; ++m) {
        const int power_of_x = m < 4 ? m : m < 7 ? m - 4 : 0, power_of_c = m < 4 ? 1 : m < 7 ? 2 : 4;
        double below = powers(power_of_x) / kFine;
        for (int k = 1; k < power_of_c; ++k) below *= c;
        miss(m) -= below * c;
        slope.row(m) += power_of_c * below * powers;
      }
    }
    a += (slope.transpose() * slope).ldlt().solve(slope.transpose() * miss);
  }
  Strips s;
  s.width_m = p.wing_length_m / kStrips;
  for (std::size_t i = 0; i < kStrips; ++i) {
    const double x = (static_cast<double>(i) + 0.5) / kStrips;
    s.r_m[i] = p.wing_length_m * x;
    s.chord_m[i] = p.mean_chord_m * (a(0) + x * (a(1) + x * (a(2) + x * a(3))));
  }
  return s;
}

}  // namespace flappy::blind
