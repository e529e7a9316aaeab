// Projection of a signal r(t) onto beats. Near beat j, its mean and first harmonics are
//   c_jh = (norm) sum_i hat(b_i - j - 1/2) f_h(b_i) r_i      f = 1, cos 2 pi b, sin 2 pi b, cos 4 pi b, ...
// b: time in beats. hat: falls from 1 to 0 over a beat to either side; all hats add up to 1. The smooth window
// suppresses differenced noise, which alternates over samples. Rows keep changes slower than a few beats up to the last
// harmonic.
#pragma once

#include <cstddef>
#include <vector>

namespace flappy::gap {

/// Harmonics of the beat, besides the mean. Choice.
inline constexpr int kHarmonics = 4;
inline constexpr int kCoefficients = 2 * kHarmonics + 1;

/// Weights of the samples of one stream in the rows of each beat.
class BeatProjection {
 public:
  BeatProjection() = default;
  /// [sample] time in beats, and whether it counts. Beats before `first`, or with over a tenth of the hat's weight
  /// missing, are not covered.
  BeatProjection(const std::vector<double>& beat, const std::vector<char>& valid, std::size_t beats, std::size_t first);

  std::size_t beats() const { return covered_.size(); }
  bool covers(std::size_t beat) const { return covered_[beat] != 0; }
  /// Adds the coefficients of `width` signals to `rows`, [beat][coefficient][width]. `samples`: [sample][width].
  void project(const double* samples, std::size_t width, double* rows) const;
  /// Calls use(sample, beat, weights[kCoefficients]) for each sample of each covered beat.
  template <class Use>
  void for_each(const Use& use) const {
    for (const Weight& w : weights_)
      if (covered_[w.beat]) use(w.sample, w.beat, w.f);
  }

 private:
  struct Weight {
    std::size_t sample, beat;
    double f[kCoefficients];
  };
  std::vector<Weight> weights_;
  std::vector<char> covered_;
};

}  // namespace flappy::gap
