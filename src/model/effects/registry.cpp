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
CatalogueEffect effect_at() {
  using Effect = EffectAt<I>;
  CatalogueEffect e{Effect::kInfo,
                    {Effect::kParameters.begin(), Effect::kParameters.end()},
                    effect_rows_before<I>(),
                    states_of<Effect>(),
                    nullptr,
                    {}};
  if constexpr (Effect::kInfo.stage == Stage::body) e.change = change<Effect>;
  return e;
}

template <auto stage, std::size_t count, class... Further>
void staged(const double* parameters, Further... further) {
  stage(*reinterpret_cast<const double(*)[count]>(parameters), further...);
}

template <class Effect>
CatalogueEffect averaged_effect() {
  constexpr std::size_t kCount = beat_averaged_parameters<Effect>().size();
  EffectInfo info = Effect::kInfo;
  if constexpr (requires { Effect::kBeatAveragedMagnitudes; }) info.magnitudes = Effect::kBeatAveragedMagnitudes;
  CatalogueEffect e{
      info, {beat_averaged_parameters<Effect>().begin(), beat_averaged_parameters<Effect>().end()}, 0, 0, nullptr, {}};
  if constexpr (Effect::kInfo.stage == Stage::body) e.change = change<Effect>;
  if constexpr (requires { Effect::template beat_averaged_drive<double>; })
    e.averaged.drive = staged<Effect::template beat_averaged_drive<double>, kCount, BeatAveragedDrive<double>&>;
  if constexpr (requires { Effect::template beat_averaged_wind<double>; })
    e.averaged.wind =
        staged<Effect::template beat_averaged_wind<double>, kCount, const BeatAveragedState<double>&, Vec3<double>&>;
  if constexpr (requires { Effect::template beat_averaged_load<double>; })
    e.averaged.load = staged<Effect::template beat_averaged_load<double>, kCount, const BeatAveragedState<double>&,
                             BeatAveragedLoads<double>&>;
  if constexpr (requires { Effect::template beat_averaged_seen<double>; })
    e.averaged.seen =
        staged<Effect::template beat_averaged_seen<double>, kCount, const BeatAveragedState<double>&, Vec3<double>&>;
  if constexpr (requires { Effect::template beat_averaged_swing<double>; }) {
    e.averaged.hang =
        staged<Effect::template beat_averaged_hang<double>, kCount, const BeatAveragedState<double>&, Hanging<double>&>;
    e.averaged.swing = staged<Effect::template beat_averaged_swing<double>, kCount, const BeatAveragedState<double>&,
                              const double&, Hanging<double>&>;
  }
  return e;
}

template <class... Effect>
std::vector<CatalogueEffect> averaged_list(std::tuple<Effect...>*) {
  return {averaged_effect<Effect>()...};
}

const std::vector<CatalogueEffect>& means() {
  static const std::vector<CatalogueEffect> all = averaged_list(static_cast<BeatAveragedEffects*>(nullptr));
  return all;
}

template <int... I>
std::vector<CatalogueEffect> list(std::integer_sequence<int, I...>) {
  return {effect_at<I>()...};
}

}  // namespace

const char* name_of(Stage stage) {
  constexpr std::array<const char*, kStages> kNames = {"body", "drive", "wing", "air", "world", "sensor"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::vector<double> CatalogueEffect::values(const std::map<std::string, double>& given) const {
  std::vector<double> list;
  for (const EffectParameter& p : parameters) {
    const auto own = given.find(p.name);
    list.push_back(own != given.end() ? own->second : p.typical);
  }
  return list;
}

std::vector<double> CatalogueEffect::values_of(const Vehicle& vehicle) const {
  const auto own = vehicle.effects.find(info.id);
  if (own != vehicle.effects.end()) return values(own->second);
  std::vector<double> typical = values({});
  std::fill_n(typical.begin(), info.magnitudes, 0.0);
  return typical;
}

bool CatalogueEffect::acts(const std::vector<double>& values) const {
  return std::any_of(values.begin(), values.begin() + info.magnitudes, [](double magnitude) { return magnitude != 0; });
}

const std::vector<CatalogueEffect>& effects() {
  static const std::vector<CatalogueEffect> all = list(std::make_integer_sequence<int, kEffects>());
  return all;
}

namespace {

const CatalogueEffect* effect_named(const std::string& id) {
  for (const auto* catalogue : {&effects(), &means()})
    for (const CatalogueEffect& e : *catalogue)
      if (e.info.id == id) return &e;
  return nullptr;
}

std::vector<CatalogueEffect> of_sensors() {
  std::vector<CatalogueEffect> list;
  for (const CatalogueEffect& e : effects())
    if (e.info.stage == Stage::sensor) list.push_back(e);
  return list;
}

}  // namespace

const std::vector<CatalogueEffect>& catalogue_of(const Vehicle& vehicle) {
  static const std::vector<CatalogueEffect> seen = of_sensors();
  return vehicle.beat_averaged ? means() : vehicle.jointed ? seen : effects();
}

const CatalogueEffect* find_effect(const Vehicle& vehicle, const std::string& id) {
  const std::vector<CatalogueEffect>& all = catalogue_of(vehicle);
  const auto found = std::ranges::find_if(all, [&](const CatalogueEffect& e) { return e.info.id == id; });
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

const CatalogueEffect& effect_within_beat(const std::string& id) {
  return effects()[static_cast<std::size_t>(effect_index(id.c_str()))];
}

bool is_effect(const std::string& id) { return effect_named(id) != nullptr; }

Stage stage_of(const std::string& id) { return effect_named(id)->info.stage; }

std::string group_of(const std::string& id) {
  const CatalogueEffect* entry = effect_named(id);
  return entry == nullptr || *entry->info.group == 0 ? id : entry->info.group;
}

std::vector<std::string> whole_group(const std::vector<CatalogueEffect>& catalogue, const std::string& id) {
  std::vector<std::string> all;
  for (const CatalogueEffect& e : catalogue)
    if (group_of(e.info.id) == group_of(id)) all.emplace_back(e.info.id);
  return all;
}

}  // namespace flappy::model
