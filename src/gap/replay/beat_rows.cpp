#include "gap/replay/beat_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/statistics.hpp"

namespace flappy::gap {

BeatProjection::BeatProjection(const std::vector<double>& beat, const std::vector<char>& valid, std::size_t beats,
                               std::size_t first)
    : covered_(beats, 0) {
  // A beat counts where less than this share of its usual weight is missing. Choice.
  constexpr double kMissing = 0.1;
  std::vector<double> there(beats, 0), all(beats, 0);
  for (std::size_t i = 0; i < beat.size(); ++i) {
    const auto near = static_cast<std::ptrdiff_t>(std::floor(beat[i] - 0.5));
    for (std::ptrdiff_t j = near; j <= near + 1; ++j) {
      if (j < static_cast<std::ptrdiff_t>(first) || j >= static_cast<std::ptrdiff_t>(beats)) continue;
      const double hat = 1 - std::abs(beat[i] - static_cast<double>(j) - 0.5);
      if (!(hat > 0)) continue;
      const auto k = static_cast<std::size_t>(j);
      all[k] += hat;
      if (!valid[i]) continue;
      there[k] += hat;
      Weight w{i, k, {}};
      w.f[0] = hat;
      for (std::size_t h = 1; h <= kHarmonics; ++h) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(h) * beat[i];
        w.f[2 * h - 1] = 2 * hat * std::cos(angle);
        w.f[2 * h] = 2 * hat * std::sin(angle);
      }
      weights_.push_back(w);
    }
  }
  // compared with the median weight, for at the ends of a flight only half of a hat has samples
  const double usual = io::upper_median(all);
  for (std::size_t k = 0; k < beats; ++k) covered_[k] = k >= first && there[k] > (1 - kMissing) * usual ? 1 : 0;
  for (Weight& w : weights_)
    for (double& f : w.f) f /= there[w.beat];
}

void BeatProjection::project(const double* samples, std::size_t width, double* rows) const {
  for_each([&](std::size_t sample, std::size_t beat, const double(&f)[kCoefficients]) {
    const double* from = samples + sample * width;
    double* to = rows + beat * kCoefficients * width;
    for (int c = 0; c < kCoefficients; ++c, to += width)
      for (std::size_t i = 0; i < width; ++i) to[i] += f[c] * from[i];
  });
}

}  // namespace flappy::gap
