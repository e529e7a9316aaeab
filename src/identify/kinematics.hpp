// Compares measured wing angles with simulated ones over a beat, as Fourier series in its phase by least squares, so
// samples may be at any times. A recording begins at an unknown phase: the measured beat is shifted as a whole until
// the first harmonics of both strokes agree best; then each angle has a phase of its own left.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "identify/force_map.hpp"

namespace flappy::identify {

inline constexpr std::array<const char*, 4> kAngleNames = {"left_stroke_rad", "left_rotation_rad", "right_stroke_rad",
                                                           "right_rotation_rad"};

struct WingSamples {
  std::string name;  ///< the file, for messages
  std::vector<double> t_s;
  std::array<std::vector<double>, 4> angles_rad;
  std::optional<sim::Input> input;  ///< from the columns of inputs, where the file has them
};

/// Reads t_s and kAngleNames, as in wings.csv; optionally constant amplitude_V,difference_V,bias_V,split_cycle.
/// InputError "file:line: column: ..." for other columns or units, times that do not increase and inputs that change.
WingSamples read_wing_samples(const std::filesystem::path& path);

/// Keeps the samples from `from_s` to `to_s`.
void cut(WingSamples& samples, double from_s, double to_s);

/// Parameters of an angle over a beat.
struct BeatParameters {
  double amplitude_rad = 0;  ///< half of maximum less minimum
  double bias_rad = 0;       ///< middle between maximum and minimum
  double phase_rad = 0;      ///< phase of the first harmonic as a cosine
};

struct AngleComparison {
  BeatParameters measured, simulated;
  double phase_rad = 0;    ///< measured minus simulated, in (-pi, pi]
  double rms_rad = 0;      ///< rms of the samples less the simulated beat
  double scatter_rad = 0;  ///< rms of the samples less the measured beat
};

inline constexpr std::size_t kBeatPoints = 200;

struct WingComparison {
  double shift_rad = 0;  ///< phase of the beat at t_s = 0
  std::array<AngleComparison, 4> angles;
  /// Angles at kBeatPoints equidistant phases from 0 on, [angle][phase].
  std::array<std::vector<double>, 4> measured_rad, simulated_rad;
};

/// Compares `samples` with the wings of `vehicle`, torso welded, settled at `input`. InputError for less than one beat
/// and for a part of it without samples.
WingComparison compare_wings(const model::Vehicle& vehicle, const sim::Input& input, const WingSamples& samples,
                             const MapOptions& options = {});

void write_beat_csv(const std::filesystem::path& path, const WingComparison& comparison);
/// Plots by gnuplot; InputError where gnuplot is missing or fails.
void write_beat_svg(const std::filesystem::path& path, const WingComparison& comparison);

}  // namespace flappy::identify
