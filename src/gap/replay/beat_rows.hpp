// Projection of signals onto beats. Near beat j, a signal r(t) is described by its mean and the first harmonics of the beat,
//   c_jh = (norm) sum_i hat(b_i - j - 1/2) f_h(b_i) r_i      f = 1, cos 2 pi b, sin 2 pi b, cos 4 pi b, ...
// b: time in beats since the start. hat: a triangle that falls from 1 to 0 within one beat to either side. The hats of all beats add up to 1,
// and a smooth window suppresses differenced noise, which alternates from sample to sample. The rows keep changes that are slower than a few
// beats; they lose what is above the last harmonic.
#pragma once

#include <cstddef>
#include <vector>

namespace flappy::gap {

inline constexpr int kHarmonics = 4;
inline constexpr int kCoefficients = 2 * kHarmonics + 1;

/// Weights of the samples of one stream in the rows of each beat.
class BeatProjection {
 public:
  BeatProjection() = default;
  /// `beat`, `valid`: [sample] time in beats, and whether it counts. A beat is not covered if more than a tenth of the weight of its
  /// hat is missing, or if it comes before beat `first`.
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
