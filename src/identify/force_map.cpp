#include "identify/force_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flappy::identify {

Window whole_beats(const model::Driver& driver) {
  constexpr int kFewest = 10, kMax = 20;
  Window best{};
  double least = std::numeric_limits<double>::infinity();
  for (int beats = kFewest; beats <= kMax; ++beats) {
    const double holds = beats / (driver.flapping_Hz * driver.hold_s);
    const double off = std::abs(holds - std::round(holds));
    if (off >= least - 1e-9) continue;
    least = off;
    best = {beats, static_cast<int>(std::lround(beats / (driver.flapping_Hz * kStep_s)))};
  }
  return best;
}

int settle_steps(const model::Driver& driver, double settle_s) {
  const double holds = std::ceil(settle_s / driver.hold_s - 1e-9);
  return static_cast<int>(std::lround(holds * driver.hold_s / kStep_s));
}

template <class T>
sim::Batch<T> welded_batch(std::span<const model::Vehicle> vehicles, std::span<const sim::Input> inputs,
                           const MapOptions& options) {
  sim::BatchOptions o;
  o.step_s = kStep_s;
  o.threads = options.threads;
  o.instruction_set = options.instruction_set;
  sim::Batch<T> batch(vehicles.size() * inputs.size(), vehicles.front(), o);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (vehicles.size() > 1) batch.set_vehicle(i, vehicles[i / inputs.size()]);
    batch.reset(i, {}, sim::Start::welded);
    batch.set_input(i, inputs[i % inputs.size()]);
  }
  return batch;
}

Wrench mean_wrench(const sim::HeldImpulse& before, const sim::HeldImpulse& after, double seconds,
                   const model::Triple& point) {
  Wrench w;
  for (std::size_t k = 0; k < 3; ++k) {
    w[k] = (after.force_N_s[k] - before.force_N_s[k]) / seconds;
    w[3 + k] = (after.moment_Nm_s[k] - before.moment_Nm_s[k]) / seconds;
  }
  w[3] -= point.y * w[2] - point.z * w[1];
  w[4] -= point.z * w[0] - point.x * w[2];
  w[5] -= point.x * w[1] - point.y * w[0];
  return w;
}

template <class T>
std::vector<Wrench> force_map(std::span<const model::Vehicle> vehicles, std::span<const sim::Input> inputs,
                              const MapOptions& options) {
  const model::Driver& driver = vehicles.front().driver;
  const Window window = whole_beats(driver);
  sim::Batch<T> batch = welded_batch<T>(vehicles, inputs, options);
  batch.step(settle_steps(driver, options.settle_s));
  std::vector<sim::HeldImpulse> before(batch.size());
  for (std::size_t i = 0; i < batch.size(); ++i) before[i] = batch.held_impulse(i);
  batch.step(window.steps);
  std::vector<Wrench> map(batch.size());
  for (std::size_t i = 0; i < batch.size(); ++i) {
    map[i] = mean_wrench(before[i], batch.held_impulse(i), window.steps * kStep_s, options.moment_point_m);
    if (batch.status(i) & sim::kFrozen) map[i].fill(std::numeric_limits<double>::quiet_NaN());
  }
  return map;
}

model::Triple centre_of_mass(const model::Vehicle& v) {
  double mass = 0;
  model::Triple sum;
  const auto add = [&](const model::RigidBody& body, const model::Triple& origin) {
    mass += body.mass_kg;
    sum.x += body.mass_kg * (origin.x + body.com_m.x);
    sum.y += body.mass_kg * (origin.y + body.com_m.y);
    sum.z += body.mass_kg * (origin.z + body.com_m.z);
  };
  add(v.torso, {});
  for (const model::Side* side : {&v.left, &v.right}) {
    add(side->leading_edge, side->shoulder_m);
    add(side->wing, side->shoulder_m);
  }
  return {sum.x / mass, sum.y / mass, sum.z / mass};
}

template std::vector<Wrench> force_map<float>(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                              const MapOptions&);
template std::vector<Wrench> force_map<double>(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                               const MapOptions&);
template sim::Batch<float> welded_batch(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                        const MapOptions&);
template sim::Batch<double> welded_batch(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                         const MapOptions&);

}  // namespace flappy::identify
