// flappy-identify simulate-forces: simulates the force map that a laboratory would measure of a vehicle.
#include <cstdio>
#include <memory>

#include "command.hpp"
#include "identify/force_sensor.hpp"
#include "shared_options.hpp"

namespace flappy::identify {

Command add_simulate_forces(const io::Command& program) {
  struct Settings {
    MapSource source;
    std::string out, inputs, noise = "nano17";
    std::uint64_t seed = 1;
  };
  const auto s = std::make_shared<Settings>();
  io::Command app = program.command("simulate-forces", "writes the force map a laboratory would measure of a vehicle");
  s->source.add(app, "vehicle to measure");
  app.option("--out", s->out, "table to write").required();
  app.option("--inputs", s->inputs, "table of inputs; without it, 37 about hover");
  app.option("--seed", s->seed, "of the noise").range(std::uint64_t{0}, kLargestSeed).shows_default();
  app.option("--noise", s->noise, "sensor: nano17 or none").one_of({"nano17", "none"});
  return {app, [s] {
            const model::Vehicle vehicle = s->source.read_vehicle();
            const std::vector<sim::Input> inputs =
                s->inputs.empty() ? default_inputs(vehicle.driver) : read_inputs(s->inputs, vehicle.driver);
            io::check_output(s->out);
            ForceSensor sensor;
            if (s->noise == "none") sensor.noise_steps = 0;
            const MeasuredMap map = simulate_forces(vehicle, inputs, sensor, s->seed, s->source.options(vehicle));
            write_measured_map(s->out, map);
            const Window window = whole_beats(vehicle.driver);
            std::printf("%s: %zu inputs, mean over %d beats (%.4g s), sensor %s\n", vehicle.name.c_str(), map.size(),
                        window.beats, window.steps * kStep_s, s->noise.c_str());
            return Json{{"vehicle", vehicle.name}, {"inputs", map.size()}, {"beats", window.beats}};
          }};
}

}  // namespace flappy::identify
