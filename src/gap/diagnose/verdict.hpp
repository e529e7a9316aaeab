// What a diagnosis may claim: which fits stand, how wide their intervals are, what probabilities come to.
#pragma once

#include <string>
#include <vector>

#include "gap/diagnose/diagnose.hpp"
#include "gap/localise/closure.hpp"

namespace flappy::gap {

/// Makes the figures of the effects of a fit, along whose coordinates its directions are, as uncertain as they are.
void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule);

/// The log evidence of a hypothesis, where what its effects, and something that no entry explains, gain over the parameters alone by chance
/// counts for nothing. `plain`: log evidence of the parameters, without what was thought before.
double beyond_chance(const ScoredHypothesis& a, double plain, const VerdictRule& rule);

/// Of every hypothesis; the most probable first. Where d nats speak for the best rather than for it, it counts
///   (1 + 2 d / (n f))^(-f / 2)       n, f: doubt.nats, doubt.freedom
/// of what was thought before: nats are right up to a factor that is as uncertain as the variance of Student's t (exp(-d / n) for
/// f -> infinity), for no making's errors are quite those that the evidence takes for granted.
/// Of what was thought of a hypothesis beforehand, what is left where so many nats speak for another one.
double kept_against(double nats, const VerdictRule& rule);

void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule);

/// The largest mass, rivals that such flights often cannot separate (EffectInfo::group) pooled: a set of effects pools with those whose
/// effects are of the same groups. Of a pool the most probable set is named where it holds half of everything or four fifths of its
/// pool; otherwise the pool is, and its verdict is `group`.
Conclusion conclude(const std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule);

/// What was concluded is flown with further effects where these explain more, by evidence and prior (ScoredHypothesis::flown_with): chance
/// speaks against a name, not against a vehicle that predicts better.
void fly_the_likeliest(std::vector<ScoredHypothesis>& hypotheses, const Conclusion& conclusion);
const char* kind_name(Conclusion::Kind kind);
const char* kind_name(ScoredHypothesis::Kind kind);

/// Groups of the effects, an effect without one being its own: "drive_lag", "body_drag+world_force".
std::string pool_name(const std::vector<std::string>& effects);

}  // namespace flappy::gap
