// The manoeuvre that a diagnosis proposes, as a laboratory flies it.
#pragma once

#include "blind/family.hpp"
#include "gap/diagnose/next_experiment.hpp"

namespace flappy::benchmark {

/// From where its log begins on, in the room that `header` declares: as far from the ceiling and from the wall as in the manoeuvre's own world, where that
/// has them, and else above the ground. It keeps a reference to `manoeuvre`.
blind::ProposedFlight proposed_flight(const gap::Manoeuvre& manoeuvre, const flightlog::FlightHeader& header);

}  // namespace flappy::benchmark
