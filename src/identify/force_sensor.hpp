// A force map as a laboratory would measure it, from a simulated vehicle: 5 kHz samples of the aerodynamic wrench over 17
// beats (or whole_beats() of another driver), each with its noise and quantised, then averaged.
#pragma once

#include "identify/measured_map.hpp"

namespace flappy::identify {

struct ForceSensor {
  double rate_hz = 5000;
  double force_step_N = 1.0 / 320, torque_step_Nm = 1e-3 / 64;  // ATI Nano17, finest calibration (SI-12-0.12)
  double noise_steps = 1;  ///< standard deviation of a sample's noise, in steps; 0: neither noise nor quantisation
};

/// The paper says 37 inputs and gives no list. This one: amplitude alone from 5 to 14 V in thirteen steps; and about 10 V,
/// which hovers the nominal vehicle, difference, bias and split cycle in eight steps each, to two thirds or more of the
/// driver's limits. The map jumps below about 3 V, where wings hardly flip, and from about 16 V on, where the stroke meets
/// its stops: by up to 150 standard deviations of this sensor, which no slope can follow.
std::vector<sim::Input> default_inputs();

/// The map of `vehicle` as `sensor` sees it, with the standard deviation of each value; none without noise.
MeasuredMap simulate_forces(const model::Vehicle& vehicle, const std::vector<sim::Input>& inputs,
                            const ForceSensor& sensor, std::uint64_t seed, const MapOptions& options = {});

}  // namespace flappy::identify
