// A manoeuvre that a diagnosis proposes, as a flight in the room of a blind robot.
#pragma once

#include "gap/next/next_experiment.hpp"
#include "lab/blind/family.hpp"

namespace flappy::benchmark {

/// The logged part of the manoeuvre in the room of `header`: it keeps its distance to its own ceiling, or else its
/// height, and to its wall if both have one. The result refers to `manoeuvre`.
blind::ProposedFlight proposed_flight(const gap::Manoeuvre& manoeuvre, const flightlog::FlightHeader& header);

}  // namespace flappy::benchmark
