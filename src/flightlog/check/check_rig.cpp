// Checks of the log of a clamped robot: axes and sign of the force, the sensor's resonance, the clock of forces.csv.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "flightlog/check/check_parts.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// Means over this span tell how the force follows the voltages: some beats.
constexpr double kMeans_s = 0.2;
/// Least spread of the squared voltage, over its mean, at which it shows.
constexpr double kMinSpreadShare = 0.2;
/// Least share of the force's slope that is along z of B: 45 degrees.
constexpr double kAlong = 0.7;
/// Harmonics of the beat that a diagnosis compares (gap/replay/beat_rows.hpp), and how far above the last of them a
/// sensor has to resonate so as not to magnify it by more than a quarter: 1 / (1 - 1 / kFree^2) = 1.25.
constexpr double kCompared = 4, kFree = 2.24;
/// The force beats at twice the frequency of the voltages to this share, or to this share of a beat over the log.
constexpr double kSpeedApart = 1e-3, kBeatsApart = 0.18, kSearchedShare = 0.02;

struct RigMeans {
  std::vector<double> square_V2;
  std::vector<Eigen::Vector3d> force_N;  ///< in B
};

RigMeans rig_means(const FlightLog& log) {
  const ForcesStream& f = *log.forces;
  const auto& [w, x, y, z] = log.header.rig->attitude;
  const Eigen::Quaterniond to_B(w, x, y, z);
  RigMeans m;
  std::size_t k = 0;
  for (std::size_t i = 0; i < f.t_s.size();) {
    const double end_s = f.t_s[i] + kMeans_s;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double n = 0, square = 0, volts = 0;
    for (; i < f.t_s.size() && f.t_s[i] < end_s; ++i, ++n)
      sum += Eigen::Vector3d(f.force_x_N[i], f.force_y_N[i], f.force_z_N[i]);
    for (; k < log.command.t_s.size() && log.command.t_s[k] < end_s; ++k, ++volts)
      square += std::pow(log.command.left_voltage_V[k], 2) + std::pow(log.command.right_voltage_V[k], 2);
    if (volts == 0) continue;
    m.square_V2.push_back(square / volts);
    m.force_N.push_back(to_B * (sum / n));
  }
  return m;
}

void check_rig_axes(const FlightLog& log, Findings& findings) {
  const RigMeans m = rig_means(log);
  const auto n = static_cast<double>(m.square_V2.size());
  double mean = 0, squares = 0;
  for (const double v : m.square_V2) mean += v / n;
  for (const double v : m.square_V2) squares += (v - mean) * (v - mean);
  if (!(std::sqrt(squares / n) > kMinSpreadShare * mean)) {
    findings.push_back({"rig axes", Verdict::not_tested, "the voltages hardly change, so the force has no slope", {}});
    return;
  }
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < m.square_V2.size(); ++i) slope += (m.square_V2[i] - mean) / squares * m.force_N[i];
  const Eigen::Vector3d along = slope.normalized();
  const std::string seen = format("with the squared voltages the force grows along (%.2f, %.2f, %.2f) of B", along.x(),
                                  along.y(), along.z());
  const std::vector<std::pair<std::string, double>> values = {{"along_z", along.z()}};
  if (along.z() > kAlong) findings.push_back({"rig axes", Verdict::ok, seen, values});
  else
    findings.push_back(
        {"rig axes",
         Verdict::warning,
         seen + ", along (0, 0, 1) expected: " +
             (along.z() < -kAlong ? "the force of the sensor on the robot, or z down" : "another rig.attitude"),
         values,
         {kForces}});
}

void check_resonance(const FlightLog& log, Findings& findings) {
  const double resonance = log.header.rig->resonance_hz, band = kCompared * log.header.flapping_Hz;
  if (resonance == 0) {
    findings.push_back({"rig resonance", Verdict::not_tested, "rig.resonance_hz is not declared", {}});
    return;
  }
  const std::string seen =
      format("the sensor resonates at %.4g Hz; harmonics up to %.4g Hz are compared", resonance, band);
  const double rate = log.header.rig->rate_hz;
  const bool magnifies = resonance <= kFree * band, folds = 2 * resonance > rate;
  std::string what = seen;
  if (magnifies) what += format(", at least %.4g Hz expected: it magnifies them", kFree * band);
  else if (folds)
    what += format(
        ", but %.4g samples/s fold what rings above %.4g Hz into these: filter it before it is sampled, or "
        "sample faster",
        rate, rate / 2);
  findings.push_back({"rig resonance",
                      magnifies || folds ? Verdict::warning : Verdict::ok,
                      what,
                      {},
                      resonance > band ? LogPlace{} : LogPlace{kForces}});
}

/// Means of the force along z, less its overall mean, over `samples` samples each, and their times.
struct SlowForce {
  Column t_s, force_N;
};
SlowForce slow_force(const ForcesStream& f, std::size_t samples) {
  double mean = 0;
  for (const double v : f.force_z_N) mean += v / static_cast<double>(f.t_s.size());
  SlowForce slow;
  for (std::size_t i = 0; i + samples <= f.t_s.size(); i += samples) {
    double t = 0, force = 0;
    for (std::size_t k = i; k < i + samples; ++k) t += f.t_s[k] - f.t_s.front(), force += f.force_z_N[k] - mean;
    slow.t_s.push_back(t / static_cast<double>(samples));
    slow.force_N.push_back(force / static_cast<double>(samples));
  }
  return slow;
}

/// Amplitude of the force at a frequency, times the number of samples over two.
double amplitude(const SlowForce& f, double hz) {
  double cosine = 0, sine = 0;
  for (std::size_t i = 0; i < f.t_s.size(); ++i) {
    const double angle = 2 * std::numbers::pi * hz * f.t_s[i];
    cosine += f.force_N[i] * std::cos(angle), sine += f.force_N[i] * std::sin(angle);
  }
  return std::hypot(cosine, sine);
}

/// Both strokes of a beat lift, so the force along z has its main harmonic at twice the beat.
void check_forces_beat(const FlightLog& log, Findings& findings) {
  Column volts(log.command.t_s.size());
  for (std::size_t i = 0; i < volts.size(); ++i)
    volts[i] = log.command.left_voltage_V[i] + log.command.right_voltage_V[i];
  const auto driven = beat_frequency(log.command.t_s, volts);
  const double span_s = log.forces->t_s.back() - log.forces->t_s.front();
  if (!driven || !(span_s > 0)) {
    findings.push_back({"forces beat", Verdict::not_tested, "fewer than five beats in the voltages", {}});
    return;
  }
  // Samples kept of each period of the force. Choice: 16 lose 0.6 % of its amplitude.
  constexpr double kKept = 16;
  const double samples = static_cast<double>(log.forces->t_s.size()) / span_s / (kKept * 2 * *driven);
  const SlowForce slow = slow_force(*log.forces, static_cast<std::size_t>(std::max(1.0, samples)));
  double best = 0, most = -1;
  const double step = 0.1 / span_s;
  for (double hz = 2 * *driven * (1 - kSearchedShare); hz <= 2 * *driven * (1 + kSearchedShare); hz += step)
    if (const double a = amplitude(slow, hz); a > most) most = a, best = hz / 2;
  const double ratio = best / *driven, limit = std::max(kSpeedApart, kBeatsApart / (*driven * span_s));
  const std::string seen = format("the force beats at %.5g Hz, the voltages at %.5g Hz", best, *driven);
  if (std::abs(ratio - 1) <= limit) findings.push_back({"forces beat", Verdict::ok, seen, {{"ratio", ratio}}});
  else findings.push_back({"forces beat", Verdict::warning, seen + ": another clock", {{"ratio", ratio}}, {kForces}});
}

}  // namespace

void check_rig(const FlightLog& log, Findings& findings) {
  check_rig_axes(log, findings);
  check_resonance(log, findings);
  check_forces_beat(log, findings);
}

}  // namespace flappy::flightlog
