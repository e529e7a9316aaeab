// Fits a gait to measured wing angles: Fourier coefficients of the beat by least squares, for model = "jointed".
//
// Columns: t_s, or beat (time in beats; its fraction is the phase), and any of stroke_plane, stroke, deviation,
// rotation, suffix _rad or _deg, prefix left_, right_, or none for a symmetric vehicle. Samples may span several beats.
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

/// One angle: q = mean_rad + sum over k of cos_rad[k] cos(2 pi (k + 1) t) + sin_rad[k] sin(2 pi (k + 1) t), t in beats.
struct FittedAngle {
  std::string side;   ///< "left" or "right"
  std::string angle;  ///< as in the vehicle file
  double mean_rad = 0;
  std::vector<double> cos_rad, sin_rad;
  double rms_rad = 0;  ///< rms of the samples less the series
};

/// InputError "file: column: ..." for a table without a whole beat, with phase gaps, not periodic, beyond the range of
/// a wing angle, or in degrees under the name of radians.
std::vector<FittedAngle> fit_gait(const std::filesystem::path& path, const GaitOptions& options);

/// The angles as TOML tables of a vehicle file.
std::string gait_text(const std::vector<FittedAngle>& angles);

}  // namespace flappy::identify
