#include "policy/actor_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "io/refuse.hpp"
#include "io/schema.hpp"
#include "policy/policy_network.hpp"

namespace flappy::policy {
namespace {

using io::refuse;
using Json = nlohmann::ordered_json;

}  // namespace

std::size_t weight_count(const std::vector<int>& widths, bool layer_norm, bool recurrent) {
  std::size_t n = 0;
  for (const auto& [inputs, outputs] : weight_blocks(widths, recurrent))
    n += static_cast<std::size_t>(inputs + 1) * static_cast<std::size_t>(outputs);
  for (std::size_t layer = recurrent ? 2 : 1; layer_norm && layer + 1 < widths.size(); ++layer)
    n += 2 * static_cast<std::size_t>(widths[layer]);
  return n;
}

Actor read_actor(const std::filesystem::path& path) {
  Json json;
  try {
    json = Json::parse(io::read_text(path));
  } catch (const Json::exception& e) {
    refuse(path, "is no JSON: " + std::string(e.what()), "an actor file");
  }
  Actor a;
  // the JSON library would silently convert other types
  const auto check = [&](const char* key, bool (Json::*is)() const noexcept, const char* accepted) {
    for (const Json& x : json.at(key))
      if (!(x.*is)()) refuse(path, std::string(key) + " has " + x.dump() + " in it", accepted);
  };
  try {
    if (const Json& schema = json.at("schema"); schema != 1)
      refuse(path, "schema " + io::other_schema(schema.get<std::int64_t>(), 1), "schema 1");
    a.task = json.at("task").get<std::string>();
    a.observation = json.at("observation").get<std::vector<std::string>>();
    a.action = json.at("action").get<std::vector<std::string>>();
    check("widths", &Json::is_number_integer, "whole numbers");
    for (const char* key : {"mean", "scale", "weights"}) check(key, &Json::is_number, "numbers");
    for (const auto w : json.at("widths").get<std::vector<std::int64_t>>())
      if (w < 1 || w > kMaxWidth)
        refuse(path, "a layer is " + std::to_string(w) + " wide", "1 to " + std::to_string(kMaxWidth));
    a.widths = json.at("widths").get<std::vector<int>>();
    const auto hidden = json.at("hidden").get<std::string>();
    const auto* known = std::ranges::find(kActivationNames, hidden);
    if (known == std::end(kActivationNames)) refuse(path, "hidden is \"" + hidden + "\"", "relu, tanh, elu or silu");
    a.hidden = static_cast<Activation>(known - kActivationNames);
    if (json.contains("layer_norm")) a.layer_norm = json.at("layer_norm").get<bool>();
    if (json.contains("output")) {
      const auto output = json.at("output").get<std::string>();
      if (output != "tanh" && output != "linear") refuse(path, "output is \"" + output + "\"", "tanh or linear");
      a.linear = output == "linear";
    }
    if (json.contains("recurrent")) a.recurrent = json.at("recurrent").get<bool>();
    a.mean = json.at("mean").get<std::vector<double>>();
    a.scale = json.at("scale").get<std::vector<double>>();
    a.clip = json.at("clip").get<double>();
    a.weights = json.at("weights").get<std::vector<double>>();
  } catch (const Json::exception& e) {
    refuse(path, e.what(), "an actor file");
  }
  const auto layers = static_cast<int>(a.widths.size()) - 1;
  if (layers < 1 || layers > kMaxLayers)
    refuse(path, "has " + std::to_string(layers) + " layers", "1 to " + std::to_string(kMaxLayers));
  if (a.recurrent && (layers < 2 || a.widths[1] > kMaxMemory))
    refuse(path, "is recurrent with " + (layers < 2 ? "one layer" : std::to_string(a.widths[1]) + " units"),
           "two layers or more, 1 to " + std::to_string(kMaxMemory) + " units");
  if (!(a.clip > 0 && a.clip <= 1e30))
    refuse(path, "clip is " + io::shortest_digits(a.clip), "a number above 0, at most 1e30");
  const auto count = [&](const char* name, std::size_t have, std::size_t want) {
    if (have != want)
      refuse(path, std::string(name) + " has " + std::to_string(have) + " entries", std::to_string(want) + " of them");
  };
  const auto inputs = static_cast<std::size_t>(a.widths.front());
  count("observation", a.observation.size(), inputs);
  count("mean", a.mean.size(), inputs);
  count("scale", a.scale.size(), inputs);
  if (a.action.empty() || a.action.size() > kMaxActions)
    refuse(path, "action has " + std::to_string(a.action.size()) + " entries", "1 to " + std::to_string(kMaxActions));
  count("action", a.action.size(), static_cast<std::size_t>(a.widths.back()));
  count("weights", a.weights.size(), weight_count(a.widths, a.layer_norm, a.recurrent));
  for (const auto* numbers : {&a.mean, &a.scale, &a.weights})
    for (const double x : *numbers)
      if (!(std::abs(x) <= static_cast<double>(std::numeric_limits<float>::max())))
        refuse(path, "has " + io::shortest_digits(x) + " in it, which single precision does not hold",
               "numbers up to 3.4e38");
  return a;
}

void write_actor(const std::filesystem::path& path, const Actor& a) {
  Json json = {{"schema", 1},         {"task", a.task},     {"observation", a.observation},
               {"action", a.action},  {"widths", a.widths}, {"hidden", name_of(a.hidden)},
               {"mean", a.mean},      {"scale", a.scale},   {"clip", a.clip},
               {"weights", a.weights}};
  if (a.layer_norm) json["layer_norm"] = true;
  if (a.linear) json["output"] = "linear";
  if (a.recurrent) json["recurrent"] = true;
  io::write_atomically(path, json.dump() + "\n");
}

}  // namespace flappy::policy
