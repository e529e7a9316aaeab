// How much a robot with wings differs from session to session, by its own reference sessions. Each session k is
// contrasted with the other sessions, as tests are with references (Evidence::with_tests). The contrast gives a scale
// f_k and coefficients delta of what differs. SessionVariation makes the prior of a further session, the tests, of
// these.
#pragma once

#include <optional>

#include "gap/fit/fit.hpp"

namespace flappy::gap {

/// None: the references are one session. Flights that name the same session are one session; a flight that names none
/// is its own. The contrast of the tests with the references (RobotFit) and learn_sessions call it. `fitter`: of that
/// contrast, with its nuisances; `parameters`: its parameters, linearised.
std::optional<OwnSessions> own_sessions(const Fitter& fitter, const Fit& parameters);

}  // namespace flappy::gap
