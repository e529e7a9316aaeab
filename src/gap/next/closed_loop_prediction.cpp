#include "gap/next/closed_loop_prediction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "io/parallel.hpp"
#include "rollout/simulated_flight.hpp"

namespace flappy::gap {
namespace {

using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// Standard deviation of the weights that smooth a measured path. Choice.
constexpr double kPathSd_s = 0.25;
/// Standard deviation of the weights that smooth a flown path. Choice: the flight smooths it again.
constexpr double kFlownSd_s = 0.12;
/// Time between knots of a path. Choice.
constexpr double kKnot_s = 0.1;
/// A path within these ranges of position and heading counts as a hover. Choice.
constexpr double kHoverReach_m = 0.06, kHoverTurn_rad = 0.6;
/// Before a recorded path: hover to learn the trim, approach the start, rest. Choice.
constexpr double kLearn_s = 3, kApproach_s = 1, kRest_s = 0.5, kLead_s = kLearn_s + kApproach_s + kRest_s;
/// Distance of that hover from ground and ceiling. Choice.
constexpr double kClear_m = 0.5;
/// Left out at the start of each flight. Choice: a simulated vehicle starts at rest and has to catch up.
constexpr double kCatchUp_s = 0.5;
/// Smallest number of beats of a flight that is compared. Choice.
constexpr std::size_t kMinBeats = 40;

constexpr std::array<const char*, 9> kQuantities = {"mean_amplitude_V", "mean_difference_V", "mean_bias_V",
                                                    "mean_split_cycle", "amplitude_rise_V",  "rms_roll_rad",
                                                    "rms_pitch_rad",    "rms_off_path_m",    "yaw_drift_rad"};
using Quantities = std::array<double, kQuantities.size()>;

/// Means over one beat.
struct Beat {
  double t_s = 0, roll_rad = 0, pitch_rad = 0, heading_rad = 0;  ///< heading: continuous over whole turns
  Vector3d position_m = Vector3d::Zero();
  BeatMotion regime;
};

/// Whole beats in which all streams have data and the vehicle is clear of the ground.
std::vector<Beat> beats_of(const Recording& r, double from_s, double to_s) {
  struct Sum {
    double n = 0, t_s = 0, roll = 0, pitch = 0;
    Vector3d position = Vector3d::Zero(), nose = Vector3d::Zero();
    bool whole = true;
  };
  std::vector<Sum> sums(r.beats);
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    if (r.beat[k] < 0 || r.beat[k] >= static_cast<double>(r.beats)) continue;
    Sum& s = sums[static_cast<std::size_t>(r.beat[k])];
    const TorsoAt& t = r.torso[k + 1];
    const Eigen::Matrix3d R =
        Eigen::Quaterniond(t.attitude[0], t.attitude[1], t.attitude[2], t.attitude[3]).toRotationMatrix();
    s.n += 1;
    s.t_s += r.end_s[k];
    s.roll += std::atan2(R(2, 1), R(2, 2));
    s.pitch += std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
    s.nose += R.col(0);
    s.position += Vector3d(t.position_m);
    s.whole = s.whole && r.valid[k] && r.end_s[k] > from_s && r.end_s[k] < to_s;
  }
  std::vector<Beat> beats;
  for (std::size_t j = 0; j < r.beats; ++j) {
    const Sum& s = sums[j];
    if (!s.whole || s.n == 0) continue;
    Beat b{s.t_s / s.n,      s.roll / s.n, s.pitch / s.n, std::atan2(s.nose.y(), s.nose.x()),
           s.position / s.n, r.regimes[j]};
    if (!beats.empty()) {
      const double before = beats.back().heading_rad;
      b.heading_rad = before + std::remainder(b.heading_rad - before, 2 * std::numbers::pi);
    }
    beats.push_back(b);
  }
  return beats;
}

/// x, y, z in W, m, and heading, rad.
using PlaceAndHeading = Eigen::Vector4d;
PlaceAndHeading place_of(const Beat& b) {
  return {b.position_m.x(), b.position_m.y(), b.position_m.z(), b.heading_rad};
}

struct OnPath {
  PlaceAndHeading at, per_s;
};

/// The path at an instant, by a weighted straight line through the beats around it.
OnPath path_at(const std::vector<Beat>& beats, double t_s, double sd_s) {
  double n = 0, t = 0, tt = 0;
  PlaceAndHeading sum = PlaceAndHeading::Zero(), moment = PlaceAndHeading::Zero();
  for (const Beat& b : beats) {
    const double dt = b.t_s - t_s, x = dt / sd_s;
    if (std::abs(x) > 5) continue;
    const double w = std::exp(-0.5 * x * x);
    n += w, t += w * dt, tt += w * dt * dt;
    sum += w * place_of(b), moment += w * dt * place_of(b);
  }
  const double spread = n * tt - t * t;
  if (!(spread > 1e-9 * n * n * sd_s * sd_s)) {  // too few beats nearby for a line: take the nearest beat
    const auto nearest = std::ranges::min_element(beats, {}, [&](const Beat& b) { return std::abs(b.t_s - t_s); });
    return {place_of(*nearest), PlaceAndHeading::Zero()};
  }
  return {(tt * sum - t * moment) / spread, (n * moment - t * sum) / spread};
}

Quantities quantities_of(std::vector<Beat> beats) {
  const double begin_s = beats.empty() ? 0 : beats.front().t_s + kCatchUp_s;
  std::erase_if(beats, [&](const Beat& b) { return b.t_s < begin_s; });
  Quantities q;
  q.fill(kNan);
  if (beats.size() < kMinBeats) return q;
  const auto n = static_cast<double>(beats.size());
  const auto mean = [&](const auto& of) {
    double sum = 0;
    for (const Beat& b : beats) sum += of(b);
    return sum / n;
  };
  const auto rms = [&](const auto& of) {
    return std::sqrt(mean([&](const Beat& b) {
      const double x = of(b);
      return x * x;
    }));
  };
  const auto amplitude = [](const Beat& b) { return b.regime.amplitude_V; };
  q[0] = mean(amplitude);
  q[1] = mean([](const Beat& b) { return b.regime.difference_V; });
  q[2] = mean([](const Beat& b) { return b.regime.bias_V; });
  q[3] = mean([](const Beat& b) { return b.regime.split_cycle; });
  const double middle_s = mean([](const Beat& b) { return b.t_s; });
  const double together = mean([&](const Beat& b) { return (b.t_s - middle_s) * amplitude(b); });
  const double alone = mean([&](const Beat& b) { return (b.t_s - middle_s) * (b.t_s - middle_s); });
  q[4] = together / alone * (beats.back().t_s - beats.front().t_s);
  q[5] = rms([](const Beat& b) { return b.roll_rad; });
  q[6] = rms([](const Beat& b) { return b.pitch_rad; });
  q[7] = rms([&](const Beat& b) { return (place_of(b) - path_at(beats, b.t_s, kPathSd_s).at).head<3>().norm(); });
  const auto heading = [&](double from_s, double to_s) {
    double sum = 0, count = 0;
    for (const Beat& b : beats)
      if (b.t_s >= from_s && b.t_s <= to_s) sum += b.heading_rad, count += 1;
    return sum / count;
  };
  const double first_s = beats.front().t_s, last_s = beats.back().t_s;
  q[8] = heading(last_s - 1, last_s) - heading(first_s, first_s + 1);
  return q;
}

using Path = std::vector<flight::Segment<double>>;

flight::Segment<double> segment(std::uint32_t tick, double duration_s, const OnPath& from, const OnPath& to) {
  flight::Segment<double> s{tick, {}};
  const double h = duration_s;
  for (int c = 0; c < 4; ++c) {
    const double d = (to.at[c] - from.at[c]) / h;
    const double a[4] = {from.at[c], from.per_s[c], (3 * d - 2 * from.per_s[c] - to.per_s[c]) / h,
                         (from.per_s[c] + to.per_s[c] - 2 * d) / (h * h)};
    std::copy(a, a + 4, s.coefficients[c]);
  }
  return s;
}

Path path_of(const std::vector<Beat>& beats, const sim::World& world, double tick_s) {
  std::vector<OnPath> knots;
  const double first_s = beats.front().t_s, span_s = beats.back().t_s - first_s;
  PlaceAndHeading low = place_of(beats.front()), high = low, mean = PlaceAndHeading::Zero();
  for (std::size_t n = 0; static_cast<double>(n) * kKnot_s <= span_s; ++n) {
    knots.push_back(path_at(beats, first_s + static_cast<double>(n) * kKnot_s, kFlownSd_s));
    low = low.cwiseMin(knots.back().at), high = high.cwiseMax(knots.back().at);
    mean += knots.back().at;
  }
  if ((high - low).head<3>().maxCoeff() < kHoverReach_m && high[3] - low[3] < kHoverTurn_rad) {
    mean /= static_cast<double>(knots.size());
    mean[3] = knots.front().at[3];
    knots = {{mean, PlaceAndHeading::Zero()}};
  }
  Path path;
  const auto add = [&](double t_s, double duration_s, const OnPath& from, const OnPath& to) {
    path.push_back(segment(static_cast<std::uint32_t>(std::lround(t_s / tick_s)), duration_s, from, to));
  };
  const OnPath start{knots.front().at, PlaceAndHeading::Zero()};
  OnPath clear = start;
  if (world.ceiling_z_m - world.ground_z_m > 2 * kClear_m)
    clear.at[2] = std::clamp(start.at[2], world.ground_z_m + kClear_m, world.ceiling_z_m - kClear_m);
  add(0, kLearn_s, clear, clear);
  add(kLearn_s, kApproach_s, clear, start);
  add(kLearn_s + kApproach_s, kRest_s, start, start);
  for (std::size_t k = 0; k + 1 < knots.size(); ++k)
    add(kLead_s + static_cast<double>(k) * kKnot_s, kKnot_s, knots[k], knots[k + 1]);
  const OnPath end{knots.back().at, PlaceAndHeading::Zero()};
  add(kLead_s + static_cast<double>(knots.size() - 1) * kKnot_s, 1, end, end);
  return path;
}

/// A simulated flight for a recorded one, and the part of its log that is evaluated.
struct Sortie {
  rollout::FlyConfig config;
  double from_s = 0, to_s = 0;
};

Sortie along(const std::vector<Beat>& beats, const Recording& r, const rollout::FlyConfig& pilot) {
  Sortie s{pilot, kLead_s, kLead_s + beats.back().t_s - beats.front().t_s};
  rollout::FlyConfig& c = s.config;
  c.duration_s = s.to_s + 0.2;  // motion capture has latency and has to log the end, too
  c.excitation = {};
  c.fleet.batch.world = r.world;
  flight::Task& task = c.fleet.task;
  task.start = {};
  task.path = path_of(beats, r.world, 1 / c.fleet.control_hz);
  for (int i = 0; i < 3; ++i) task.start.position_m[i].centre = task.path.front().coefficients[i][0];
  task.start.rotation_rad[2].centre = task.path.front().coefficients[3][0];
  return s;
}

Quantities predict(const Sortie& sortie, const Recording& r, model::Vehicle vehicle, std::size_t copies) {
  vehicle.air_density_kg_m3 *= r.density_ratio;
  Quantities sum{};
  for (const rollout::SimulatedFlight& f : simulate(sortie.config, vehicle, copies, sortie.from_s)) {
    Quantities q;
    q.fill(kNan);
    if (!f.lost && f.log)
      q = quantities_of(beats_of(Recording("prediction", *f.log, vehicle), sortie.from_s, sortie.to_s));
    for (std::size_t i = 0; i < q.size(); ++i) sum[i] += q[i] / static_cast<double>(copies);
  }
  return sum;
}

}  // namespace

std::vector<ClosedLoop> predict_closed_loop(const FlightList& flights, const model::Vehicle& nominal,
                                            const model::Vehicle& corrected, const rollout::FlyConfig& pilot,
                                            const ClosedLoopOptions& options) {
  const model::Vehicle* const vehicles[] = {&nominal, &corrected};
  std::vector<std::array<Quantities, 3>> found(flights.size());  // recorded, nominal, corrected
  io::parallel_for(2 * flights.size(), options.threads, [&](std::size_t job) {
    const std::size_t f = job / 2, v = job % 2;
    const Recording& r = *flights[f]->recording();
    const double zero_s = r.log.command.t_s.front();
    const double from_s = options.own_path ? zero_s + pilot.settle_s : -1e300;
    const double to_s = options.own_path ? zero_s + pilot.duration_s : 1e300;
    const std::vector<Beat> beats = beats_of(r, from_s, to_s);
    if (v == 0) found[f][0] = quantities_of(beats);
    Quantities& to = found[f][1 + v];
    to.fill(kNan);
    if (beats.size() < kMinBeats) return;
    Sortie sortie = options.own_path ? Sortie{pilot, pilot.settle_s, pilot.duration_s} : along(beats, r, pilot);
    sortie.config.changes = r.log.header.changes;
    to = predict(sortie, r, *vehicles[v], options.copies);
  });
  std::vector<ClosedLoop> rows;
  for (std::size_t f = 0; f < flights.size(); ++f)
    for (std::size_t q = 0; q < kQuantities.size(); ++q)
      rows.push_back({flights[f]->name(), kQuantities[q], found[f][0][q], found[f][1][q], found[f][2][q]});
  return rows;
}

}  // namespace flappy::gap
