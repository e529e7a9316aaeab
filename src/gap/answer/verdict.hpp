// The end of a diagnosis: the probabilities of the hypotheses, and the verdict.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gap/question/question.hpp"

namespace flappy::gap {

/// Widens the effects' posterior in `fit` to the errors found on robots with known effects (`interval` of the verdict
/// rule). infer() calls it before flights are held out.
void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule);

/// Log evidence of hypothesis `a`, one of `all`, less what its effects and unknown cause gain by chance, and less what
/// further effects and a remainder gain because the effects before them follow another law. A positive gain over the
/// parameters alone becomes 0 at least.
double beyond_chance(const ScoredHypothesis& a, const std::vector<ScoredHypothesis>& all, const VerdictRule& rule);

/// Factor on the prior probability of a hypothesis whose evidence is d = `nats` behind the best one's:
///   (1 + 2 d / (n f))^(-f / 2)       n, f: tempering.nats, tempering.freedom
/// Errors of a robot's model are not quite as assumed, so evidence counts only up to a factor. That factor is as
/// uncertain as the variance in Student's t (f -> infinity: exp(-d / n)).
double tempered(double nats, const VerdictRule& rule);

/// Sets the probabilities by log_evidence and log_prior, and sorts the hypotheses: the most probable first.
void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule);

/// Name of the pool of a hypothesis; that of a hypothesis without effects begins with "/".
using PoolOf = std::function<std::string(const ScoredHypothesis&)>;

/// Sets d.verdict, whose probability is what the rule says of it (VerdictRule::Said), and d.concluded. Hypotheses with effects of the same groups (EffectInfo::group) form a pool, as short
/// flights often cannot tell them apart. The verdict names the most probable hypothesis of the most probable pool if
/// that hypothesis' share of the whole probability, or of the pool's, is large enough (`naming` of the rule); else the
/// verdict is `group`. `pool`: Question::pool.
void conclude(const VerdictRule& rule, const PoolOf& pool, Inference& d);

/// Refutes hypotheses that explain too little of test flights held out (`refutation` of the rule), and those that the
/// question refutes. Then sets the probabilities, concludes, and chooses what predicts. `d`: with `refit`, `nominal`
/// and `held_out`. `fitter`: with the scales of the parameters alone.
void decide(const Question& question, const RobotFit& robot, const Fitter& fitter, const Flights& flights,
            const VerdictRule& rule, Inference& d);

}  // namespace flappy::gap
