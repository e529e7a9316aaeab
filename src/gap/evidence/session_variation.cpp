#include "gap/evidence/session_variation.hpp"

#include <algorithm>

#include "io/text.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

constexpr const char* kSessionHead =
    R"(# This file says by how much two sessions of one robot differ if nothing that matters has changed. An effect that is named by contrast with
# reference flights has to explain more than this. Read by flappy-gap diagnose --reference, written by flappy-gap learn-discrepancy --pairs.
#
# Learnt: flappy-gap learn-discrepancy --pairs, )";
constexpr const char* kSessionSpread =
    R"(# scale_sd: standard deviation of the logarithm of the scale of a pair of sessions. block_freedom: degrees of freedom of the scales of
# single blocks. Choice: high, for no session differs by a hundred times as much as others.
)";
constexpr const char* kSessionLaws =
    R"(# How far another law of the same cause deviates from that of the catalogue, as a share of the change by the effect: by the stage in which it acts, the
# centre over effects and robots. spread: standard deviation of its logarithm. most: the largest over the centre; what deviates more is another cause.
)";
constexpr const char* kScaleSd = "  # Standard deviation of the logarithm of the scale of a pair of sessions. Learnt.";
constexpr const char* kOwnScaleSd =
    "  # The same among sessions of one robot, where references are of several sessions. Learnt.";
constexpr const char* kOwnOffset =
    "  # By how much this logarithm is larger in tests than contrasts among references say. Learnt.";
constexpr const char* kEffectFreedom = "  # Of the scales of magnitudes. Learnt.";
constexpr const char* kOwnShare =
    "  # Share of what these say of the scales of single blocks that counts: few causes move all coefficients. Learnt.";
const char* stage_name(std::size_t stage) { return name_of(static_cast<model::Stage>(stage)); }
constexpr const char* kSessionParametersHead =
    R"(# Prior standard deviation of the change of a parameter, in standard deviations of its prior (configs/gap/priors.toml), by a part of its name.
# Weather: density by 1 %. A battery put back: mass by 0.5 %, centre of mass by 0.1 mm. Temperature of the motors: resistance by 2.5 %, torque constant
# by 0.3 %. Wear and grease: friction and damping by 7 %. A hinge that was touched: rest angle by 0.3 degrees. The IMU and the markers are taken off and
# put back: mounting by a tenth of its prior. Clocks drift with temperature. Choice: made before any session was seen.
)";
constexpr const char* kDelays =
    "  # Streams of a bench start earlier or later, by 0.3 ms. Choice: made after harmless development robots had been "
    "called "
    "changed.";
constexpr const char* kSessionBackground =
    R"(# Prior standard deviation of the change of each effect's magnitude from session to session, in coordinates of the effect (1: the prior of the
# catalogue).
)";

}  // namespace

double SessionVariation::log_scale() const {
  if (!own) return 0;
  const double within = own_scale_sd * own_scale_sd, precision = precision_of_scale();
  return (own->count - 1) / (within * precision) * (own->mean_log_scale + own_offset + own->from_fewer());
}

double SessionVariation::sd_of_scale() const {
  return own ? std::sqrt(own_scale_sd * own_scale_sd + 1 / precision_of_scale()) : scale_sd;
}

double SessionVariation::precision_of_scale() const {
  const double within = own_scale_sd * own_scale_sd;
  return 1 / (scale_sd * scale_sd - within) + (own->count - 1) / within;
}

double SessionVariation::freedom(std::size_t block) const {
  return own ? block_freedom + own_share * (1 - 1 / own->count) * own->known[block] : block_freedom;
}

double SessionVariation::centre(std::size_t block) const {
  if (!own) return 1;
  return std::sqrt((block_freedom + own_share * (1 - 1 / own->count) * own->squares[block]) / freedom(block));
}

ScalePrior SessionVariation::of_magnitude(const std::string& name) const {
  ScalePrior prior{effect_freedom};
  if (!own) return prior;
  const auto at = own->magnitudes.find(name);
  if (at == own->magnitudes.end()) return prior;
  const double share = 1 - 1 / own->count;
  prior.freedom += share * at->second.second;
  prior.centre = std::sqrt((effect_freedom + share * at->second.first) / prior.freedom);
  return prior;
}

double SessionVariation::parameter_sd(const std::string& name) const {
  const auto at =
      std::ranges::find_if(parameters, [&](const auto& p) { return name.find(p.first) != std::string::npos; });
  return at == parameters.end() ? 0 : at->second;
}

double SessionVariation::law_error_of(const std::string& effect) const {
  return law_error[static_cast<std::size_t>(model::stage_of(effect))];
}

double SessionVariation::background_sd(const std::string& effect) const {
  const auto at = background.find(effect);
  return at != background.end() ? at->second : background.at("other");
}

std::string session_text(const SessionVariation& s, const std::string& learnt) {
  const auto number = [](double v) { return io::format("%.4g", v); };
  std::string text =
      kSessionHead + learnt + ".\nschema = 1\n\n" + kSessionSpread + "[spread]\nscale_sd = " + number(s.scale_sd) +
      kScaleSd + "\nown_scale_sd = " + number(s.own_scale_sd) + kOwnScaleSd + "\nown_offset = " + number(s.own_offset) +
      kOwnOffset + "\nown_share = " + number(s.own_share) + kOwnShare + "\nblock_freedom = " + number(s.block_freedom) +
      "\neffect_freedom = " + number(s.effect_freedom) + kEffectFreedom + "\n\n" + kSessionLaws + "[law_error]\n";
  for (std::size_t stage = 0; stage < model::kStages; ++stage)
    text += std::string(stage_name(stage)) + " = " + number(s.law_error[stage]) + "\n";
  text += "spread = " + number(s.law_spread) + "\nmost = " + number(s.law_most) + "\n\n" + kSessionParametersHead +
          "[parameters]\n";
  for (const auto& [name, sd] : s.parameters)
    text += "\"" + name + "\" = " + number(sd) + (name.ends_with("_delay") ? kDelays : "") + "\n";
  text += "\n" + shares_text(s.shares) + kSessionBackground + "[background_sd]\n";
  for (const auto& [effect, sd] : s.background)
    text += effect + " = " + number(sd) + (effect == "other" ? kOthers : "") + "\n";
  return text;
}

SessionVariation read_session_variation(const std::filesystem::path& path) {
  const io::Config config = io::Config::load(path);
  const io::Table root = config.root();
  root.schema(1);
  SessionVariation s;
  const io::Table spread = root.table("spread");
  s.scale_sd = spread.number("scale_sd", io::positive());
  s.own_scale_sd = spread.number("own_scale_sd", io::positive(s.scale_sd));
  s.own_offset = spread.number("own_offset", io::Range{-3, 3});
  s.own_share = spread.number("own_share", io::Range{0, 1});
  s.block_freedom = spread.number("block_freedom", io::positive());
  s.effect_freedom = spread.number("effect_freedom", io::positive());
  const io::Table laws = root.table("law_error");
  for (std::size_t stage = 0; stage < model::kStages; ++stage)
    s.law_error[stage] = laws.number(stage_name(stage), io::positive());
  s.law_spread = laws.number("spread", io::positive());
  s.law_most = laws.number("most", io::Range{1, 1e3});
  const io::Table parameters = root.table("parameters");
  for (const std::string& key : parameters.keys())
    s.parameters.emplace_back(key, parameters.number(key, io::positive()));
  s.shares = read_shares(root);
  const io::Table background = root.table("background_sd");
  s.background["other"] = background.number("other", io::non_negative());
  for (const std::string& key : background.keys())
    if (key == "other" || model::is_effect(key)) s.background[key] = background.number(key, io::non_negative());
  root.finish();
  return s;
}

}  // namespace flappy::gap
