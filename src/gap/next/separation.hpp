// Finds which effects planned flights would tell apart (plan.hpp). If the robot has effect T, its rows change by c. The
// gain of a hypothesis R over the parameters alone is then
//   G_R(c) = log p(c | R) - log p(c | parameters)
// p integrates out the magnitudes of R's effect, parameters, errors of sensors, model discrepancy and noise
// (gap/evidence/evidence.hpp). Screening finds the gains (gap/fit/screening.hpp). The expected evidence for T over R
// (expected_nats.hpp) is
//   nats(T, R) = G_T(c) - G_R(c).
// The discrepancy includes how far the robot's law of T deviates from the catalogue's. What noise adds on average, at
// most half a nat for each magnitude, is left out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gap/fit/robot_fit.hpp"
#include "gap/question/verdict_rule.hpp"

namespace flappy::gap {

struct Separation {
  std::vector<std::string> effects;  ///< those asked about, except those that change no row or diverge
  std::vector<std::string> rivals;   ///< all effects that change a row, then "parameters": no effect
  Eigen::MatrixXd nats;              ///< [effect][rival] expected evidence for the effect over the rival
  /// [effect] How probable a diagnosis finds the effect, if the robot has it.
  std::vector<double> probability;
  /// [effect] Factor on the magnitude from which on `probability` is kSure; at least 1 / kMaxFactor. None: it is not
  /// reached up to kMaxFactor, largest_factor() or a simulation that diverges; or it was not asked for.
  std::vector<std::optional<double>> sure_from;
};
/// A probability that counts as sure. Choice.
inline constexpr double kSure = 0.9;
/// Largest factor on a magnitude that is tried, and one over the smallest. Choice.
inline constexpr double kMaxFactor = 16;

/// The largest factor on all typical magnitudes of an effect that a vehicle file accepts.
double largest_factor(const model::CatalogueEffect& effect);

/// `robot`: of RobotFit::planned, for `flights`. `asked`: [effect] magnitude over the typical one. `rule`: as
/// Question::rule gives it. `sure`: also find sure_from.
Separation separation_of(const Flights& flights, const RobotFit& robot, const std::map<std::string, double>& asked,
                         const VerdictRule& rule, int threads, bool sure = true);

}  // namespace flappy::gap
