#include "flight/excitation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/csv.hpp"
#include "model/math.hpp"

namespace flappy::flight {
namespace {

constexpr std::array<double sim::Input::*, 4> kInputs = {&sim::Input::amplitude_V, &sim::Input::difference_V,
                                                         &sim::Input::bias_V, &sim::Input::split_cycle};
const std::vector<std::string> kNames = {"amplitude_V", "difference_V", "bias_V", "split_cycle"};
constexpr double kSame_s = 1e-9;  // times closer than this count as equal
constexpr io::Range kTime{0, 1e5}, kSize{-18, 18};

double cos_turns(double x) { return model::cos_pi(2 * (x - std::floor(x + 0.5))); }

double value(const Wave& w, double t_s) {
  const double t = t_s - w.start_s;
  if (t < -kSame_s || t >= w.duration_s - kSame_s) return 0;
  if (w.kind == Wave::Kind::step) return w.amplitude;
  if (w.kind == Wave::Kind::sweep)
    return w.amplitude * cos_turns((w.from_hz + (w.to_hz - w.from_hz) / (2 * w.duration_s) * t) * t - 0.25);
  double sum = 0;
  const double n = static_cast<double>(w.harmonics.size());
  for (std::size_t k = 1; k <= w.harmonics.size(); ++k)
    sum += cos_turns(w.harmonics[k - 1] * (t / w.period_s) - static_cast<double>(k * (k - 1)) / (2 * n));
  return w.amplitude * sum;
}

/// Harmonics of multisine number `index`, counted from 0, out of `of` multisines in the flight.
std::vector<int> harmonics(const io::Table& table, const Wave& w, int count, int index, int of) {
  std::vector<int> own, chosen;
  const auto first = static_cast<int>(std::ceil(w.from_hz * w.period_s - 1e-9));
  const auto last = static_cast<int>(std::floor(w.to_hz * w.period_s + 1e-9));
  for (int h = std::max(first, 1); h <= last; ++h)
    if (h % of == index) own.push_back(h);
  const auto have = static_cast<int>(own.size());
  if (have < count)
    table.fail("count", "the band holds " + std::to_string(have) + " harmonics of this multisine's own",
               "at most that many; a longer period_s has more");
  for (int k = 0; k < count; ++k)
    chosen.push_back(own[count == 1 ? 0 : static_cast<std::size_t>(std::lround(k * (have - 1.0) / (count - 1)))]);
  return chosen;
}

Script read_script(const io::Table& table) {
  const io::CsvTable csv = io::read_csv(table.file("file"));
  if (csv.column("t_s").empty()) throw io::InputError(csv.name + ": has no rows; accepted: at least one");
  Script s{csv.column("t_s"), std::vector<sim::Input>(csv.column("t_s").size())};
  for (std::size_t k = 0; k < kInputs.size(); ++k) {
    const std::vector<double>& column = csv.column(kNames[k]);
    for (std::size_t i = 0; i < column.size(); ++i) s.input[i].*kInputs[k] = column[i];
  }
  for (std::size_t i = 1; i < s.t_s.size(); ++i)
    if (!(s.t_s[i] > s.t_s[i - 1]))
      throw io::InputError(csv.name + ":" + std::to_string(i + 2) +
                           ": t_s does not come after that of the line before; accepted: times that increase");
  return s;
}

Wave read_wave(const io::Table& table, const std::string& kind, double flight_s, int index, int of) {
  Wave w;
  w.input = static_cast<int>(std::ranges::find(kNames, table.choice("input", kNames)) - kNames.begin());
  if (kind == "multisine") {
    w.kind = Wave::Kind::multisine;
    w.start_s = table.number_or("start_s", 0, kTime);
    w.duration_s = table.number_or("duration_s", flight_s, io::positive(1e5));
    w.period_s = table.number("period_s", io::positive(1e4));
    w.from_hz = table.number("from_hz", io::positive(1e3));
    w.to_hz = table.number("to_hz", {w.from_hz, 1e3});
    const auto count = static_cast<int>(table.integer("count", 1, 1000));
    w.amplitude = table.number("rms", io::non_negative(18)) * std::sqrt(2.0 / count);
    w.harmonics = harmonics(table, w, count, index, of);
    return w;
  }
  w.start_s = table.number("start_s", kTime);
  w.duration_s = table.number("duration_s", io::positive(1e5));
  if (kind == "step") {
    w.amplitude = table.number("height", kSize);
  } else {
    w.kind = Wave::Kind::sweep;
    w.from_hz = table.number("from_hz", io::non_negative(1e3));
    w.to_hz = table.number("to_hz", io::non_negative(1e3));
    w.amplitude = table.number("amplitude", io::non_negative(18));
  }
  return w;
}

}  // namespace

sim::Input Excitation::at(double t_s) const {
  sim::Input sum = constant;
  for (const Wave& w : waves) sum.*kInputs[static_cast<std::size_t>(w.input)] += value(w, t_s);
  for (const Script& s : scripts) {
    const auto after = std::ranges::upper_bound(s.t_s, t_s + kSame_s) - s.t_s.begin();
    if (after == 0) continue;
    for (const auto input : kInputs) sum.*input += s.input[static_cast<std::size_t>(after - 1)].*input;
  }
  return sum;
}

bool Excitation::acts() const {
  return changes() || std::ranges::any_of(kInputs, [&](auto input) { return constant.*input != 0; });
}

Excitation read_excitation(const io::Table& root, double flight_s) {
  Excitation e;
  if (const auto constant = root.optional_table("constant_input"))
    for (std::size_t k = 0; k < kInputs.size(); ++k) e.constant.*kInputs[k] = constant->number_or(kNames[k], 0, kSize);

  const std::vector<io::Table> tables = root.tables("excitation");
  std::vector<std::string> kinds;
  for (const io::Table& t : tables) kinds.push_back(t.choice("kind", {"step", "sweep", "multisine", "script"}));
  const auto multisines = static_cast<int>(std::ranges::count(kinds, "multisine"));
  int multisine = 0;
  double period_s = 0;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    if (kinds[i] == "script") {
      e.scripts.push_back(read_script(tables[i]));
      continue;
    }
    e.waves.push_back(read_wave(tables[i], kinds[i], flight_s, multisine, multisines));
    if (kinds[i] != "multisine") continue;
    if (multisine++ > 0 && e.waves.back().period_s != period_s)
      tables[i].fail("period_s", "differs from that of another multisine", "one period, so that they do not correlate");
    period_s = e.waves.back().period_s;
  }
  return e;
}

}  // namespace flappy::flight
