#include "gap/localise/ladder.hpp"

#include <algorithm>
#include <cmath>

#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

std::size_t rung_of_channel(int channel, bool clamped) {
  switch (channel) {
    case kStrokeLeft:
    case kStrokeRight:
    case kRotationLeft:
    case kRotationRight:
    case kBattery:
    case kCurrentLeft:
    case kCurrentRight:
      return kDriveRung;
    default:
      return clamped ? kAirRung : kBodyRung;
  }
}

/// Root mean square of residual over noise on one rung; none: no row of it is known.
std::optional<double> error_on(std::size_t rung, const RowContext& around, const TestResiduals* residual) {
  if (residual == nullptr) return {};
  double squares = 0, count = 0;
  for (std::size_t f = 0; f < around.beats.size(); ++f) {
    const Rows& rows = (*residual)[f];
    if (rows.empty()) return {};  // the simulation diverged
    for (int channel = 0; channel < kChannels; ++channel) {
      if (rung_of_channel(channel, around.clamped[f] != 0) != rung) continue;
      for (int c = 0; c < kCoefficients; ++c) {
        const double noise = around.noise_sd_of(around.clamped[f] != 0, channel, c);
        if (!around.has_rows(channel, c) || !(noise > 0)) continue;
        for (std::size_t beat = 0; beat < around.beats[f]; ++beat)
          if (around.covers(f, beat, channel))
            squares += std::pow(rows[beat * kRowsPerBeat + group_of(channel, c)] / noise, 2), count += 1;
      }
    }
  }
  if (count == 0) return {};
  return std::sqrt(squares / count);
}

}  // namespace

std::size_t rung_of_effect(const std::string& effect) {
  if (effect == "wing_inertia") return kDriveRung;  // of the body, but it acts on the wings
  if (effect == "wing_damage") return kAirRung;
  for (const char* surroundings : {"wind", "ground_effect", "ceiling_effect"})
    if (effect == surroundings) return kBodyRung;  // of the air, but a clamped robot does not show them
  switch (model::stage_of(effect)) {
    case model::Stage::drive:
    case model::Stage::wing:
      return kDriveRung;
    case model::Stage::air:
      return kAirRung;
    default:
      return kBodyRung;
  }
}

std::array<double, kRungs> rung_probabilities(const std::vector<RankedHypothesis>& hypotheses) {
  std::array<double, kRungs> sums{};
  for (const RankedHypothesis& h : hypotheses)
    for (std::size_t rung = 0; rung < kRungs; ++rung)
      if (std::ranges::any_of(h.effects, [&](const std::string& e) { return rung_of_effect(e) == rung; }))
        sums[rung] += h.probability;
  return sums;
}

std::vector<LadderRung> ladder_of(const RowContext& around, const TestResiduals& nominal, const TestResiduals& refit,
                                  const TestResiduals* effect, const std::vector<RankedHypothesis>& hypotheses) {
  constexpr const char* kNames[kRungs] = {"drive and hinges", "air", "body and sensors"};
  const std::array<double, kRungs> probabilities = rung_probabilities(hypotheses);
  std::vector<LadderRung> ladder;
  for (std::size_t rung = 0; rung < kRungs; ++rung)
    ladder.push_back({kNames[rung], error_on(rung, around, &nominal), error_on(rung, around, &refit),
                      error_on(rung, around, effect), probabilities[rung]});
  return ladder;
}

}  // namespace flappy::gap
