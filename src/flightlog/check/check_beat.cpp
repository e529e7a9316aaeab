// Vibration, currents and strokes have the beat frequency of the voltages; a stream with another one has a wrong clock.
#include <cmath>
#include <complex>
#include <numbers>

#include "flightlog/check/check_parts.hpp"

namespace flappy::flightlog {
namespace {

using Phasor = std::complex<double>;

constexpr int kBeats = 4;  ///< beats in one phasor; a frequency error of 1/8 turns the phase by half a turn in them

/// Complex amplitude of a column at the angular frequency `turn_rad_s`, for successive stretches of kBeats beats.
std::vector<Phasor> phasors(const Column& t_s, const Column& values, double turn_rad_s) {
  const double stretch_s = kBeats * 2 * std::numbers::pi / turn_rad_s;
  std::vector<Phasor> list;
  for (std::size_t i = 0; i < t_s.size();) {
    const double end_s = t_s.front() + static_cast<double>(list.size() + 1) * stretch_s;
    double mean = 0, n = 0;
    std::size_t end = i;
    for (; end < t_s.size() && t_s[end] < end_s; ++end) mean += values[end], ++n;
    if (end == t_s.size()) break;  // the last stretch is not whole
    Phasor sum = 0;
    for (std::size_t k = i; k < end; ++k)
      sum += (values[k] - mean / n) * std::polar(1 / n, -turn_rad_s * (t_s[k] - t_s.front()));
    list.push_back(sum);
    i = end;
  }
  return list;
}

/// Angular frequency of the columns' common wave beyond `turn_rad_s`; `steady` is 1 without noise.
struct PhasorTurn {
  double rad_s = 0, steady = 0;
};

PhasorTurn turn_of(const Column& t_s, const std::vector<const Column*>& columns, double turn_rad_s) {
  Phasor sum = 0;
  double size = 0;
  for (const Column* values : columns) {
    const std::vector<Phasor> list = phasors(t_s, *values, turn_rad_s);
    for (std::size_t k = 1; k < list.size(); ++k)
      sum += std::conj(list[k - 1]) * list[k], size += std::abs(list[k - 1] * list[k]);
  }
  return {std::arg(sum) * turn_rad_s / (2 * std::numbers::pi * kBeats), size > 0 ? std::abs(sum) / size : 0};
}

Finding compare(const std::string& name, const Column& t_s, const std::vector<const Column*>& columns,
                double turn_rad_s, double volts_rad_s) {
  // Changing inputs move the phase of the measured wave by tenths of a radian once in a flight: allow 0.18 beats.
  constexpr double kAllowed = 1e-3, kAllowedBeats = 0.18;
  const double duration_s = t_s.back() - t_s.front(), beat_s = 2 * std::numbers::pi / turn_rad_s;
  const double allowed = std::max(kAllowed, kAllowedBeats * beat_s / duration_s);
  const auto not_tested = [&](const char* why) { return Finding{name, Verdict::not_tested, why, {}}; };
  if (duration_s < 60 * beat_s) return not_tested("shorter than 60 beats");
  if (static_cast<double>(t_s.size()) < 4 * duration_s / beat_s) return not_tested("too few samples in a beat");
  const PhasorTurn seen = turn_of(t_s, columns, turn_rad_s);
  if (seen.steady < 0.8) return not_tested("the beat is not steady, or lost in the noise");
  const double ratio = (turn_rad_s + seen.rad_s) / (turn_rad_s + volts_rad_s);
  const std::string text = format("beats %.5f times as often as the voltages", ratio);
  const bool good = std::abs(ratio - 1) <= allowed;
  return {name,
          good ? Verdict::ok : Verdict::warning,
          good ? text : text + format(", 1 +- %g expected: clocks run at different speeds", allowed),
          {{"ratio", ratio}}};
}

}  // namespace

void check_beat(const FlightLog& log, Findings& findings) {
  const CommandStream& u = log.command;
  const auto driven = beat_frequency(u.t_s, u.left_voltage_V);
  const double turn_rad_s = driven ? 2 * std::numbers::pi * *driven : 0;
  const PhasorTurn volts = driven ? turn_of(u.t_s, {&u.left_voltage_V, &u.right_voltage_V}, turn_rad_s) : PhasorTurn{};
  const auto look = [&](const std::string& name, const Column& t_s, const std::vector<const Column*>& columns) {
    if (volts.steady < 0.8)
      findings.push_back({name, Verdict::not_tested, "fewer than five beats in the voltages, or not steady", {}});
    else findings.push_back(compare(name, t_s, columns, turn_rad_s, volts.rad_s));
  };
  // Gyro and accelerometer oscillate by similar numbers, so they can be mixed; a wrong unit keeps the phases.
  const ImuStream& s = log.imu;
  look("imu beat", s.t_s,
       {&s.gyro_x_rad_s, &s.gyro_y_rad_s, &s.gyro_z_rad_s, &s.accel_x_m_s2, &s.accel_y_m_s2, &s.accel_z_m_s2});
  if (log.power) look("power beat", log.power->t_s, {&log.power->left_current_A, &log.power->right_current_A});
  if (log.wings) look("wings beat", log.wings->t_s, {&log.wings->left_stroke_rad, &log.wings->right_stroke_rad});
}

}  // namespace flappy::flightlog
