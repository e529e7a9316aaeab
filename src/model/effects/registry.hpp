// Every effect beyond the base model. A new one is added here, and nowhere else.
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "model/effects/body_drag.hpp"
#include "model/effects/ground_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

using Effects = std::tuple<BodyDrag, GroundEffect>;

inline constexpr int kEffects = std::tuple_size_v<Effects>;

/// Rows of parameters before those of effect `I`; of all effects for I = kEffects.
template <int I>
constexpr int effect_rows_before() {
  if constexpr (I == 0) return 0;
  else return effect_rows_before<I - 1>() + static_cast<int>(std::tuple_element_t<I - 1, Effects>::kParameters.size());
}
inline constexpr int kEffectRows = effect_rows_before<kEffects>();

}  // namespace FLAPPY_ISA

/// What the rest of the project knows of an effect.
struct EffectEntry {
  EffectInfo info;
  std::vector<EffectParameter> parameters;
  int first_row;  ///< of its parameters in a block's effect rows
};

/// The registry by index, which is also the bit of an effect in a block's set.
const std::vector<EffectEntry>& effects();
/// Index of `id`, or -1.
int effect_index(const char* id);

}  // namespace flappy::model
