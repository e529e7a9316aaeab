#include "lab/benchmark/change_over_noise.hpp"

#include <cmath>
#include <numbers>

namespace flappy::benchmark {

std::optional<double> change_over_noise(const blind::Family& family, const blind::Assignment& robot,
                                        std::size_t flights, const std::string& effect, double magnitude) {
  const flightlog::FlightHeader header = family.fly(robot, 0).log.header;  // the same in all flights of a robot
  const double beat_s = 1 / header.flapping_Hz, samples = header.imu.rate_hz * beat_s;
  const double force = header.imu.accel_noise_m_s2 / std::sqrt(samples),
               rate = header.imu.gyro_noise_rad_s / std::sqrt(samples);
  double sum = 0;
  for (std::size_t flight = 0; flight < flights; ++flight)
    for (const std::array<double, 30>& change : family.contrast(robot, flight, effect, magnitude).change)
      for (std::size_t i = 0; i < change.size(); ++i) {
        const std::size_t number = (i % 5 + 1) / 2;  // rows: the mean, then cosine and sine of each harmonic
        const auto harmonic = static_cast<double>(number);
        const double of_wave = harmonic > 0 ? std::numbers::sqrt2 : 1;
        const double slope = harmonic > 0 ? 2 * std::numbers::pi * harmonic / beat_s : std::sqrt(12.0) / beat_s;
        const double sd = of_wave * (i < 15 ? force : rate * slope);
        sum += std::pow(change[i] / sd, 2);
      }
  return sum > 0 ? std::optional(std::sqrt(sum)) : std::nullopt;
}

}  // namespace flappy::benchmark
