#include "lab/benchmark/detectability.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <mutex>
#include <numbers>

#include "io/files.hpp"
#include "io/parallel.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"
#include "lab/benchmark/families.hpp"

namespace flappy::benchmark {
namespace {

using Json = nlohmann::ordered_json;

/// Robots fly twice the detectable magnitude, at most 4. kMaxHover stands for "never" in hover.
constexpr double kMaxDetectable = 2, kMaxHover = 1000;
/// Only rich flight has these. Effects that act in them alone need a contrast of their own in hover.
constexpr const char* kOfFlight[] = {"height", "ceiling",      "wall",    "place",      "velocity",
                                     "rate",   "acceleration", "heading", "difference", "bias"};
constexpr const char* kChannels[] = {"specific_force_x",       "specific_force_y",       "specific_force_z",
                                     "angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"};
constexpr const char* kOrders[] = {"mean", "first harmonic", "second harmonic"};

/// Mean square of the waveform of one order of a beat.
double power(const double* at, std::size_t order) {
  return order == 0 ? at[0] * at[0] : (at[2 * order - 1] * at[2 * order - 1] + at[2 * order] * at[2 * order]) / 2;
}

/// Detectable magnitude of an effect for one robot, in rich flight and in hover.
struct Found {
  double rich = 0, hover = 0;
  Shown where;  ///< at magnitude 1
};

std::string three_digits(double x) { return io::format("%.3g", x); }

struct Detectable {
  double detectable = 0, low = 0, high = 0, hover = 0;
  Shown where;
  bool undetectable = false, of_sensors = false;
};

Detectable detectable_of(const blind::FamilyEffect& effect, const std::vector<Found>& robots) {
  std::vector<double> magnitudes, hovers;
  Detectable s;
  for (const Found& f : robots) {
    magnitudes.push_back(f.rich);
    hovers.push_back(f.hover);
    if (f.where.share > s.where.share) s.where = f.where;
  }
  s.of_sensors = s.where.share == 0 && std::ranges::none_of(effect.channels, [](const std::string& c) {
                   return c.starts_with("specific_force") || c.starts_with("angular_acceleration");
                 });
  if (s.of_sensors) magnitudes = {1}, hovers = {1};
  s.detectable = io::median(magnitudes);
  s.low = *std::ranges::min_element(magnitudes);
  s.high = *std::ranges::max_element(magnitudes);
  s.hover = std::min(io::median(hovers), kMaxHover);
  s.undetectable = !(s.detectable <= kMaxDetectable);
  return s;
}

std::string shows(const Detectable& s) {
  if (s.of_sensors) return "sensors alone";
  return std::string(kChannels[s.where.channel]) + ", " + kOrders[s.where.order];
}

}  // namespace

Beats beats_of(const flightlog::FlightLog& log, const std::vector<double>& beat_s) {
  const double beat = 1 / log.header.flapping_Hz, turn = 2 * std::numbers::pi / beat;
  const flightlog::ImuStream& imu = log.imu;
  const flightlog::Column* streams[] = {&imu.accel_x_m_s2, &imu.accel_y_m_s2, &imu.accel_z_m_s2,
                                        &imu.gyro_x_rad_s, &imu.gyro_y_rad_s, &imu.gyro_z_rad_s};
  constexpr std::ptrdiff_t kMinSamples = 9;
  Beats beats;
  for (const double start : beat_s) {
    const double late = log.header.imu.latency_s;
    const auto first = std::ranges::lower_bound(imu.t_s, start + late),
               last = std::ranges::lower_bound(imu.t_s, start + beat + late);
    beats.emplace_back();
    if (last - first < kMinSamples) continue;
    const auto from = first - imu.t_s.begin();
    Eigen::MatrixXd waves(last - first, 6), values(last - first, 6);
    for (Eigen::Index i = 0; i < waves.rows(); ++i) {
      const double t = imu.t_s[static_cast<std::size_t>(from + i)] - late - start;
      waves.row(i) << 1, std::cos(turn * t), std::sin(turn * t), std::cos(2 * turn * t), std::sin(2 * turn * t),
          t / beat - 0.5;
      for (Eigen::Index k = 0; k < 6; ++k) values(i, k) = (*streams[k])[static_cast<std::size_t>(from + i)];
    }
    const Eigen::MatrixXd fit = waves.colPivHouseholderQr().solve(values);
    std::array<double, 30>& of = beats.back().emplace();
    for (std::size_t k = 0; k < 6; ++k) {
      const auto c = fit.col(static_cast<Eigen::Index>(k));
      // gyros measure rates, whose slope and harmonics' derivatives are those of the angular acceleration
      const std::array<double, 5> row =
          k < 3 ? std::array{c[0], c[1], c[2], c[3], c[4]}
                : std::array{c[5] / beat, turn * c[2], -turn * c[1], 2 * turn * c[4], -2 * turn * c[3]};
      std::ranges::copy(row, of.begin() + static_cast<std::ptrdiff_t>(5 * k));
    }
  }
  return beats;
}

void Changed::add(const blind::Contrast& contrast, const Beats& of) {
  for (std::size_t b = 0; b < std::min(contrast.change.size(), of.size()); ++b)
    if (of[b] && std::ranges::all_of(contrast.change[b], [](double x) { return std::isfinite(x); })) {
      change.push_back(contrast.change[b]);
      signal.push_back(*of[b]);
    }
}

Shown shown(const Changed& d, double magnitude) {
  const std::size_t n = d.change.size();
  if (n == 0) return {};
  const double beats = static_cast<double>(n);
  double weight = 0;
  std::array<double, 2> waveform{};  // mean square of an axis: forces, angular accelerations
  for (const auto& s : d.signal)
    for (std::size_t c = 0; c < 6; ++c)
      for (std::size_t order = 0; order < 3; ++order) {
        const double p = power(s.data() + 5 * c, order) / beats;
        waveform[c / 3] += p / 3;
        if (c < 3 && order == 0) weight += p;
      }
  Shown most;
  std::vector<double> left(n);
  for (std::size_t c = 0; c < 6; ++c)
    for (std::size_t order = 0; order < 3; ++order) {
      const double reference = std::sqrt(order == 0 && c < 3 ? weight : waveform[c / 3]);
      if (!(reference > 0)) continue;
      // bounded least squares, column by column: signal, derivative, a constant for each coefficient
      const std::size_t from = 5 * c + (order == 0 ? 0 : 2 * order - 1), width = order == 0 ? 1 : 2;
      const double turn = 2 * std::numbers::pi * static_cast<double>(order) * d.flapping_Hz;
      const auto column = [&](std::size_t b, std::size_t k, std::size_t i) {
        const double* x = d.signal[b].data() + from;
        if (k == 0) return x[i];
        if (k == 1) return order == 0 ? 0 : i == 0 ? turn * x[1] : -turn * x[0];
        return k - 2 == i ? 1.0 : 0.0;
      };
      const std::array<double, 4> bound = {kParameterError, kLate_s, kConstant * reference, kConstant * reference};
      std::array<double, 4> at{};
      const auto rest = [&](std::size_t b, std::size_t i) {
        double r = magnitude * d.change[b][from + i];
        for (std::size_t k = 0; k < at.size(); ++k) r -= at[k] * column(b, k, i);
        return r;
      };
      for (int pass = 0; pass < 6; ++pass)
        for (std::size_t k = 0; k < 2 + width; ++k) {
          double along = 0, own = 0;
          for (std::size_t b = 0; b < n; ++b)
            for (std::size_t i = 0; i < width; ++i) {
              const double x = column(b, k, i);
              along += x * rest(b, i);
              own += x * x;
            }
          if (own > 0) at[k] = std::clamp(at[k] + along / own, -bound[k], bound[k]);
        }
      for (std::size_t b = 0; b < n; ++b) {
        left[b] = 0;
        for (std::size_t i = 0; i < width; ++i) left[b] += rest(b, i) * rest(b, i) / static_cast<double>(width);
      }
      std::ranges::sort(left, std::greater{});
      const std::size_t tenth = std::max<std::size_t>(1, n / 10);
      double sum = 0;
      for (std::size_t b = 0; b < tenth; ++b) sum += left[b];
      const double share = std::sqrt(sum / static_cast<double>(tenth)) / reference;
      if (share > most.share) most = {share, c, order};
    }
  return most;
}

double detectable_magnitude(const Changed& changed, double most) {
  if (!(shown(changed, most).share >= kShare)) return std::numeric_limits<double>::infinity();
  double low = 0, high = most;
  for (int i = 0; i < 24; ++i) {
    const double middle = (low + high) / 2;
    (shown(changed, middle).share >= kShare ? high : low) = middle;
  }
  return high;
}

Json run_detectability(const DetectabilityCommand& command) {
  const blind::Family& family = family_named(command.family);
  const std::vector<blind::FamilyEffect>& effects = family.effects();
  io::check_output(command.out);
  struct Robot {
    blind::Assignment rich, hover;
    std::vector<flightlog::FlightLog> logs;
    flightlog::FlightLog hover_log;
  };
  std::vector<Robot> robots;
  for (int i = 0; i < command.vehicles; ++i) {
    blind::Assignment a;
    a.vehicle_file = command.vehicle;
    a.own_parameters = true;
    FlownRobot flown = fly_drawn(family, a, command.seed + static_cast<std::uint64_t>(i));
    Robot r{flown.assignment, flown.assignment, {}, {}};
    for (blind::FamilyFlight& f : flown.flights) r.logs.push_back(std::move(f.log));
    r.hover.hover = true;
    r.hover_log = family.fly(r.hover, 0).log;
    robots.push_back(std::move(r));
  }
  std::vector<std::vector<Found>> found(effects.size(), std::vector<Found>(robots.size()));
  io::ProgressLine line("contrasts", 60);
  std::mutex mutex;
  double done = 0;
  io::parallel_for(effects.size() * robots.size(), command.threads, [&](std::size_t k) {
    const Robot& r = robots[k % robots.size()];
    const blind::FamilyEffect& effect = effects[k / robots.size()];
    Found& f = found[k / robots.size()][k % robots.size()];
    const auto add = [&](Changed& to, const blind::Assignment& a, std::size_t flight, const flightlog::FlightLog& log) {
      const blind::Contrast c = family.contrast(a, flight, effect.id, 1);
      to.flapping_Hz = log.header.flapping_Hz;
      to.add(c, beats_of(log, c.beat_s));
      return std::ranges::any_of(
          c.change, [](const auto& row) { return std::ranges::any_of(row, [](double x) { return x != 0; }); });
    };
    Changed rich, hover;
    bool acts = true;
    for (std::size_t n = 0; n < r.logs.size() && acts; ++n) acts = add(rich, r.rich, n, r.logs[n]) || n > 0;
    f.rich = detectable_magnitude(rich, kMaxDetectable);
    f.where = shown(rich, 1);
    f.hover = f.rich;
    if (std::ranges::all_of(effect.regimes,
                            [](const std::string& w) { return std::ranges::count(kOfFlight, w) > 0; }) &&
        acts) {
      add(hover, r.hover, 0, r.hover_log);
      f.hover = detectable_magnitude(hover, kMaxHover);
    }
    const std::scoped_lock lock(mutex);
    line.show(++done / static_cast<double>(effects.size() * robots.size()));
  });
  line.clear();

  std::string text = "# How large the effects of family " + command.family +
                     " have to be (docs/reference/benchmark.md), in its own unit: 1 is typical. Written by\n"
                     "#   flappy-blind detectability --family " +
                     command.family + " --vehicle " + command.vehicle + " --vehicles " +
                     std::to_string(command.vehicles) + " --seed " + std::to_string(command.seed) + " --out " +
                     command.out + "\n# commit " + io::commit() +
                     "\n#\n"
                     "# detectable    an effect of this magnitude changes a channel's mean or harmonic by " +
                     three_digits(100 * kShare) +
                     " % beyond what parameters and lateness take over\n"
                     "#               (src/lab/benchmark/detectability.hpp); median of robots; 1 where it acts on "
                     "sensors alone\n"
                     "# undetectable  that is beyond 2\n"
                     "# hover         the same of calm hover, 1000 for never\n"
                     "schema = 1\n";
  std::printf("%-30s %10s %17s %8s  %s\n", "effect", "detectable", "least, most", "hover", "shows in");
  Json all = Json::object();
  for (std::size_t e = 0; e < effects.size(); ++e) {
    const Detectable s = detectable_of(effects[e], found[e]);
    std::printf("%-30s %10.3g %8.3g %8.3g %8.3g  %s%s\n", effects[e].id.c_str(), s.detectable, s.low, s.high, s.hover,
                shows(s).c_str(), s.undetectable ? "; undetectable" : "");
    text += "\n[" + effects[e].id + "]\n";
    if (!s.undetectable) text += "detectable = " + three_digits(s.detectable) + "\n";
    text += std::string("undetectable = ") + (s.undetectable ? "true" : "false") +
            "\nhover = " + three_digits(s.hover) + "\n";
    all[effects[e].id] = {{"detectable", s.undetectable ? Json(nullptr) : Json(s.detectable)},
                          {"undetectable", s.undetectable},
                          {"hover", s.hover},
                          {"shows", shows(s)}};
  }
  io::write_atomically(command.out, text);
  return {{"family", command.family}, {"vehicles", robots.size()}, {"effects", all}};
}

}  // namespace flappy::benchmark
