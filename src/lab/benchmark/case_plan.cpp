#include "lab/benchmark/case_plan.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "io/config.hpp"
#include "lab/benchmark/families.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

/// Below kSeedsOfAFamily: robots flown by hand or for tables of detectable magnitudes. Already used: 700001 to 799999
/// and, from each family's first seed, the 120,000 from each of 5,000,000, 5,500,000, ..., 8,500,000 on.
constexpr std::uint64_t kSeedsOfAFamily = 10'000'000, kReported = 9'000'000, kSeedsOfAPart = 10'000,
                        kSeedsOfSessions = 300'000;
/// Least number of cases of most parts; rounded up so that all effects of a part have as many.
constexpr std::size_t kAtLeast = 100;
/// Least numbers of cases in parts of a contrast.
constexpr std::size_t kSingles = 60, kHarmless = 30, kStrange = 15, kPairs = 20;
constexpr double kLargest = 4;
/// For effects outside the catalogue that the table does not list.
constexpr double kOutsideMagnitude = 2;
/// Robots differ in how much they have of a cause: magnitudes of contrasts are this many times what its source
/// measured, uniform in the logarithm.
constexpr double kMinTypical = 0.7, kMaxTypical = 2;

using Ids = std::vector<std::string>;

std::uint64_t number_of(const blind::Family& family) {
  return static_cast<std::uint64_t>(std::ranges::find(kFamilies, family.name()) - std::begin(kFamilies)) + 1;
}

class Planner {
 public:
  Planner(const blind::Family& family, const std::map<std::string, Detectability>& detectability,
          const PlanOptions& options)
      : of_(detectability),
        options_(options),
        first_seed_(number_of(family) * kSeedsOfAFamily + (options.reported ? kReported : 0) +
                    (options.reference_sessions - 1) * kSeedsOfSessions),
        random_(first_seed_) {
    for (const blind::FamilyEffect& e : family.effects()) {
      const auto known = of_.find(e.id);
      if (known == of_.end()) {
        outside_.push_back(e.id);
        continue;
      }
      const Detectability& d = known->second;
      if (in_catalogue(e) && d.hidden) hidden_.push_back(e.id);
      if (d.undetectable) continue;
      (in_catalogue(e) ? detectable_ : outside_).push_back(e.id);
      if (in_catalogue(e) && d.detectable <= 1) typical_.push_back(e.id);
    }
    if (options.bench) require_bench(family);
    if (outside_.empty())
      throw io::InputError(
          "--detectable: nothing outside the catalogue is detectable; accepted: a table of flappy-blind detectability");
    if (detectable_.size() < 2)
      throw io::InputError(
          "--detectable: fewer than two effects are detectable; accepted: a table of flappy-blind detectability");
    // the first cases of a part (PlanOptions::at_most) are a fair draw
    for (Ids* ids : {&detectable_, &typical_, &outside_, &hidden_}) shuffle(*ids);
    random_.seed(first_seed_);
  }

  std::vector<PlannedCase> run() {
    const Ids known = options_.contrast ? Ids(std::begin(kContrastParts), std::end(kContrastParts))
                                        : Ids(std::begin(kParts), std::end(kParts));
    for (const std::string& part : options_.parts)
      if (!std::ranges::count(known, part))
        throw io::InputError("--part " + part + ": not " + (options_.contrast ? "with" : "without") +
                             " --contrast; accepted: " + io::joined(known));
    if (options_.contrast) return contrasts();
    const std::size_t singles = rounds(detectable_, kAtLeast);
    part("singles", singles, [&](std::size_t k, PlannedCase& c) { single(k, c); });
    part("singles_current", singles, [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.power = true;
      c.seed = seed_of("singles", k);  // the robots of part "singles"
    });
    part("redeclared", kAtLeast, [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.seed = seed_of("singles", k);
      c.conventions = false;
    });
    part("typical", rounds(typical_, kAtLeast), [&](std::size_t k, PlannedCase& c) {
      const std::string& id = typical_[k % typical_.size()];
      c.effects = {{id, 1}};
    });
    const auto harmless = [&](const char* name, bool published, bool own_parameters, bool conventions) {
      part(name, kAtLeast, [&](std::size_t, PlannedCase& c) {
        c.published = published, c.own_parameters = own_parameters, c.conventions = conventions;
      });
    };
    harmless("none", false, false, false);
    harmless("parameters", true, false, false);
    harmless("own_parameters", false, true, false);
    harmless("conventions", false, false, true);
    part("withheld", rounds(detectable_, kAtLeast / 2), [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.withheld = model::whole_group(model::effects(), c.effects.front().id);
    });
    part("outside", rounds(outside_, kAtLeast / 2),
         [&](std::size_t k, PlannedCase& c) { c.effects = {at_twice(outside_[k % outside_.size()])}; });
    part("pairs", kAtLeast, [&](std::size_t, PlannedCase& c) {
      pair(
          detectable_, [&](const std::string& id) { return at_twice(id).magnitude; }, c);
    });
    part("hover", rounds(hidden_, kAtLeast), [&](std::size_t k, PlannedCase& c) {
      c.effects = {at_twice(hidden_[k % hidden_.size()])};
      c.hover = true;
    });
    number();
    return std::move(cases_);
  }

 private:
  /// The least multiple of the number of effects that is at least `at_least`; 0 without effects.
  static std::size_t rounds(const Ids& ids, std::size_t at_least) {
    return ids.empty() ? 0 : (at_least + ids.size() - 1) / ids.size() * ids.size();
  }
  static std::uint64_t index_of(const std::string& part) {
    const auto at = std::ranges::find(kParts, part);
    if (at != std::end(kParts)) return static_cast<std::uint64_t>(at - std::begin(kParts));
    return std::size(kParts) +
           static_cast<std::uint64_t>(std::ranges::find(kContrastParts, part) - std::begin(kContrastParts));
  }
  std::uint64_t seed_of(const std::string& part, std::size_t k) const {
    return first_seed_ + kSeedsOfAPart * index_of(part) + k;
  }

  template <class Fill>
  void part(const char* name, std::size_t count, const Fill& fill) {
    if (!options_.parts.empty() && !std::ranges::count(options_.parts, name)) return;
    if (options_.at_most > 0) count = std::min(count, options_.at_most);
    for (std::size_t k = 0; k < count; ++k) {
      PlannedCase c;
      c.part = name;
      c.seed = seed_of(name, k);
      c.own_parameters = c.conventions = true;
      fill(k, c);
      cases_.push_back(std::move(c));
    }
  }

  blind::BlindEffect at_twice(const std::string& id) const {
    const auto d = of_.find(id);
    if (d == of_.end()) return {id, kOutsideMagnitude};
    return {id, kOverDetectable * d->second.detectable};
  }

  void single(std::size_t k, PlannedCase& c) const {
    const std::string& id = detectable_[k % detectable_.size()];
    c.effects = {at_twice(id)};
  }

  template <class Magnitude>
  void pair(const Ids& ids, const Magnitude& magnitude, PlannedCase& c) {
    const std::string& first = ids[below(ids.size())];
    const Ids group = model::whole_group(model::effects(), first);
    Ids others = ids;
    std::erase_if(others, [&](const std::string& id) { return std::ranges::count(group, id) > 0; });
    if (others.empty())
      throw io::InputError("--detectable: all are of one group; accepted: a table of flappy-blind detectability");
    const std::string& second = others[below(others.size())];
    c.effects = {{first, magnitude(first)}, {second, magnitude(second)}};
  }

  /// Typical magnitude of one robot.
  static double typical(std::uint64_t seed) {
    const double share = static_cast<double>(std::mt19937_64(seed)()) / static_cast<double>(std::mt19937_64::max());
    return kMinTypical * std::pow(kMaxTypical / kMinTypical, share);
  }

  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }

  template <class List>
  void shuffle(List& list) {
    for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[below(i)]);
  }

  /// Every effect of the catalogue is asked for, whatever the table says; the score leaves out changes within noise.
  std::vector<PlannedCase> contrasts() {
    const Ids all = shuffled_catalogue();
    const auto part = [&](const char* name, std::size_t count, const auto& fill) {
      this->part(name, count, [&](std::size_t k, PlannedCase& c) {
        c.references = blind::Family::kFlights;
        fill(k, c);
        c.references = std::min(c.references, options_.flights);
        c.reference_sessions = std::min(options_.reference_sessions, c.references);
        c.flights = std::min(c.flights, options_.flights);
        c.bench = options_.bench;
      });
    };
    const auto single = [&](std::size_t k, PlannedCase& c) { c.effects = {{all[k % all.size()], typical(c.seed)}}; };
    part("changed", rounds(all, kSingles), single);
    part("changed_short_reference", rounds(all, kSingles), [&](std::size_t k, PlannedCase& c) {
      c.seed = seed_of("changed", k);
      single(k, c);
      c.references = 1;
    });
    part("changed_short_test", rounds(all, kSingles), [&](std::size_t k, PlannedCase& c) {
      c.seed = seed_of("changed", k);
      single(k, c);
      c.flights = 1;
    });
    part("unchanged", kHarmless, [](std::size_t, PlannedCase&) {});
    part("changed_calm", rounds(all, kHarmless), [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.calm_reference = true;
    });
    part("unchanged_calm", kHarmless, [](std::size_t, PlannedCase& c) { c.calm_reference = true; });
    part("changed_withheld", rounds(all, kStrange), [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.withheld = model::whole_group(model::effects(), c.effects.front().id);
    });
    part("changed_outside", rounds(outside_, kStrange), [&](std::size_t k, PlannedCase& c) {
      c.effects = {{outside_[k % outside_.size()], kOutsideMagnitude}};
    });
    part("changed_pairs", kPairs, [&](std::size_t, PlannedCase& c) {
      std::uint64_t draw = c.seed;
      pair(
          all, [&](const std::string&) { return typical(draw++); }, c);
    });
    number();
    return std::move(cases_);
  }

  Ids shuffled_catalogue() {
    Ids all;
    for (const auto& [id, d] : of_)
      if (!id.starts_with("outside_")) all.push_back(id);
    shuffle(all);
    for (const std::string& id : options_.effects)
      if (!std::ranges::count(all, id))
        throw io::InputError("--effects " + id + ": no effect of the catalogue; accepted: " + io::joined(all));
    if (!options_.effects.empty())
      std::erase_if(all, [&](const std::string& id) { return !std::ranges::count(options_.effects, id); });
    random_.seed(first_seed_);
    return all;
  }

  void number() {
    random_.seed(first_seed_);
    shuffle(cases_);
    for (std::size_t i = 0; i < cases_.size(); ++i) cases_[i].number = i + 1;
  }

  const std::map<std::string, Detectability>& of_;
  const PlanOptions& options_;
  std::uint64_t first_seed_;
  Ids detectable_, typical_, outside_, hidden_;
  std::mt19937_64 random_;
  std::vector<PlannedCase> cases_;
};

}  // namespace

std::map<std::string, Detectability> read_detectability(const std::filesystem::path& file,
                                                        const blind::Family& family) {
  const io::Config config = io::Config::load(file);
  const io::Table root = config.root();
  root.schema(1);
  std::map<std::string, Detectability> all;
  for (const blind::FamilyEffect& e : family.effects()) {
    if (!in_catalogue(e) && !root.has(e.id)) continue;
    const io::Table t = root.table(e.id);
    Detectability d;
    d.undetectable = t.boolean_or("undetectable", false);
    if (!d.undetectable || t.has("detectable")) d.detectable = t.number("detectable", io::positive(kLargest));
    if (!d.undetectable && kOverDetectable * d.detectable > kLargest)
      t.fail("detectable", "twice that is beyond magnitude 4", "undetectable = true");
    d.hidden = t.number("hover", io::positive(1e3)) > kOverDetectable * d.detectable && !d.undetectable;
    all[e.id] = d;
  }
  root.finish();
  return all;
}

blind::Assignment assignment_of(const PlannedCase& planned, const std::filesystem::path& vehicle) {
  blind::Assignment a;
  a.vehicle_file = vehicle;
  for (const blind::BlindEffect& e : planned.effects) a.effects.emplace_back(e.id, e.magnitude);
  a.hover = planned.hover, a.power = planned.power || planned.bench;
  a.bench = planned.bench;
  a.own_parameters = planned.own_parameters, a.conventions = planned.conventions;
  a.session = planned.references > 0 ? 1 : 0;
  return a;
}

std::optional<blind::Assignment> reference_of(const PlannedCase& planned, const std::filesystem::path& vehicle) {
  if (planned.references == 0) return std::nullopt;
  blind::Assignment a = assignment_of(planned, vehicle);
  a.effects.clear();
  a.session = 0;
  a.calm = planned.calm_reference;
  return a;
}

std::vector<PlannedCase> plan_cases(const blind::Family& family,
                                    const std::map<std::string, Detectability>& detectability,
                                    const PlanOptions& options) {
  return Planner(family, detectability, options).run();
}

}  // namespace flappy::benchmark
