// Projection of a signal r(t) onto beats. Near beat j, its mean and first harmonics are
//   c_jk = n_k / W_j sum_i hat(b_i - j - 1/2) f_k(b_i) r_i      f = 1, cos 2 pi b, sin 2 pi b, cos 4 pi b, ...
// i: sample. b: time in beats. hat: falls from 1 to 0 over a beat to either side; all hats add up to 1. W_j: sum of the
// hat's weights. n: 1 for the mean, else 2. The smooth window suppresses differenced noise, which alternates over
// samples. Of each harmonic, rows keep changes slower than a few beats. Vehicles with wings and motors are compared by
// these rows; of a beat-averaged vehicle the mean alone is used, without a projection.
#pragma once

#include <cstddef>
#include <vector>

namespace flappy::gap {

/// Harmonics of the beat, besides the mean. Choice.
inline constexpr int kHarmonics = 4;
/// Coefficients of a beat, in this order: mean, cos 1, sin 1, cos 2, ..., sin kHarmonics.
inline constexpr int kCoefficients = 2 * kHarmonics + 1;

/// Weights of the samples of one stream in the rows of each beat.
class BeatProjection {
 public:
  BeatProjection() = default;  ///< of a stream that is not logged: no beats
  /// `beat`: [sample] time in beats; `valid`: [sample] whether it counts. `beats`: number of beats. A beat is not
  /// covered if it is before `first`, or lacks a tenth or more of the weight that the median beat has.
  BeatProjection(const std::vector<double>& beat, const std::vector<char>& valid, std::size_t beats, std::size_t first);

  std::size_t beats() const { return covered_.size(); }
  bool covers(std::size_t beat) const { return covered_[beat] != 0; }
  bool operator==(const BeatProjection&) const = default;
  /// Adds the coefficients of `width` signals to `rows`, [beat][coefficient][signal], in covered beats. `samples`:
  /// [sample][signal].
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
    bool operator==(const Weight&) const = default;
  };
  std::vector<Weight> weights_;
  std::vector<char> covered_;
};

}  // namespace flappy::gap
