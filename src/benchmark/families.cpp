#include "benchmark/families.hpp"

#include "blind/a/family_a.hpp"
#include "blind/a/sampled_robot.hpp"
#ifdef FLAPPY_FAMILIES
#include "blind/b/family_b.hpp"
#endif
#ifdef FLAPPY_HAVE_MUJOCO
#include "blind/c/family_c.hpp"
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

bool in_catalogue(const blind::FamilyEffect& effect) { return !effect.id.starts_with("outside_"); }

std::uint64_t seed_of_draw(std::uint64_t seed, std::uint64_t draw) { return seed * blind::kTries + draw; }

FlownRobot fly_drawn(const Family& family, blind::Assignment a, std::uint64_t seed,
                     const std::function<void(blind::Assignment&)>& prepare) {
  FlownRobot robot;
  for (; robot.draw < blind::kTries; ++robot.draw) {
    a.seed = seed_of_draw(seed, robot.draw);
    if (prepare) prepare(a);
    robot.flights.clear();
    while (robot.flights.size() < Family::kFlights && (robot.flights.empty() || !robot.flights.back().crashed))
      robot.flights.push_back(family.fly(a, robot.flights.size()));
    if (!robot.flights.back().crashed) {
      robot.assignment = std::move(a);
      return robot;
    }
    robot.lost.push_back("flight " + std::to_string(robot.flights.size()) + " " + robot.flights.back().how);
  }
  throw blind::NeverFlies("--seed " + std::to_string(seed) + ": " + std::to_string(blind::kTries) +
                          " robots in a row crashed; accepted: effects of smaller magnitude, less randomisation");
}

}  // namespace flappy::benchmark
