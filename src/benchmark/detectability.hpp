// How large an effect of a family has to be, without any diagnosis: from what it changes along flights without it
// (Family::contrast), against what is known of a vehicle at all.
//
// Masses, springs and wings as published, or as weighed, are some per cent off, and an IMU is declared to be up to a millisecond earlier or
// later than it is. So no model has forces and turning of a beat exactly, and what an effect changes has to stand out of
// that; the sensors' noise is averaged to less than a thousandth of the beat in 30 s. In each channel and order of the beat (mean,
// first, second harmonic) let d be the change at size s, x the signal of the flight, and R what the signal is measured by: then
//   q(s) = rms of (d - a x - tau x' - c) / R
// is what neither a factor a within kFigures, nor lateness tau within kLate_s, nor a constant c within kConstant R takes over, by least
// squares. The rms is of the tenth of the beats that shows it most: 3 of 30 s, for some effects act near the ground, or the wall, alone.
// R is the rms of the waveform of the three forces together, or of the three turning accelerations: a wing by itself shakes along all
// axes, and what cancels between two wings is known no better than its parts. Only the mean force is the weight, and measured by that.
// These are choices: a constant of a third of a waveform, as much as quasi-steady models of a wing may leave; of the tenth by which
// motion and inputs change it a third as well, kShare; and the lateness that is left in a declared latency.
// An effect is detectable at the size at which its largest q comes to kShare, with changes that grow as the size; beyond half the
// largest size that robots have, it is undetectable.
//
// Effects that change neither force nor turning act on what a sensor says alone. Their size 1 is what data sheets and laboratories call
// an error (FamilyEffect::typical), many times what 30 s of noise leaves of it: they count as detectable there.
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

inline constexpr double kShare = 0.03, kFigures = 0.1, kConstant = 0.3, kLate_s = 1e-3;

/// A flight by beats: [beat][channel x 5 + coefficient], as Contrast has it; nothing where a beat lacks samples.
using Beats = std::vector<std::optional<std::array<double, 30>>>;

/// Specific force and turning acceleration of the beats that begin at `beat_s`, by the log's IMU.
Beats beats_of(const flightlog::FlightLog& log, const std::vector<double>& beat_s);

/// What an effect of size 1 changes along one flight, by the beats of the signal.
struct Changed {
  std::vector<std::array<double, 30>> change, signal;
  double flapping_Hz = 0;
  void add(const blind::Contrast& contrast, const Beats& of);  ///< of one more flight
};

/// Largest q, and where.
struct Shown {
  double share = 0;
  std::size_t channel = 0, order = 0;
};
Shown shown(const Changed& changed, double size);

/// Where q comes to kShare; infinite beyond `most`.
double detectable_size(const Changed& changed, double most);

struct DetectabilityCommand {
  std::string family, vehicle = io::config_path("vehicles/hummingbird_nominal.toml"), out;
  int vehicles = 2;
  std::uint64_t seed = 2001;  ///< of the first
  int threads = 0;            ///< 0: one for each processor
};

/// flappy-blind detectability: prints and writes the sizes of every effect; the machine-readable result.
nlohmann::ordered_json run_detectability(const DetectabilityCommand& command);

}  // namespace flappy::benchmark
