// The shipped vehicles, for tests.
#pragma once

#include <string>

#include "flappy/vehicle_file.hpp"

namespace flappy::test {

inline std::string source_path(const std::string& path) { return std::string(FLAPPY_SOURCE_DIR) + "/" + path; }
inline model::Vehicle nominal() {
  return model::read_vehicle(source_path("configs/vehicles/hummingbird_nominal.toml"));
}
inline model::Vehicle identified() {
  return model::read_vehicle(source_path("configs/vehicles/hummingbird_identified.toml"));
}

}  // namespace flappy::test
