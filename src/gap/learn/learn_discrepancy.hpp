// Learns the model discrepancy, and what sessions differ by, from trusted robots: their flights contain nothing that
// the vehicle file lacks. flappy-gap learn-discrepancy calls it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gap/fit/robot_fit.hpp"

namespace flappy::gap {

/// Finds the prior standard deviations that make the residuals of all robots most probable: those of coefficients (by
/// channel, harmonic and kind of function) and those of background magnitudes. Fits each robot, then runs
/// expectation-maximisation from `start`. All else in `start` stays, and so do standard deviations on which the flights
/// have no information. Estimates are shrunk towards those of like channels or effects, as each rests on few
/// coefficients. `flights`: [robot], test flights alone. `uncertain`: the vehicle file of all robots with the priors of
/// its parameters. io::InputError after Ctrl-C, and as from RobotFit.
ModelDiscrepancy learn_discrepancy(const std::vector<Flights>& flights, const sim::Randomisation& uncertain,
                                   const ModelDiscrepancy& start, int threads);

/// Sessions of a robot with wings: the references, of one session or of several, and the tests, a later session.
struct SessionPair {
  Flights flights;
  std::string effect;  ///< effect of the catalogue that appeared before the tests; empty: none
};

/// Deviations of the laws of effects from the catalogue's, as shares of their changes, by effect.
using LawErrors = std::vector<std::pair<std::string, double>>;

/// Takes the centre of each stage, and the spread of errors over the centres. The centre that a stage had counts, too, so
/// a stage without an error keeps it.
void learn_laws(const LawErrors& errors, SessionVariation& to);

/// Learns from pairs without an effect what differs between sessions; then, from pairs with an effect, how far its law
/// deviates from the catalogue's. What too few pairs show stays as in `start.session`. io::InputError after Ctrl-C, as
/// from RobotFit, and if all pairs have an effect but too few tell of its law.
SessionVariation learn_sessions(const std::vector<SessionPair>& pairs, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& start, int threads);

}  // namespace flappy::gap
