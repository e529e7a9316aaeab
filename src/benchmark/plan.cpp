#include "benchmark/plan.hpp"

#include <algorithm>
#include <random>

#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

/// First seeds. Robots flown by hand and for the table of detectable sizes have seeds below; a part has 1,000.
constexpr std::uint64_t kDevelopment = 10001, kReported = 700001, kSeedsOfAPart = 1000;
constexpr std::size_t kSingles = 5, kNone = 40, kParameters = 40, kWithheld = 30, kOutside = 30, kPairs = 40,
                      kHover = 6, kTypical = 2;
constexpr double kOverDetectable = 2, kLargest = 4;
/// Of effects outside the catalogue of which the table says nothing.
constexpr double kOutsideSize = 2;
/// What hover alone does not show.
constexpr const char* kHidden[] = {"ground_effect", "ceiling_effect", "body_drag", "tether", "marker_offset"};

class Planner {
 public:
  Planner(const std::map<std::string, Detectability>& detectability, const PlanOptions& options)
      : of_(detectability), options_(options), random_(options.reported ? kReported : kDevelopment) {
    for (std::size_t k = 0; k < model::effects().size(); ++k) {  // in the blind robot's order
      const std::string& id = blind::effect_names()[k];
      catalogue_.push_back(id);
      if (!of_.at(id).undetectable) detectable_.push_back(id);
    }
    for (std::size_t k = catalogue_.size(); k < blind::kBlindEffects; ++k) {
      const std::string& id = blind::effect_names()[k];
      const auto known = of_.find(id);
      if (known == of_.end()) outside_.push_back({id, kOutsideSize});
      else if (!known->second.undetectable) outside_.push_back(at_twice(id));
    }
    if (outside_.empty())
      throw io::InputError(
          "--detectable: nothing outside the catalogue is detectable; accepted: a table of flappy-blind detectability");
    if (detectable_.size() < 2)
      throw io::InputError(
          "--detectable: fewer than two effects are detectable; accepted: a table of flappy-blind detectability");
  }

  std::vector<PlannedCase> run() {
    const std::size_t singles = detectable_.size() * kSingles;
    part("singles", singles, [&](std::size_t k, PlannedCase& c) { single(k, c); });
    part("singles_current", singles, [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.power = true;
      c.seed = seed_of("singles", k);  // the same robots
    });
    part("none", kNone, [](std::size_t, PlannedCase& c) { c.randomised = false; });
    part("parameters", kParameters, [](std::size_t, PlannedCase&) {});
    part("withheld", kWithheld + kOutside, [&](std::size_t k, PlannedCase& c) {
      if (k < kWithheld) {
        single(k, c);
        c.withheld = model::whole_group(c.effects.front().id);
      } else {
        c.effects = {outside_[(k - kWithheld) % outside_.size()]};
      }
    });
    part("pairs", kPairs, [&](std::size_t, PlannedCase& c) { pair(c); });
    part("hover", kHover * std::size(kHidden), [&](std::size_t k, PlannedCase& c) {
      c.effects = {at_twice(kHidden[k % std::size(kHidden)])};
      c.hover = true;
    });
    part("typical", kTypical * catalogue_.size(), [&](std::size_t k, PlannedCase& c) {
      const std::string& id = catalogue_[k % catalogue_.size()];
      c.effects = {{id, 1}};
      c.inseparable = of_.at(id).inseparable_at_typical;
    });
    number();
    return std::move(cases_);
  }

 private:
  static std::uint64_t index_of(const std::string& part) {
    return static_cast<std::uint64_t>(std::ranges::find(kParts, part) - std::begin(kParts));
  }
  std::uint64_t seed_of(const std::string& part, std::size_t k) const {
    return (options_.reported ? kReported : kDevelopment) + kSeedsOfAPart * index_of(part) + k;
  }

  template <class Fill>
  void part(const char* name, std::size_t count, const Fill& fill) {
    if (!options_.parts.empty() && !std::ranges::count(options_.parts, name)) return;
    if (options_.at_most > 0) count = std::min(count, options_.at_most);
    for (std::size_t k = 0; k < count; ++k) {
      PlannedCase c;
      c.part = name;
      c.seed = seed_of(name, k);
      fill(k, c);
      cases_.push_back(std::move(c));
    }
  }

  blind::BlindEffect at_twice(const std::string& id) const {
    const Detectability& d = of_.at(id);
    return {id, d.undetectable ? 1 : kOverDetectable * d.detectable};
  }

  void single(std::size_t k, PlannedCase& c) const {
    const std::string& id = detectable_[k % detectable_.size()];
    c.effects = {at_twice(id)};
    c.inseparable = of_.at(id).inseparable;
  }

  void pair(PlannedCase& c) {
    const std::string& first = detectable_[below(detectable_.size())];
    const std::vector<std::string> group = model::whole_group(first);
    std::vector<std::string> others = detectable_;
    std::erase_if(others, [&](const std::string& id) { return std::ranges::count(group, id) > 0; });
    if (others.empty())
      throw io::InputError("--detectable: all are of one group; accepted: a table of flappy-blind detectability");
    c.effects = {at_twice(first), at_twice(others[below(others.size())])};
  }

  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }

  void number() {
    random_.seed(options_.reported ? kReported : kDevelopment);
    for (std::size_t i = cases_.size(); i > 1; --i) std::swap(cases_[i - 1], cases_[below(i)]);
    for (std::size_t i = 0; i < cases_.size(); ++i) cases_[i].number = i + 1;
  }

  const std::map<std::string, Detectability>& of_;
  const PlanOptions& options_;
  std::vector<std::string> catalogue_, detectable_;
  std::vector<blind::BlindEffect> outside_;
  std::mt19937_64 random_;
  std::vector<PlannedCase> cases_;
};

}  // namespace

std::map<std::string, Detectability> read_detectability(const std::filesystem::path& file) {
  const io::Config config = io::Config::load(file);
  const io::Table root = config.root();
  root.schema(1);
  std::map<std::string, Detectability> all;
  for (const std::string& id : blind::effect_names()) {
    if (model::effect_index(id.c_str()) < 0 && !root.has(id)) continue;
    const io::Table t = root.table(id);
    Detectability d;
    d.undetectable = t.boolean_or("undetectable", false);
    if (!d.undetectable || t.has("detectable")) d.detectable = t.number("detectable", io::positive(kLargest));
    if (!d.undetectable && kOverDetectable * d.detectable > kLargest)
      t.fail("detectable", "twice that is beyond size 4", "undetectable = true");
    const auto rivals = [&](const char* key) {
      std::vector<std::string> list = t.strings(key);
      for (const std::string& rival : list)
        if (model::effect_index(rival.c_str()) < 0)
          t.fail(key, "no effect \"" + rival + "\"", "identifiers of docs/effects.md");
      return list;
    };
    d.inseparable = rivals("inseparable");
    if (t.has("inseparable_at_typical")) d.inseparable_at_typical = rivals("inseparable_at_typical");
    else
      for (const model::EffectEntry& e : model::effects())
        if (e.info.id != id) d.inseparable_at_typical.emplace_back(e.info.id);
    // for the reader of the file
    t.number_or("gain_at_typical", 0);
    t.number_or("misfit", 0);
    if (const auto values = t.optional_table("catalogue"))
      for (const std::string& key : values->keys()) values->number(key);
    all[id] = std::move(d);
  }
  root.finish();
  return all;
}

std::vector<PlannedCase> plan_cases(const std::map<std::string, Detectability>& detectability,
                                    const PlanOptions& options) {
  return Planner(detectability, options).run();
}

}  // namespace flappy::benchmark
