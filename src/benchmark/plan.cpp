#include "benchmark/plan.hpp"

#include <algorithm>
#include <random>

#include "benchmark/families.hpp"
#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

/// Below kSeedsOfAFamily: robots flown by hand or for tables of detectable magnitudes. Already used: 700001 to 799999
/// and, from each family's first seed, the 120,000 from each of 5,000,000, 5,500,000, ..., 8,000,000 on.
constexpr std::uint64_t kSeedsOfAFamily = 10'000'000, kReported = 8'500'000, kSeedsOfAPart = 10'000;
/// Least number of cases of most parts; rounded up so that all effects of a part have as many.
constexpr std::size_t kAtLeast = 100;
constexpr double kOverDetectable = 2, kLargest = 4;
/// For effects outside the catalogue that the table does not list.
constexpr double kOutsideMagnitude = 2;

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
        first_seed_(number_of(family) * kSeedsOfAFamily + (options.reported ? kReported : 0)),
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
    part("pairs", kAtLeast, [&](std::size_t, PlannedCase& c) { pair(c); });
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
    return static_cast<std::uint64_t>(std::ranges::find(kParts, part) - std::begin(kParts));
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
    return {id, d->second.undetectable ? 1 : kOverDetectable * d->second.detectable};
  }

  void single(std::size_t k, PlannedCase& c) const {
    const std::string& id = detectable_[k % detectable_.size()];
    c.effects = {at_twice(id)};
  }

  void pair(PlannedCase& c) {
    const std::string& first = detectable_[below(detectable_.size())];
    const Ids group = model::whole_group(model::effects(), first);
    Ids others = detectable_;
    std::erase_if(others, [&](const std::string& id) { return std::ranges::count(group, id) > 0; });
    if (others.empty())
      throw io::InputError("--detectable: all are of one group; accepted: a table of flappy-blind detectability");
    c.effects = {at_twice(first), at_twice(others[below(others.size())])};
  }

  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }

  template <class List>
  void shuffle(List& list) {
    for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[below(i)]);
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
  a.hover = planned.hover, a.power = planned.power;
  a.own_parameters = planned.own_parameters, a.conventions = planned.conventions;
  return a;
}

std::vector<PlannedCase> plan_cases(const blind::Family& family,
                                    const std::map<std::string, Detectability>& detectability,
                                    const PlanOptions& options) {
  return Planner(family, detectability, options).run();
}

}  // namespace flappy::benchmark
