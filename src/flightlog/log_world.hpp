// Conversion between the surroundings in a log's header and the world of the simulator.
#pragma once

#include "flappy/world.hpp"
#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

sim::World world_of(const FlightHeader& header);

void add_solid(const sim::Shape& shape, LogAmbient& ambient);

}  // namespace flappy::flightlog
