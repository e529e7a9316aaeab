#include "model/coarse_step.hpp"

#include <algorithm>
#include <cmath>

#include "io/text.hpp"

namespace flappy::model {
namespace {

constexpr double kMinOrder = 2;

double fastest_beat_Hz(const Vehicle& v) {
  if (!v.jointed) return v.driver.flapping_Hz;
  double faster = 1;
  for (const Jointed::Input& i : v.jointed->inputs) faster += std::max(i.frequency * i.low, i.frequency * i.high);
  return faster * v.jointed->frequency_Hz;
}

/// k of the head.
double order_of_rates(const Vehicle& v) {
  if (!v.jointed) return kMinOrder;
  double sum = 0, weighted = 0;
  for (const Jointed::Wing* w : {&v.jointed->left, &v.jointed->right})
    for (const Jointed::Angle& a : w->angles)
      for (std::size_t k = 0; k < a.cos_rad.size(); ++k) {
        const double n = static_cast<double>(k + 1),
                     rate2 = n * n * (a.cos_rad[k] * a.cos_rad[k] + a.sin_rad[k] * a.sin_rad[k]);
        sum += rate2;
        weighted += n * n * rate2;
      }
  return sum > 0 ? std::max(kMinOrder, std::sqrt(weighted / sum)) : kMinOrder;
}

}  // namespace

std::optional<CoarseStep> coarse_step(const Vehicle& v, double step_s) {
  if (v.beat_averaged) return std::nullopt;
  const double beat_Hz = fastest_beat_Hz(v), cycle_s = 1 / (order_of_rates(v) * beat_Hz);
  if (step_s * kEnoughSteps <= cycle_s) return std::nullopt;
  const double steps = 1 / (beat_Hz * step_s), enough = kEnoughSteps / (cycle_s * beat_Hz);
  return CoarseStep{io::format("is %.3g steps per beat of %.4g Hz, whose wings need %.3g", steps, beat_Hz, enough),
                    cycle_s / kEnoughSteps, step_s * kFewestSteps > cycle_s};
}

}  // namespace flappy::model
