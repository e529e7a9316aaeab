// The last stage of a diagnosis: probabilities of the hypotheses, and what may be concluded from them.
#pragma once

#include <string>
#include <vector>

#include "gap/diagnose/inference.hpp"

namespace flappy::gap {

/// Makes the posterior of the effects of a fit as uncertain as its errors were found to be (interval of the verdict rule).
void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule);

/// Log evidence without what effects and unknown causes gain by chance. `baseline`: log evidence of the parameters alone, without its prior.
double beyond_chance(const ScoredHypothesis& a, double baseline, const VerdictRule& rule);

/// Factor on the prior probability of a hypothesis behind which another one is by d = `nats` of evidence:
///   (1 + 2 d / (n f))^(-f / 2)       n, f: tempering.nats, tempering.freedom
/// The evidence is right up to a factor that is as uncertain as the variance of Student's t (exp(-d / n) for f -> infinity): no robot's errors are
/// quite those that the evidence assumes.
double tempered(double nats, const VerdictRule& rule);

/// Sets the probabilities; the most probable first.
void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule);

/// Hypotheses whose effects are of the same groups (EffectInfo::group) form a pool, for short flights often cannot tell them apart. Of the pool
/// with the largest probability, the most probable hypothesis is named if it holds enough of everything or of its pool (naming of the verdict
/// rule); else the verdict is `group`. Sets d.verdict and d.concluded.
void conclude(const VerdictRule& rule, Inference& d);

/// Has the conclusion predicted with further effects where a hypothesis that contains its effects explains more (ScoredHypothesis::predicted_with):
/// chance speaks against a name, not against a vehicle that predicts better.
void predict_with_the_likeliest(Inference& d);

/// Refutes hypotheses that explain too little of flights held out, shares background magnitudes, sets probabilities and concludes. `fitter`: with
/// the scales of the parameters.
void decide(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule, Inference& d);

/// Groups of the effects, an effect without one being its own: "drive_lag", "body_drag+world_force".
std::string pool_name(const std::vector<std::string>& effects);

}  // namespace flappy::gap
