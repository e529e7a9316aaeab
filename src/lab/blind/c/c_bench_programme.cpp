// Run 0: amplitudes, then differences. Run 1: biases and split cycles. Run 2: several at once. Each begins below the
// amplitude of hover and goes up. All values are our choice: below 0.8 of the amplitude's limit and 0.65 of the others',
// where no wing of a drawn robot meets the stops of its stroke.
#include "lab/blind/c/c_bench_programme.hpp"

#include <algorithm>

#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

const std::array<std::vector<BenchPoint>, Family::kFlights> kPoints = {{
    {{0.60, 0, 0, 0, false},
     {0.70, 0, 0, 0, false},
     {0.80, 0, 0, 0, true},
     {0.90, 0, 0, 0, false},
     {1.00, 0, 0, 0, true},
     {1.10, 0, 0, 0, false},
     {1.20, 0, 0, 0, true},
     {1.30, 0, 0, 0, false},
     {1.00, 0.25, 0, 0, false},
     {1.00, -0.25, 0, 0, false},
     {1.00, 0.50, 0, 0, true},
     {1.00, -0.50, 0, 0, true},
     {1.20, 0.35, 0, 0, false}},
    {{0.80, 0, 0, 0, false},
     {1.00, 0, 0, 0, false},
     {1.00, 0, 0.20, 0, false},
     {1.00, 0, -0.20, 0, false},
     {1.00, 0, 0.40, 0, true},
     {1.00, 0, -0.40, 0, true},
     {1.10, 0, 0.30, 0, true},
     {1.00, 0, 0, 0.30, false},
     {1.00, 0, 0, -0.30, false},
     {1.00, 0, 0, 0.60, true},
     {1.00, 0, 0, -0.60, true},
     {0.85, 0, 0, 0.45, false}},
    {{0.75, 0, 0, 0, false},
     {0.95, 0, 0, 0, false},
     {1.00, 0.30, 0.30, 0, false},
     {1.00, -0.30, 0.30, 0, false},
     {1.00, 0.30, 0, 0.40, false},
     {1.00, -0.30, 0, 0.40, false},
     {1.00, 0, 0.30, -0.40, false},
     {1.00, 0, -0.30, -0.40, false},
     {1.15, 0.25, -0.25, 0.30, false},
     {0.90, -0.25, 0.25, -0.30, false},
     {1.25, 0, 0, 0, false},
     {1.05, 0.20, 0.20, 0.20, false}},
}};
constexpr double kJitter = 0.03;  // a set point is dialled anew in each session
constexpr double kRamp_s = 0.3;   // each run starts up softly
constexpr double kStepUp_s = 0.1, kLowest = 0.75, kHighest = 1.25, kTone = 0.12;

}  // namespace

BenchProgramme::BenchProgramme(const Assignment& a, std::size_t run, const RobotParameters& parameters)
    : run_(run), parameters_(&parameters), points_(kPoints.at(run)) {
  Random random(a.seed, "bench points", programme_stream_of(a, run));
  for (BenchPoint& point : points_)
    for (double* value : {&point.amplitude, &point.difference, &point.bias, &point.split_cycle})
      *value *= 1 + kJitter * random.uniform(-1, 1);
  for (double t = 0; t < kSweep_s; t += kStepUp_s) levels_.push_back(random.uniform(kLowest, kHighest));
  for (auto& pair : tones_)
    for (Tone& tone : pair) {
      tone.frequency_Hz = random.uniform(2, 12);
      tone.phase = random.uniform(0, 2 * M_PI);
    }
}

BenchPoint BenchProgramme::sweep(double t_s) const {
  const double turn = 2 * M_PI * t_s / kSweep_s;
  if (run_ == 0) return {0.65 + 0.65 * t_s / kSweep_s, 0, 0, 0, false};
  if (run_ == 1) return {1, 0.4 * std::sin(3 * turn), 0.45 * std::sin(2 * turn), 0, false};
  const std::size_t level = std::min(static_cast<std::size_t>(t_s / kStepUp_s), levels_.size() - 1);
  std::array<double, 3> sum{};
  for (std::size_t input = 0; input < 3; ++input)
    for (const Tone& tone : tones_[input])
      sum[input] += kTone * std::sin(2 * M_PI * tone.frequency_Hz * t_s + tone.phase);
  return {levels_[level], sum[0], sum[1], sum[2], false};
}

Inputs BenchProgramme::inputs(double t_s) const {
  if (t_s < 0) return {};
  const std::size_t number = static_cast<std::size_t>(t_s / kPoint_s + 1e-9);
  const double held_s = kPoint_s * static_cast<double>(points_.size());
  const BenchPoint now = number < points_.size() ? points_[number] : sweep(std::max(0.0, t_s - held_s));
  const RobotParameters& f = *parameters_;
  return clipped({kHover_V * now.amplitude * std::min(1.0, t_s / kRamp_s), now.difference * f.difference_limit_V,
                  now.bias * f.bias_limit_V, now.split_cycle * f.split_cycle_limit},
                 f);
}

bool BenchProgramme::filmed(double t_s) const {
  const std::size_t number = static_cast<std::size_t>(std::max(0.0, t_s) / kPoint_s);
  return t_s >= 0 && number < points_.size() && points_[number].filmed;
}

}  // namespace flappy::blind::c
