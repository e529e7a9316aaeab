#include "model/effects/registry.hpp"

#include <cstring>

namespace flappy::model {
namespace {

template <int... I>
std::vector<EffectEntry> list(std::integer_sequence<int, I...>) {
  return {EffectEntry{
      std::tuple_element_t<I, Effects>::kInfo,
      {std::tuple_element_t<I, Effects>::kParameters.begin(), std::tuple_element_t<I, Effects>::kParameters.end()},
      effect_rows_before<I>()}...};
}

}  // namespace

const std::vector<EffectEntry>& effects() {
  static const std::vector<EffectEntry> all = list(std::make_integer_sequence<int, kEffects>());
  return all;
}

int effect_index(const char* id) {
  for (std::size_t i = 0; i < effects().size(); ++i)
    if (std::strcmp(effects()[i].info.id, id) == 0) return static_cast<int>(i);
  return -1;
}

}  // namespace flappy::model
