// How far an effect changes flights beyond the noise of the IMU.
#pragma once

#include <optional>

#include "lab/blind/family.hpp"

namespace flappy::benchmark {

/// The signal-to-noise ratio of a matched filter: sqrt(sum of (change / sd of the noise)^2) over the first `flights`
/// flights, beats, axes, and the mean and two harmonics of specific force and angular acceleration. None: the effect
/// changes none of these, as effects of sensors do. `robot`: its flights without the effect.
///
/// Over a beat of N samples, white noise of standard deviation s gives a mean of sd s / sqrt(N) and coefficients of a
/// harmonic of sd s sqrt(2 / N). The angular acceleration is the slope of the gyro's rate: sd s sqrt(12 / N) / T for the
/// mean of a beat of duration T, by least squares, and 2 pi h / T times that of the rate for harmonic h.
std::optional<double> change_over_noise(const blind::Family& family, const blind::Assignment& robot,
                                        std::size_t flights, const std::string& effect, double magnitude);

/// Below, an effect does not change the flights beyond noise. A choice.
inline constexpr double kBeyondNoise = 10;
/// Such a case is left out. None: not known.
inline bool is_within_noise(std::optional<double> change) { return change && *change < kBeyondNoise; }

}  // namespace flappy::benchmark
