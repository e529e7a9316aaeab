#include "gap/replay/recording.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flightlog/log_world.hpp"
#include "flightlog/readings.hpp"
#include "io/statistics.hpp"
#include "model/derive.hpp"
#include "sim/replay.hpp"

namespace flappy::gap {
namespace {

using Eigen::Vector3d;
constexpr double kTurn = 2 * std::numbers::pi;
/// The flapping frequency is searched within this share of the declared one. Choice.
constexpr double kFrequencyReach = 0.02;
/// Cut off at both ends. Choice: the log still covers the grid after its clocks are corrected.
constexpr double kMargin_s = 0.05;
/// Number of first samples that give the full voltage. Choice.
constexpr std::size_t kFirstSamples = 20;
/// A ratio of the full to the nominal voltage below this counts as 1. Choice: it may be noise.
constexpr double kFuller = 1.02;
/// An interval between commands that is longer than so many times the median is a gap. Choice.
constexpr double kLongestHold = 5;

TorsoAt torso_at(const flightlog::TorsoMotion& m) {
  TorsoAt t;
  for (int i = 0; i < 3; ++i) {
    t.position_m[i] = m.position_m[i];
    t.velocity_m_s[i] = m.velocity_m_s[i];
    t.body_rate_rad_s[i] = m.body_rate_rad_s[i];
  }
  t.attitude[0] = m.attitude.w(), t.attitude[1] = m.attitude.x();
  t.attitude[2] = m.attitude.y(), t.attitude[3] = m.attitude.z();
  return t;
}

double density_over(const model::Vehicle& nominal, const flightlog::FlightHeader& h,
                    const std::filesystem::path& folder) {
  const double file = nominal.air_density_kg_m3, here = h.ambient.air_density_kg_m3;
  if (file == 0 && here > 0)
    throw io::InputError((folder / flightlog::log_file::kHeader).string() + ": ambient.air_density_kg_m3: is " +
                         io::shortest_digits(here) +
                         ", and the vehicle's file is of a vacuum; accepted: 0, or a vehicle "
                         "file with the density of air");
  return file > 0 ? here / file : 1;
}

}  // namespace

Recording::Recording(const std::filesystem::path& folder, flightlog::FlightLog flight_log,
                     const model::Vehicle& nominal)
    : name(io::folder_name(folder)),
      least_z_m(flight_log.header.ambient.ground_z_m + nominal.extent.below_m + kMinClearance_m),
      density_ratio(density_over(nominal, flight_log.header, folder)),
      mass_kg(model::total_mass_kg(nominal)),
      inertia_kg_m2(nominal.torso.inertia_kg_m2.xx, nominal.torso.inertia_kg_m2.yy, nominal.torso.inertia_kg_m2.zz),
      log(flightlog::on_its_clocks(std::move(flight_log))) {
  if (!log.header.rig) smoother.emplace(log, folder);
  const double from_s = smoother ? smoother->begin_s() : log.forces->t_s.front() - log.header.rig->latency_s,
               to_s = smoother ? smoother->end_s() : log.forces->t_s.back() - log.header.rig->latency_s;
  begin_s = std::max(from_s, log.command.t_s.front()) + kMargin_s;
  last_s = std::min(to_s, log.command.t_s.back()) - kMargin_s;
  prepare(folder.string());
}

Recording::Recording(const Recording& other, flightlog::FlightLog flight_log)
    : name(other.name),
      least_z_m(other.least_z_m),
      density_ratio(other.density_ratio),
      mass_kg(other.mass_kg),
      inertia_kg_m2(other.inertia_kg_m2),
      log(std::move(flight_log)),
      begin_s(other.begin_s),
      last_s(other.last_s),
      beats(other.beats),
      phase_t_s_(other.phase_t_s_),
      phase_beats_(other.phase_beats_),
      phase_offset_(other.phase_offset_),
      phase_hz_(other.phase_hz_),
      phase_from_s_(other.phase_from_s_),
      first_beat_(other.first_beat_) {
  if (!log.header.rig) smoother.emplace(log, other.name);
  prepare(name);
}

void Recording::prepare(const std::string& place) {
  world = flightlog::world_of(log.header);
  if (clamped()) lay_clamped_grid();
  else lay_grid();
  if (steps.empty() && clamped()) throw io::InputError(place + ": forces.csv and command.csv share less than 0.1 s");
  if (steps.empty()) throw io::InputError(place + ": no interval of the IMU has motion capture around it");
  read_voltages();
  find_phase();
  read_regimes();
}

void Recording::drop_streams() {
  log.command = {}, log.imu = {}, log.mocap = {}, log.wings.reset();
  smoother.reset();
  for (std::vector<double>* times : {&end_s, &phase_t_s_, &phase_beats_}) *times = {};
  force_m_s2 = {};
}

void Recording::lay_grid() {
  const flightlog::Smoother& smoothed = *smoother;
  const std::vector<double>& bounds = smoothed.bounds_s();
  const double usual_s = 1 / log.header.imu.rate_hz;
  const auto first =
      static_cast<std::size_t>(std::ranges::lower_bound(bounds, begin_s - kPredictionStep_s / 2) - bounds.begin());
  if (first >= bounds.size() || bounds[first] >= last_s) return;
  begin_s = bounds[first];
  double now_s = begin_s;
  torso.push_back(torso_at(smoothed.at(std::max(begin_s, smoothed.begin_s()))));
  const std::vector<std::pair<double, double>> undriven = undriven_s();
  for (std::size_t k = first + 1; k < bounds.size() && bounds[k] <= last_s + kPredictionStep_s / 2; ++k) {
    // a gap of the IMU is divided into usual intervals, so that the torso is reset often enough
    const int pieces = std::max(1, static_cast<int>(std::lround((bounds[k] - now_s) / usual_s)));
    for (int i = pieces; i > 0; --i) {
      const int n = static_cast<int>(std::lround((bounds[k] - now_s) / i / kPredictionStep_s));
      if (n == 0) continue;
      const double from_s = now_s;
      now_s += n * kPredictionStep_s;
      const double at_s = std::clamp(now_s, smoothed.begin_s(), smoothed.end_s());
      steps.push_back(n);
      end_s.push_back(now_s);
      torso.push_back(torso_at(smoothed.at(at_s)));
      force_m_s2.push_back(smoothed.mean_force_m_s2(from_s, now_s));
      const bool flies = torso.back().position_m[2] > least_z_m;
      const bool driven =
          std::ranges::none_of(undriven, [&](const auto& span) { return span.first < now_s && from_s < span.second; });
      // hypotheses share the grid; with another delay of motion capture, the record may cover less of it
      const bool recorded = now_s > smoothed.begin_s() && from_s < smoothed.end_s() &&
                            smoothed.covers(std::max(from_s, smoothed.begin_s()), at_s);
      valid.push_back(recorded && flies && driven ? 1 : 0);
    }
  }
}

/// Bounds half-way between samples of the sensor. Each interval has as many samples as kClampedInterval_s holds, and
/// they are spread evenly in it, so that their mean is that of the interval.
void Recording::lay_clamped_grid() {
  const flightlog::Column& t_s = log.forces->t_s;
  const double late_s = log.header.rig->latency_s, rate_hz = log.header.rig->rate_hz;
  // a rounding error of the rate does not cost a sample
  samples_per_interval = std::max<std::size_t>(1, static_cast<std::size_t>(kClampedInterval_s * rate_hz + 0.01));
  const double usual_s = static_cast<double>(samples_per_interval) / rate_hz;
  const auto bound_s = [&](std::size_t i) { return (t_s[i - 1] + t_s[i]) / 2 - late_s; };
  std::size_t i = 1;
  while (i < t_s.size() && bound_s(i) < begin_s) ++i;
  if (i >= t_s.size()) return;
  begin_s = bound_s(i);
  double now_s = begin_s;
  torso.emplace_back();
  const std::vector<std::pair<double, double>> undriven = undriven_s();
  for (std::size_t first = i; i + 1 < t_s.size() && bound_s(i + 1) <= last_s; ++i) {
    if (i + 1 - first < samples_per_interval) continue;
    const int n = static_cast<int>(std::lround((bound_s(i + 1) - now_s) / kPredictionStep_s));
    if (n == 0) continue;
    const double from_s = now_s;
    now_s += n * kPredictionStep_s;
    steps.push_back(n);
    end_s.push_back(now_s);
    torso.emplace_back();
    take_load(first, i + 1);
    const bool driven =
        std::ranges::none_of(undriven, [&](const auto& span) { return span.first < now_s && from_s < span.second; });
    // where the sensor has a gap, the mean of the samples is not the mean over the interval
    valid.push_back(driven && n * kPredictionStep_s < usual_s + 0.5 / rate_hz + kPredictionStep_s ? 1 : 0);
    first = i + 1;
  }
}

/// Mean force and moment of the samples from `first` on, before `end`; in B and about the torso origin.
void Recording::take_load(std::size_t first, std::size_t end) {
  const flightlog::ForcesStream& f = *log.forces;
  const flightlog::RigHeader& rig = *log.header.rig;
  const Eigen::Quaterniond to_B(rig.attitude[0], rig.attitude[1], rig.attitude[2], rig.attitude[3]);
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
  for (std::size_t i = first; i < end; ++i) {
    force += Vector3d(f.force_x_N[i], f.force_y_N[i], f.force_z_N[i]);
    moment += Vector3d(f.moment_x_Nm[i], f.moment_y_Nm[i], f.moment_z_Nm[i]);
  }
  const auto samples = static_cast<double>(end - first);
  force = to_B * (force / samples);
  moment = to_B * (moment / samples) + Vector3d(rig.position_m.data()).cross(force);
  force_m_s2.push_back(force / mass_kg);
  turn_rad_s2.push_back(moment.cwiseQuotient(inertia_kg_m2));
}

/// Spans without commands. Each lasts until the transient of the unknown voltages has decayed.
std::vector<std::pair<double, double>> Recording::undriven_s() const {
  const flightlog::Column& t_s = log.command.t_s;
  flightlog::Column intervals_s;
  for (std::size_t i = 1; i < t_s.size(); ++i) intervals_s.push_back(t_s[i] - t_s[i - 1]);
  const double longest_s = kLongestHold * io::upper_median(intervals_s);
  std::vector<std::pair<double, double>> spans;
  for (std::size_t i = 1; i < t_s.size(); ++i)
    if (t_s[i] - t_s[i - 1] > longest_s)
      spans.emplace_back(t_s[i - 1] + longest_s, t_s[i] + kSpinUpBeats / log.header.flapping_Hz);
  return spans;
}

void Recording::read_voltages() {
  std::size_t total = 0;
  for (const int n : steps) total += static_cast<std::size_t>(n);
  sim::step_voltages({log.command.t_s, log.command.left_voltage_V, log.command.right_voltage_V}, begin_s,
                     kPredictionStep_s, total, left_V, right_V);
  if (!log.power) return;
  const flightlog::Column& battery_V = log.power->battery_V;
  const std::size_t n = std::min<std::size_t>(kFirstSamples, battery_V.size());
  double sum_V = 0;
  for (std::size_t i = 0; i < n; ++i) sum_V += battery_V[i];
  full = sum_V / static_cast<double>(n) / log.header.power->battery_nominal_V;
  if (full < kFuller) full = 1;
  for (std::vector<double>* side : {&left_V, &right_V})
    for (double& v : *side) v *= full;
}

/// The phase of the beat as logged, or that of the sine that fits the voltages best.
void Recording::find_phase() {
  const flightlog::CommandStream& c = log.command;
  // corrected clocks may move the grid by a step; the beats have to stay the same
  const bool as_before = phase_from_s_.has_value(), found = as_before && (c.phase_rad || *phase_from_s_ == begin_s);
  phase_from_s_ = begin_s;
  if (found) {
    // commands are the same in every copy
  } else if (c.phase_rad) {
    double turns = 0;
    for (std::size_t i = 0; i < c.t_s.size(); ++i) {
      if (i > 0) turns += std::remainder((*c.phase_rad)[i] - (*c.phase_rad)[i - 1], kTurn) / kTurn;
      else turns = (*c.phase_rad)[0] / kTurn;
      phase_t_s_.push_back(c.t_s[i]);
      phase_beats_.push_back(turns);
    }
  } else {
    double best = -1;
    const double span_s = c.t_s.back() - c.t_s.front();
    const double reach = log.header.flapping_Hz * kFrequencyReach, step = 0.1 / std::max(span_s, 1e-3);
    const auto tried = static_cast<int>(2 * reach / step);
    for (int n = 0; n <= tried; ++n) {
      const double hz = log.header.flapping_Hz - reach + n * step;
      double cosine = 0, sine = 0;
      for (std::size_t i = 0; i < c.t_s.size(); ++i) {
        const double v = c.left_voltage_V[i] + c.right_voltage_V[i], a = kTurn * hz * (c.t_s[i] - begin_s);
        cosine += v * std::cos(a);
        sine += v * std::sin(a);
      }
      const double power = cosine * cosine + sine * sine;
      if (power > best) {
        best = power;
        phase_hz_ = hz;
        phase_offset_ = std::atan2(-sine, cosine) / kTurn;  // V ~ cos(2 pi (hz t + offset))
      }
    }
  }
  if (!as_before) first_beat_ = std::floor(beat_at(begin_s));
  if (!found) {
    phase_offset_ -= first_beat_;
    for (double& b : phase_beats_) b -= first_beat_;
  }
  double from_s = begin_s;
  for (std::size_t k = 0; k < intervals(); ++k) {
    beat.push_back(beat_at((from_s + end_s[k]) / 2));
    from_s = end_s[k];
  }
  if (!as_before) beats = beat.empty() ? 0 : static_cast<std::size_t>(std::max(0.0, std::floor(beat.back())));
}

double Recording::beat_at(double t_s) const {
  if (phase_t_s_.empty()) return phase_hz_ * (t_s - begin_s) + phase_offset_;
  const auto after = std::ranges::upper_bound(phase_t_s_, t_s);
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(after - phase_t_s_.begin(), 1, static_cast<std::ptrdiff_t>(phase_t_s_.size()) - 1));
  const double share = (t_s - phase_t_s_[i - 1]) / (phase_t_s_[i] - phase_t_s_[i - 1]);
  return phase_beats_[i - 1] + share * (phase_beats_[i] - phase_beats_[i - 1]);
}

/// From the voltages, which every log has: mean, first harmonic, and the second harmonic of a split cycle.
void Recording::read_regimes() {
  struct Sum {
    double n = 0, left = 0, right = 0, left_cos = 0, right_cos = 0, left_sin2 = 0, right_sin2 = 0;
  };
  std::vector<Sum> sums(beats);
  regimes.assign(beats, BeatMotion{0, 0, 0, 0, 0, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), 0});
  std::vector<double> count(beats, 0);
  std::size_t step = 0;
  double from_s = begin_s;
  for (std::size_t k = 0; k < intervals(); ++k) {
    const double begin = beat_at(from_s), end = beat_at(end_s[k]);
    for (int i = 0; i < steps[k]; ++i, ++step) {
      const double b = begin + (end - begin) * (i + 0.5) / steps[k];
      if (b < 0 || b >= static_cast<double>(beats)) continue;
      Sum& s = sums[static_cast<std::size_t>(b)];
      const double c = std::cos(kTurn * b), s2 = std::sin(2 * kTurn * b);
      s.n += 1;
      s.left += left_V[step], s.right += right_V[step];
      s.left_cos += left_V[step] * c, s.right_cos += right_V[step] * c;
      s.left_sin2 += left_V[step] * s2, s.right_sin2 += right_V[step] * s2;
    }
    from_s = end_s[k];
    if (beat[k] < 0 || beat[k] >= static_cast<double>(beats)) continue;
    const auto j = static_cast<std::size_t>(beat[k]);
    const TorsoAt& t = torso[k + 1];
    const Eigen::Quaterniond q(t.attitude[0], t.attitude[1], t.attitude[2], t.attitude[3]);
    BeatMotion& r = regimes[j];
    count[j] += 1;
    r.t_s += end_s[k];
    r.velocity_B_m_s += q.conjugate() * Vector3d(t.velocity_m_s);
    r.rate_rad_s += Vector3d(t.body_rate_rad_s);
    r.position_m += Vector3d(t.position_m);
    const Vector3d x = q * Vector3d::UnitX();
    r.heading_rad = std::atan2(x.y(), x.x());
  }
  for (std::size_t j = 0; j < beats; ++j) {
    const Sum& s = sums[j];
    BeatMotion& r = regimes[j];
    if (s.n == 0 || count[j] == 0) continue;
    r.t_s /= count[j];
    r.velocity_B_m_s /= count[j];
    r.rate_rad_s /= count[j];
    r.position_m /= count[j];
    const double left = 2 * s.left_cos / s.n, right = 2 * s.right_cos / s.n;
    r.amplitude_V = (left + right) / 2;
    r.difference_V = (left - right) / 2;
    r.bias_V = (s.left + s.right) / (2 * s.n);
    // a split cycle is a second harmonic with opposite signs on the two sides
    r.split_cycle = r.amplitude_V != 0 ? (s.left_sin2 - s.right_sin2) / (s.n * r.amplitude_V) : 0;
  }
}

}  // namespace flappy::gap
