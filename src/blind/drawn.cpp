#include "blind/drawn.hpp"

#include "flappy/vehicle_file.hpp"
#include "io/config.hpp"
#include "io/sha256.hpp"

namespace flappy::blind {

Case declared_case(const std::filesystem::path& vehicle_file) {
  Case c;
  c.vehicle = model::read_vehicle_for_steps(vehicle_file, kStep_s);
  if (!c.vehicle.effects.empty())
    io::Config::load(vehicle_file)
        .root()
        .fail("effects", "the blind robot has effects of its own", "a vehicle without");
  c.declared_density_kg_m3 = c.vehicle.air_density_kg_m3;
  c.vehicle_file = vehicle_file.filename().string();
  c.vehicle_sha256 = io::sha256(io::read_text(vehicle_file));
  return c;
}

Case drawn_case(Case c, const sim::Randomisation& randomisation, std::uint64_t seed, std::uint64_t draw) {
  c.seed = seed * kTries + draw;
  c.vehicle = randomisation.sample({c.seed, 0, 0, sim::Stream::vehicle});
  return c;
}

Drawn fly_drawn(Case c, const sim::Randomisation& randomisation, std::uint64_t seed) {
  Drawn drawn;
  for (; drawn.draw < kTries; ++drawn.draw) {
    c = drawn_case(std::move(c), randomisation, seed, drawn.draw);
    drawn.flights.clear();
    while (drawn.flights.size() < kFlights && (drawn.flights.empty() || !drawn.flights.back().crashed))
      drawn.flights.push_back(fly(c, drawn.flights.size()));
    if (!drawn.flights.back().crashed) {
      drawn.flown = std::move(c);
      return drawn;
    }
    drawn.lost.push_back({drawn.flights.size(), drawn.flights.back().how});
  }
  throw NeverFlies("--seed " + std::to_string(seed) + ": " + std::to_string(kTries) +
                   " robots in a row crashed; accepted: effects of smaller size, less randomisation");
}

}  // namespace flappy::blind
