#include "gap/answer/contrast_warnings.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::gap {
namespace {

/// Shorter sessions are warned of. Choice: the benchmark's shortest ones are 10 s long.
constexpr double kShortest_s = 9;
/// A regime is warned of if more than this share of the beats of the tests is beyond the references'. Choice.
constexpr double kMaxBeyond = 0.2;

double duration_s(const FlightList& flights) {
  double sum = 0;
  for (const auto& f : flights) sum += static_cast<double>(f->beats()) / f->beats_Hz();
  return sum;
}

/// A rate that import measured is never the same to the last digit.
bool same_sensors(const flightlog::FlightHeader& a, const flightlog::FlightHeader& b) {
  // Largest relative difference. Choice.
  constexpr double kSameRate = 0.01;
  const auto like = [](auto own, const auto& other) {
    if (std::abs(own.rate_hz - other.rate_hz) <= kSameRate * other.rate_hz) own.rate_hz = other.rate_hz;
    return own == other;
  };
  return like(a.imu, b.imu) && like(a.mocap, b.mocap);
}

struct Range {
  double low = 1e300, high = -1e300;
};

}  // namespace

void check_same_streams(const std::vector<flightlog::FlightLog>& logs, const std::vector<std::string>& folders,
                        std::size_t references) {
  const auto check = [&](const char* file, const std::function<bool(const flightlog::FlightLog&)>& has) {
    const auto first_test = logs.begin() + static_cast<std::ptrdiff_t>(references);
    const auto before = std::find_if(logs.begin(), first_test, has), after = std::find_if(first_test, logs.end(), has);
    const bool shown = before != first_test;
    if (shown == (after != logs.end())) return;
    throw io::InputError(folders[static_cast<std::size_t>((shown ? before : after) - logs.begin())] + ": has " + file +
                         ", but no " + (shown ? "flight" : "reference") +
                         " has it; accepted: both with the same streams, in some of the flights at least");
  };
  check("power.csv", [](const auto& log) { return log.power.has_value(); });
  check("wings.csv", [](const auto& log) { return log.wings.has_value(); });
  check("forces.csv", [](const auto& log) { return log.header.rig.has_value(); });
  check("imu.csv", [](const auto& log) { return log.header.imu.rate_hz > 0; });
}

std::vector<std::string> contrast_warnings(const std::vector<flightlog::FlightHeader>& headers,
                                           const Flights& flights) {
  std::vector<std::string> lines;
  const auto& [references, tests] = flights;
  const auto differs = [&](const auto& same) {
    return !std::ranges::all_of(headers, [&](const auto& h) { return same(h, headers.front()); });
  };
  if (differs([](const auto& a, const auto& b) { return a.vehicle_sha256 == b.vehicle_sha256; }))
    lines.push_back(
        "flights and reference name different vehicle files: if the robots are not the same, what differs "
        "between them is taken for a change");
  if (differs(same_sensors))
    lines.push_back("flights and reference declare different sensors: errors of the sensors do not cancel");
  for (const auto& [name, list] : {std::pair("reference lasts", references), std::pair("flights last", tests)})
    if (const double s = duration_s(list); s < kShortest_s)
      lines.push_back(
          io::format("the %s %.1f s: under 10 s, small changes stay hidden, and probabilities were not "
                     "tested",
                     name, s));
  std::set<std::string> sessions;
  for (const auto& f : references) sessions.insert(f->session());
  if (sessions.size() == 1 && references.size() > 1 && !tests.front()->is_averaged())
    lines.push_back(sessions.contains("")
                        ? "reference flights name no session, so each counts as one of its own: give those of one "
                          "battery or day the same session in flight.toml, or as one folder"
                        : "the reference is one session: how much sessions differ is taken from other robots, and "
                          "flights of two more sessions would make the answer surer");
  const std::vector<RegimeQuantity> quantities = tests.front()->regimes();
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    if (quantities[q].name == "time" || quantities[q].name == "heading")
      continue;  // a model's errors do not depend on it
    Range range;
    const auto values = [q](const auto& f) { return f->regimes()[q].values; };
    for (const auto& f : references)
      for (const double v : values(f)) range.low = std::min(range.low, v), range.high = std::max(range.high, v);
    double beyond = 0, all = 0;
    for (const auto& f : tests)
      for (const double v : values(f)) beyond += v < range.low || v > range.high ? 1 : 0, all += 1;
    if (beyond > kMaxBeyond * all)
      lines.push_back(io::format("%.0f %% of the flights have a %s that the reference never has (%.3g to %.3g%s): %s",
                                 100 * beyond / all, quantities[q].name.c_str(), range.low, range.high,
                                 quantities[q].unit.empty() ? "" : (" " + quantities[q].unit).c_str(),
                                 // the quantities of sessions are corrected for what depends on it, as a straight line
                                 tests.front()->is_averaged()
                                     ? "what the robot shows there is extrapolated from the reference"
                                     : "errors of the model do not cancel there"));
  }
  return lines;
}

}  // namespace flappy::gap
