#include "lab/blind/b/b_contrast.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/files.hpp"

namespace flappy::blind::b {
namespace {

/// Specific force in front of the IMU's mount, in axes that may be out of square.
Vector3d at_imu(const Robot& robot, const Felt& felt, const Vector3d& place) {
  const EffectMagnitudes& a = robot.plant().effect_magnitudes();
  const Vector3d force = felt.at(place);
  return a.any(kAccelerometerMisalignment) ? skewed(force, a[kAccelerometerMisalignment] * a.skew) : force;
}

/// The torso is led along the path while the drivers get the sent inputs.
Contrast led(const Assignment& a, const Case& c, std::size_t flight, double trim_s, const Path& path,
             const std::vector<Beat>& sent) {
  const std::uint64_t drawn = draw_number(flight, a.session);
  Robot robot(c.parameters, c.effect_magnitudes, c.room, a.seed, drawn);
  std::copy(path.pose.front().begin(), path.pose.front().end(), robot.state().begin());
  Radio radio(a.seed, drawn, c.effect_magnitudes[kCommandDropout], -trim_s);
  SoftMount mount(c.effect_magnitudes[kSoftImuMount]);
  const double square = c.effect_magnitudes[kVibrationRectification];
  Vector3d filtered(0, 0, kGravity_m_s2);
  Contrast out;
  const double beat_s = 1 / c.parameters.flapping_Hz;
  // Number of the first whole beat of the log, by the driver's phase.
  long beat = std::lround(std::ceil(trim_s / beat_s - 1e-9));
  std::array<double, 30> sum{};
  int count = 0;
  const std::size_t ticks = std::min(sent.size(), path.pose.size() / kStepsPerTick);
  for (std::size_t k = 0; k < ticks; ++k) {
    const double begins = static_cast<double>(k) * kTick_s;
    robot.drive(radio.arrived(sent[k], begins - trim_s), begins);
    for (int step = 0; step < kStepsPerTick; ++step) {
      const std::size_t at = k * kStepsPerTick + static_cast<std::size_t>(step);
      if (at + 1 >= path.acceleration.size()) return out;
      const double time = static_cast<double>(at) * kStep_s;
      while (time >= static_cast<double>(beat + 1) * beat_s - 1e-9) {
        if (count > 0) {
          for (std::size_t n = 0; n < sum.size(); ++n) sum[n] /= count;
          out.beat_s.push_back(static_cast<double>(beat) * beat_s - trim_s);
          out.change.push_back(sum);
        }
        sum.fill(0);
        count = 0;
        ++beat;
      }
      robot.led_step(path, at);
      // Impacts at stops last a few steps, so every step counts. A soft mount and the sensor's low-pass settle in the
      // 0.1 s before the log.
      const double left = static_cast<double>(beat) * beat_s - 1e-9 - time;
      if (left > 0.1) continue;
      const Felt felt = robot.felt_now();
      Vector3d force = mount.shaken(at_imu(robot, felt, c.sensors.imu_place_m));
      if (square != 0) {
        filtered = low_pass(filtered, force, c.sensors.bandwidth_hz, kStep_s);
        force += rectified(filtered, square);
      }
      if (left > 0) continue;
      const double phase = 2 * std::numbers::pi * (time + kStep_s) / beat_s;
      const std::array<double, 5> waves = {1, 2 * std::cos(phase), 2 * std::sin(phase), 2 * std::cos(2 * phase),
                                           2 * std::sin(2 * phase)};
      for (std::size_t channel = 0; channel < 6; ++channel) {
        const auto axis = static_cast<Eigen::Index>(channel % 3);
        const double value = channel < 3 ? force[axis] : felt.acceleration.w[axis];
        for (std::size_t n = 0; n < 5; ++n) sum[channel * 5 + n] += value * waves[n];
      }
      ++count;
    }
  }
  return out;
}

}  // namespace

FamilyFlight fly_programme(const Assignment& a, std::size_t number, const Times& times, Path* path,
                           std::vector<Beat>* sent) {
  const Case c = make_case(a);
  const Programme programme(a, number, c.parameters, c.room);
  // noise, gusts and jitter are the session's, whichever programme is flown
  Flight flight(a, c, draw_number(number, a.session), programme.start_m(), programme.start_heading_rad(), times.trim_s);
  flight.record(path);
  Beat beat;
  FamilyFlight out;
  double end = times.log_s;
  while (flight.time_s() < times.log_s - 1e-9) {
    if (flight.steers_now()) {
      const double now = flight.time_s();
      beat = flight.pilot().steer(flight.view(), programme.target(now));
      if (now >= 0) {
        const Beat more = programme.excitation(now);
        beat = {beat.amplitude_V + more.amplitude_V, beat.difference_V + more.difference_V, beat.bias_V + more.bias_V,
                beat.split_cycle + more.split_cycle};
      }
    }
    if (sent) sent->push_back(beat);
    out.how = flight.tick(beat);
    if (!out.how.empty()) {
      out.crashed = true;
      end = flight.time_s();
      break;
    }
  }
  out.log = flight.log(end);
  return out;
}

Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double magnitude,
                     const Times& times) {
  for (const auto& [id, present] : a.effects)
    if (id == effect && present != 0)
      throw io::InputError("effect " + effect + ": the flight was flown with it; accepted: a flight without it");
  Assignment with = a;
  std::erase_if(with.effects, [&](const auto& e) { return e.first == effect; });
  with.effects.emplace_back(effect, magnitude);
  const Case before = make_case(a), after = make_case(with);
  Path path;
  std::vector<Beat> sent;
  fly_programme(a, flight, times, &path, &sent);
  const Contrast without = led(a, before, flight, times.trim_s, path, sent);
  Contrast out = led(with, after, flight, times.trim_s, path, sent);
  for (std::size_t i = 0; i < out.change.size(); ++i)
    for (std::size_t n = 0; n < 30; ++n) out.change[i][n] -= without.change[i][n];
  return out;
}

}  // namespace flappy::blind::b
