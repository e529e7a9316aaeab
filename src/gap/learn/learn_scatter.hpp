// Learns how much the quantities of beat-averaged robots (gap/session/quantities.hpp) differ from session to session
// while nothing is done to the robots. A group has the sessions in which one robot flew the same. In each group a
// quantity has a mean and a variance s^2 of its own; s^2 ~ scaled inverse chi-squared(nu, s_0^2). With both integrated
// out, the density of the quantity's values x in n sessions is Student's t (session_scatter.hpp; Q and R:
// session_walk.hpp):
//   p(x) ~ Gamma(f / 2) / Gamma(nu / 2) (nu s_0^2)^(nu / 2) (nu s_0^2 + Q)^(-f / 2) |R|^-1/2 (1' R^-1 1)^-1/2
//   f = nu + n - 1
// The product of these densities over quantities, groups and robots is maximised over nu, the share of the noise, and
// scatter and drift of each kind of quantity (Gelman et al., Bayesian Data Analysis, 3rd ed., ch. 5). A log-normal
// prior holds each scatter near its value before learning. Finally, the largest degrees of freedom
// (SessionPrior::most_freedom) are those that foretell sessions best.
#pragma once

#include "gap/question/inferred.hpp"

namespace flappy::gap {

/// Sessions in which a robot flew the same, in their order in time.
struct SessionGroup {
  std::vector<SessionQuantity> quantities;
  SessionValues sessions;
  Eigen::VectorXd times;  ///< [session] as SessionTimes::references
};
struct RobotSessions {
  std::string name;
  std::vector<SessionGroup> groups;
};

/// One group of these flights. The parameters are fitted to them, as to references. `options`: as for a contrast.
SessionGroup sessions_of(const FlightList& flights, const sim::Randomisation& uncertain,
                         const InferenceOptions& options);

/// The learnt prior. It keeps from `start` the probabilities of causes, `unknown` and `leak` of each kind of quantity,
/// and scatter and drift of kinds that no robot shows.
SessionPrior learn_scatter(const std::vector<RobotSessions>& robots, const SessionPrior& start);

/// How well sessions are foretold by those before them.
struct Foretold {
  double number = 0;     ///< how many values were foretold: one for each quantity of each session
  double outside = 0;    ///< how many of them are outside of the interval that should hold kInside of them
  double log_score = 0;  ///< sum of log densities under `prior`, less that under `reference`
};
/// Share of sessions that an interval should hold. Choice: as intervals of a diagnosis.
inline constexpr double kInside = 0.9;
/// Predicts each session that has at least three before it in its group from all of these; if `later`, each session of
/// the second half of the group from the first half. `reference`: the prior whose score is subtracted.
Foretold foretold(const RobotSessions& robot, const SessionPrior& prior, const SessionPrior& reference, bool later);

/// Text of configs/gap/beat_averaged/session_scatter.toml. `learnt`: source of the values, for the head of the file.
std::string session_prior_text(const SessionPrior& prior, const std::string& learnt);

}  // namespace flappy::gap
