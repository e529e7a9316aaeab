#include "gap/replay/believed_vehicle.hpp"

#include <algorithm>

#include "flappy/vehicle_file.hpp"
#include "gap/replay/recording.hpp"
#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {

model::Vehicle read_believed_vehicle(const std::string& file) {
  model::Vehicle vehicle = model::read_any_vehicle(file);
  if (vehicle.beat_averaged) return vehicle;
  vehicle = model::read_vehicle_for_steps(file, kHoldStep_s);
  if (!vehicle.effects.empty())
    io::Config::load(file).root().fail("effects", "a diagnosis asks what is missing in the vehicle as it was believed",
                                       "a vehicle without effects");
  return vehicle;
}

void check_effect(const std::string& option, const std::string& id, const model::Vehicle& vehicle) {
  std::vector<std::string> known;
  for (const model::CatalogueEffect& e : model::catalogue_of(vehicle)) known.emplace_back(e.info.id);
  if (std::ranges::count(known, id) > 0) return;
  throw io::InputError(option + " " + id + ": no such effect; accepted: those that flappy-gap effects lists" +
                       io::did_you_mean(id, known));
}

}  // namespace flappy::gap
