// Renamed keys of configuration files. For one release, an old key is refused with a message that gives the new one.
#pragma once

#include <string_view>
#include <utility>

namespace flappy::io {

inline constexpr std::pair<std::string_view, const char*> kRenamedKeys[] = {
    // configs/gap/verdict.toml
    {"doubt", "tempering"},
    {"freeing_nats", "penalty_nats"},
    {"least_share", "min_share"},
    {"size_error", "magnitude_error"},
    {"vanished_size", "vanished_magnitude"},
    // configs/gap/model_discrepancy.toml
    {"beside_all", "beat_averaged"},
    {"entry_freedom", "effect_freedom"},
};

inline const char* new_name(std::string_view key) {  ///< null: not renamed
  for (const auto& [old_key, now] : kRenamedKeys)
    if (old_key == key) return now;
  return nullptr;
}

}  // namespace flappy::io
