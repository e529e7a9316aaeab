#include "flappy/vehicle_file.hpp"

#include <charconv>

#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::model {
namespace {

std::string known_effects() {
  std::string list;
  for (const EffectEntry& e : effects()) list += (list.empty() ? "" : ", ") + std::string(e.info.id);
  return list;
}

void read_effects(const io::Table& table, Vehicle& vehicle) {
  for (const std::string& id : table.keys()) {
    const int index = effect_index(id.c_str());
    if (index < 0) table.fail(id, "unknown effect", known_effects());
    const io::Table entry = table.table(id);
    for (const EffectParameter& p : effects()[static_cast<std::size_t>(index)].parameters)
      vehicle.effects[id][p.name] = entry.number_or(p.name, p.typical, {p.low, p.high});
  }
}

std::string number_text(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  std::string s(text, end);
  if (s.find_first_of(".en") == std::string::npos) s += ".0";
  return s;
}

}  // namespace

Vehicle read_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const io::Table root = io::Config::load(path, overrides).root();
  root.integer("schema", 1, 1);
  Vehicle vehicle;
  vehicle.name = root.string("name");
  for (const Parameter& p : parameters(vehicle)) *p.value = root.number(p.path, {p.low, p.high});
  if (const auto table = root.optional_table("effects")) read_effects(*table, vehicle);
  root.finish();
  if (const std::optional<PhysicalFault> fault = physical_fault(vehicle))
    root.fail(fault->path, fault->what, fault->accepted);
  return vehicle;
}

std::string vehicle_text(const Vehicle& vehicle) {
  std::string text = "schema = 1\nname = \"" + vehicle.name + "\"\n";
  Vehicle copy = vehicle;
  for (const Parameter& p : parameters(copy)) text += p.path + " = " + number_text(*p.value) + "\n";
  for (const auto& [id, values] : vehicle.effects)
    for (const auto& [name, value] : values) text += "effects." + id + "." + name + " = " + number_text(value) + "\n";
  return text;
}

}  // namespace flappy::model
