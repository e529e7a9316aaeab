#include "flightlog/check/check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "flightlog/check/check_parts.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// `film`: a camera's memory holds a part of the flight, and a wing hides the other.
void check_stream(const StreamStatistics& s, double flapping_Hz, bool film, Findings& findings) {
  const auto warn = [&](const std::string& text) { findings.push_back({s.name, Verdict::warning, text, {}}); };
  if (!s.declared_hz) return;
  const std::size_t before = findings.size();
  const double interval = 1 / s.rate_hz;
  // Crystals agree to 1e-4, a mean rate to 1 / samples: 5 % means another rate or another unit.
  if (std::abs(s.rate_hz / *s.declared_hz - 1) > 0.05)
    warn(format("%.4g samples/s, %.4g declared: thinned out, repeated, or t_s not in seconds", s.rate_hz,
                *s.declared_hz));
  const double missing = static_cast<double>(s.missing) / static_cast<double>(s.samples + s.missing);
  if (missing > 0.01 && !film)
    warn(format("%zu samples missing (%.1f %%), at most 1 %% expected: dropouts", s.missing, 100 * missing));
  // Gaps of three beats cannot be interpolated: the motion of the body within a beat is not smooth.
  const double longest_s = std::max(10 * interval, flapping_Hz > 0 ? 3 / flapping_Hz : 0);
  if (s.longest_gap_s > longest_s && !film)
    warn(format("a gap of %.3g s, at most %.3g s expected: lost tracking or a lost link", s.longest_gap_s, longest_s));
  // Beyond this jitter, samples may change order.
  if (s.jitter_s > 0.3 * interval)
    warn(format("intervals vary by %.2g ms of %.2g ms: arrival times are not evenly spaced; a buffered link?",
                1e3 * s.jitter_s, 1e3 * interval));
  if (findings.size() > before) return;
  findings.push_back(
      {s.name,
       Verdict::ok,
       film ? format("%.3g s of frames with angles, at the declared rate", static_cast<double>(s.samples) * interval)
            : "rate, gaps and intervals as declared",
       {}});
}

/// Warns of samples that repeat the previous one to the last digit, which noise makes impossible.
void check_repeats(const std::string& name, const std::vector<const Column*>& columns, double noise,
                   Findings& findings) {
  const std::size_t count = columns.front()->size();
  std::size_t repeats = 0;
  for (std::size_t i = 1; i < count; ++i)
    repeats += std::ranges::all_of(columns, [&](const Column* c) { return (*c)[i] == (*c)[i - 1]; });
  if (noise > 0 && static_cast<double>(repeats) > 0.01 * static_cast<double>(count))
    findings.push_back(
        {name,
         Verdict::warning,
         format("%zu of %zu samples repeat the one before: tracking lost, or written faster than measured", repeats,
                count),
         {}});
}

/// The robot's own estimate is no second opinion on its sensors, so nothing is compared with it.
void check_estimate(PoseSource source, Findings& findings) {
  std::string text =
      "mocap.csv has the robot's own estimate: its axes, clock and noise cannot be tested, effects of motion "
      "capture cannot be named, and errors of the estimate may look like physics";
  if (source == PoseSource::estimate_without_pitch)
    text += "; its pitch was derived from the force along x, which is therefore not compared";
  findings.push_back({"estimate", Verdict::not_tested, text, {}});
}

void check_latencies(const FlightHeader& h, Findings& findings) {
  // Cameras and radio links need some 0.01 s; 0.1 s would be three beats of lag, with which no flapper can fly.
  constexpr double kLargest_s = 0.1;
  std::string wrong;
  const auto look = [&](const char* key, double value) {
    if (value > kLargest_s) wrong += (wrong.empty() ? "" : ", ") + format("%s = %g", key, value);
  };
  look("mocap.latency_s", h.mocap.latency_s);
  look("imu.latency_s", h.imu.latency_s);
  if (h.power) look("power.latency_s", h.power->latency_s);
  if (h.rig) look("rig.latency_s", h.rig->latency_s);
  if (h.attitude) look("attitude.latency_s", h.attitude->latency_s);
  if (wrong.empty()) findings.push_back({"latencies", Verdict::ok, "declared ones are plausible", {}});
  else findings.push_back({"latencies", Verdict::warning, wrong + ": at most 0.1 s expected: milliseconds?", {}});
}

}  // namespace

std::size_t index_before(const std::vector<double>& times, double t) {
  const auto after = std::ranges::upper_bound(times, t);
  return after == times.begin() ? times.size() : static_cast<std::size_t>(after - times.begin()) - 1;
}

std::size_t line_at(const Column& t_s, double after_s) {
  const auto at = std::ranges::lower_bound(t_s, t_s.front() + after_s);
  // + 2: lines count from 1, and the first holds the names
  return static_cast<std::size_t>(std::min(at, t_s.end() - 1) - t_s.begin()) + 2;
}

double next_window(const Column& t_s, double middle_s, double span_s) {
  const double next_s = middle_s + span_s;
  const auto after = std::ranges::upper_bound(t_s, next_s);
  constexpr double kMany = 1000;
  const double empty = after == t_s.end() ? 0 : std::floor((*after - next_s) / span_s) - 1;
  return empty > kMany ? next_s + empty * span_s : next_s;
}

std::optional<double> beat_frequency(const Column& t_s, const Column& values) {
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  std::vector<double> rises, periods;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double before = values[i - 1] - mean, after = values[i] - mean;
    if (before < 0 && after >= 0) rises.push_back(t_s[i - 1] + (t_s[i] - t_s[i - 1]) * before / (before - after));
  }
  for (std::size_t i = 1; i < rises.size(); ++i) periods.push_back(rises[i] - rises[i - 1]);
  if (periods.size() < 4) return std::nullopt;
  return 1 / io::upper_median(periods);
}

std::size_t CheckReport::count(Verdict verdict) const {
  return static_cast<std::size_t>(std::ranges::count(findings, verdict, &Finding::verdict));
}

CheckReport check_flight(const FlightLog& log) {
  const FlightHeader& h = log.header;
  CheckReport report;
  const auto add = [&](const char* name, const Column& t_s, std::optional<double> declared_hz, bool film = false) {
    report.streams.push_back(stream_statistics(name, t_s, declared_hz));
    check_stream(report.streams.back(), h.flapping_Hz, film, report.findings);
  };
  add("command", log.command.t_s, std::nullopt);
  if (h.rig) add("forces", log.forces->t_s, h.rig->rate_hz);
  else add("mocap", log.mocap.t_s, h.mocap.rate_hz);
  if (h.imu.rate_hz > 0) add("imu", log.imu.t_s, h.imu.rate_hz);
  if (log.power) add("power", log.power->t_s, h.power->rate_hz);
  if (log.wings) add("wings", log.wings->t_s, h.wings->rate_hz, true);
  if (log.attitude) add("attitude", log.attitude->t_s, h.attitude->rate_hz);
  if (h.rig) {
    const ForcesStream& f = *log.forces;
    check_repeats("forces", {&f.force_x_N, &f.force_y_N, &f.force_z_N, &f.moment_x_Nm, &f.moment_y_Nm, &f.moment_z_Nm},
                  h.rig->force_noise_N, report.findings);
    check_latencies(h, report.findings);
    check_rig(log, report.findings);
    check_command(log, report.findings);
    check_power(log, report.findings);
    check_wings(log, report.findings);
    return report;
  }
  const MocapStream& m = log.mocap;
  check_repeats("mocap", {&m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz}, h.mocap.position_noise_m,
                report.findings);
  check_latencies(h, report.findings);
  check_space(log, report.findings);
  check_range(log, report.findings);
  if (!h.inputs.empty()) {
    if (h.mocap.source == PoseSource::motion_capture) check_motion(log, report.findings);
    else check_estimate(h.mocap.source, report.findings);
    check_inputs_apart(log, report.findings);
    check_power(log, report.findings);
    check_wings(log, report.findings);
    return report;
  }
  const ImuStream& i = log.imu;
  check_repeats("imu",
                {&i.gyro_x_rad_s, &i.gyro_y_rad_s, &i.gyro_z_rad_s, &i.accel_x_m_s2, &i.accel_y_m_s2, &i.accel_z_m_s2},
                h.imu.gyro_noise_rad_s, report.findings);
  check_motion(log, report.findings);
  check_command(log, report.findings);
  check_beat(log, report.findings);
  check_power(log, report.findings);
  check_wings(log, report.findings);
  return report;
}

std::vector<CheckReport> check_flights(const std::vector<FlightLog>& logs) {
  std::vector<CheckReport> reports;
  // Compare only flights with the same inputs: others are of another robot.
  std::map<std::vector<std::string>, std::vector<std::size_t>> of_inputs;
  for (const FlightLog& log : logs) {
    of_inputs[log.header.inputs].push_back(reports.size());
    reports.push_back(check_flight(log));
  }
  for (const auto& [inputs, flights] : of_inputs) {
    if (inputs.empty() || flights.size() < 2) continue;
    std::vector<const FlightLog*> same;
    std::vector<Findings*> findings;
    for (const std::size_t i : flights) same.push_back(&logs[i]), findings.push_back(&reports[i].findings);
    compare_inputs(same, findings);
    if (flights.size() > 2) compare_correlations(same, findings);
  }
  return reports;
}

}  // namespace flappy::flightlog
