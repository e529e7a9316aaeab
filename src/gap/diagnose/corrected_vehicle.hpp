// What a diagnosis hands back to train on.
#pragma once

#include "flappy/vehicle.hpp"
#include "gap/diagnose/diagnose.hpp"

namespace flappy::gap {

/// The vehicle with what was concluded and nothing else; its posterior says what remains uncertain.
model::Vehicle corrected_vehicle(const model::Vehicle& vehicle, const Diagnosis& diagnosis,
                                 const sim::Randomisation& uncertain);

}  // namespace flappy::gap
