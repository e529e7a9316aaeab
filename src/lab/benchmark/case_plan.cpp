#include "lab/benchmark/case_plan.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "io/files.hpp"
#include "io/text.hpp"
#include "lab/benchmark/families.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

/// Below kSeedsOfAFamily: robots flown by hand. Already used: 700001 to 799999
/// and, from each family's first seed, the 120,000 from each of 5,000,000, 5,500,000, ..., 8,500,000 on.
constexpr std::uint64_t kSeedsOfAFamily = 10'000'000, kReported = 9'000'000, kSeedsOfAPart = 10'000,
                        kSeedsOfSessions = 300'000, kSeedsOfBench = 150'000;
/// Parts of kParts whose robots are no others': the first ones.
constexpr std::size_t kOwnRobots = 11;
/// Least number of cases of most parts; rounded up so that all effects of a part have as many.
constexpr std::size_t kAtLeast = 100;
/// Least numbers of cases in parts of a contrast.
constexpr std::size_t kSingles = 60, kHarmless = 30, kStrange = 15, kPairs = 20;
/// Effects outside the catalogue are strong, so that what is asked is whether they are called unknown.
constexpr double kOutsideMagnitude = 2;
/// Robots differ in how much they have of a cause: magnitudes are this many times what its source measured, uniform in
/// the logarithm.
constexpr double kMinTypical = 0.7, kMaxTypical = 2;

/// Regimes that rich flights alone have.
constexpr const char* kOfFlight[] = {"height", "ceiling",      "wall",    "place",      "velocity",
                                     "rate",   "acceleration", "heading", "difference", "bias"};

using Ids = std::vector<std::string>;

std::uint64_t number_of(const blind::Family& family) {
  return static_cast<std::uint64_t>(std::ranges::find(kFamilies, family.name()) - std::begin(kFamilies)) + 1;
}

class Planner {
 public:
  Planner(const blind::Family& family, const PlanOptions& options)
      : options_(options),
        family_(family),
        first_seed_(number_of(family) * kSeedsOfAFamily + (options.reported ? kReported : 0) +
                    (options.contrast ? (options.reference_sessions - 1) * kSeedsOfSessions : 0) +
                    (options.contrast && options.bench ? kSeedsOfBench : 0)),
        random_(first_seed_) {
    Ids known;
    for (const blind::FamilyEffect& e : family.effects()) (in_catalogue(e) ? known : outside_).push_back(e.id);
    for (const std::string& id : options.effects)
      if (!std::ranges::count(known, id))
        throw io::InputError("--effects " + id + ": no effect of the catalogue; accepted: " + io::joined(known));
    for (const blind::FamilyEffect& e : family.effects()) {
      if (!in_catalogue(e) || (!options.effects.empty() && !std::ranges::count(options.effects, e.id))) continue;
      catalogue_.push_back(e.id);
      if (std::ranges::all_of(e.regimes, [](const std::string& r) { return std::ranges::count(kOfFlight, r) > 0; }))
        hidden_.push_back(e.id);
    }
    if (options.bench) require_bench(family);
    // the first cases of a part (PlanOptions::at_most) are a fair draw
    for (Ids* ids : {&catalogue_, &outside_, &hidden_}) shuffle(*ids);
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
    const std::size_t singles = rounds(catalogue_, kAtLeast);
    part("singles", singles, [&](std::size_t k, PlannedCase& c) { single(k, c); });
    part("singles_current", singles, [&](std::size_t k, PlannedCase& c) {
      c.power = true;
      c.seed = seed_of("singles", k);  // the robots of part "singles"
      single(k, c);
    });
    part("redeclared", kAtLeast, [&](std::size_t k, PlannedCase& c) {
      c.seed = seed_of("singles", k);
      single(k, c);
      c.conventions = false;
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
    part("withheld", rounds(catalogue_, kAtLeast / 2), [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.withheld = model::whole_group(model::effects(), c.effects.front().id);
    });
    part("outside", rounds(outside_, kAtLeast / 2), [&](std::size_t k, PlannedCase& c) {
      c.effects = {{outside_[k % outside_.size()], kOutsideMagnitude}};
    });
    part("pairs", catalogue_.size() > 1 ? kAtLeast : 0, [&](std::size_t, PlannedCase& c) { pair(c); });
    part("hover", rounds(hidden_, kAtLeast), [&](std::size_t k, PlannedCase& c) {
      c.effects = {{hidden_[k % hidden_.size()], typical(c.seed)}};
      c.hover = true;
    });
    if (family_.has_bench()) {
      part("singles_bench", singles, [&](std::size_t k, PlannedCase& c) {
        c.seed = seed_of("singles", k);
        single(k, c);
        c.bench = true;
      });
      part("own_parameters_bench", kAtLeast, [&](std::size_t k, PlannedCase& c) {
        c.seed = seed_of("own_parameters", k);
        c.conventions = false;
        c.bench = true;
      });
    }
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
    return kOwnRobots +
           static_cast<std::uint64_t>(std::ranges::find(kContrastParts, part) - std::begin(kContrastParts));
  }
  std::uint64_t seed_of(const std::string& part, std::size_t k) const {
    return first_seed_ + kSeedsOfAPart * index_of(part) + k;
  }

  template <class Fill>
  void part(const char* name, std::size_t count, const Fill& fill) {
    if (!options_.parts.empty() && !std::ranges::count(options_.parts, name)) return;
    if (options_.at_most > 0) count = std::min(count, options_.skip + options_.at_most);
    for (std::size_t k = options_.skip; k < count; ++k) {
      PlannedCase c;
      c.part = name;
      c.seed = seed_of(name, k);
      c.own_parameters = c.conventions = true;
      fill(k, c);
      cases_.push_back(std::move(c));
    }
  }

  void single(std::size_t k, PlannedCase& c) const {
    c.effects = {{catalogue_[k % catalogue_.size()], typical(c.seed)}};
  }

  /// Two effects of different groups.
  void pair(PlannedCase& c) {
    const std::string& first = catalogue_[below(catalogue_.size())];
    const Ids group = model::whole_group(model::effects(), first);
    Ids others = catalogue_;
    std::erase_if(others, [&](const std::string& id) { return std::ranges::count(group, id) > 0; });
    if (others.empty()) throw io::InputError("--effects: all are of one group; accepted: of two groups for pairs");
    const std::string& second = others[below(others.size())];
    c.effects = {{first, typical(c.seed)}, {second, typical(c.seed + 1)}};
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

  std::vector<PlannedCase> contrasts() {
    const auto part = [&](const char* name, std::size_t count, const auto& fill) {
      this->part(name, count, [&](std::size_t k, PlannedCase& c) {
        c.references = blind::Family::kFlights;
        fill(k, c);
        c.bench = options_.bench;
        if (!c.bench) c.references = std::min(c.references, options_.flights);
        c.reference_sessions = std::min(options_.reference_sessions, c.references);
        if (c.bench) c.references = c.reference_sessions * blind::Family::kFlights;
        c.flights = std::min(c.flights, options_.flights);
      });
    };
    const auto single = [&](std::size_t k, PlannedCase& c) { this->single(k, c); };
    part("changed", rounds(catalogue_, kSingles), single);
    part("changed_short_reference", rounds(catalogue_, kSingles), [&](std::size_t k, PlannedCase& c) {
      c.seed = seed_of("changed", k);
      single(k, c);
      c.references = 1;
    });
    part("changed_short_test", rounds(catalogue_, kSingles), [&](std::size_t k, PlannedCase& c) {
      c.seed = seed_of("changed", k);
      single(k, c);
      c.flights = 1;
    });
    part("unchanged", kHarmless, [](std::size_t, PlannedCase&) {});
    part("changed_calm", rounds(catalogue_, kHarmless), [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.calm_reference = true;
    });
    part("unchanged_calm", kHarmless, [](std::size_t, PlannedCase& c) { c.calm_reference = true; });
    part("changed_withheld", rounds(catalogue_, kStrange), [&](std::size_t k, PlannedCase& c) {
      single(k, c);
      c.withheld = model::whole_group(model::effects(), c.effects.front().id);
    });
    part("changed_outside", rounds(outside_, kStrange), [&](std::size_t k, PlannedCase& c) {
      c.effects = {{outside_[k % outside_.size()], kOutsideMagnitude}};
    });
    part("changed_pairs", catalogue_.size() > 1 ? kPairs : 0, [&](std::size_t, PlannedCase& c) { pair(c); });
    number();
    return std::move(cases_);
  }

  void number() {
    random_.seed(first_seed_);
    shuffle(cases_);
    for (std::size_t i = 0; i < cases_.size(); ++i) cases_[i].number = i + 1;
  }

  const PlanOptions& options_;
  const blind::Family& family_;
  std::uint64_t first_seed_;
  Ids catalogue_, outside_, hidden_;  ///< hidden_: hover does not show them
  std::mt19937_64 random_;
  std::vector<PlannedCase> cases_;
};

}  // namespace

blind::Assignment assignment_of(const PlannedCase& planned, const std::filesystem::path& vehicle) {
  blind::Assignment a;
  a.vehicle_file = vehicle;
  for (const blind::BlindEffect& e : planned.effects) a.effects.emplace_back(e.id, e.magnitude);
  a.bench = planned.bench && planned.references > 0;
  a.hover = planned.hover, a.power = planned.power || a.bench;
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

std::vector<PlannedCase> plan_cases(const blind::Family& family, const PlanOptions& options) {
  std::vector<PlannedCase> all = Planner(family, options).run();
  if (all.empty() && options.skip > 0)
    throw io::InputError(io::format("--skip %zu: leaves no case; accepted: less than a part has", options.skip));
  for (const std::uint64_t number : options.only)
    if (number < 1 || number > all.size())
      throw io::InputError(io::format("--only %llu: no such case; accepted: 1 to %zu",
                                      static_cast<unsigned long long>(number), all.size()));
  if (!options.only.empty())
    std::erase_if(all, [&](const PlannedCase& c) { return std::ranges::count(options.only, c.number) == 0; });
  return all;
}

}  // namespace flappy::benchmark
