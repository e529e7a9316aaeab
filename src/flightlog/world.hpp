// The room of a log, to fly in once more.
#pragma once

#include "flappy/world.hpp"
#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

sim::World world_of(const FlightHeader& header);

/// A solid of a world as a log has it.
void add_solid(const sim::Shape& shape, LogAmbient& ambient);

}  // namespace flappy::flightlog
