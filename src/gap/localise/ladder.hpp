// Where a vehicle leaves a robot with wings, in the order of causes: drive and hinges move the wings, the air at this
// motion makes forces, forces move the body, sensors measure it. An error on one rung shows on all that follow, so the
// first rung with an error is the place to look at. The ladder of validation of Fei et al. 2019 (film, force map, open
// loop, closed loop). Controller and software come last: flappy-gap check --flown compares them.
#pragma once

#include <vector>

#include "gap/localise/where.hpp"

namespace flappy::gap {

/// Index in ladder_of() of the rung where an effect acts.
std::size_t rung_of_effect(const std::string& effect);

/// Three rungs. `nominal`, `refit`, `effect`: residuals as Diagnosis::nominal_loss and so on, [flight of `around`];
/// null: not fitted. `hypotheses`: with their probabilities.
///   drive and hinges   stroke angles, currents, battery of all flights
///   air                forces and moments of clamped robots
///   body and sensors   forces, angular accelerations and motion of robots that fly
std::vector<LadderRung> ladder_of(const RowContext& around, const TestResiduals& nominal, const TestResiduals& refit,
                                  const TestResiduals* effect, const std::vector<RankedHypothesis>& hypotheses);

}  // namespace flappy::gap
