#include "gap/result/plan_json.hpp"

#include "io/text.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Json to_json(const Plan& plan) {
  Json effects = Json::array(), choices = Json::array();
  for (const PlannedEffect& e : plan.effects) {
    Json magnitudes = Json::object(), nats = Json::object();
    for (const Estimate& m : e.magnitudes) magnitudes[m.name] = {{"value", m.value}, {"unit", m.unit}};
    for (std::size_t r = 0; r < plan.rivals.size(); ++r)
      if (plan.rivals[r] != e.effect) nats[plan.rivals[r]] = e.nats[r];
    effects.push_back({{"effect", e.effect},
                       {"group", e.group},
                       {"magnitudes", magnitudes},
                       {"probability", e.probability},
                       {"sure_from", e.sure_from ? Json(*e.sure_from) : Json(nullptr)},
                       {"alike", e.alike},
                       {"nats", nats}});
  }
  for (const PlannedChoice& c : plan.choices)
    choices.push_back({{"name", c.name},
                       {"what", c.what},
                       {"flies", c.flies},
                       {"probability", c.probability},
                       {"hours", c.hours},
                       {"gained_per_hour", c.gained_per_hour},
                       {"named", c.named},
                       {"gained", c.gained}});
  return {{"schema", 1},
          {"vehicle", plan.vehicle},
          {"manoeuvre", plan.manoeuvre},
          {"flights", plan.flights},
          {"reference", plan.reference},
          {"rivals", plan.rivals},
          {"effects", effects},
          {"unseen", plan.unseen},
          {"groups", plan.groups},
          {"choices", choices},
          {"complete", plan.complete}};
}

std::string matrix_csv(const Plan& plan) {
  std::string text = "effect";
  for (const std::string& r : plan.rivals) text += "," + r;
  for (const PlannedEffect& e : plan.effects) {
    text += "\n" + e.effect;
    for (std::size_t r = 0; r < plan.rivals.size(); ++r)
      text += plan.rivals[r] == e.effect ? "," : io::format(",%.1f", e.nats[r]);
  }
  return text + "\n";
}

}  // namespace flappy::gap
