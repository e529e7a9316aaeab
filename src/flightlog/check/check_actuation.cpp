#include <algorithm>
#include <cmath>
#include <numbers>

#include "flightlog/check/check_parts.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Two crystals and a median of interpolated crossings agree far better than 2 %.
constexpr double kFrequencyTolerance = 0.02;

double rms(const Column& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// Half the span of the values without the lowest and highest hundredth.
double amplitude(Column values) {
  std::ranges::sort(values);
  const std::size_t cut = values.size() / 100;
  return (values[values.size() - 1 - cut] - values[cut]) / 2;
}

double median_interval(const Column& t_s) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < t_s.size(); ++i) intervals.push_back(t_s[i] - t_s[i - 1]);
  return io::upper_median(intervals);
}

/// Cosine and sine component of the voltage at the phase of the beat, and the share of the variance that they explain.
struct FittedWave {
  double cosine = 0, sine = 0, explained = 0;
};

FittedWave fit_wave(const Column& phase_rad, const Column& volts) {
  // Least squares of volts on 1, cos and sin, by Cramer's rule on the centred sums.
  double n = 0, c = 0, s = 0, v = 0, cc = 0, ss = 0, cs = 0, cv = 0, sv = 0, vv = 0;
  for (std::size_t i = 0; i < volts.size(); ++i) {
    const double a = std::cos(phase_rad[i]), b = std::sin(phase_rad[i]), y = volts[i];
    n += 1, c += a, s += b, v += y, cc += a * a, ss += b * b, cs += a * b, cv += a * y, sv += b * y, vv += y * y;
  }
  cc -= c * c / n, ss -= s * s / n, cs -= c * s / n, cv -= c * v / n, sv -= s * v / n, vv -= v * v / n;
  const double determinant = cc * ss - cs * cs;
  if (!(determinant > 1e-9 * n * n) || !(vv > 0)) return {};
  const double x = (cv * ss - sv * cs) / determinant, y = (sv * cc - cv * cs) / determinant;
  return {x, y, (x * cv + y * sv) / vv};
}

Column sum_of_voltages(const CommandStream& u) {
  Column volts(u.t_s.size());
  for (std::size_t i = 0; i < volts.size(); ++i) volts[i] = u.left_voltage_V[i] + u.right_voltage_V[i];
  return volts;
}

void check_frequency(const FlightLog& log, Findings& findings) {
  const std::string name = "flapping frequency";
  const double declared = log.header.flapping_Hz, per_beat = 1 / (declared * median_interval(log.command.t_s));
  const auto add_finding = [&](Verdict verdict, const std::string& text, LogPlace fault = {}) {
    findings.push_back({name, verdict, text, {}, std::move(fault)});
  };
  if (per_beat < 4)
    return add_finding(Verdict::not_tested, format("command.csv has %.2g samples a beat, 4 are needed", per_beat));
  // Use the sum of both sides: in a robot that rolls periodically, the phase of one side advances while the other lags.
  const auto beat = beat_frequency(log.command.t_s, sum_of_voltages(log.command));
  if (!beat) return add_finding(Verdict::not_tested, "fewer than five beats in the voltages");
  const std::string seen = format("voltages beat at %.4g Hz, %.4g Hz declared", *beat, declared);
  if (std::abs(*beat / declared - 1) > kFrequencyTolerance)
    add_finding(Verdict::warning, seen + ": another beat, or t_s not in seconds", {kCommand});
  else add_finding(Verdict::ok, seen);
  findings.back().values = {{"frequency_Hz", *beat}};
}

void check_phase(const FlightLog& log, Findings& findings) {
  const CommandStream& u = log.command;
  if (!u.phase_rad) return;
  const std::string name = "wing-beat phase";
  const double interval = median_interval(u.t_s), f = log.header.flapping_Hz;
  // The split cycle shifts left and right in opposite directions; their sum keeps the phase.
  const Column volts = sum_of_voltages(u);
  const auto add_finding = [&](Verdict verdict, const std::string& text) {
    findings.push_back({name, verdict, text, {}, verdict == Verdict::warning ? LogPlace{kCommand} : LogPlace{}});
  };
  if (f * interval > 0.25 || rms(volts) < 0.1)
    return add_finding(Verdict::not_tested, "too few samples a beat, or hardly any voltage");
  Column speeds;
  for (std::size_t i = 1; i < volts.size(); ++i)
    speeds.push_back(((*u.phase_rad)[i] - (*u.phase_rad)[i - 1]) / (u.t_s[i] - u.t_s[i - 1]));
  const double speed = io::upper_median(speeds), ratio = speed / (kTurn * f);  // the median ignores steps that wrap
  if (std::abs(ratio - 1) > kFrequencyTolerance) {
    const auto is = [&](double unit) { return std::abs(ratio / unit - 1) < kFrequencyTolerance; };
    const char* cause = is(360 / kTurn) ? "likely in degrees, not rad"
                        : is(1 / kTurn) ? "likely in beats, not rad"
                                        : "another beat";
    return add_finding(Verdict::warning,
                       format("phase_rad advances by %.4g rad/s, %.4g expected: ", speed, kTurn * f) + cause);
  }
  const FittedWave wave = fit_wave(*u.phase_rad, volts);
  // With varying amplitude the wave still explains most of the variance; with a wrong phase it explains nothing.
  if (wave.explained < 0.5)
    return add_finding(Verdict::warning,
                       format("phase_rad explains %.0f %% of the voltages, at least 50 %% expected: another clock, "
                              "or an estimate that slipped",
                              100 * std::max(wave.explained, 0.0)));
  // The voltage is A cos(phase), held for an interval; the logged phase may be that of any instant in the interval.
  const double offset = std::atan2(wave.sine, wave.cosine), allowed = kTurn * f * interval + 0.1;
  const std::string seen = format("voltages lag phase_rad by %.2f rad, at most %.2f expected", offset, allowed);
  if (std::abs(offset) > allowed)
    add_finding(Verdict::warning, seen + ": phase 0 is where the voltage peaks, V = A cos(phase) + bias");
  else add_finding(Verdict::ok, seen);
  findings.back().values = {{"lag_rad", offset}};
}

void check_inputs(const FlightLog& log, Findings& findings) {
  const CommandStream& u = log.command;
  if (!u.inputs) return;
  const BeatInputs& in = *u.inputs;
  double beyond = 0, worst = 0, worst_t_s = 0;
  std::size_t first = u.t_s.size();
  for (std::size_t i = 0; i < u.t_s.size(); ++i) {
    const double left = std::abs(u.left_voltage_V[i] - in.bias_V[i]) - std::abs(in.amplitude_V[i] + in.difference_V[i]);
    const double right =
        std::abs(u.right_voltage_V[i] - in.bias_V[i]) - std::abs(in.amplitude_V[i] - in.difference_V[i]);
    const double excess = std::max(left, right);
    if (excess > 0.01 * std::abs(in.amplitude_V[i]) + 0.02) {  // tolerance for rounded logs
      ++beyond;
      first = std::min(first, i);
    }
    if (excess > worst) worst = excess, worst_t_s = u.t_s[i];
  }
  // Tolerate 1 %: an input that changes within a beat may be logged one sample early or late.
  const double share = beyond / static_cast<double>(u.t_s.size());
  if (share > 0.01)
    findings.push_back(
        {"wing-beat inputs",
         Verdict::warning,
         format("%.1f %% of the voltages exceed bias_V +- (amplitude_V +- difference_V), by %.3g V at %.6g s: "
                "inputs of another instant, left and right swapped, or the amplitude peak to peak",
                100 * share, worst, worst_t_s),
         {{"share", share}},
         {kCommand, first + 2}});
  else
    findings.push_back({"wing-beat inputs",
                        Verdict::ok,
                        "voltages stay within bias_V +- (amplitude_V +- difference_V)",
                        {{"share", share}}});
}

}  // namespace

void check_space(const FlightLog& log, Findings& findings) {
  const LogAmbient& a = log.header.ambient;
  const MocapStream& m = log.mocap;
  const double slack = 0.005 + 6 * log.header.mocap.position_noise_m;  // markers are placed by hand; 6 sd: one in 1e9
  std::vector<std::string> crossed;
  const auto look = [&](const std::string& what, const std::string& cause, const auto& height) {
    double deepest = 0, t_s = 0;
    for (std::size_t i = 0; i < m.t_s.size(); ++i) {
      if (-height(i) > deepest) deepest = -height(i), t_s = m.t_s[i];
    }
    if (deepest <= slack) return;
    crossed.push_back(what);
    findings.push_back(
        {"space",
         Verdict::warning,
         format("%.3g m %s at %.6g s, at most %.2g m expected: ", deepest, what.c_str(), t_s, slack) + cause,
         {{"deepest_m", deepest}}});
  };
  look("below the ground", "another origin, z not up, or not in metres",
       [&](std::size_t i) { return m.z_m[i] - a.ground_z_m; });
  look("above the ceiling", "another origin, z not up, or not in metres",
       [&](std::size_t i) { return a.ceiling_z_m - m.z_m[i]; });
  for (std::size_t w = 0; w < a.walls.size(); ++w) {
    const LogWall& wall = a.walls[w];
    look("behind wall " + std::to_string(w), "another origin, its normal reversed, or not in metres",
         [&](std::size_t i) { return (m.x_m[i] - wall.x_m) * wall.normal_x + (m.y_m[i] - wall.y_m) * wall.normal_y; });
  }
  if (crossed.empty()) findings.push_back({"space", Verdict::ok, "positions within ground, ceiling and walls", {}});
}

void check_command(const FlightLog& log, Findings& findings) {
  check_frequency(log, findings);
  check_phase(log, findings);
  check_inputs(log, findings);
}

void check_power(const FlightLog& log, Findings& findings) {
  if (!log.power) return;
  const PowerStream& p = *log.power;
  const PowerHeader& h = *log.header.power;
  const double battery = io::upper_median(p.battery_V);
  const std::string seen = format("%.3g V in the middle, %.3g V nominal", battery, h.battery_nominal_V);
  // A lithium cell of nominally 3.7 V holds 3.0 to 4.2 V.
  const bool near = battery > 0.75 * h.battery_nominal_V && battery < 1.25 * h.battery_nominal_V;
  const std::optional<Finding> frozen = near ? frozen_battery(p) : std::nullopt;
  if (frozen) findings.push_back(*frozen);
  else
    findings.push_back({"battery",
                        near ? Verdict::ok : Verdict::warning,
                        near ? seen : seen + ", within 25 % expected: another number of cells, or another unit",
                        {{"battery_V", battery}},
                        near ? LogPlace{} : LogPlace{kPower}});

  if (!h.currents || !log.header.inputs.empty()) return;  // the power of a motor needs its voltage
  const Column* const currents[] = {&p.left_current_A, &p.right_current_A};
  const Column* const volts[] = {&log.command.left_voltage_V, &log.command.right_voltage_V};
  for (int side = 0; side < 2; ++side) {
    const std::string name = side == 0 ? "left motor" : "right motor";
    double power = 0, squares = 0, n = 0;
    for (std::size_t i = 0; i < p.t_s.size(); ++i) {
      const std::size_t k = index_before(log.command.t_s, p.t_s[i] - h.latency_s);
      if (k == log.command.t_s.size()) continue;
      const double v = (*volts[side])[k] * p.battery_V[i] / h.battery_nominal_V;
      power += v * (*currents[side])[i], squares += v * v, ++n;
    }
    const double mean = n > 0 ? power / n : 0, current = rms(*currents[side]);
    // kSigmas times the standard deviation of the mean power if the current is noise alone.
    const double least = n > 0 ? kSigmas * h.current_noise_A * std::sqrt(squares) / n : 0;
    const std::string figures = format("%.3g W on average, %.3g A rms", mean, current);
    const std::vector<std::pair<std::string, double>> values = {{"mean_power_W", mean}, {"current_rms_A", current}};
    // A motor for 6 g of lift draws less than 1 A.
    if (current > 10)
      findings.push_back({name, Verdict::warning, figures + ", below 10 A expected: likely in mA", values, {kPower}});
    else if (mean < -least)
      findings.push_back({name,
                          Verdict::warning,
                          figures + ", positive expected: the current's sign, or left and right swapped",
                          values,
                          {kPower}});
    else if (mean <= least) findings.push_back({name, Verdict::not_tested, "no power beyond the noise", values});
    else findings.push_back({name, Verdict::ok, figures, values});
  }
}

void check_wings(const FlightLog& log, Findings& findings) {
  if (!log.wings) return;
  const WingsStream& w = *log.wings;
  const bool driven = rms(log.command.left_voltage_V) > 1;
  const auto look = [&](const std::string& name, const Column& angles) {
    const double a = amplitude(angles), noise = log.header.wings->noise_rad;
    const std::string seen = format("amplitude %.3g rad", a);
    const std::vector<std::pair<std::string, double>> values = {{"amplitude_rad", a}};
    // Stops limit strokes to 1.7 rad and rotations to 1.5 rad.
    if (a > std::numbers::pi)
      findings.push_back(
          {name, Verdict::warning, seen + ", below 1.8 rad expected: likely in degrees", values, {kWings}});
    else if (a > 1.8 + kSigmas * noise)
      findings.push_back({name, Verdict::warning, seen + ", below 1.8 rad expected", values});
    else if (driven && a < 0.05 + kSigmas * noise)
      findings.push_back({name,
                          Verdict::warning,
                          seen + ", at least 0.05 rad expected while driven: another wing, unit, or a dead channel",
                          values,
                          {kWings}});
    else findings.push_back({name, Verdict::ok, seen, values});
  };
  look("left stroke", w.left_stroke_rad);
  look("left rotation", w.left_rotation_rad);
  look("right stroke", w.right_stroke_rad);
  look("right rotation", w.right_rotation_rad);
  const double declared = log.header.flapping_Hz, per_beat = 1 / (declared * median_interval(w.t_s));
  const auto f = beat_frequency(w.t_s, w.left_stroke_rad);
  if (!(declared > 0) || per_beat < 4 || !f) {
    findings.push_back({"stroke frequency", Verdict::not_tested, "too few samples a beat, or too few beats", {}});
    return;
  }
  const std::string seen = format("the left wing beats at %.4g Hz, %.4g Hz declared", *f, declared);
  const bool near = !driven || std::abs(*f / declared - 1) < kFrequencyTolerance;
  findings.push_back({"stroke frequency",
                      near ? Verdict::ok : Verdict::warning,
                      near ? seen : seen + ": another beat, or t_s not in seconds",
                      {{"left_Hz", *f}}});
}

}  // namespace flappy::flightlog
