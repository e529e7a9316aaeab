// The least magnitude at which an effect is detectable, without a diagnosis: its change along flights without it
// (Family::contrast), against the errors of any model: masses, springs and wings are some per cent off, the declared
// latency of an IMU up to a millisecond. (The noise of sensors averages to less than a thousandth of the beat in 30 s.)
// In each channel and order of the beat, with d the change at magnitude s, x the flight's signal and R a reference,
//   q(s) = rms of (d - a x - tau x' - c) / R
// is what least squares leaves over a within kParameterError, tau within kLate_s, and constant c within kConstant R.
// The rms is over the tenth of the beats with the largest remainder: some effects act only near surfaces. R is the rms
// waveform of an axis over all three forces or angular accelerations, as a wing shakes along all axes and loads that
// cancel between wings are known no better than one wing's; for mean forces, the weight.
// The bounds are choices: the constant, a third of a waveform, is what quasi-steady wing models may leave; kShare is a
// third of a tenth, as motion and inputs change the waveform by a tenth and models leave a third of that; kLate_s is
// the error of a latency. An effect is detectable where its largest q reaches kShare, with changes in proportion to the
// magnitude; undetectable if that is beyond half the largest magnitude of robots.
// Effects on a sensor alone count as detectable at magnitude 1, an error that data sheets and laboratories state
// (FamilyEffect::typical), many times what 30 s of noise leave uncertain.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/installation.hpp"
#include "lab/blind/family.hpp"

namespace flappy::benchmark {

inline constexpr double kShare = 0.03, kParameterError = 0.1, kConstant = 0.3, kLate_s = 1e-3;

/// Signal of a flight: [beat][channel x 5 + coefficient], as in blind::Contrast; none for beats with too few samples.
using Beats = std::vector<std::optional<std::array<double, 30>>>;

/// Specific force and angular acceleration of the beats that begin at `beat_s`, measured by the log's IMU.
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

/// Prints the magnitudes of every effect and writes them to `out`.
nlohmann::ordered_json run_detectability(const DetectabilityCommand& command);

}  // namespace flappy::benchmark
