#include "deploy/flown/flown.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "deploy/flown/replay.hpp"
#include "io/files.hpp"
#include "io/statistics.hpp"

namespace flappy::deploy {
namespace {

using Parameters = std::vector<double>;
using Volts = std::vector<std::array<double, 2>>;

/// Share of commands within tolerance from which the log is explained: a few may fall on the edge of a period.
constexpr double kExplained = 0.98;
/// So many commands in a row have to differ.
constexpr std::size_t kInARow = 3;
/// How far beyond the first difference candidates are replayed at first, s.
constexpr double kWindow_s = 0.2;
/// Tolerance over the effect of digits that the log has lost, which is estimated from two replays.
constexpr double kMargin = 4;
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

/// Numbers from 0 to 1, always the same.
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
  for (auto& s : log.imu)
    for (std::size_t k = 0; k < 3; ++k) {
      s.rate_rad_s[k] += log.rate_step_rad_s * dither.next();
      s.force_m_s2[k] += log.force_step_m_s2 * dither.next();
    }
  for (auto& s : log.poses) {
    for (double& x : s.position_m) x += log.position_step_m * dither.next();
    for (double& x : s.attitude) x += log.attitude_step * dither.next();
  }
  return log;
}

/// The log with every second sample of the IMU.
OnboardLog thinned(OnboardLog log) {
  std::vector<OnboardLog::Imu> half;
  for (std::size_t i = 1; i < log.imu.size(); i += 2) half.push_back(log.imu[i]);
  log.imu = std::move(half);
  return log;
}

class Search {
 public:
  using Library = std::function<const ExportedC&(Build)>;
  Search(const Contract& contract, const std::vector<Mistake>& mistakes, const OnboardLog& log, Library library)
      : contract_(contract), mistakes_(mistakes), log_(log), library_(std::move(library)) {
    find_tolerances();
  }

  Flown run() {
    const Volts exported = volts({}, kForever);
    Flown flown;
    flown.share = share(exported);
    flown.tolerance_V = io::median(tolerance_);
    const std::size_t first = first_difference(exported);
    flown.from_s = first < log_.commands.size() ? log_.commands[first].t_s : 0;
    flown.as_exported = flown.share >= kExplained && first == log_.commands.size();
    if (flown.as_exported) return flown;
    if (flown.share >= 0.9995) {
      flown.as_exported = true;
      return flown;
    }
    Candidate best = one_mistake(flown.from_s);
    if (share(volts(best.wiring(), kForever)) < kExplained) {
      const Candidate two = two_mistakes(flown.from_s);
      if (two.parts.size() > 1) best = two;
    }
    flown.explained = share(volts(best.wiring(), kForever));
    if (flown.explained >= kExplained) {
      for (const auto& [mistake, p] : best.parts)
        flown.mistakes.push_back({mistake->stage, mistake->id, mistake->said(p)});
      return flown;
    }
    explain_nothing(exported, flown);
    return flown;
  }

 private:
  static constexpr double kForever = std::numeric_limits<double>::infinity();

  Volts volts(const Wiring& w, double until_s) const {
    return replay(library_(w.build), contract_, log_, w, until_s).volts;
  }

  void find_tolerances() {
    const Volts as_logged = volts({}, kForever);
    std::vector<double> moved(as_logged.size(), 0);
    const auto add = [&](const OnboardLog& other, double margin) {
      const Volts v = replay(library_(Build::exact), contract_, other, {}).volts;
      for (std::size_t i = 0; i < v.size(); ++i)
        moved[i] += margin * std::max(std::abs(v[i][0] - as_logged[i][0]), std::abs(v[i][1] - as_logged[i][1]));
    };
    if (log_.rate_step_rad_s + log_.force_step_m_s2 + log_.position_step_m + log_.attitude_step > 0)
      add(dithered(log_), kMargin);
    if (!log_.imu.empty() && contract_.imu_Hz > 0) {
      const double rate = static_cast<double>(log_.imu.size() - 1) /
                          std::max(log_.imu.back().arrived_s - log_.imu.front().arrived_s, 1e-9);
      if (rate < 0.75 * contract_.imu_Hz) add(thinned(log_), kMargin);
    }
    tolerance_.resize(log_.commands.size());
    for (std::size_t begin = 0, end = 0; begin < tolerance_.size(); begin = end) {
      while (end < tolerance_.size() && log_.commands[end].t_s < log_.commands[begin].t_s + kBlock_s) ++end;
      const double most = *std::max_element(moved.begin() + static_cast<std::ptrdiff_t>(begin),
                                            moved.begin() + static_cast<std::ptrdiff_t>(end));
      for (std::size_t i = begin; i < end; ++i) {
        const double size = std::max(std::abs(log_.commands[i].left_V), std::abs(log_.commands[i].right_V));
        tolerance_[i] = most + log_.voltage_step_V + 1e-5 + 4e-7 * size;
      }
    }
  }

  double difference(const Volts& v, std::size_t i) const {
    return std::max(std::abs(v[i][0] - log_.commands[i].left_V), std::abs(v[i][1] - log_.commands[i].right_V));
  }
  double share(const Volts& v) const {
    if (v.empty()) return 0;
    std::size_t within = 0;
    for (std::size_t i = 0; i < v.size(); ++i) within += difference(v, i) <= tolerance_[i];
    return static_cast<double>(within) / static_cast<double>(v.size());
  }
  double loss(const Volts& v) const {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i) {
      const double d = difference(v, i) / tolerance_[i];
      sum += std::isfinite(d) ? std::log1p(d * d) : 100;
    }
    return v.empty() ? 100 : sum / static_cast<double>(v.size());
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

  /// The loss with a candidate's mistakes, its last one with the best parameters.
  void fit(Candidate& c, double until_s, double from_s, bool thorough) const {
    const auto loss_at = [&](const Parameters& p) {
      c.parts.back().second = p;
      return loss(volts(c.wiring(), until_s));
    };
    const Mistake& last = *c.parts.back().first;
    std::vector<Parameters> starts = last.starts;
    if (starts.empty()) {
      c.loss = loss_at({});
      return;
    }
    if (last.id == "handed_back_early" && log_.begin_s) starts.push_back({from_s - *log_.begin_s});
    Parameters best;
    c.loss = kForever;
    for (const Parameters& p : starts)
      if (const double l = loss_at(p); l < c.loss) c.loss = l, best = p;
    c.parts.back().second = best;
    if (!thorough) return;
    // a pattern search with shrinking steps
    std::vector<double> steps = last.scales;
    for (double shrunk = 1; shrunk > 1e-7;) {
      bool better = false;
      for (std::size_t k = 0; k < best.size(); ++k)
        for (const double sign : {1.0, -1.0}) {
          Parameters p = best;
          p[k] += sign * steps[k] * shrunk;
          if (const double l = loss_at(p); l < c.loss) {
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
      fit(c, until_s, from_s, false);
      list.push_back(std::move(c));
    }
    std::ranges::stable_sort(list, {}, &Candidate::loss);
    return list;
  }

  /// Fits the best of a list to the whole flight.
  Candidate best_of(std::vector<Candidate> list, std::size_t count, double from_s) const {
    list.resize(std::min(count, list.size()));
    for (Candidate& c : list) fit(c, kForever, from_s, true);
    std::ranges::stable_sort(list, {}, &Candidate::loss);
    return list.front();
  }

  Candidate one_mistake(double from_s) {
    singles_ = ranked({}, from_s, from_s + kWindow_s);
    return best_of(singles_, 5, from_s);
  }

  /// The most promising mistakes, each with a second one for what it leaves.
  Candidate two_mistakes(double) const {
    Candidate best;
    best.loss = kForever;
    for (std::size_t i = 0; i < std::min<std::size_t>(5, singles_.size()); ++i) {
      const std::size_t next = first_difference(volts(singles_[i].wiring(), kForever));
      if (next == log_.commands.size()) continue;
      const double from_s = log_.commands[next].t_s;
      const Candidate c = best_of(ranked(singles_[i].parts, from_s, from_s + kWindow_s), 3, from_s);
      if (c.loss < best.loss) best = c;
    }
    return best;
  }

  /// What differs where no mistake explains it.
  void explain_nothing(const Volts& exported, Flown& flown) const {
    if (!log_.begin_s || flown.from_s < *log_.begin_s - 1e-6) {
      flown.unexplained = "the estimate or the controller, before the policy acts";
      return;
    }
    const double end_s = log_.hand_back_s.value_or(kForever);
    std::size_t outside = 0, differ = 0;
    for (std::size_t i = 0; i < exported.size(); ++i) {
      if (log_.commands[i].t_s > *log_.begin_s - 1e-6 && log_.commands[i].t_s < end_s) continue;
      ++outside;
      differ += difference(exported, i) > tolerance_[i];
    }
    if (static_cast<double>(differ) <= (1 - kExplained) * static_cast<double>(outside)) {
      flown.mistakes = {{Stage::software, "another_policy", "another policy flies"}};
      return;
    }
    flown.unexplained = "observation or action, from the policy's begin on";
  }

  const Contract& contract_;
  const std::vector<Mistake>& mistakes_;
  const OnboardLog& log_;
  const Library library_;
  std::vector<double> tolerance_;  ///< [command], V
  std::vector<Candidate> singles_;
};

}  // namespace

FlownCheck::FlownCheck(const std::filesystem::path& folder)
    : folder_(folder),
      contract_(read_contract(folder)),
      has_int8_(std::filesystem::exists(folder / "flappy_policy_int8.h")),
      mistakes_(mistakes_of(contract_, library(Build::exact), has_int8_)) {}

const ExportedC& FlownCheck::library(Build build) const {
  auto& found = libraries_[build];
  if (!found) found = std::make_unique<const ExportedC>(folder_, build);
  return *found;
}

Flown FlownCheck::check(const OnboardLog& log) const {
  return Search(contract_, mistakes_, log, [this](Build b) -> const ExportedC& { return library(b); }).run();
}

}  // namespace flappy::deploy
