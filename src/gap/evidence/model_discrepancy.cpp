#include "gap/evidence/model_discrepancy.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "io/config.hpp"
#include "io/text.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

constexpr const char* kHead =
    R"(# The model discrepancy (Kennedy and O'Hagan 2001): what every model of a flapping wing gets wrong, before anything is known of a vehicle. An effect
# has to explain more than this. Read by flappy-gap diagnose, written by flappy-gap learn-discrepancy: learn it again from robots of your own that
# you trust, whose flights contain nothing that the vehicle file lacks.
#
# Learnt: flappy-gap learn-discrepancy, )";
constexpr const char* kSpread =
    R"(# Priors of the scales by which models of one robot are off by more or less than those of others. robot_sd: standard deviation of the logarithm of the
# robot's scale; wide, for a robot may be nearly the model. The other scales have inverse gamma priors of their squares; the more degrees of freedom,
# the closer a scale stays to the centre of its prior. Scales of blocks (a class of regimes in a channel and harmonic) are centred on the robot's
# scale: block_freedom, and place_freedom for those of the place, which are closer, for a wing does not sense its place. Scales of background
# magnitudes are centred on 1 (effect_freedom), except those of the effects of_models, which describe how a wing, its hinges and its drive work:
# each model and each robot has its own laws of these, so they are centred on the robot's scale and vary more (model_freedom). Choice.
)";
constexpr const char* kSensors =
    R"(# Errors of declared sensors: prior standard deviations, the same under every hypothesis. Choice.
)";
constexpr const char* kBackground =
    R"(# Prior standard deviation of the background magnitudes, in coordinates of the effect (1: the prior of the catalogue). Every vehicle has a little of
# every effect, or of something that looks like it; only more than that is evidence of the effect.
)";

/// The name of a background magnitude without its last suffix.
std::string without_suffix(const std::string& background) {
  for (const char* suffix : {kOnBench, kOfBoth})
    if (background.ends_with(suffix)) return background.substr(0, background.size() - std::strlen(suffix));
  return background;
}

std::string effect_of(const std::string& background) { return without_suffix(without_suffix(background)); }

}  // namespace

Regimes regimes_of(BasisFunction function) {
  switch (function) {
    case BasisFunction::constant:
    case BasisFunction::flight:
      return Regimes::always;
    case BasisFunction::input:
    case BasisFunction::rate:
    case BasisFunction::product:
      return Regimes::inputs;
    case BasisFunction::place:
      return Regimes::place;
    default:
      return Regimes::velocity;
  }
}

std::array<std::string, 4> backgrounds_of(const std::string& effect) {
  return {effect, effect + kOfBoth, effect + kOnBench, effect + kOfBoth + kOnBench};
}

double ModelDiscrepancy::background_sd(const std::string& effect) const {
  const auto at = background.find(effect);
  if (at != background.end()) return at->second;
  const std::string own = without_suffix(effect);
  return own != effect ? background_sd(own) : background.at("other");
}

ScalePrior ModelDiscrepancy::scale_prior(const std::string& effect) const {
  if (effect.starts_with(kSessionOf)) return session.of_magnitude(effect);
  if (effect.starts_with(kModelOf)) return scale_prior(effect.substr(std::string(kModelOf).size()));
  if (beat_averaged) return {spread.effect_freedom, true};
  const bool of_model = std::ranges::count(of_models, effect_of(effect)) > 0;
  return {of_model ? spread.model_freedom : spread.effect_freedom, of_model};
}

std::string discrepancy_text(const ModelDiscrepancy& d, const std::string& learnt) {
  const auto number = [](double v) { return io::format("%.4g", v); };
  const auto sensor = [&](const char* id) {
    return number(std::ranges::find(d.nuisances, id, &ModelDiscrepancy::Nuisance::id)->sd);
  };
  std::string text = kHead + learnt + ".\nschema = 1\n\n" + shares_text(d.shares);
  std::string of_models;
  if (!d.beat_averaged) {
    for (const std::string& id : d.of_models) of_models += (of_models.empty() ? "\"" : ", \"") + id + "\"";
    of_models = "\nmodel_freedom = " + number(d.spread.model_freedom) + "\nof_models = [" + of_models + "]";
  }
  text += std::string(kSpread) + "[spread]\nrobot_sd = " + number(d.spread.robot_sd) +
          "\nblock_freedom = " + number(d.spread.block_freedom) +
          (d.beat_averaged ? "" : "\nplace_freedom = " + number(d.spread.place_freedom)) +
          "\neffect_freedom = " + number(d.spread.effect_freedom) + of_models +
          (d.beat_averaged ? "\nbeat_averaged = true\n\n" : "\n\n");
  if (!d.nuisances.empty())
    text += std::string(kSensors) + "[sensors]\nimu_rotation_rad = " + sensor("imu_mounting") +
            "  # As the IMU is mounted, about each axis. Choice.\n" + "imu_place_m = " + sensor("imu_place") +
            "  # Where the IMU is, along each axis. Choice.\npower_latency_s = " + sensor("power_delay") +
            "  # Of a sample that is an instant, a mean, or held. Choice.\nclock_rate = " + sensor("imu_clock") +
            "  # Of each stream's clock against that of the commands. Choice.\n\n";
  text += std::string(kBackground) + "[background_sd]\n";
  for (const auto& [effect, sd] : d.background)
    text += effect + " = " + number(sd) + (effect == "other" ? kOthers : "") + "\n";
  return text;
}

ModelDiscrepancy read_model_discrepancy(const std::filesystem::path& path) {
  const io::Config config = io::Config::load(path);
  const io::Table root = config.root();
  root.schema(1);
  ModelDiscrepancy d;
  const io::Table spread = root.table("spread");
  d.spread = {spread.number("robot_sd", io::positive()), spread.number("block_freedom", io::positive()),
              spread.number("block_freedom", io::positive()), spread.number("effect_freedom", io::positive()), 0};
  d.beat_averaged = spread.boolean_or("beat_averaged", false);
  if (!d.beat_averaged) {
    d.spread.place_freedom = spread.number("place_freedom", io::positive());
    d.spread.model_freedom = spread.number("model_freedom", io::positive());
    d.of_models = spread.strings("of_models");
  }
  for (const std::string& id : d.of_models)
    if (!model::is_effect(id))
      spread.fail("of_models", "no effect \"" + id + "\"", "those that flappy-gap effects lists");

  d.shares = read_shares(root);
  const auto sensors = root.optional_table("sensors");
  const auto axes = [&](const char* id, const char* unit, double sd) {
    for (const char* axis : {"x_", "y_", "z_"}) d.nuisances.push_back({id, std::string(axis) + unit, sd});
  };
  if (sensors) {
    axes("imu_mounting", "rad", sensors->number("imu_rotation_rad", io::positive()));
    axes("imu_place", "m", sensors->number("imu_place_m", io::positive()));
    d.nuisances.push_back({"power_delay", "delay_s", sensors->number("power_latency_s", io::positive())});
    for (const char* id : {"imu_clock", "mocap_clock", "power_clock", "forces_clock", "wings_clock"})
      d.nuisances.push_back({id, "rate", sensors->number("clock_rate", io::positive())});
    for (const char* id : {"forces_delay", "wings_delay"})
      d.nuisances.push_back({id, "delay_s", sensors->number("power_latency_s", io::positive())});
  }
  const io::Table background = root.table("background_sd");
  d.background["other"] = background.number("other", io::positive());
  for (const std::string& key : background.keys())
    if (key == "other" || model::is_effect(effect_of(key))) d.background[key] = background.number(key, io::positive());
  root.finish();
  return d;
}

}  // namespace flappy::gap
