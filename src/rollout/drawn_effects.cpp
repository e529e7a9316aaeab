#include "rollout/drawn_effects.hpp"

#include <algorithm>
#include <cmath>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"
#include "io/text.hpp"

namespace flappy::rollout {
namespace {

/// Random numbers of an effect start at its place in the catalogue times this; the first are of the choice of effects.
constexpr std::uint32_t kIndicesPerEffect = 16;

/// Share of an effect's typical magnitude that acts, though hardly.
constexpr double kHardlyOn = 1e-6;

/// Which of `count` things a uniform number chooses.
std::size_t chosen(double uniform, std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(uniform * static_cast<double>(count)));
}

/// Index of the effect that a uniform number chooses, the more probable the larger its weight.
std::size_t chosen(double uniform, const std::vector<DrawnEffects::Weighted>& of) {
  double all = 0;
  for (const DrawnEffects::Weighted& w : of) all += w.weight;
  double left = uniform * all;
  for (std::size_t i = 0; i < of.size(); ++i)
    if ((left -= of[i].weight) < 0) return i;
  return of.size() - 1;
}

/// Whether the typical magnitudes may change places: they are of one kind, and some are 0.
bool change_places(const model::CatalogueEffect& effect) {
  const auto* const first = effect.parameters.data();
  const auto* const last = first + effect.info.magnitudes;
  return std::any_of(first, last, [](const model::EffectParameter& p) { return p.typical == 0; }) &&
         std::all_of(first, last,
                     [&](const model::EffectParameter& p) { return p.low == first->low && p.high == first->high; });
}

}  // namespace

void DrawnEffects::add(sim::RandomKey key, model::Vehicle& vehicle) const {
  key.stream = sim::Stream::effects;
  const sim::UniformPair how_many = sim::uniform_pair(key, 0);
  if (how_many.first < none || of.empty()) return;
  std::vector<Weighted> left = of;
  const std::size_t count = std::min(left.size(), 1 + chosen(how_many.second, most));
  for (std::size_t k = 0; k < count; ++k) {
    const auto base = static_cast<std::uint32_t>(k + 1) * kIndicesPerEffect;
    const sim::UniformPair which = sim::uniform_pair(key, base);
    const auto at = left.begin() + static_cast<std::ptrdiff_t>(chosen(which.first, left));
    const model::CatalogueEffect& effect = *at->effect;
    left.erase(at);
    if (vehicle.effects.contains(effect.info.id)) continue;
    const auto magnitudes = static_cast<std::size_t>(effect.info.magnitudes);
    const std::size_t turned = change_places(effect) ? chosen(sim::uniform_pair(key, base + 1).first, magnitudes) : 0;
    auto& values = vehicle.effects[effect.info.id];
    for (std::size_t i = 0; i < magnitudes; ++i) {
      const model::EffectParameter& p = effect.parameters[i];
      const bool negative =
          p.prior_low < 0 && sim::uniform_pair(key, base + 2 + static_cast<std::uint32_t>(i)).first < 0.5;
      const double typical = effect.parameters[(i + turned) % magnitudes].typical;
      values[p.name] = std::clamp((negative ? -1 : 1) * magnitude * which.second * typical, p.low, p.high);
    }
  }
}

void DrawnEffects::make_room(model::Vehicle& vehicle) const {
  for (const auto& [effect, weight] : of) {
    if (vehicle.effects.contains(effect->info.id)) continue;
    auto& values = vehicle.effects[effect->info.id];
    for (std::size_t i = 0; i < static_cast<std::size_t>(effect->info.magnitudes); ++i) {
      const model::EffectParameter& p = effect->parameters[i];
      values[p.name] = vehicle.beat_averaged ? kHardlyOn * p.typical : 0;
    }
  }
}

DrawnEffects read_drawn_effects(const io::Table& table, const model::Vehicle& vehicle, bool has_ground) {
  DrawnEffects drawn;
  drawn.none = table.number("none", {0, 1});
  drawn.most = static_cast<std::size_t>(table.integer("most", 1, 8));
  drawn.magnitude = table.number("magnitude", {0, 10});
  const auto weights = table.optional_table("weights");
  std::vector<std::string> known;
  for (const model::CatalogueEffect& effect : model::catalogue_of(vehicle)) {
    const std::string id = effect.info.id;
    known.push_back(id);
    const bool hangs_nowhere = id == model::Tether::kInfo.id && !has_ground;
    const double weight = weights ? weights->number_or(id, hangs_nowhere ? 0 : 1, {0, 1e6}) : hangs_nowhere ? 0 : 1;
    if (weight > 0 && hangs_nowhere) weights->fail(id, "has no ground that it hangs down to", "0, or world.ground_z_m");
    if (weight > 0) drawn.of.push_back({&effect, weight});
  }
  if (!weights) return drawn;
  for (const std::string& id : weights->keys())
    if (!std::ranges::count(known, id))
      weights->fail(id, "is no effect of this vehicle",
                    "those that docs/reference/effects.md lists for it" + io::did_you_mean(id, known));
  if (drawn.of.empty()) table.fail("weights", "are all 0", "one above 0");
  return drawn;
}

}  // namespace flappy::rollout
