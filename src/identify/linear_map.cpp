#include "identify/linear_map.hpp"

#include "identify/force_sensor.hpp"
#include "io/config.hpp"

namespace flappy::identify {

LinearMap read_published_map(const std::filesystem::path& path) {
  const io::Table root = io::Config::load(path).root();
  root.schema(1);
  LinearMap map;
  map[0] = {root.number("thrust.slope_N_V"), root.number("thrust.offset_N")};
  map[1] = {root.number("roll.slope_Nm_V"), root.number("roll.offset_Nm")};
  map[2] = {root.number("pitch.slope_Nm_V"), root.number("pitch.offset_Nm")};
  map[3] = {root.number("yaw.slope_Nm"), root.number("yaw.offset_Nm")};
  root.finish();
  return map;
}

LinearMap linear_map(const model::Vehicle& vehicle, const MapOptions& options) {
  const std::vector<sim::Input> inputs = default_inputs(vehicle.driver);
  const std::vector<Wrench> wrenches = whole_map(vehicle, inputs, options);
  LinearMap map;
  for (std::size_t line = 0; line < map.size(); ++line) {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const sim::Input& u = inputs[i];
      const std::array<double, 4> values = {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
      const bool plain = u.difference_V == 0 && u.bias_V == 0 && u.split_cycle == 0;
      if (line == 0 ? !plain : values[line] == 0) continue;
      const double value = wrenches[i][line + 2];
      n += 1, x += values[line], y += value, xx += values[line] * values[line], xy += values[line] * value;
    }
    map[line].slope = (n * xy - x * y) / (n * xx - x * x);
    map[line].offset = (y - map[line].slope * x) / n;
  }
  return map;
}

}  // namespace flappy::identify
