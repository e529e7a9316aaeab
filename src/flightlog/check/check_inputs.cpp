// Checks of declared inputs: their meaning, though unknown, must be the same in a flight and in all flights of a robot.
#include <algorithm>
#include <cmath>

#include "flightlog/check/check_parts.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// Median, and the span between the 5 % and the 95 % quantile.
struct Level {
  double middle = 0, spread = 0;
};

Level level_of(const Column& values) {
  return {io::median(values), io::quantile(values, 0.95) - io::quantile(values, 0.05)};
}

struct Levels {
  Level all;
  std::vector<Level> parts;
};

constexpr std::size_t kParts = 10;

Levels levels_of(const Column& values) {
  Levels levels{level_of(values), {}};
  for (std::size_t k = 0; k < kParts; ++k) {
    const auto at = [&](std::size_t i) {
      return values.begin() + static_cast<std::ptrdiff_t>(values.size() * i / kParts);
    };
    if (at(k) < at(k + 1)) levels.parts.push_back(level_of(Column(at(k), at(k + 1))));
  }
  return levels;
}

/// Largest plausible ratios of a flight's level, a part's level, the spread. A robot of constant weight needs about the
/// same inputs in all flights; battery, wear, wind and manoeuvres change them somewhat, another unit changes them more.
/// Inputs about 0 have no level, and their spread depends on the manoeuvre: only another unit (57 from radians to
/// degrees, 1000 from metres to millimetres) is plausible beyond kOtherUnit.
constexpr double kOtherLevel = 1.5, kOtherPart = 2, kOtherSpread = 5, kOtherUnit = 30;

bool has_level(const Level& usual) { return std::abs(usual.middle) > usual.spread; }

double ratio(double value, double usual) { return usual != 0 ? value / usual : value != 0 ? INFINITY : 1; }

bool beyond(double value, double usual, double most) {
  const double r = ratio(value, usual);
  return !(r <= most && r >= 1 / most);
}

Level usual_of(const std::vector<Levels>& flights) {
  std::vector<double> middles, spreads;
  for (const Levels& l : flights) middles.push_back(l.all.middle), spreads.push_back(l.all.spread);
  return {io::median(middles), io::median(spreads)};
}

std::string check_of(const std::string& input) { return "input " + input; }

/// Describes how a flight deviates from the usual level of several flights; empty: it does not.
std::string oddity(const Levels& flight, const Level& usual) {
  const auto odd = [&](const char* where, double value, double expected) {
    return format("%s%.4g, %.4g usual in these flights (%.3g x): a column in another scale", where, value, expected,
                  ratio(value, expected));
  };
  if (!has_level(usual))
    return beyond(flight.all.spread, usual.spread, kOtherUnit) ? odd("varies by ", flight.all.spread, usual.spread)
                                                               : "";
  if (beyond(flight.all.middle, usual.middle, kOtherLevel))
    return odd("in the middle ", flight.all.middle, usual.middle);
  for (const Level& part : flight.parts)
    if (beyond(part.middle, usual.middle, kOtherPart)) return odd("in a part ", part.middle, usual.middle);
  return "";
}

/// Describes a scale that changes within a flight; empty: none. Tests only inputs that have a level in all parts.
std::string change_of_scale(const Levels& flight) {
  for (std::size_t k = 0; k < flight.parts.size(); ++k)
    if (!has_level(flight.parts[k])) return "";
  for (std::size_t k = 1; k < flight.parts.size(); ++k)
    if (const double to = flight.parts[k].middle, before = flight.parts[0].middle; beyond(to, before, kOtherSpread))
      return format("%.4g at first, %.4g in part %zu of %zu of the flight: its scale changes", before, to, k + 1,
                    kParts);
  return "";
}

/// Means over 0.2 s: faster changes of a controller's commands are noise.
Column slow(const Column& t_s, const Column& values) {
  constexpr double kSlow_s = 0.2;
  const double per_s = static_cast<double>(t_s.size() - 1) / (t_s.back() - t_s.front());
  const auto block = static_cast<std::size_t>(std::max(std::round(kSlow_s * per_s), 1.0));
  Column means;
  for (std::size_t i = 0; i + block <= values.size(); i += block) means.push_back(io::mean({values.data() + i, block}));
  return means;
}

double correlation(const Column& a, const Column& b) {
  const double a0 = io::mean(a), b0 = io::mean(b);
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    aa += (a[i] - a0) * (a[i] - a0), bb += (b[i] - b0) * (b[i] - b0), ab += (a[i] - a0) * (b[i] - b0);
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

/// Largest plausible difference of a correlation from the flights' median; manoeuvres change correlations less.
constexpr double kOtherCorrelation = 0.8;

Finding dead(const std::string& input, double value) {
  return {check_of(input), Verdict::warning, format("is %.4g all the time: not logged, or not used", value), {}};
}

}  // namespace

void check_inputs_apart(const FlightLog& log, Findings& findings) {
  for (std::size_t k = 0; k < log.header.inputs.size(); ++k) {
    const Column& values = log.command.declared[k];
    const std::string& name = log.header.inputs[k];
    const auto [low, high] = std::ranges::minmax(values);
    if (low == high) {
      findings.push_back(dead(name, low));
      continue;
    }
    const Levels levels = levels_of(values);
    if (has_level(levels.all))
      if (std::optional<Finding> dropped = dropped_readings(check_of(name), values)) {
        findings.push_back(*std::move(dropped));
        continue;
      }
    const std::string odd = change_of_scale(levels);
    const std::vector<std::pair<std::string, double>> figures = {{"middle", levels.all.middle},
                                                                 {"spread", levels.all.spread}};
    if (odd.empty())
      findings.push_back({check_of(name), Verdict::ok,
                          format("%.4g in the middle, %.4g to %.4g", levels.all.middle, low, high), figures});
    else findings.push_back({check_of(name), Verdict::warning, odd, figures, {kCommand}});
  }
}

void compare_inputs(const std::vector<const FlightLog*>& logs, const std::vector<Findings*>& findings) {
  const std::vector<std::string>& inputs = logs.front()->header.inputs;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    std::vector<Levels> flights;
    for (const FlightLog* log : logs) flights.push_back(levels_of(log->command.declared[k]));
    const Level usual = usual_of(flights);
    for (std::size_t i = 0; i < logs.size(); ++i) {
      Finding& own = *std::ranges::find(*findings[i], check_of(inputs[k]), &Finding::check);
      const std::string odd = oddity(flights[i], usual);
      // With only two flights it is unknown which one is right, so no fault is set.
      if (!odd.empty() && own.verdict == Verdict::ok)
        own = {own.check, Verdict::warning, odd, own.values, logs.size() > 2 ? LogPlace{kCommand} : LogPlace{}};
    }
  }
}

void compare_correlations(const std::vector<const FlightLog*>& logs, const std::vector<Findings*>& findings) {
  const std::vector<std::string>& inputs = logs.front()->header.inputs;
  std::vector<std::vector<Column>> columns;
  for (const FlightLog* log : logs) {
    columns.emplace_back();
    for (const Column& values : log->command.declared) columns.back().push_back(slow(log->command.t_s, values));
  }
  for (std::size_t k = 0; k < inputs.size(); ++k)
    for (std::size_t l = 0; l < inputs.size(); ++l) {
      if (k == l) continue;
      std::vector<double> all;
      for (const std::vector<Column>& flight : columns) all.push_back(correlation(flight[k], flight[l]));
      const double usual = io::median(all);
      for (std::size_t i = 0; i < logs.size(); ++i) {
        Finding& own = *std::ranges::find(*findings[i], check_of(inputs[k]), &Finding::check);
        if (std::abs(all[i] - usual) <= kOtherCorrelation || own.verdict != Verdict::ok) continue;
        own.verdict = Verdict::warning;
        own.text = format("goes along with %s by %.2f, by %.2f in most of these flights: columns swapped?",
                          inputs[l].c_str(), all[i], usual);
      }
    }
}

}  // namespace flappy::flightlog
