// How much the quantities of robots differ from session to session, learnt from several robots to which nothing was
// done. Each group of sessions in which a robot flew the same has a mean and a variance s^2 of its own; s^2 ~ scaled
// inverse chi-squared(nu, s_0^2). Integrated over both, the density of a quantity x of n sessions is Student's t
// (session_scatter.hpp, session_walk.hpp):
//   p(x) ~ Gamma(f / 2) / Gamma(nu / 2) (nu s_0^2)^(nu / 2) (nu s_0^2 + Q)^(-f / 2) |R|^-1/2 (1' R^-1 1)^-1/2
//   f = nu + n - 1
// The product over quantities, groups and robots is maximised over scatter and drift of each kind of quantity, nu and
// the share of the noise (Gelman et al., Bayesian Data Analysis, 3rd ed., ch. 5), each scatter and drift held near what
// learning starts with by a log-normal prior. The largest freedom is then the one that foretells sessions best.
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

/// `options`: of a contrast. The flights fit the parameters, as references do.
SessionGroup sessions_of(const FlightList& flights, const sim::Randomisation& uncertain,
                         const InferenceOptions& options);

/// Keeps from `start` the probabilities of causes, `unknown` and `leak` of each kind of quantity, and scatter and drift
/// of kinds that no robot shows.
SessionPrior learn_scatter(const std::vector<RobotSessions>& robots, const SessionPrior& start);

/// How well sessions are foretold by those before them.
struct Foretold {
  double number = 0;     ///< of quantities of sessions
  double outside = 0;    ///< how many of them are outside of what should hold kInside
  double log_score = 0;  ///< sum of log densities under `prior`, less that under `reference`
};
/// Share of sessions that an interval should hold. Choice: as intervals of a diagnosis.
inline constexpr double kInside = 0.9;
/// Each session that has at least three before it in its group, by all of these; `later`: each of the second half, by
/// the first half. `reference`: what scores are told against.
Foretold foretold(const RobotSessions& robot, const SessionPrior& prior, const SessionPrior& reference, bool later);

/// configs/gap/beat_averaged/session_scatter.toml. `learnt`: from what.
std::string session_prior_text(const SessionPrior& prior, const std::string& learnt);

}  // namespace flappy::gap
