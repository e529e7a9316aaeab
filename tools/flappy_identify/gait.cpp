// flappy-identify gait: fits Fourier coefficients to measured wing angles, for a vehicle file.
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include "command.hpp"
#include "identify/gait_fit.hpp"
#include "io/files.hpp"

namespace flappy::identify {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

struct GaitSettings {
  std::string measured, out;
  GaitOptions options;
  double frequency_Hz = 0;
  io::Option frequency;
};

Json run(const GaitSettings& s) {
  GaitOptions options = s.options;
  if (s.frequency.given()) {
    if (!(s.frequency_Hz > 0)) throw io::InputError("--frequency-Hz: is not above 0; accepted: beats per second");
    options.frequency_Hz = s.frequency_Hz;
  }
  if (!s.out.empty()) io::check_output(s.out);
  const std::vector<FittedAngle> angles = fit_gait(s.measured, options);
  const std::string text = gait_text(angles);
  if (s.out.empty()) std::printf("%s", text.c_str());
  else io::write_atomically(s.out, text);
  Json all = Json::array();
  for (const FittedAngle& f : angles) {
    if (!s.out.empty())
      std::printf("%s.%s: mean %.2f deg, first harmonic %.2f deg, %.3f deg rms left\n", f.side.c_str(), f.angle.c_str(),
                  f.mean_rad * kDegrees, std::hypot(f.cos_rad[0], f.sin_rad[0]) * kDegrees, f.rms_rad * kDegrees);
    all.push_back({{"side", f.side},
                   {"angle", f.angle},
                   {"mean_rad", f.mean_rad},
                   {"cos_rad", f.cos_rad},
                   {"sin_rad", f.sin_rad},
                   {"rms_rad", f.rms_rad}});
  }
  return {{"angles", all}};
}

}  // namespace

Command add_gait(const io::Command& program) {
  const auto s = std::make_shared<GaitSettings>();
  io::Command app = program.command("gait", "Fourier coefficients of measured wing angles, for a vehicle file");
  app.option("measured", s->measured, "table of a beat or more: t_s or beat, and angles in _rad or _deg").required();
  s->frequency = app.option("--frequency-Hz", s->frequency_Hz, "beats per second, of a table by t_s");
  app.option("--harmonics", s->options.harmonics, "of the beat (8)");
  app.option("--residual", s->options.residual, "rms that no beat explains, as a share of the angle's, at most (0.1)")
      .range(0.0, 1.0);
  app.option("--out", s->out, "file for the lines of the vehicle file");
  return {app, [s] { return run(*s); }};
}

}  // namespace flappy::identify
