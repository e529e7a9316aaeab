// A manoeuvre that a diagnosis proposes, as a flight in the room of a blind robot.
#pragma once

#include "blind/family.hpp"
#include "gap/diagnose/next_experiment.hpp"

namespace flappy::benchmark {

/// The part of the manoeuvre that is logged, moved into the room that `header` declares: the distance to the ceiling is that of the manoeuvre's own
/// world if that has a ceiling, otherwise the height above the ground; the distance to the wall likewise if both have a wall. The result refers to
/// `manoeuvre`.
blind::ProposedFlight proposed_flight(const gap::Manoeuvre& manoeuvre, const flightlog::FlightHeader& header);

}  // namespace flappy::benchmark
