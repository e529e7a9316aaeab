// A gait from measured wing angles: Fourier coefficients of the beat by least squares, as a vehicle file with model = "jointed" has them.
//
// The table has a column t_s, or beat (time as beats, whose fraction is the phase), and any of stroke_plane, stroke, deviation, rotation, with the unit
// as suffix, _rad or _deg; left_ or right_ before it, or neither for a vehicle that is symmetric. Samples may come at any times and of several beats.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flappy::identify {

struct GaitOptions {
  std::size_t harmonics = 8;
  std::optional<double> frequency_Hz;  ///< of a table by t_s
  double residual =
      0.1;  ///< rms of what no beat explains, as a share of the angle's, above which it counts as not periodic
};

/// One angle: q = mean + sum cos_rad[k] cos(2 pi (k + 1) t) + sin_rad[k] sin(...), t in beats since the phase 0 of the table.
struct FittedAngle {
  std::string side;   ///< "left" or "right"
  std::string angle;  ///< as in the vehicle file
  double mean_rad = 0;
  std::vector<double> cos_rad, sin_rad;
  double rms_rad = 0;  ///< of samples about it
};

/// InputError "file: column: ..." for a table that holds no whole beat, has gaps in its phase, does not repeat, goes beyond what a wing's angle may, or is
/// in degrees where it says radians.
std::vector<FittedAngle> fit_gait(const std::filesystem::path& path, const GaitOptions& options);

/// Tables of a vehicle file.
std::string gait_text(const std::vector<FittedAngle>& angles);

}  // namespace flappy::identify
