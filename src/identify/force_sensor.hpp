// Simulates a laboratory's measurement of a force map: 5 kHz samples of a simulated vehicle's aerodynamic wrench over 17 beats (or
// whole_beats() of another driver), each with noise and quantisation, then averaged.
#pragma once

#include "identify/measured_map.hpp"

namespace flappy::identify {

struct ForceSensor {
  double rate_hz = 5000;
  double force_step_N = 1.0 / 320, torque_step_Nm = 1e-3 / 64;  // ATI Nano17, finest calibration (SI-12-0.12)
  double noise_steps = 1;  ///< standard deviation of a sample's noise, in steps; 0: neither noise nor quantisation
};

/// 37 inputs, as many as in the paper, which gives no list. Here: amplitude alone from 5 to 14 V in thirteen steps;
/// and, at an amplitude of 10 V, where the nominal vehicle hovers, difference, bias and split cycle in eight steps
/// each, to two thirds or more of the driver's limits. The range avoids jumps of the map: below about 3 V, where wings
/// hardly flip, and from about 16 V on, where the stroke meets its stops, it jumps by up to 150 standard deviations of
/// this sensor, and slopes mean nothing there.
std::vector<sim::Input> default_inputs();

/// The force map of `vehicle` as `sensor` measures it, with the standard deviation of each value. Without noise: the
/// exact map and no standard deviations.
MeasuredMap simulate_forces(const model::Vehicle& vehicle, const std::vector<sim::Input>& inputs,
                            const ForceSensor& sensor, std::uint64_t seed, const MapOptions& options = {});

}  // namespace flappy::identify
