// The flight is flown once; its voltages are applied twice more, with and without the effect, while the torso repeats
// the motion. Both runs record the torso's acceleration if free in this step; other parts follow the true one. Effects
// on sensors alone give no contrast.
#include "lab/blind/c/c_contrast.hpp"

namespace flappy::blind::c {
namespace {

using Six = Eigen::Matrix<double, 6, 1>;

/// Mean, cosine and sine of two harmonics of each beat.
struct Beats {
  std::vector<std::array<double, 30>> sums;
  std::vector<double> counts;

  void add(std::size_t beat, double phase, const Six& value) {
    if (beat >= sums.size()) {
      sums.resize(beat + 1);
      counts.resize(beat + 1);
    }
    const double angle = 2 * M_PI * phase;
    const std::array<double, 5> basis = {1, 2 * std::cos(angle), 2 * std::sin(angle), 2 * std::cos(2 * angle),
                                         2 * std::sin(2 * angle)};
    for (std::size_t channel = 0; channel < 6; ++channel)
      for (std::size_t i = 0; i < 5; ++i) sums[beat][channel * 5 + i] += basis[i] * value[static_cast<int>(channel)];
    ++counts[beat];
  }
};

Beats replayed(const Assignment& a, std::size_t flight, const Flown& flown, Length length) {
  Robot robot(a, flight);
  const Eigen::Vector3d place = sensor_parameters(a, robot).imu.position_m;
  robot.mechanism().move_torso(flown.path.front());
  Beats beats;
  std::size_t step = 0;
  const std::size_t before =
      static_cast<std::size_t>(std::lround(length.trim_s / robot.parameters().hold_s)) * robot.steps_per_tick();
  for (const std::array<double, 2>& voltages : flown.voltages) {
    robot.tick_held(voltages, &flown.path[step], [&] {
      if (step >= before && robot.is_finite()) {
        Motion now = flown.path[step];
        const Motion free = robot.mechanism().motion();
        now.acceleration_W = free.acceleration_W;
        now.turning_B = free.turning_B;
        Six value;
        value << specific_force_B(now, place), now.turning_B;
        const double beat =
            (static_cast<double>(step - before) + 0.5) * robot.step_s() * robot.parameters().flapping_Hz;
        beats.add(static_cast<std::size_t>(beat), beat - std::floor(beat), value);
      }
      ++step;
    });
  }
  return beats;
}

}  // namespace

Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double magnitude,
                     Length length) {
  Assignment without = a;
  std::erase_if(without.effects, [&](const auto& one) { return one.first == effect; });
  Assignment with = without;
  with.effects.emplace_back(effect, magnitude);
  const Magnitudes checked(with.effects);  // throws for an unknown effect before anything is flown
  const Flown flown = fly_one(without, flight, true, length);
  const Beats plain = replayed(without, flight, flown, length), changed = replayed(with, flight, flown, length);
  const double flapping_Hz = read_parameters(a.vehicle_file).flapping_Hz;
  const double end_s = flown.flight.log.command.t_s.empty() ? 0 : flown.flight.log.command.t_s.back();
  Contrast contrast;
  for (std::size_t beat = 0; beat < std::min(plain.sums.size(), changed.sums.size()); ++beat) {
    if (static_cast<double>(beat + 1) / flapping_Hz > end_s + 1e-3) break;  // the last beat is incomplete
    contrast.beat_s.push_back(static_cast<double>(beat) / flapping_Hz);
    std::array<double, 30>& change = contrast.change.emplace_back();
    for (std::size_t i = 0; i < 30; ++i)
      change[i] = changed.sums[beat][i] / std::max(1.0, changed.counts[beat]) -
                  plain.sums[beat][i] / std::max(1.0, plain.counts[beat]);
  }
  return contrast;
}

}  // namespace flappy::blind::c
