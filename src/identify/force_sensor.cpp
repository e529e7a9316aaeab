#include "identify/force_sensor.hpp"

#include <cmath>

#include "sim/random.hpp"

namespace flappy::identify {

std::vector<sim::Input> default_inputs() {
  std::vector<sim::Input> inputs;
  for (int k = 0; k <= 12; ++k) inputs.push_back({5 + 0.75 * k, 0, 0, 0});
  for (const double side : {-1.0, 1.0})
    for (int k = 1; k <= 4; ++k) {
      inputs.push_back({10, side * 0.5 * k, 0, 0});
      inputs.push_back({10, 0, side * 0.75 * k, 0});
      inputs.push_back({10, 0, 0, side * 0.03 * k});
    }
  return inputs;
}

std::vector<sim::Input> default_inputs(const model::Driver& driver) {
  std::vector<sim::Input> inputs = default_inputs();
  for (const sim::Input& input : inputs) check_limits(input, driver, "the inputs of a sweep, without --inputs");
  return inputs;
}

MeasuredMap simulate_forces(const model::Vehicle& vehicle, const std::vector<sim::Input>& inputs,
                            const ForceSensor& sensor, std::uint64_t seed, const MapOptions& options) {
  if (!(sensor.noise_steps > 0)) return {"", inputs, whole_map(vehicle, inputs, options), {}};
  const int each = static_cast<int>(std::lround(1 / (sensor.rate_hz * kStep_s)));
  const int samples = whole_beats(vehicle.driver).steps / each;
  MapOptions alone = options;  // one thread: synchronising after every sample would cost more than it gains
  alone.threads = 1;
  auto batch = welded_batch<double>(std::span(&vehicle, 1), inputs, alone);
  batch.step(settle_steps(vehicle.driver, options.settle_s));
  MeasuredMap map{"", inputs, std::vector<Wrench>(inputs.size()), std::vector<Wrench>(inputs.size())};
  std::vector<sim::HeldImpulse> before(inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) before[i] = batch.held_impulse(i);
  for (int n = 0; n < samples; ++n) {
    batch.step(each);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const sim::HeldImpulse after = batch.held_impulse(i);
      const Wrench now = mean_wrench(before[i], after, each * kStep_s, options.moment_point_m);
      before[i] = after;
      for (int k = 0; k < kChannels; ++k) {
        const double step = is_force(k) ? sensor.force_step_N : sensor.torque_step_Nm;
        const sim::RandomKey key{seed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k),
                                 sim::Stream::force_sensor};
        const double noisy = now[static_cast<std::size_t>(k)] / step +
                             sensor.noise_steps * sim::normal(key, static_cast<std::uint32_t>(n));
        map.wrenches[i][static_cast<std::size_t>(k)] += step * std::round(noisy) / samples;
      }
    }
  }
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (batch.status(i) & sim::kFrozen) refuse_apart(vehicle.name, inputs[i]);
  // Quantisation adds the variance of a uniform error, 1/12 of a step squared.
  const double sd = std::sqrt((sensor.noise_steps * sensor.noise_steps + 1.0 / 12) / samples);
  for (Wrench& each_sd : map.sd)
    for (int k = 0; k < kChannels; ++k)
      each_sd[static_cast<std::size_t>(k)] = sd * (is_force(k) ? sensor.force_step_N : sensor.torque_step_Nm);
  return map;
}

}  // namespace flappy::identify
