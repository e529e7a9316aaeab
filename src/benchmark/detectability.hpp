// The least magnitude at which an effect of a family is detectable, without any diagnosis: the change that the effect makes along flights without
// it (Family::contrast), compared with the errors of any model of a vehicle.
//
// Masses, springs and wings as published or weighed are some per cent off, and the declared latency of an IMU is up to a millisecond off. So no
// model predicts the forces and angular accelerations of a beat exactly, and the change has to exceed these errors; the noise of the sensors
// averages to less than a thousandth of the beat in 30 s. In each channel and order of the beat (mean, first, second harmonic), let d be the change
// at magnitude s, x the signal of the flight, and R a reference. Then
//   q(s) = rms of (d - a x - tau x' - c) / R
// is the part that remains after least squares over a factor a within kParameterError, a latency tau within kLate_s, and a constant c within
// kConstant R. The rms is over the tenth of the beats with the largest remainder, 3 of 30 s, for some effects act only near the ground or a wall.
// R is the rms waveform of an axis, over all three forces or all three angular accelerations: a wing by itself shakes along all axes, and loads
// that cancel between two wings are known no better than the load of one. For mean forces, R is the rms of the whole mean force, the weight.
// These bounds are choices. The constant is a third of a waveform, as much as quasi-steady models of a wing may leave. kShare is a third of a
// tenth: motion and inputs change the waveform by about a tenth, and models leave a third of that, too. kLate_s is the error of a declared latency.
// An effect is detectable at the magnitude at which its largest q reaches kShare, with changes in proportion to the magnitude. It is undetectable
// if that is beyond half the largest magnitude of robots.
//
// Effects that change neither force nor angular acceleration act only on a sensor. Their magnitude 1 is an error that data sheets and laboratories
// state (FamilyEffect::typical), many times what 30 s of noise leave uncertain, so they count as detectable at magnitude 1.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "blind/family.hpp"
#include "io/installation.hpp"

namespace flappy::benchmark {

inline constexpr double kShare = 0.03, kParameterError = 0.1, kConstant = 0.3, kLate_s = 1e-3;

/// Signal of a flight: [beat][channel x 5 + coefficient], as in blind::Contrast; none where a beat has too few samples.
using Beats = std::vector<std::optional<std::array<double, 30>>>;

/// Specific force and angular acceleration of the beats that begin at `beat_s`, measured by the IMU of the log.
Beats beats_of(const flightlog::FlightLog& log, const std::vector<double>& beat_s);

/// The change that an effect of magnitude 1 makes along flights, and the signal of these, [beat].
struct Changed {
  std::vector<std::array<double, 30>> change, signal;
  double flapping_Hz = 0;
  void add(const blind::Contrast& contrast, const Beats& of);  ///< appends one flight, whose signal is `of`
};

/// The largest q, with its channel and order.
struct Shown {
  double share = 0;
  std::size_t channel = 0, order = 0;
};
Shown shown(const Changed& changed, double magnitude);

/// The magnitude at which the largest q reaches kShare; infinite if beyond `most`.
double detectable_magnitude(const Changed& changed, double most);

struct DetectabilityCommand {
  std::string family, vehicle = io::config_path("vehicles/hummingbird_nominal.toml"), out;
  int vehicles = 2;
  std::uint64_t seed = 2001;  ///< seed of the first vehicle
  int threads = 0;            ///< 0: one for each processor
};

/// flappy-blind detectability: prints the detectable magnitudes of every effect and writes them to `out`; returns them as JSON.
nlohmann::ordered_json run_detectability(const DetectabilityCommand& command);

}  // namespace flappy::benchmark
