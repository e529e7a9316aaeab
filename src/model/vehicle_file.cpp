#include "flappy/vehicle_file.hpp"

#include <algorithm>
#include <cmath>

#include "io/config.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "model/beat_averaged.hpp"
#include "model/coarse_step.hpp"
#include "model/contact.hpp"
#include "model/effects/registry.hpp"
#include "model/jointed.hpp"
#include "model/posterior.hpp"

namespace flappy::model {
namespace {

std::string known_effects(const std::string& wrong, const Vehicle& vehicle) {
  std::vector<std::string> names;
  for (const CatalogueEffect& e : catalogue_of(vehicle)) names.push_back(e.info.id);
  return io::joined(names) + io::did_you_mean(wrong, names);
}

void read_effects(const io::Table& table, Vehicle& vehicle) {
  for (const std::string& id : table.keys()) {
    const CatalogueEffect* effect = find_effect(vehicle, id);
    if (effect == nullptr && vehicle.jointed && is_effect(id))
      table.fail(id, "acts on wings and motors of another kind of vehicle", "effects of sensors");
    if (effect == nullptr) table.fail(id, "unknown effect", known_effects(id, vehicle));
    if (effect->averaged.drive != nullptr && vehicle.beat_averaged->predicted)
      table.fail(id, "acts between inputs and wings, which predicted forces have in them",
                 "effects that act on the vehicle itself");
    const io::Table entry = table.table(id);
    for (const EffectParameter& p : effect->parameters)
      vehicle.effects[id][p.name] = entry.number_or(p.name, p.typical, {p.low, p.high});
  }
}

const std::vector<std::string> kBodies = {"torso", "left.leading_edge", "left.wing", "right.leading_edge",
                                          "right.wing"};

void read_contact(const io::Table& table, Vehicle& vehicle) {
  for (const std::string& name : table.keys()) {
    if (!io::is_bare(name)) table.fail(name, "is no name of a point", "letters, digits, underscores and dashes");
    const io::Table point = table.table(name);
    point.accept({"on", "position_m", "stiffness_N_m", "damping_s_m", "friction", "grasp_m_s"});
    const std::string on = point.choice("on", kBodies);
    vehicle.contact.push_back(
        {name, static_cast<ContactPoint::Body>(std::ranges::find(kBodies, on) - kBodies.begin()), {}});
  }
  if (vehicle.contact.empty() || vehicle.contact.size() > kMaxContactPoints)
    table.fail("", vehicle.contact.empty() ? "has no point" : "has too many points",
               "1 to " + std::to_string(kMaxContactPoints) + " tables [contact.NAME]");
}

const std::string kMultibody = "multibody", kBeatAveraged = "beat_averaged", kPredicted = "predicted",
                  kJointed = "jointed";

Vehicle vehicle_of(const io::Config& config) {
  const io::Table root = config.root();
  root.schema(1);
  Vehicle vehicle;
  std::vector<std::string> keys = {"schema", "name", "model", "effects", "posterior", "contact"};
  const std::string model = root.choice_or("model", kMultibody, {kMultibody, kBeatAveraged, kPredicted, kJointed});
  if (model == kJointed) {
    vehicle.jointed = read_jointed(root);
    for (const char* key : {"gait", "input", "symmetric", "left", "right"}) keys.emplace_back(key);
  } else if (model != kMultibody) {
    vehicle.beat_averaged = read_beat_averaged(root, model == kPredicted);
    for (const char* key : {"beat", "input", "actuator", "coefficients"}) keys.emplace_back(key);
    if (model == kBeatAveraged) keys.emplace_back("wrench");
  }
  if (const auto table = root.optional_table("contact")) {
    if (vehicle.beat_averaged || vehicle.jointed)
      root.fail("contact", "is given, but only a vehicle of wings and motors has points that touch",
                "no such table, or model = " + io::toml_string(kMultibody));
    read_contact(*table, vehicle);
  }
  for (const Parameter& p : parameters(vehicle)) keys.push_back(p.path.substr(0, p.path.find('.')));
  root.accept(keys);
  vehicle.name = root.string("name");
  const bool mirrored = vehicle.jointed && is_symmetric(root);
  for (const Parameter& p : parameters(vehicle))
    if (!p.path.starts_with("coefficients.") && !(mirrored && p.path.starts_with("right.")))
      *p.value = p.optional ? root.number_or(p.path, 0, {p.low, p.high}) : root.number(p.path, {p.low, p.high});
  if (mirrored) mirror_left(vehicle);
  if (vehicle.jointed) check_gait(root, *vehicle.jointed);
  if (const auto table = root.optional_table("effects")) read_effects(*table, vehicle);
  if (const auto table = root.optional_table("posterior")) vehicle.posterior = read_posterior(*table, vehicle);
  root.finish();
  if (const std::optional<PhysicalFault> fault = physical_fault(vehicle))
    root.fail(fault->path, fault->what, fault->accepted);
  if (const std::optional<PhysicalFault> fault = layout_fault(vehicle))
    root.fail(fault->path, fault->what, fault->accepted);
  return vehicle;
}

}  // namespace

Vehicle read_any_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  return vehicle_of(io::Config::load(path, overrides));
}

Vehicle parse_vehicle(const std::string& text, const std::string& name) {
  return vehicle_of(io::Config::parse(text, name));
}

Vehicle read_flyable_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  Vehicle vehicle = read_any_vehicle(path, overrides);
  if (vehicle.beat_averaged && vehicle.beat_averaged->predicted)
    io::Config::load(path, overrides)
        .root()
        .fail("model", "a vehicle whose forces stand in files of recorded flights cannot be flown",
              "\"multibody\", \"beat_averaged\" or \"jointed\"; flappy-gap diagnose takes it");
  return vehicle;
}

Vehicle read_vehicle(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  Vehicle vehicle = read_any_vehicle(path, overrides);
  if (vehicle.beat_averaged)
    io::Config::load(path).root().fail(
        "model", "a beat-averaged vehicle has no wings",
        "a vehicle of wings and motors; flappy-fly, flappy-train and flappy-gap diagnose take both");
  if (vehicle.jointed)
    io::Config::load(path).root().fail("model", "wings whose angles are driven have no motors",
                                       "a vehicle of wings and motors; flappy-fly and flappy-train take both");
  return vehicle;
}

Vehicle read_vehicle_for_steps(const std::filesystem::path& path, double step_s) {
  Vehicle vehicle = read_vehicle(path);
  const double steps = vehicle.driver.hold_s / step_s;
  if (std::abs(steps - std::round(steps)) > 1e-6 || steps < 0.5)
    io::Config::load(path).root().table("driver").fail(
        "hold_s", "physics goes by steps of " + io::shortest_digits(step_s) + " s here", "a multiple of that");
  if (const auto coarse = coarse_step(vehicle, step_s); coarse && coarse->refused)
    io::Config::load(path).root().table("driver").fail(
        "flapping_Hz", "the step of " + io::shortest_digits(step_s) + " s here " + coarse->what,
        "a beat of at most " + io::format("%.4g", vehicle.driver.flapping_Hz * coarse->enough_s / step_s) + " Hz");
  return vehicle;
}

std::string vehicle_text(const Vehicle& vehicle) {
  std::string text = "schema = 1\nname = " + io::toml_string(vehicle.name) + "\n";
  if (vehicle.beat_averaged)
    text += "model = " + io::toml_string(vehicle.beat_averaged->predicted ? kPredicted : kBeatAveraged) + "\n" +
            beat_averaged_text(*vehicle.beat_averaged);
  for (const ContactPoint& p : vehicle.contact)
    text += "contact." + p.name + ".on = " + io::toml_string(kBodies[static_cast<std::size_t>(p.on)]) + "\n";
  if (vehicle.jointed) text += "model = " + io::toml_string(kJointed) + "\n" + jointed_text(*vehicle.jointed);
  Vehicle copy = vehicle;
  for (const Parameter& p : parameters(copy))
    if ((!p.optional || *p.value != 0) && !p.path.starts_with("coefficients."))
      text += p.path + " = " + io::toml_number(*p.value) + "\n";
  for (const auto& [id, values] : vehicle.effects)
    if (values.empty()) text += "effects." + id + " = {}\n";  // in force at its typical magnitude
  if (vehicle.posterior) text += posterior_text(*vehicle.posterior);
  return text;
}

}  // namespace flappy::model
