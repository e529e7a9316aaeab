// flappy-identify compare-map: compares a vehicle's force map with the lines published for the real robot.
#include <cstdio>
#include <memory>

#include "command.hpp"
#include "identify/linear_map.hpp"
#include "io/installation.hpp"
#include "shared_options.hpp"

namespace flappy::identify {

Command add_compare_map(const io::Command& program) {
  struct Settings {
    MapSource source;
    std::string published = io::config_path("identify/published_map.toml");
  };
  const auto s = std::make_shared<Settings>();
  s->source.moment_point = "com";
  io::Command app =
      program.command("compare-map", "compares a vehicle's force map with that published for the real robot");
  s->source.add(app, "vehicle to simulate");
  app.option("--published", s->published, "slopes and offsets of the real robot").shows_default();
  return {app, [s] {
            const model::Vehicle vehicle = s->source.read_vehicle();
            const LinearMap published = read_published_map(s->published);
            const LinearMap simulated = linear_map(vehicle, s->source.options(vehicle));
            std::printf("%s, torques about %s, N and N m per input\n", vehicle.name.c_str(),
                        s->source.moment_point.c_str());
            std::printf("%-8s %12s %12s %7s %13s %12s\n", "", "slope", "published", "ratio", "offset", "published");
            Json lines = Json::object();
            for (std::size_t i = 0; i < kLineNames.size(); ++i) {
              const double ratio = simulated[i].slope / published[i].slope;
              std::printf("%-8s %12.4g %12.4g %7.3f %13.4g %12.4g\n", kLineNames[i], simulated[i].slope,
                          published[i].slope, ratio, simulated[i].offset, published[i].offset);
              lines[kLineNames[i]] = {{"slope", simulated[i].slope},
                                      {"slope_published", published[i].slope},
                                      {"slope_ratio", ratio},
                                      {"offset", simulated[i].offset},
                                      {"offset_published", published[i].offset}};
            }
            std::printf("thrust is zero at %.3f V, published %.3f V\n", -simulated[0].offset / simulated[0].slope,
                        -published[0].offset / published[0].slope);
            return Json{{"vehicle", vehicle.name}, {"moment_point", s->source.moment_point}, {"lines", lines}};
          }};
}

}  // namespace flappy::identify
