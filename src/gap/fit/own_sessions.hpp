// How much a robot with wings differs from session to session, as its own reference sessions show. Each session k is
// contrasted with the other sessions, as tests are with references (Evidence::with_tests). The contrast gives a scale
// f_k and coefficients delta of what differs. From these, SessionVariation makes the prior for a further session: the
// tests.
#pragma once

#include <optional>

#include "gap/fit/fit.hpp"

namespace flappy::gap {

/// None: the references are one session. Flights that name the same session are one session; a flight that names none
/// is a session of its own. RobotFit calls it in the contrast of the tests with the references, and learn_sessions
/// does. `fitter`: of that contrast, with its nuisances; `parameters`: the fit of its parameters, linearised.
std::optional<OwnSessions> own_sessions(const Fitter& fitter, const Fit& parameters);

}  // namespace flappy::gap
