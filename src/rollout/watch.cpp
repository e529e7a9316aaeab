#include "rollout/watch.hpp"

#include <algorithm>
#include <stdexcept>

namespace flappy::rollout {
namespace {

constexpr std::uint32_t kStream = std::uint32_t{1} << 30;  // flapper numbers per stream, as in evaluation.hpp

}  // namespace

Watch::Watch(const std::vector<std::uint32_t>& flappers) : size_(flappers.size()) {
  if (size_ > kMax) throw std::invalid_argument("too many flappers to watch");
  for (std::size_t i = 0; i < size_; ++i) flappers_[i] = flappers[i];
}

template <class T>
void show(Watch& watch, const flight::Fleet<T>& fleet) {
  const std::uint32_t first = fleet.options().first_flapper % kStream;
  for (std::size_t slot = 0; slot < watch.size(); ++slot) {
    const std::uint32_t number = watch.flapper(slot);
    if (number < first || number - first >= fleet.size()) continue;
    const std::size_t i = number - first;
    FlightSample s;
    s.slot = static_cast<std::uint32_t>(slot);
    s.flapper = number;
    s.tick = fleet.tick(i);
    s.t_s = static_cast<double>(s.tick) * fleet.period_s();
    s.state = fleet.batch().state(i);
    const auto [gyro, accel] = fleet.felt(i);
    std::ranges::copy(gyro, s.gyro_rad_s);
    std::ranges::copy(accel, s.accel_m_s2);
    s.input = fleet.input(i);
    s.sets_voltages = fleet.options().task.sets_voltages();
    if (s.sets_voltages) s.left_V = fleet.adds(i)[0], s.right_V = fleet.adds(i)[1];
    watch.see(s);
  }
}

template void show(Watch&, const flight::Fleet<float>&);
template void show(Watch&, const flight::Fleet<double>&);

}  // namespace flappy::rollout
