#include "model/effects/registry.hpp"

#include <algorithm>
#include <cstring>

#include "flappy/vehicle.hpp"

namespace flappy::model {
namespace {

template <class Effect>
void change(const double* parameters, Vehicle& v) {
  constexpr std::size_t kCount = Effect::kParameters.size();
  Effect::vehicle(*reinterpret_cast<const double(*)[kCount]>(parameters), v);
}

template <int I>
EffectEntry entry() {
  using Effect = EffectAt<I>;
  EffectEntry e{Effect::kInfo,
                {Effect::kParameters.begin(), Effect::kParameters.end()},
                effect_rows_before<I>(),
                states_of<Effect>(),
                nullptr,
                {}};
  if constexpr (Effect::kInfo.stage == Stage::body) e.change = change<Effect>;
  return e;
}

/// A stage that reads its parameters as an array.
template <auto stage, std::size_t count, class... Further>
void staged(const double* parameters, Further... further) {
  stage(*reinterpret_cast<const double(*)[count]>(parameters), further...);
}

template <class Effect>
EffectEntry mean_entry() {
  constexpr std::size_t kCount = mean_parameters<Effect>().size();
  EffectInfo info = Effect::kInfo;
  if constexpr (requires { Effect::kMeanSizes; }) info.sizes = Effect::kMeanSizes;
  EffectEntry e{info, {mean_parameters<Effect>().begin(), mean_parameters<Effect>().end()}, 0, 0, nullptr, {}};
  if constexpr (Effect::kInfo.stage == Stage::body) e.change = change<Effect>;
  if constexpr (requires { Effect::template mean_drive<double>; })
    e.mean.drive = staged<Effect::template mean_drive<double>, kCount, MeanDrive<double>&>;
  if constexpr (requires { Effect::template mean_wind<double>; })
    e.mean.wind = staged<Effect::template mean_wind<double>, kCount, const MeanState<double>&, Vec3<double>&>;
  if constexpr (requires { Effect::template mean_load<double>; })
    e.mean.load = staged<Effect::template mean_load<double>, kCount, const MeanState<double>&, MeanLoads<double>&>;
  if constexpr (requires { Effect::template mean_seen<double>; })
    e.mean.seen = staged<Effect::template mean_seen<double>, kCount, const MeanState<double>&, Vec3<double>&>;
  return e;
}

template <class... Effect>
std::vector<EffectEntry> mean_list(std::tuple<Effect...>*) {
  return {mean_entry<Effect>()...};
}

const std::vector<EffectEntry>& means() {
  static const std::vector<EffectEntry> all = mean_list(static_cast<MeanEffects*>(nullptr));
  return all;
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

std::vector<double> EffectEntry::values_of(const Vehicle& vehicle) const {
  const auto own = vehicle.effects.find(info.id);
  if (own != vehicle.effects.end()) return values(own->second);
  std::vector<double> typical = values({});
  std::fill_n(typical.begin(), info.sizes, 0.0);
  return typical;
}

bool EffectEntry::acts(const std::vector<double>& values) const {
  return std::any_of(values.begin(), values.begin() + info.sizes, [](double size) { return size != 0; });
}

const std::vector<EffectEntry>& effects() {
  static const std::vector<EffectEntry> all = list(std::make_integer_sequence<int, kEffects>());
  return all;
}

namespace {

const EffectEntry* entry_of(const std::string& id) {
  for (const auto* catalogue : {&effects(), &means()})
    for (const EffectEntry& e : *catalogue)
      if (e.info.id == id) return &e;
  return nullptr;
}

}  // namespace

const std::vector<EffectEntry>& catalogue_of(const Vehicle& vehicle) {
  static const std::vector<EffectEntry> seen = [] {
    std::vector<EffectEntry> of_sensors;
    for (const EffectEntry& e : effects())
      if (e.info.stage == Stage::sensor) of_sensors.push_back(e);
    return of_sensors;
  }();
  return vehicle.beat_averaged ? means() : vehicle.jointed ? seen : effects();
}

const EffectEntry* find_effect(const Vehicle& vehicle, const std::string& id) {
  const std::vector<EffectEntry>& all = catalogue_of(vehicle);
  const auto found = std::ranges::find_if(all, [&](const EffectEntry& e) { return e.info.id == id; });
  return found == all.end() ? nullptr : &*found;
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

bool is_effect(const std::string& id) { return entry_of(id) != nullptr; }

std::string group_of(const std::string& id) {
  const EffectEntry* entry = entry_of(id);
  return entry == nullptr || *entry->info.group == 0 ? id : entry->info.group;
}

std::vector<std::string> whole_group(const std::vector<EffectEntry>& catalogue, const std::string& id) {
  std::vector<std::string> all;
  for (const EffectEntry& e : catalogue)
    if (group_of(e.info.id) == group_of(id)) all.emplace_back(e.info.id);
  return all;
}

}  // namespace flappy::model
