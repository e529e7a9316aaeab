#include "identify/transitions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "flightlog/log_world.hpp"
#include "flightlog/smoother.hpp"
#include "identify/force_map.hpp"
#include "io/csv.hpp"
#include "io/statistics.hpp"
#include "sim/replay.hpp"

namespace flappy::identify {
namespace {

/// Beats of spin-up, after which wings that started at rest are in phase.
constexpr double kSpinUpBeats = 3;
/// Share of a stroke's deviation corrected in each interval of the IMU; a quarter of the logged noise remains.
constexpr double kStrokeShare = 0.1;
constexpr double kMinChords = 5;  ///< least height above the ground, in mean chords
/// Largest accepted rms innovation or bias of the smoother, in units of the declared noise.
constexpr double kLargestInnovation = 5;
/// A longer interval between commands, in median intervals, means that commands were lost.
constexpr double kLongestHold = 5;

StateVector state_vector(const sim::FlapperState& s) {
  const double w = s.attitude[0], x = s.attitude[1], y = s.attitude[2], z = s.attitude[3];
  const double *p = s.position_m, *v = s.velocity_m_s, *r = s.body_rate_rad_s;
  return {p[0],
          p[1],
          p[2],
          std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
          std::asin(std::clamp(2 * (w * y - z * x), -1.0, 1.0)),
          std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
          v[0],
          v[1],
          v[2],
          r[0],
          r[1],
          r[2]};
}

/// a - b, angles the shorter way round.
StateVector difference(const StateVector& a, const StateVector& b) {
  StateVector d;
  for (std::size_t k = 0; k < d.size(); ++k) {
    d[k] = a[k] - b[k];
    if (k >= 3 && k < 6) d[k] = std::remainder(d[k], 2 * std::numbers::pi);
  }
  return d;
}

/// The state `x` with the mean body rate since the state `before`.
sim::FlapperState with_mean_rate(const sim::FlapperState& before, sim::FlapperState x, double interval_s) {
  const auto of = [](const double* q) { return Eigen::Quaterniond(q[0], q[1], q[2], q[3]); };
  const Eigen::Quaterniond turn = of(before.attitude).conjugate() * of(x.attitude);
  // Small-angle formula: for a turn of 0.1 rad, exact to 4e-4.
  for (int k = 0; k < 3; ++k) x.body_rate_rad_s[k] = std::copysign(2 / interval_s, turn.w()) * turn.vec()[k];
  return x;
}

std::string in_ms(const std::array<double, 2>& window_s) {
  const auto ms = [](double s) { return io::shortest_digits(std::round(1e4 * s) / 10); };
  return ms(window_s[0]) + " and " + ms(window_s[1]) + " ms";
}

/// Standard deviation of each state from the sensors' noise: the least range of a state.
StateVector noise_of(const flightlog::FlightHeader& h) {
  const double x = h.mocap.position_noise_m, angle = h.mocap.attitude_noise_rad, rate = h.imu.gyro_noise_rad_s;
  // Noise of a velocity that the accelerometer's noise integrates to within a beat.
  const double v = h.imu.accel_noise_m_s2 / std::sqrt(h.imu.rate_hz * h.flapping_Hz);
  return {x, x, x, angle, angle, angle, v, v, v, rate, rate, rate};
}

class Truth {
 public:
  /// InputError for rows that are not at equal intervals of whole steps.
  explicit Truth(const std::filesystem::path& folder) : table_(io::read_csv(folder / flightlog::log_file::kTruth)) {
    const auto& t = t_s();
    if (t.size() < 2)
      throw io::InputError(table_.name + ": has " + (t.empty() ? "no row" : "one row") + "; accepted: at least two");
    const double interval_s = std::round((t[1] - t[0]) / sim::kDefaultStep_s) * sim::kDefaultStep_s;
    for (std::size_t i = 1; i < t.size(); ++i)
      if (!(interval_s > 0) || !(std::abs(t[i] - t[i - 1] - interval_s) < 0.01 * sim::kDefaultStep_s))
        throw io::InputError(table_.name + ":" + std::to_string(i + 2) + ": t_s: is " +
                             io::shortest_digits(t[i] - t[i - 1]) + " s after the row before; accepted: " +
                             (interval_s > 0
                                  ? io::shortest_digits(interval_s) + " s, as the rows before"
                                  : "a whole number of steps of " + io::shortest_digits(sim::kDefaultStep_s) + " s"));
  }
  const std::vector<double>& t_s() const { return table_.column("t_s"); }
  double interval_s() const { return t_s()[1] - t_s()[0]; }
  bool covers(double from_s, double to_s) const { return from_s >= t_s().front() && to_s <= t_s().back(); }
  std::size_t row_near(double at_s) const {
    const auto& t = t_s();
    const auto after = static_cast<std::size_t>(std::ranges::lower_bound(t, at_s) - t.begin());
    if (after == 0) return 0;
    if (after == t.size()) return t.size() - 1;
    return at_s - t[after - 1] < t[after] - at_s ? after - 1 : after;
  }
  sim::FlapperState state(std::size_t row) const {
    const auto at = [&](const char* name) { return table_.column(name)[row]; };
    return {{at("x_m"), at("y_m"), at("z_m")},
            {at("qw"), at("qx"), at("qy"), at("qz")},
            {at("velocity_x_m_s"), at("velocity_y_m_s"), at("velocity_z_m_s")},
            {at("rate_x_rad_s"), at("rate_y_rad_s"), at("rate_z_rad_s")},
            {at("left_stroke_rad"), at("right_stroke_rad")},
            {at("left_rotation_rad"), at("right_rotation_rad")},
            {at("left_stroke_rate_rad_s"), at("right_stroke_rate_rad_s")},
            {at("left_rotation_rate_rad_s"), at("right_rotation_rate_rad_s")},
            {at("left_stroke_acceleration_rad_s2"), at("right_stroke_acceleration_rad_s2")},
            {at("left_rotation_acceleration_rad_s2"), at("right_rotation_acceleration_rad_s2")}};
  }

 private:
  io::CsvTable table_;
};

}  // namespace

struct Transitions::Flight {
  model::Vehicle vehicle;
  sim::World world;
  StateVector noise;
  double beat_s, imu_interval_s;
  sim::VoltageScript voltages;
  std::optional<flightlog::WingsStream> wings;
  double wings_hz;
  flightlog::Smoother track;
  std::unique_ptr<Truth> truth;
  std::vector<double> starts_s;
  std::size_t recorded = 0, low = 0, not_covered = 0;

  Flight(const std::filesystem::path& folder, const flightlog::FlightLog& log, const model::Vehicle& v, Source source)
      : vehicle(v),
        world(flightlog::world_of(log.header)),
        noise(noise_of(log.header)),
        beat_s(1 / log.header.flapping_Hz),
        imu_interval_s(1 / log.header.imu.rate_hz),
        voltages(flightlog::motor_voltages(log)),
        wings(log.wings),
        wings_hz(log.header.wings ? log.header.wings->rate_hz : 0),
        track(log, folder),
        truth(source == Source::truth ? std::make_unique<Truth>(folder) : nullptr) {
    vehicle.air_density_kg_m3 = log.header.ambient.air_density_kg_m3;
  }

  /// Spacing of the instants at which states are known best: intervals of the IMU, or rows of truth.csv.
  double grid_s() const { return truth ? truth->interval_s() : imu_interval_s; }
  int grid_steps() const { return std::max(1, static_cast<int>(std::lround(grid_s() / sim::kDefaultStep_s))); }
  int beat_steps(double beats) const {
    return std::max(1, static_cast<int>(std::lround(beats * beat_s / grid_s()))) * grid_steps();
  }
  /// Length of one and of two beats, rounded to the grid.
  std::array<double, 2> window_s() const {
    return {beat_steps(1) * sim::kDefaultStep_s, beat_steps(2) * sim::kDefaultStep_s};
  }
  int spin_up_steps() const { return truth ? 0 : beat_steps(kSpinUpBeats); }

  sim::FlapperState at(double t_s) const {
    if (truth) return truth->state(truth->row_near(t_s));
    const flightlog::TorsoMotion m = track.at(t_s);
    sim::FlapperState x;
    for (int i = 0; i < 3; ++i) {
      x.position_m[i] = m.position_m[i];
      x.velocity_m_s[i] = m.velocity_m_s[i];
      x.body_rate_rad_s[i] = m.body_rate_rad_s[i];
    }
    if (wings) std::copy_n(flightlog::wing_angles_at(*wings, wings_hz, t_s).begin(), 2, x.stroke_rad);
    const Eigen::Quaterniond& q = m.attitude;
    x.attitude[0] = q.w(), x.attitude[1] = q.x(), x.attitude[2] = q.y(), x.attitude[3] = q.z();
    return x;
  }

  void choose_starts() {
    std::vector<double> holds;
    for (std::size_t i = 1; i < voltages.t_s.size(); ++i) holds.push_back(voltages.t_s[i] - voltages.t_s[i - 1]);
    const double longest_s = kLongestHold * io::median(holds);
    const auto commanded = [&](double from_s, double to_s) {
      const auto& t = voltages.t_s;
      if (from_s < t.front() || to_s > t.back() + longest_s) return false;
      for (auto i = static_cast<std::size_t>(std::ranges::upper_bound(t, from_s) - t.begin());
           i < t.size() && t[i - 1] < to_s; ++i)
        if (t[i] - t[i - 1] > longest_s) return false;
      return true;
    };
    const double before_s = kSpinUpBeats * beat_s + grid_s(), after_s = 2 * beat_s + grid_s();
    const double least_z_m =
        world.ground_z_m + kMinChords * (vehicle.left.planform.mean_chord_m + vehicle.right.planform.mean_chord_m) / 2;
    for (const double pose_s : track.pose_s()) {
      ++recorded;
      const double t_s = truth ? truth->t_s()[truth->row_near(pose_s)] : track.imu_bound_s(pose_s);
      const double from_s = t_s - before_s, to_s = t_s + after_s;
      if (!track.covers(from_s, to_s) || !commanded(from_s, to_s) || (truth && !truth->covers(from_s, to_s)))
        ++not_covered;
      else if (track.at(t_s).position_m.z() <= least_z_m) ++low;
      else starts_s.push_back(t_s);
    }
  }

  /// Range of each state within the beat that follows a start.
  StateVector range(double start_s) const {
    constexpr int kLooks = 30;
    StateVector least{}, most{};
    const StateVector begin = state_vector(at(start_s));
    for (int i = 1; i <= kLooks; ++i) {
      const StateVector d = difference(state_vector(at(start_s + beat_s * i / kLooks)), begin);
      for (std::size_t k = 0; k < d.size(); ++k) {
        least[k] = std::min(least[k], d[k]);
        most[k] = std::max(most[k], d[k]);
      }
    }
    for (std::size_t k = 0; k < least.size(); ++k) most[k] -= least[k];
    return most;
  }
};

Transitions::Transitions(const TransitionOptions& options) : options_(options) {}
Transitions::~Transitions() = default;

void Transitions::add(const std::filesystem::path& folder, const flightlog::FlightLog& log,
                      const model::Vehicle& vehicle) {
  flightlog::require_voltages(log, folder.string());
  const auto refuse = [&](const std::string& what) { throw io::InputError(folder.string() + ": " + what); };
  auto flight = std::make_unique<Flight>(folder, log, vehicle, options_.source);
  const flightlog::Smoother& t = flight->track;
  const double innovation = std::sqrt(
      std::max({t.angle_normalised_innovation(), t.position_normalised_innovation(), t.bias_normalised_innovation()}));
  if (!(innovation <= kLargestInnovation) && !options_.accept_innovation)
    refuse("motion capture and IMU disagree, or are biased, by " +
           io::shortest_digits(std::round(10 * innovation) / 10) + " times their declared noise; accepted: at most " +
           io::shortest_digits(kLargestInnovation) + ", or any by --accept-innovation; flappy-gap check says more");
  normalised_innovation_ = std::max(normalised_innovation_, innovation);
  flight->choose_starts();
  if (flight->starts_s.empty()) {
    if (flight->low > 0) refuse("no sample is higher than five mean chords above the ground; accepted: free flight");
    refuse("no sample has " + io::shortest_digits(kSpinUpBeats) +
           " beats before and 2 after it in which all streams are there; accepted: longer flights");
  }
  if (!flights_.empty() && flight->window_s() != flights_.front()->window_s())
    refuse("one and two of its beats are " + in_ms(flight->window_s()) + ", those of the flights before " +
           in_ms(flights_.front()->window_s()) +
           ", in whole intervals of the IMU; accepted: flights of equal beats, others in a run of their own");
  flights_.push_back(std::move(flight));
}

TransitionReport Transitions::run() const {
  TransitionReport report;
  report.normalised_innovation = normalised_innovation_;
  if (!flights_.empty()) report.beats_s = flights_.front()->window_s();
  std::size_t available = 0;
  for (const auto& f : flights_) {
    available += f->starts_s.size();
    report.recorded += f->recorded;
    report.low += f->low;
    report.not_covered += f->not_covered;
  }
  const std::size_t wanted = options_.every > 0 ? (available + options_.every - 1) / options_.every : options_.samples;
  report.samples = std::min(wanted, available);
  std::vector<StateVector> ranges;
  std::size_t chosen = 0, before = 0;
  StateVector noise{};
  for (const auto& f : flights_) {
    std::vector<sim::ReplayWindow> windows;
    for (; chosen < report.samples; ++chosen) {
      const std::size_t index = options_.every > 0 ? chosen * options_.every : chosen * available / report.samples;
      if (index >= before + f->starts_s.size()) break;
      windows.push_back({f->starts_s[index - before], &f->vehicle, &f->voltages});
    }
    before += f->starts_s.size();
    // The body rate is compared as a gyro measures it: the mean over one interval.
    const int ends[2] = {f->beat_steps(1), f->beat_steps(2)}, interval = f->grid_steps();
    const std::vector<int> checkpoints = {ends[0] - interval, ends[0], ends[1] - interval, ends[1]};
    sim::ReplayOptions o;
    o.step_s = sim::kDefaultStep_s;
    o.threads = options_.threads;
    o.world = f->world;
    o.spin_up_steps = f->spin_up_steps();
    o.carry_steps = interval;
    if (f->wings) o.stroke_share = kStrokeShare;
    const auto results = sim::replay(
        windows, checkpoints, [&](std::size_t, double t_s) { return f->at(t_s); }, o);
    for (std::size_t i = 0; i < windows.size(); ++i) {
      ranges.push_back(f->range(windows[i].start_s));
      if (results[i].status & sim::kFrozen) {
        ++report.diverged;
        for (auto& errors : report.errors) {
          errors.emplace_back();
          errors.back().fill(std::numeric_limits<double>::infinity());
        }
        continue;
      }
      for (std::size_t b = 0; b < 2; ++b) {
        const double end_s = windows[i].start_s + report.beats_s[b], interval_s = interval * sim::kDefaultStep_s;
        const auto simulated = with_mean_rate(results[i].states[2 * b], results[i].states[2 * b + 1], interval_s);
        const auto recorded = with_mean_rate(f->at(end_s - interval_s), f->at(end_s), interval_s);
        StateVector error = difference(state_vector(simulated), state_vector(recorded));
        for (double& e : error) e = std::abs(e);
        report.errors[b].push_back(error);
      }
    }
    for (std::size_t k = 0; k < noise.size(); ++k) noise[k] = std::max(noise[k], f->noise[k]);
  }
  for (std::size_t k = 0; k < noise.size(); ++k) {
    std::vector<double> values;
    for (const StateVector& r : ranges) values.push_back(r[k]);
    report.range[k] = std::max(io::median(std::move(values)), noise[k]);
  }
  return report;
}

StateVector TransitionReport::quantile(int beats, double share, bool of_range) const {
  StateVector result;
  for (std::size_t k = 0; k < result.size(); ++k) {
    std::vector<double> values;
    for (const StateVector& e : errors[static_cast<std::size_t>(beats - 1)]) values.push_back(e[k]);
    result[k] = io::quantile(std::move(values), share) / (of_range ? range[k] : 1);
  }
  return result;
}

std::string distribution_csv(const TransitionReport& report) {
  std::vector<std::string> names = {"beats", "quantile"};
  for (const bool of_range : {false, true})
    for (const char* name : kStateNames) names.push_back(std::string(name) + (of_range ? "_of_range" : ""));
  std::vector<std::vector<double>> columns(names.size());
  for (int beats = 1; beats <= 2; ++beats) {
    for (int percent = 5; percent <= 100; percent += 5) {
      columns[0].push_back(beats);
      columns[1].push_back(percent / 100.0);
      std::size_t column = 2;
      for (const bool of_range : {false, true})
        for (const double value : report.quantile(beats, percent / 100.0, of_range)) columns[column++].push_back(value);
    }
  }
  return io::csv_text(names, columns);
}

}  // namespace flappy::identify
