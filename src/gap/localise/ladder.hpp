// Shows where a vehicle deviates from its robot with wings, in the order of causes: drive and hinges move the wings, at
// this motion the air exerts forces, forces move the body, sensors measure this. An error on one rung shows on all that
// follow, so the first rung with an error is the place to look at. This is the ladder of validation of Fei et al. 2019
// (film, force map, open loop, closed loop). Controller and software come last: flappy-gap check --flown compares them.
#pragma once

#include <array>
#include <vector>

#include "gap/localise/where.hpp"

namespace flappy::gap {

/// Indices in ladder_of().
enum RungIndex : std::size_t { kDriveRung, kAirRung, kBodyRung, kRungs };
/// The rung where an effect acts.
std::size_t rung_of_effect(const std::string& effect);

/// [rung] Probability that effects of a rung are missing.
std::array<double, kRungs> rung_probabilities(const std::vector<RankedHypothesis>& hypotheses);

/// The three rungs below. `nominal`, `refit`, `effect`: [flight of `around`] residuals of the vehicle file, of the
/// fitted parameters, and with effects as well (Fitted); null: not fitted. `hypotheses`: with their probabilities.
///   drive and hinges   stroke angles, currents, battery of all flights
///   air                forces and moments of clamped robots
///   body and sensors   forces, angular accelerations and motion of robots that fly
std::vector<LadderRung> ladder_of(const RowContext& around, const TestResiduals& nominal, const TestResiduals& refit,
                                  const TestResiduals* effect, const std::vector<RankedHypothesis>& hypotheses);

}  // namespace flappy::gap
