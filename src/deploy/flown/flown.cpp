#include "deploy/flown/flown.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "deploy/flown/replay_flown.hpp"
#include "io/files.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"

namespace flappy::deploy {
namespace {

using Parameters = std::vector<double>;
using Volts = std::vector<std::array<double, 2>>;

/// kExplained: least share of commands within tolerance if no three in a row differ. kNearlyAll: least share otherwise.
constexpr double kExplained = 0.98, kNearlyAll = 0.9995;
/// On a log that lost samples, a mistake counts only if it leaves at most this share of the mean square.
constexpr double kMuch = 0.6;
/// So many commands in a row have to differ.
constexpr std::size_t kInARow = 3;
/// How far beyond the first difference candidates are replayed at first, s.
constexpr double kWindow_s = 0.2;
/// Tolerance over the effect of digits that the log has lost, which is estimated from two replays.
constexpr double kMargin = 4;
constexpr double kStamp_s = 1e-6;  ///< by which firmware may round a stamp
constexpr double kBlock_s = 0.02;  ///< for which tolerances are the same

/// A mistake with its parameters, or several.
struct Candidate {
  std::vector<std::pair<const Mistake*, Parameters>> parts;
  double loss = 0;
  Wiring wiring() const {
    Wiring w;
    for (const auto& [mistake, p] : parts) mistake->make(w, p);
    return w;
  }
};

/// A fixed sequence of numbers from -0.5 to 0.5.
class Dither {
 public:
  double next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state_ >> 11) * 0x1p-53 - 0.5;
  }

 private:
  std::uint64_t state_ = 1;
};

/// The log with values moved at random within what its digits leave open.
OnboardLog dithered(OnboardLog log) {
  Dither dither;
  for (auto& s : log.imu) {
    s.arrived_s += log.time_noise_s * dither.next();
    for (std::size_t k = 0; k < 3; ++k) {
      s.rate_rad_s[k] += log.rate_step_rad_s * dither.next();
      s.force_m_s2[k] += log.force_step_m_s2 * dither.next();
    }
  }
  for (auto& s : log.poses) {
    s.arrived_s += log.time_noise_s * dither.next();
    for (double& x : s.position_m) x += log.position_step_m * dither.next();
    for (double& x : s.attitude) x += log.attitude_step * dither.next();
  }
  return log;
}

/// The log has every n-th IMU sample; returns n.
std::size_t thinning(const OnboardLog& log, const Contract& contract) {
  const double had_Hz = log.imu_Hz > 0 ? log.imu_Hz : contract.imu_Hz;
  if (log.imu.size() < 2) return 1;
  const double lasts_s = log.imu.back().arrived_s - log.imu.front().arrived_s;
  return static_cast<std::size_t>(
      std::max(1L, std::lround(had_Hz * lasts_s / static_cast<double>(log.imu.size() - 1))));
}

/// The log with `every` samples of the IMU in place of one, by cubics through four neighbours.
OnboardLog filled(OnboardLog log, std::size_t every) {
  const std::vector<OnboardLog::Imu> had = std::move(log.imu);
  log.imu.clear();
  for (std::size_t i = 0; i < had.size(); ++i) {
    log.imu.push_back(had[i]);
    if (i + 1 == had.size()) break;
    const OnboardLog::Imu &before = had[i > 0 ? i - 1 : 0], &here = had[i], &next = had[i + 1],
                          &after = had[std::min(i + 2, had.size() - 1)];
    for (std::size_t k = 1; k < every; ++k) {
      const double f = static_cast<double>(k) / static_cast<double>(every);
      const std::array<double, 4> w = {-f * (f - 1) * (f - 2) / 6, (f + 1) * (f - 1) * (f - 2) / 2,
                                       -(f + 1) * f * (f - 2) / 2, (f + 1) * f * (f - 1) / 6};
      const auto at = [&](const std::array<double, 3> OnboardLog::Imu::*x) {
        std::array<double, 3> v{};
        for (std::size_t j = 0; j < 3; ++j)
          v[j] = w[0] * (before.*x)[j] + w[1] * (here.*x)[j] + w[2] * (next.*x)[j] + w[3] * (after.*x)[j];
        return v;
      };
      log.imu.push_back({(1 - f) * here.arrived_s + f * next.arrived_s, at(&OnboardLog::Imu::rate_rad_s),
                         at(&OnboardLog::Imu::force_m_s2)});
    }
  }
  return log;
}

/// Drops every second logged IMU sample and interpolates it.
OnboardLog thinned(OnboardLog log, std::size_t every) {
  std::vector<OnboardLog::Imu> half;
  for (std::size_t i = every; i < log.imu.size(); i += 2 * every) half.push_back(log.imu[i]);
  log.imu = std::move(half);
  return filled(std::move(log), 2 * every);
}

class Search {
 public:
  using Library = std::function<const ExportedC&(Build)>;
  Search(const Contract& contract, const std::vector<Mistake>& mistakes, const OnboardLog& log, Library library)
      : contract_(contract),
        mistakes_(mistakes),
        library_(std::move(library)),
        thinning_(thinning(log, contract)),
        log_(filled(log, thinning_)),
        exported_(played({}, kForever)),
        tolerance_(tolerances({}, exported_.volts)),
        policy_tolerance_(policy_tolerances()) {}

  /// `quick`: without looking for mistakes.
  Flown run(bool quick) {
    const Volts& exported = exported_.volts;
    Flown flown;
    flown.share = share(exported, tolerance_);
    flown.tolerance_V = io::median(tolerance_);
    flown.mode = *log_.mode;
    flown.begin_s = log_.begin_s;
    std::size_t first = first_difference(exported);
    flown.as_exported = (flown.share >= kExplained && first == log_.commands.size()) || flown.share >= kNearlyAll;
    if (flown.as_exported) return flown;
    for (std::size_t i = 0; first == log_.commands.size() && i < exported.size(); ++i)
      if (!(difference(exported, i) <= tolerance_[i])) first = i;
    flown.from_s = log_.commands[std::min(first, log_.commands.size() - 1)].t_s;
    if (quick) return flown;
    Candidate best = one_mistake(flown.from_s);
    flown.explained = explained(best);
    if (flown.explained < kExplained) {
      const Candidate two = two_mistakes();
      if (const double both = explained(two); both > flown.explained) best = two, flown.explained = both;
    }
    if (flown.explained >= kExplained) {
      for (const auto& [mistake, p] : best.parts)
        flown.mistakes.push_back({mistake->stage, mistake->id, mistake->said(p)});
      return flown;
    }
    explain_nothing(flown);
    return flown;
  }

 private:
  static constexpr double kForever = std::numeric_limits<double>::infinity(), kLost = 100;

  Replay played(const Wiring& w, double until_s) const {
    return replay(library_(w.build), contract_, log_, w, until_s);
  }
  Volts volts(const Wiring& w, double until_s) const { return played(w, until_s).volts; }

  /// By how much commands may differ under a wiring, for what the log has lost. [command], V. `as_logged`: the wiring's
  /// replay of the log as it is.
  std::vector<double> tolerances(const Wiring& w, const Volts& as_logged) const {
    const auto differences = [&](const OnboardLog& other) {
      const Volts v = replay(library_(w.build), contract_, other, w).volts;
      std::vector<double> list(v.size());
      for (std::size_t i = 0; i < v.size(); ++i)
        list[i] = std::max(std::abs(v[i][0] - as_logged[i][0]), std::abs(v[i][1] - as_logged[i][1]));
      return list;
    };
    // firmware may round times to microseconds in another way
    OnboardLog sooner = log_;
    sooner.imu_latency_s += kStamp_s;
    sooner.pose_latency_s += kStamp_s;
    std::vector<double> moved = differences(sooner);
    if (log_.time_noise_s + log_.rate_step_rad_s + log_.force_step_m_s2 + log_.position_step_m + log_.attitude_step >
        0) {
      const std::vector<double> digits = differences(dithered(log_));
      for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += kMargin * digits[i];
    }
    if (thinning_ > 1) {
      // The lost samples changed the commands as much as losing half of the rest does. Their noise does not vary in time.
      double sum = 0;
      for (const double d : differences(thinned(log_, thinning_))) sum += d * d;
      const double rms = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, moved.size())));
      for (double& m : moved) m += kMargin * rms;
    }
    std::vector<double> list(log_.commands.size());
    for (std::size_t begin = 0, end = 0; begin < list.size(); begin = end) {
      while (end < list.size() && log_.commands[end].t_s < log_.commands[begin].t_s + kBlock_s) ++end;
      const double most = *std::max_element(moved.begin() + static_cast<std::ptrdiff_t>(begin),
                                            moved.begin() + static_cast<std::ptrdiff_t>(end));
      for (std::size_t i = begin; i < end; ++i) {
        const double size = std::max(std::abs(log_.commands[i].left_V), std::abs(log_.commands[i].right_V));
        list[i] = most + log_.voltage_step_V + 1e-5 + 4e-7 * size;
      }
    }
    return list;
  }

  double difference(const Volts& v, std::size_t i) const {
    return std::max(std::abs(v[i][0] - log_.commands[i].left_V), std::abs(v[i][1] - log_.commands[i].right_V));
  }
  double share(const Volts& v, const std::vector<double>& tolerance) const {
    if (v.empty()) return 0;
    std::size_t within = 0;
    for (std::size_t i = 0; i < v.size(); ++i) within += difference(v, i) <= tolerance[i];
    return static_cast<double>(within) / static_cast<double>(v.size());
  }
  /// Share of the commands that a candidate explains. Where samples were lost, it has to explain much of what differs.
  double explained(const Candidate& c) const {
    if (c.parts.empty()) return 0;
    const Wiring w = c.wiring();
    const Volts v = volts(w, kForever);
    if (thinning_ == 1) return share(v, tolerance_);
    return mean_square(v) > kMuch * mean_square(exported_.volts) ? 0 : share(v, tolerances(w, v));
  }
  double mean_square(const Volts& v) const {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i) sum += std::pow(difference(v, i), 2);
    return sum / static_cast<double>(std::max<std::size_t>(1, v.size()));
  }
  /// Loss of a number whose difference is `d` tolerances.
  static double loss_of(double d) { return std::isfinite(d) ? std::log1p(d * d) : kLost; }
  double loss(const Volts& v) const {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i) sum += loss_of(difference(v, i) / tolerance_[i]);
    return v.empty() ? kLost : sum / static_cast<double>(v.size());
  }
  /// Calls `take(row, number, difference over tolerance)` for each number of the policy that the log has.
  template <class Take>
  void compare_policy(const std::vector<OnboardLog::Inference>& is, Take&& take) const {
    std::size_t next = 0;
    for (std::size_t row = 0; row < log_.inferences.size(); ++row) {
      const OnboardLog::Inference& logged = log_.inferences[row];
      while (next < is.size() && is[next].t_s < logged.t_s - contract_.policy_s / 2) ++next;
      if (next == is.size()) return;
      if (is[next].t_s > logged.t_s + contract_.policy_s / 2) continue;
      for (std::size_t k = 0; k < logged.numbers.size(); ++k)
        take(row, k, std::abs(is[next].numbers[k] - logged.numbers[k]) / policy_tolerance_[k]);
    }
  }
  double policy_loss(const std::vector<OnboardLog::Inference>& is) const {
    double sum = 0, count = 0;
    compare_policy(is, [&](std::size_t, std::size_t, double d) {
      sum += loss_of(d);
      ++count;
    });
    return count > 0 ? sum / count : 0;
  }
  /// [number of the policy] what the log has lost may change it by.
  std::vector<double> policy_tolerances() const {
    std::vector<double> list;
    const std::size_t seen = contract_.observation.size();
    for (std::size_t k = 0; k < log_.policy_numbers.size(); ++k) {
      const std::size_t i = log_.policy_numbers[k];
      const Contract::Signal& s = i < seen ? contract_.observation[i] : contract_.action[i - seen];
      list.push_back(log_.policy_steps[k] + 1e-5 * (s.high - s.low));
    }
    if (list.empty()) return list;
    const std::vector<OnboardLog::Inference>& as_logged = exported_.inferences;
    const auto add = [&](const OnboardLog& other) {
      const auto moved = replay(library_(Build::exact), contract_, other, {}).inferences;
      for (std::size_t k = 0; k < list.size(); ++k) {
        double sum = 0;
        for (std::size_t i = 0; i < std::min(moved.size(), as_logged.size()); ++i)
          sum += std::pow(moved[i].numbers[k] - as_logged[i].numbers[k], 2);
        list[k] += kMargin * std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, moved.size())));
      }
    };
    add(dithered(log_));
    if (thinning_ > 1) add(thinned(log_, thinning_));
    return list;
  }

  /// First of several commands in a row that differ; the number of all: none does.
  std::size_t first_difference(const Volts& v) const {
    std::size_t row = 0;
    for (std::size_t i = 0; i < v.size(); ++i) {
      row = difference(v, i) <= tolerance_[i] ? 0 : row + 1;
      if (row == kInARow) return i + 1 - row;
    }
    return log_.commands.size();
  }

  double loss_with(Candidate& c, const Parameters& p, double until_s) const {
    c.parts.back().second = p;
    const Replay r = played(c.wiring(), until_s);
    return loss(r.volts) + policy_loss(r.inferences);
  }

  /// Moves the parameters of a candidate's last mistake by Levenberg and Marquardt's method, which needs smooth ones.
  void descend(Candidate& c, double until_s, int iterations) const {
    const Parameters from = c.parts.back().second;
    const auto count = static_cast<Eigen::Index>(from.size());
    const Eigen::Map<const Eigen::ArrayXd> scales(c.parts.back().first->scales.data(), count);
    const auto parameters = [&](const Eigen::VectorXd& x) {
      Parameters p(from.size());
      Eigen::Map<Eigen::ArrayXd>(p.data(), count) = x.array() * scales;
      return p;
    };
    const auto residual = [&](const Eigen::VectorXd& x) {
      Candidate there = c;
      there.parts.back().second = parameters(x);
      const Volts v = volts(there.wiring(), until_s);
      Eigen::VectorXd r(2 * static_cast<Eigen::Index>(v.size()));
      for (std::size_t i = 0; i < v.size(); ++i) {
        r[2 * static_cast<Eigen::Index>(i)] = v[i][0] - log_.commands[i].left_V;
        r[2 * static_cast<Eigen::Index>(i) + 1] = v[i][1] - log_.commands[i].right_V;
      }
      return r;
    };
    Eigen::VectorXd x = Eigen::Map<const Eigen::ArrayXd>(from.data(), count) / scales;
    Eigen::VectorXd r = residual(x);
    double damping = 1e-3;
    for (int iteration = 0; iteration < iterations && r.allFinite(); ++iteration) {
      constexpr double kStep = 1e-3;  // smaller steps would show the rounding of the C's floats
      Eigen::MatrixXd slopes(r.size(), count);
      for (Eigen::Index k = 0; k < count; ++k) {
        Eigen::VectorXd there = x;
        there[k] += kStep;
        slopes.col(k) = (residual(there) - r) / kStep;
      }
      if (!slopes.allFinite() || slopes.isZero()) break;
      Eigen::MatrixXd normal = slopes.transpose() * slopes;
      normal.diagonal() *= 1 + damping;
      normal.diagonal().array() += 1e-12;
      const Eigen::VectorXd next = x - normal.ldlt().solve(slopes.transpose() * r);
      const Eigen::VectorXd left = residual(next);
      if (left.allFinite() && left.squaredNorm() < r.squaredNorm()) {
        x = next, r = left, damping /= 10;
      } else {
        damping *= 100;
      }
    }
    if (const double l = loss_with(c, parameters(x), until_s); l < c.loss) c.loss = l;
    else c.parts.back().second = from;
  }

  /// Begins a candidate's last mistake with its best parameters among the starts.
  void begin(Candidate& c, double until_s, double from_s) const {
    const Mistake& last = *c.parts.back().first;
    std::vector<Parameters> starts = last.starts;
    if (starts.empty()) starts.emplace_back();
    if (last.id == "handed_back_early" && log_.begin_s) starts.push_back({from_s - *log_.begin_s});
    std::vector<std::pair<double, Parameters>> tried;
    for (const Parameters& p : starts) tried.emplace_back(loss_with(c, p, until_s), p);
    std::ranges::stable_sort(tried, {}, [](const auto& t) { return t.first; });
    Candidate best = c;
    best.loss = kForever;
    // one parameter is ranked by its starts well enough
    const std::size_t refined = tried.front().second.size() > 1 ? std::min<std::size_t>(3, tried.size()) : 1;
    for (std::size_t i = 0; i < refined; ++i) {
      c.loss = tried[i].first;
      c.parts.back().second = tried[i].second;
      if (tried[i].second.size() > 1) descend(c, until_s, 8);
      if (c.loss < best.loss) best = c;
    }
    c = best;
  }

  /// The best parameters of a candidate's last mistake over the whole flight.
  void refine(Candidate& c) const {
    c.loss = loss_with(c, Parameters(c.parts.back().second), kForever);
    if (c.parts.back().second.empty()) return;
    descend(c, kForever, 8);
    constexpr double kGood = 0.05;
    if (c.loss < kGood) return;
    // a pattern search with shrinking steps, for parameters that act by jumps
    Parameters best = c.parts.back().second;
    const std::vector<double>& steps = c.parts.back().first->scales;
    for (double shrunk = 1; shrunk > 1e-7;) {
      bool better = false;
      for (std::size_t k = 0; k < best.size(); ++k)
        for (const double sign : {1.0, -1.0}) {
          Parameters p = best;
          p[k] += sign * steps[k] * shrunk;
          if (const double l = loss_with(c, p, kForever); l < c.loss) {
            c.loss = l, best = p, better = true;
            break;
          }
        }
      if (!better) shrunk /= 2;
    }
    c.parts.back().second = best;
  }

  std::vector<Candidate> ranked(const std::vector<std::pair<const Mistake*, Parameters>>& given, double from_s,
                                double until_s) const {
    std::vector<Candidate> list;
    for (const Mistake& m : mistakes_) {
      if (std::ranges::any_of(given, [&](const auto& part) { return part.first == &m; })) continue;
      Candidate c{given};
      c.parts.emplace_back(&m, Parameters());
      begin(c, until_s, from_s);
      list.push_back(std::move(c));
    }
    std::ranges::stable_sort(list, {}, &Candidate::loss);
    return list;
  }

  /// Fits the best of a list to the whole flight.
  Candidate best_of(std::vector<Candidate> list, std::size_t count) const {
    list.resize(std::min(count, list.size()));
    for (Candidate& c : list) refine(c);
    std::ranges::stable_sort(list, {}, &Candidate::loss);
    return list.front();
  }

  Candidate one_mistake(double from_s) {
    singles_ = ranked({}, from_s, from_s + kWindow_s);
    return best_of(singles_, 5);
  }

  /// The most promising mistakes, each with a second one for what it leaves.
  Candidate two_mistakes() const {
    Candidate best;
    best.loss = kForever;
    for (std::size_t i = 0; i < std::min<std::size_t>(5, singles_.size()); ++i) {
      const std::size_t next = first_difference(volts(singles_[i].wiring(), kForever));
      if (next == log_.commands.size()) continue;
      const double from_s = log_.commands[next].t_s;
      const Candidate c = best_of(ranked(singles_[i].parts, from_s, from_s + kWindow_s), 3);
      if (c.loss < best.loss) best = c;
    }
    return best;
  }

  /// Says which part of the software differs, after no mistake has explained it.
  void explain_nothing(Flown& flown) const {
    const Volts& exported = exported_.volts;
    flown.explained = 0;
    if (!log_.begin_s || flown.from_s < *log_.begin_s - 1e-6) {
      flown.unexplained = log_.begin_s ? "the estimate or the controller, before the policy acts"
                                       : "the estimate, the controller, or a policy that began at an unknown time";
      return;
    }
    flown.unexplained = first_observation_that_differs();
    if (!flown.unexplained.empty()) return;
    const double end_s = log_.hand_back_s.value_or(kForever);
    constexpr std::size_t kEnough = 25;
    std::size_t outside = 0, differ = 0;
    for (std::size_t i = 0; i < exported.size(); ++i) {
      if (log_.commands[i].t_s > *log_.begin_s - 1e-6 && log_.commands[i].t_s < end_s) continue;
      ++outside;
      differ += difference(exported, i) > tolerance_[i];
    }
    if (outside >= kEnough && static_cast<double>(differ) <= (1 - kExplained) * static_cast<double>(outside)) {
      flown.mistakes = {{Stage::software, "another_policy", "another policy flies"}};
      return;
    }
    flown.unexplained = "observation or action, from the policy's begin on";
  }

  /// Names the first logged number of the observation that differs from the replay's; empty if none does.
  std::string first_observation_that_differs() const {
    std::size_t row = log_.inferences.size(), number = 0;
    compare_policy(exported_.inferences, [&](std::size_t at, std::size_t k, double d) {
      if (d <= 1 || log_.policy_numbers[k] >= contract_.observation.size() || at > row) return;
      if (at < row || log_.policy_numbers[k] < log_.policy_numbers[number]) row = at, number = k;
    });
    if (row == log_.inferences.size()) return "";
    return "the observation's " + contract_.observation[log_.policy_numbers[number]].name +
           io::format(", from %.3f s on", log_.inferences[row].t_s);
  }

  const Contract& contract_;
  const std::vector<Mistake>& mistakes_;
  const Library library_;
  const std::size_t thinning_;
  const OnboardLog log_;
  const Replay exported_;                ///< without a mistake
  const std::vector<double> tolerance_;  ///< as exported
  const std::vector<double> policy_tolerance_;
  std::vector<Candidate> singles_;
};

}  // namespace

FlownCheck::FlownCheck(const std::filesystem::path& folder)
    : folder_(folder),
      contract_(read_contract(folder)),
      has_int8_(std::filesystem::exists(folder / "flappy_policy_int8.h")),
      mistakes_(mistakes_of(contract_, library(Build::exact), has_int8_)) {
  const auto require = [&](const char* header, std::uint32_t crc, std::uint32_t is) {
    if (is != crc)
      throw io::InputError((folder / "contract.json").string() + ": is of a " + header + " with CRC " +
                           std::to_string(crc) + ", and that beside it has " + std::to_string(is) +
                           "; accepted: all files of one flappy-export");
  };
  require("flappy_policy.h", contract_.policy_crc32, library(Build::exact).policy_crc32());
  require("flappy_controller.h", contract_.controller_crc32, library(Build::exact).controller_crc32());
}

const ExportedC& FlownCheck::library(Build build) const {
  if (build == Build::contracted && no_clang_) return library(Build::exact);
  auto& found = libraries_[build];
  if (found) return *found;
  try {
    found = std::make_unique<const ExportedC>(folder_, build);
  } catch (const io::InputError&) {
    if (build != Build::contracted) throw;
    no_clang_ = true;
    return library(Build::exact);
  }
  return *found;
}

Flown FlownCheck::check(const OnboardLog& log) const {
  std::vector<OnboardLog> logs;
  for (const auto mode : {OnboardLog::Mode::task, OnboardLog::Mode::hover, OnboardLog::Mode::stay}) {
    if (log.mode && log.mode != mode) continue;
    logs.push_back(log);
    logs.back().mode = mode;
  }
  const auto run = [&](const OnboardLog& one, bool quick) {
    return Search(contract_, mistakes_, one, [this](Build b) -> const ExportedC& { return library(b); }).run(quick);
  };
  for (OnboardLog& one : logs) {
    if (log.mode && log.begin_s) break;
    Flown flown = run(one, true);
    if (flown.as_exported) return flown;
    if (log.begin_s) continue;
    // a policy whose begin is not known began shortly before the first command that differs, if commands after it agree
    constexpr int kTried = 20;
    const double first_s = flown.from_s;
    const double ticks = std::floor((first_s - one.start_s) / contract_.control_s + 1e-6);
    for (int k = 0; k < kTried && k <= ticks; ++k) {
      OnboardLog begun = one;
      begun.begin_s = one.start_s + (ticks - k) * contract_.control_s;
      Flown other = run(begun, true);
      if (other.as_exported) return other;
      if (other.from_s < flown.from_s + kWindow_s) continue;
      flown = std::move(other);
      one = std::move(begun);
    }
  }
  const auto explained = [](const Flown& flown) { return flown.as_exported || flown.explained > 0; };
  Flown best = run(logs.front(), false);
  for (std::size_t i = 1; i < logs.size() && !explained(best); ++i)
    if (Flown flown = run(logs[i], false); explained(flown) || flown.from_s > best.from_s) best = std::move(flown);
  return best;
}

}  // namespace flappy::deploy
