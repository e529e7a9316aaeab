#include "gap/result/diagnosis.hpp"

#include <algorithm>
#include <functional>

#include "gap/result/sentences.hpp"
#include "io/text.hpp"

namespace flappy::gap {

const char* name_of(HypothesisKind kind) {
  static const char* const kNames[] = {"none", "parameters", "effect", "unknown"};
  return kNames[static_cast<int>(kind)];
}

const char* name_of(VerdictKind kind) {
  static const char* const kNames[] = {"effect", "group", "parameters", "none", "unknown", "data"};
  return kNames[static_cast<int>(kind)];
}

const char* name_of(Fitted fitted) {
  static const char* const kNames[] = {"nominal", "refit", "effect"};
  return kNames[static_cast<int>(fitted)];
}

const char* name_of(ResidualTest test) {
  static const char* const kNames[] = {"channel", "regime", "phase", "frequency", "input", "whiteness"};
  return kNames[static_cast<int>(test)];
}

std::string text_of(const Regime& r, ResidualTest test) {
  const std::string unit = r.unit.empty() ? "" : " " + r.unit;
  const auto number = [&](const std::optional<double>& x) { return io::format("%.4g", x.value_or(0)); };
  switch (test) {
    case ResidualTest::channel:
      return "all";
    case ResidualTest::regime:
      if (r.third == Regime::Third::low) return r.quantity + " below " + number(r.high) + unit;
      if (r.third == Regime::Third::high) return r.quantity + " above " + number(r.low) + unit;
      return r.quantity + " " + number(r.low) + " to " + number(r.high) + unit;
    case ResidualTest::phase:
      return harmonic_words(static_cast<int>(r.low.value_or(0)));
    case ResidualTest::frequency:
      return number(r.low) + " to " + number(r.high) + unit;
    case ResidualTest::input:
      return r.quantity;
    case ResidualTest::whiteness:
      return "means of " + number(r.high) + unit;
  }
  return "";
}

std::vector<ResidualLocation> largest_discoveries(const Diagnosis& diagnosis, Fitted fitted, std::size_t most) {
  std::vector<ResidualLocation> list;
  for (const ResidualLocation& l : diagnosis.locations)
    if (l.fitted == fitted && l.discovered && l.test != ResidualTest::input && l.test != ResidualTest::whiteness)
      list.push_back(l);
  std::ranges::stable_sort(list, std::greater{},
                           [](const ResidualLocation& l) { return l.gap / std::max(l.noise_floor, 1e-300); });
  if (list.size() > most) list.resize(most);
  return list;
}

std::string unit_of(const std::string& name) {
  static const std::pair<const char*, const char*> kUnits[] = {
      {"m", "m"},    {"s", "s"},    {"V", "V"},   {"K", "K"},       {"W", "W"},     {"ohm", "ohm"},
      {"C", "C"},    {"N", "N"},    {"Nm", "Nm"}, {"kg", "kg"},     {"rad", "rad"}, {"m2", "m^2"},
      {"m3", "m^3"}, {"s2", "s^2"}, {"A", "A"},   {"rad2", "rad^2"}};
  if (name.find("moment_") != std::string::npos && name.ends_with("_kg_m")) return "kg m";
  // words at the end of the name that are units: the first of them over the others
  std::vector<std::string> units;
  std::string rest = name;
  while (true) {
    const std::size_t cut = rest.rfind('_');
    const std::string word = cut == std::string::npos ? rest : rest.substr(cut + 1);
    const auto unit = std::ranges::find_if(kUnits, [&](const auto& u) { return u.first == word; });
    if (word == "per" && !units.empty()) units.insert(units.begin(), "1");
    if (cut == std::string::npos || unit == std::end(kUnits)) break;
    units.insert(units.begin(), unit->second);
    rest = rest.substr(0, cut);
  }
  std::string text;
  for (std::size_t i = 0; i < units.size(); ++i) text += (i == 0 ? "" : "/") + units[i];
  return text;
}

}  // namespace flappy::gap
