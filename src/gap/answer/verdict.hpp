// The end of a diagnosis: the probabilities of the hypotheses, and the verdict.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/question/question.hpp"

namespace flappy::gap {

/// Widens the posterior of the effects in `fit`, as it holds too few true values of robots with known effects
/// (VerdictRule::interval). infer() calls it before flights are held out.
void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule);

/// Returns the log evidence of hypothesis `a`, one of `all`, less two gains: what its effects and unknown cause gain by
/// chance; and what further effects and a remainder gain because the effects before them follow another law than the
/// catalogue's. A positive gain over the parameters alone does not fall below 0 by this; a negative one stays.
double beyond_chance(const ScoredHypothesis& a, const std::vector<ScoredHypothesis>& all, const VerdictRule& rule);

/// Factor on the prior probability of a hypothesis whose evidence is d = `nats` behind the best one's:
///   (1 + 2 d / (n f))^(-f / 2)       n, f: tempering.nats, tempering.freedom
/// Errors of a robot's model are not quite as assumed, so evidence counts only by an unknown factor about 1 / n. Its
/// distribution is that of the precision in Student's t (f -> infinity: exp(-d / n)).
double tempered(double nats, const VerdictRule& rule);

/// Sets the probabilities by log_evidence and log_prior, and sorts the hypotheses: the most probable first.
void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule);

/// Returns the name of the pool of a hypothesis (conclude()). It begins with "/" if the hypothesis has no effects.
using PoolOf = std::function<std::string(const ScoredHypothesis&)>;

/// Sets d.verdict and d.concluded. Hypotheses with effects of the same groups (EffectInfo::group) form a pool, as short
/// flights often cannot tell them apart. The verdict names the most probable hypothesis of the most probable pool. If
/// it has effects, and too small a share both of the whole probability and of the pool's (VerdictRule::naming), the
/// verdict is `group`. VerdictRule::said maps the verdict's probability to the one that is told. `pool`:
/// Question::pool.
void conclude(const VerdictRule& rule, const PoolOf& pool, Inference& d);

/// Refutes hypotheses that explain too little of test flights held out (VerdictRule::refutation), and those that
/// Question::refute refutes. Then sets the probabilities, concludes, and chooses whose fit predicts
/// (Question::choose_predicting). `d`: with `refit`, `nominal` and each hypothesis' `held_out`. `fitter`: with the
/// scales of the parameters alone.
void decide(const Question& question, const RobotFit& robot, const Fitter& fitter, const Flights& flights,
            const VerdictRule& rule, Inference& d);

}  // namespace flappy::gap
