// Fits a gait to measured wing angles: Fourier coefficients of the beat by least squares, for a vehicle file with model = "jointed".
//
// The table has a column t_s, or beat (time in beats; its fraction is the phase), and any of stroke_plane, stroke, deviation, rotation,
// with the unit as suffix, _rad or _deg, and with the prefix left_ or right_, or none for a symmetric vehicle. Samples may be at any times
// and span several beats.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flappy::identify {

struct GaitOptions {
  std::size_t harmonics = 8;
  std::optional<double> frequency_Hz;  ///< needed for a table with t_s
  double residual =
      0.1;  ///< largest rms residual, as a share of the angle's rms, at which the angle still counts as periodic
};

/// One angle: q = mean_rad + sum over k of cos_rad[k] cos(2 pi (k + 1) t) + sin_rad[k] sin(2 pi (k + 1) t), t in beats
/// of the table.
struct FittedAngle {
  std::string side;   ///< "left" or "right"
  std::string angle;  ///< as in the vehicle file
  double mean_rad = 0;
  std::vector<double> cos_rad, sin_rad;
  double rms_rad = 0;  ///< rms of the samples less the series
};

/// InputError "file: column: ..." for a table that holds no whole beat, has gaps in its phase, is not periodic, exceeds
/// the range of a wing angle, or is in degrees although its column says radians.
std::vector<FittedAngle> fit_gait(const std::filesystem::path& path, const GaitOptions& options);

/// The angles as TOML tables of a vehicle file.
std::string gait_text(const std::vector<FittedAngle>& angles);

}  // namespace flappy::identify
