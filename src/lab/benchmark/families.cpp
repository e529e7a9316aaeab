#include "lab/benchmark/families.hpp"

#include "lab/blind/a/family_a.hpp"
#include "lab/blind/a/sampled_robot.hpp"
#ifdef FLAPPY_FAMILIES
#include "lab/blind/b/family_b.hpp"
#endif
#ifdef FLAPPY_HAVE_MUJOCO
#include "lab/blind/c/family_c.hpp"
#endif

namespace flappy::benchmark {

using blind::Family;

const Family& family_named(const std::string& name) {
  if (name == "a") {
    static const std::unique_ptr<Family> a = blind::make_family_a();
    return *a;
  }
  if (name == "b") {
#ifdef FLAPPY_FAMILIES
    static const std::unique_ptr<Family> b = blind::b::make_family_b();
    return *b;
#else
    throw io::InputError("--family b: this build has only a; accepted: a, or a build with -DFLAPPY_FAMILIES=ON");
#endif
  }
  if (name == "c") {
#ifdef FLAPPY_HAVE_MUJOCO
    static const std::unique_ptr<Family> c = blind::c::make_family_c();
    return *c;
#else
    throw io::InputError(
        "--family c: not in this build; accepted: a, or a build with -DFLAPPY_FAMILIES=ON where MuJoCo is installed");
#endif
  }
  throw io::InputError("--family " + name + ": no such family; accepted: a, b or c");
}

void check_engine(const std::filesystem::path& folder, const std::string& family, const std::string& engine) {
  if (engine.empty()) return;
  const std::string own = family_named(family).engine();
  if (engine != own)
    throw io::InputError((folder / "manifest.json").string() + ": its robots are of " + engine +
                         ", and fly otherwise with " + (own.empty() ? "family " + family + " here" : own) +
                         "; accepted: a build with " + engine);
}

void require_bench(const Family& family) {
  if (!family.has_bench())
    throw io::InputError("--bench: robots of family " + family.name() + " cannot be clamped; accepted: b or c");
}

bool in_catalogue(const blind::FamilyEffect& effect) { return !effect.id.starts_with("outside_"); }

std::uint64_t seed_of_draw(std::uint64_t seed, std::uint64_t draw) { return seed * blind::kTries + draw; }

namespace {

/// Flies until the robot crashes; how it did, or none. Flights are of the session of `a` and of `sessions` - 1 others,
/// which are no session of the tests, 1: in turn, or each with all runs on a bench, whose runs have inputs of their own.
std::optional<std::string> fly_session(const Family& family, blind::Assignment a, std::size_t sessions,
                                       std::vector<blind::FamilyFlight>& flights) {
  flights.clear();
  const std::size_t first = a.session;
  while (flights.size() < (a.bench ? sessions : 1) * Family::kFlights) {
    const std::size_t turn = a.bench ? flights.size() / Family::kFlights : flights.size() % sessions;
    a.session = turn == 0 ? first : first + turn + 1;
    flights.push_back(family.fly(a, flights.size() % Family::kFlights));
    flights.back().log.header.session = "session " + std::to_string(a.session);
    if (flights.back().crashed) return "flight " + std::to_string(flights.size()) + " " + flights.back().how;
  }
  return std::nullopt;
}

}  // namespace

FlownRobot fly_drawn(const Family& family, blind::Assignment a, std::uint64_t seed,
                     const std::function<void(blind::Assignment&)>& prepare, std::optional<blind::Assignment> reference,
                     std::size_t sessions) {
  FlownRobot robot;
  for (; robot.draw < blind::kTries; ++robot.draw) {
    a.seed = seed_of_draw(seed, robot.draw);
    if (prepare) prepare(a);
    std::optional<std::string> lost;
    if (reference) {
      reference->seed = a.seed;
      lost = fly_session(family, *reference, sessions, robot.reference);
      if (lost) *lost += " of the reference";
    }
    if (!lost) lost = fly_session(family, a, 1, robot.flights);
    if (!lost) {
      robot.assignment = std::move(a);
      return robot;
    }
    robot.lost.push_back(*lost);
  }
  throw blind::NeverFlies("--seed " + std::to_string(seed) + ": " + std::to_string(blind::kTries) +
                          " robots in a row crashed; accepted: effects of smaller magnitude, less randomisation");
}

}  // namespace flappy::benchmark
