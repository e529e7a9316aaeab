// A laboratory's measurement of a force map: the mean of 5 kHz samples of a simulated wrench over 17 beats (or
// whole_beats() of another driver), each with noise and quantisation.
#pragma once

#include "identify/measured_map.hpp"

namespace flappy::identify {

struct ForceSensor {
  double rate_hz = 5000;
  double force_step_N = 1.0 / 320, torque_step_Nm = 1e-3 / 64;  // ATI Nano17, finest calibration (SI-12-0.12)
  double noise_steps = 1;  ///< standard deviation of a sample's noise, in steps; 0: neither noise nor quantisation
};

/// 37 inputs, as many as in the paper, which gives no list: amplitude alone from 5 to 14 V in thirteen steps; at 10 V,
/// where the nominal vehicle hovers, difference, bias and split cycle in eight steps each, to two thirds or more of the
/// driver's limits. Below about 3 V, where wings hardly flip, and from about 16 V on, at the stops, the map jumps by up
/// to 150 sd of this sensor, and slopes mean nothing.
std::vector<sim::Input> default_inputs();
/// The same; io::InputError if one is beyond the driver's limits.
std::vector<sim::Input> default_inputs(const model::Driver& driver);

/// The map as `sensor` measures it, with each value's sd; without noise: the exact map without standard deviations.
MeasuredMap simulate_forces(const model::Vehicle& vehicle, const std::vector<sim::Input>& inputs,
                            const ForceSensor& sensor, std::uint64_t seed, const MapOptions& options = {});

}  // namespace flappy::identify
