#include "lab/blind/a/sampled_robot.hpp"

#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/sha256.hpp"

namespace flappy::blind {

Case declared_case(const std::filesystem::path& vehicle_file) {
  Case c;
  c.vehicle = model::read_vehicle_for_steps(vehicle_file, kRobotStep_s);
  if (!c.vehicle.effects.empty())
    io::Config::load(vehicle_file)
        .root()
        .fail("effects", "the blind robot has effects of its own", "a vehicle without");
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  c.vehicle_file = vehicle_file.filename().string();
  c.vehicle_sha256 = io::sha256(io::read_text(vehicle_file));
  return c;
}

Case sampled_case(Case c, const sim::Randomisation& randomisation, std::uint64_t seed, std::uint64_t draw) {
  c.seed = seed * kTries + draw;
  c.vehicle = randomisation.sample({c.seed, 0, 0, sim::Stream::vehicle});
  return c;
}

SampledRobot fly_sampled(Case c, const sim::Randomisation& randomisation, std::uint64_t seed) {
  SampledRobot sampled;
  for (; sampled.draw < kTries; ++sampled.draw) {
    c = sampled_case(std::move(c), randomisation, seed, sampled.draw);
    sampled.flights.clear();
    while (sampled.flights.size() < kFlights && (sampled.flights.empty() || !sampled.flights.back().crashed))
      sampled.flights.push_back(fly(c, sampled.flights.size()));
    if (!sampled.flights.back().crashed) {
      sampled.flown = std::move(c);
      return sampled;
    }
    sampled.lost.push_back({sampled.flights.size(), sampled.flights.back().how});
  }
  throw NeverFlies("--seed " + std::to_string(seed) + ": " + std::to_string(kTries) +
                   " robots in a row crashed; accepted: effects of smaller magnitude, less randomisation");
}

}  // namespace flappy::blind
