// Signals, beat by beat: a signal r(t) around beat j becomes its mean and the first harmonics of the beat,
//   c_jh = (norm) sum_i hat(b_i - j - 1/2) f_h(b_i) r_i      f = 1, cos 2 pi b, sin 2 pi b, cos 4 pi b, ...
// b: beats since the start; hat: falls from 1 to 0 within a beat to either side, so that the hats of all beats add up to 1
// and a jump from one sample to the next, as noise differenced, hardly shows. What is below a few beats is all in the rows;
// what is above the last harmonic is not.
#pragma once

#include <cstddef>
#include <vector>

namespace flappy::gap {

inline constexpr int kHarmonics = 4;
inline constexpr int kCoefficients = 2 * kHarmonics + 1;

/// Weights of the samples of one stream.
class BeatProjection {
 public:
  BeatProjection() = default;
  /// `beat`: of each sample; a beat whose two hats miss more than a tenth of their samples is not covered. `first`: beats
  /// before it are left out.
  BeatProjection(const std::vector<double>& beat, const std::vector<char>& valid, std::size_t beats, std::size_t first);

  std::size_t beats() const { return covered_.size(); }
  bool covers(std::size_t beat) const { return covered_[beat] != 0; }
  /// Adds `samples` of `width` signals side by side, [sample][width], as [beat][coefficient][width].
  void project(const double* samples, std::size_t width, double* rows) const;
  /// Calls use(sample, beat, weights[kCoefficients]) wherever a sample counts.
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
