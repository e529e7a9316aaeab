#include "lab/blind/a/a_effects.hpp"

#include <algorithm>
#include <sstream>

#include "io/files.hpp"

namespace flappy::blind {

const std::array<std::string, kBlindEffects>& effect_names() {
#define FLAPPY_TEXT(...) #__VA_ARGS__
#define FLAPPY_TEXT_OF(list) FLAPPY_TEXT(list)
  static const std::array<std::string, kBlindEffects> kNames = [] {
    std::array<std::string, kBlindEffects> names;
    std::istringstream list(FLAPPY_TEXT_OF(FLAPPY_BLIND_EFFECTS));
    for (std::string& name : names) std::getline(list >> std::ws, name, ',');
    return names;
  }();
#undef FLAPPY_TEXT_OF
#undef FLAPPY_TEXT
  return kNames;
}

Magnitudes::Magnitudes(const std::vector<BlindEffect>& effects) {
  const auto& names = effect_names();
  std::array<bool, kBlindEffects> given{};
  for (const BlindEffect& e : effects) {
    const auto k = static_cast<std::size_t>(std::ranges::find(names, e.id) - names.begin());
    if (k == kBlindEffects)
      throw io::InputError("--effect " + e.id + ": no such effect; accepted: what `flappy-blind effects` lists" +
                           io::did_you_mean(e.id, {names.begin(), names.end()}));
    if (given[k]) throw io::InputError("--effect " + e.id + ": given twice; accepted: each effect once");
    if (!(e.magnitude >= 0 && e.magnitude <= 4))
      throw io::InputError("--effect " + e.id + ": magnitude " + io::shortest_digits(e.magnitude) +
                           " is out of range; accepted: 0 to 4, 1 is typical");
    given[k] = true;
    magnitude_[k] = e.magnitude;
  }
}

}  // namespace flappy::blind
