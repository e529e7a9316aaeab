// How much a robot with wings differs from session to session, by its own reference sessions: each is contrasted with
// the others as tests are with references (Evidence::with_tests), and has a scale f_k and coefficients delta.
// SessionVariation says what they make of the priors of a further session.
#pragma once

#include <optional>

#include "gap/fit/fit.hpp"

namespace flappy::gap {

/// None: the references are one session. Flights that name the same session are one, others each their own.
/// `parameters`: of a contrast, linearised; `fitter`: with its nuisances.
std::optional<OwnSessions> own_sessions(const Fitter& fitter, const Fit& parameters);

}  // namespace flappy::gap
