// Measured wings beside simulated ones on one wing beat.
//
// Both become Fourier series in the phase of the beat, by least squares: samples may come at any times and need not repeat.
// When a recording began is not known to the phase, so the measured beat is shifted as a whole until the first harmonics of
// both strokes agree best; what is left is a phase of each angle.
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
  std::optional<sim::Input> input;  ///< where the file has its columns
};

/// Columns t_s and kAngleNames, as a flight log's wings.csv; optional amplitude_V,difference_V,bias_V,split_cycle, constant.
/// InputError "file:line: column: ..." for other columns, units, times that do not increase, inputs that change.
WingSamples read_wing_samples(const std::filesystem::path& path);

/// Leaves the samples from `from_s` to `to_s`.
void cut(WingSamples& samples, double from_s, double to_s);

/// An angle over a beat.
struct BeatFigures {
  double amplitude_rad = 0;  ///< half of what it sweeps
  double bias_rad = 0;       ///< middle of what it sweeps
  double phase_rad = 0;      ///< of its first harmonic, a cosine
};

struct AngleComparison {
  BeatFigures measured, simulated;
  double phase_rad = 0;    ///< measured minus simulated, in (-pi, pi]
  double rms_rad = 0;      ///< of samples minus the simulated beat
  double scatter_rad = 0;  ///< of samples about the measured beat
};

inline constexpr std::size_t kBeatPoints = 200;

struct WingComparison {
  double shift_rad = 0;  ///< phase of the beat at t_s = 0
  std::array<AngleComparison, 4> angles;
  /// On kBeatPoints phases from 0 on.
  std::array<std::vector<double>, 4> measured_rad, simulated_rad;
};

/// The wings of `vehicle`, welded and settled at `input`, beside `samples`. InputError for less than one beat, or for times
/// that leave a part of the beat without samples.
WingComparison compare_wings(const model::Vehicle& vehicle, const sim::Input& input, const WingSamples& samples,
                             const MapOptions& options = {});

void write_beat_csv(const std::filesystem::path& path, const WingComparison& comparison);
/// By gnuplot; InputError where it is missing or fails.
void write_beat_svg(const std::filesystem::path& path, const WingComparison& comparison);

}  // namespace flappy::identify
