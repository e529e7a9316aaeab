// How a quantity of one robot varies from session to session: sessions scatter, and the robot drifts by a random walk,
// for example through wear or a warmer room. For sessions at the times t_i,
//   x_i = m + w(t_i) + e_i    e_i ~ N(0, s^2)    w(t) - w(t') ~ N(0, s^2 r |t - t'|)    m: unknown constant
// Hence x ~ N(m, s^2 R), R = I + r K, K_ij = min(t_i, t_j), with times counted from the first one. Given r [1],
//   m^ = 1' R^-1 x / 1' R^-1 1    sum of squares Q = (x - m^)' R^-1 (x - m^), of n - 1 degrees of freedom
//   at a time t, with k_i = r min(t_i, t): mean m_t = m^ + k' R^-1 (x - m^), variance s^2 c,
//   c = 1 + r K_tt - k' R^-1 k + (1 - 1' R^-1 k)^2 / 1' R^-1 1
// With r = 0, m^ is the mean of x, Q the sum of squares about it, and c = 1 + 1 / n.
// [1] Cressie, Statistics for Spatial Data, 1993, ch. 3.4 (universal kriging).
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "gap/replay/session_names.hpp"

namespace flappy::gap {

class SessionWalk {
 public:
  /// `times`: [session]. `walk`: r. `at`: t, the time asked about.
  SessionWalk(const Eigen::VectorXd& times, double at, double walk);
  double sum_of_squares(const Eigen::VectorXd& x) const;
  double mean_of_next(const Eigen::VectorXd& x) const { return next_.dot(x); }
  /// c: variance of a session at the time asked about, over s^2.
  double factor_of_next() const { return factor_; }

 private:
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd mean_, next_;  ///< weights of m^, and of the mean at the time asked about
  double factor_;
};

/// When sessions were, in units of the mean time from a reference session to the next; in days if all references were
/// at one time.
struct SessionTimes {
  Eigen::VectorXd references;
  double tests = 0;  ///< mean over the test flights
};
/// Takes the times from dates if the session name of every flight, or its folder, begins with a date: 2024-03-05, or
/// with the time of day 2024-03-05T14:30. Else sessions count 0, 1, ... in the order in which they are given, the tests
/// after the references. `references`, `tests`: [flight] name of its session.
SessionTimes session_times(const std::vector<std::string>& references, const std::vector<std::string>& tests);

}  // namespace flappy::gap
