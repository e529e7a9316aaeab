// The last stage of a diagnosis: the probabilities of the hypotheses, and the verdict.
#pragma once

#include <string>
#include <vector>

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// Widens the posterior of the effects of a fit to the errors that were found on robots whose effects are known (`interval` of the verdict rule).
void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule);

/// Log evidence of a hypothesis, less what its effects and its unknown cause gain by chance; at least a gain of 0 remains of a positive gain.
/// `baseline`: log evidence of the parameters alone, without its prior.
double beyond_chance(const ScoredHypothesis& a, double baseline, const VerdictRule& rule);

/// Tempering of the evidence: factor on the prior probability of a hypothesis whose evidence is d = `nats` behind the best one's,
///   (1 + 2 d / (n f))^(-f / 2)       n, f: tempering.nats, tempering.freedom
/// The errors of a robot are never quite those that the evidence assumes. So the evidence counts only up to a factor, as uncertain as the variance
/// in Student's t distribution (f -> infinity: exp(-d / n)).
double tempered(double nats, const VerdictRule& rule);

/// Sets the probabilities, and sorts the hypotheses: the most probable first.
void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule);

/// Sets d.verdict and d.concluded. Hypotheses whose effects belong to the same groups (EffectInfo::group) form a pool, for short flights often
/// cannot tell them apart. The verdict names the most probable hypothesis of the most probable pool if its share of the whole probability, or of
/// that of its pool, is large enough (`naming` of the verdict rule); else the verdict is `group`.
void conclude(const VerdictRule& rule, Inference& d);

/// Sets predicted_with of the conclusion to the effects of the hypothesis with the largest evidence that contains those of the conclusion. Its
/// further effects may be due to chance, so they are not named; yet a vehicle with them predicts better.
void predict_with_the_likeliest(Inference& d);

/// Refutes hypotheses that explain too little of held-out flights, gives hypotheses without an effect its background magnitude, sets the
/// probabilities and concludes. `fitter`: with the scales of the parameters alone.
void decide(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule, Inference& d);

/// Sorted groups of the effects, joined by +; an effect without a group counts as its own group: "drive_lag", "body_drag+world_force".
std::string pool_name(const std::vector<std::string>& effects);

}  // namespace flappy::gap
