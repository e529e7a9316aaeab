#include "model/effects/registry.hpp"

#include <algorithm>
#include <cstring>

#include "flappy/vehicle.hpp"

namespace flappy::model {
namespace {

template <int I>
void change(const double* parameters, Vehicle& v) {
  constexpr std::size_t kCount = EffectAt<I>::kParameters.size();
  EffectAt<I>::vehicle(*reinterpret_cast<const double(*)[kCount]>(parameters), v);
}

template <int I>
EffectEntry entry() {
  using Effect = EffectAt<I>;
  EffectEntry e{Effect::kInfo,
                {Effect::kParameters.begin(), Effect::kParameters.end()},
                effect_rows_before<I>(),
                states_of<Effect>(),
                nullptr};
  if constexpr (Effect::kInfo.stage == Stage::body) e.change = change<I>;
  return e;
}

template <int... I>
std::vector<EffectEntry> list(std::integer_sequence<int, I...>) {
  return {entry<I>()...};
}

}  // namespace

std::vector<double> EffectEntry::values(const std::map<std::string, double>& given) const {
  std::vector<double> list;
  for (const EffectParameter& p : parameters) {
    const auto own = given.find(p.name);
    list.push_back(own != given.end() ? own->second : p.typical);
  }
  return list;
}

bool EffectEntry::acts(const std::vector<double>& values) const {
  return std::any_of(values.begin(), values.begin() + info.sizes, [](double size) { return size != 0; });
}

const std::vector<EffectEntry>& effects() {
  static const std::vector<EffectEntry> all = list(std::make_integer_sequence<int, kEffects>());
  return all;
}

std::uint64_t sensor_effects() {
  static const std::uint64_t set = [] {
    std::uint64_t bits = 0;
    for (std::size_t e = 0; e < effects().size(); ++e)
      if (effects()[e].info.stage == Stage::sensor) bits |= std::uint64_t{1} << e;
    return bits;
  }();
  return set;
}

int effect_index(const char* id) {
  for (std::size_t i = 0; i < effects().size(); ++i)
    if (std::strcmp(effects()[i].info.id, id) == 0) return static_cast<int>(i);
  return -1;
}

std::string group_of(const std::string& id) {
  const int index = effect_index(id.c_str());
  const std::string group = index < 0 ? "" : effects()[static_cast<std::size_t>(index)].info.group;
  return group.empty() ? id : group;
}

std::vector<std::string> whole_group(const std::string& id) {
  std::vector<std::string> all;
  for (const EffectEntry& e : effects())
    if (group_of(e.info.id) == group_of(id)) all.emplace_back(e.info.id);
  return all;
}

}  // namespace flappy::model
