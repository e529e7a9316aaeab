#include "shared_options.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>

#include "flappy/vehicle_file.hpp"
#include "io/files.hpp"

namespace flappy::identify {

void MapSource::add(const io::Command& app, const std::string& vehicle_help) {
  app.option("--vehicle", vehicle, vehicle_help).required();
  app.option("--moment-point", moment_point,
             "torques are about this point: x,y,z in B from the torso origin in metres, or com")
      .shows_default();
  app.option("--threads", threads, "0: one for each processor; results do not depend on it").range(0, 1024);
}

model::Vehicle MapSource::read_vehicle() const { return model::read_vehicle_for_steps(vehicle, kStep_s); }

MapOptions MapSource::options(const model::Vehicle& v) const {
  MapOptions o;
  o.threads = threads;
  if (moment_point == "com") {
    o.moment_point_m = centre_of_mass(v);
    return o;
  }
  int end = 0;
  model::Triple& p = o.moment_point_m;
  const bool three = std::sscanf(moment_point.c_str(), "%lf,%lf,%lf%n", &p.x, &p.y, &p.z, &end) == 3;
  const auto near = [](double x) { return std::abs(x) <= 1; };  // false for NaN
  if (!three || static_cast<std::size_t>(end) != moment_point.size() || !near(p.x) || !near(p.y) || !near(p.z))
    throw io::InputError("--moment-point: \"" + moment_point +
                         "\" is no point; accepted: x,y,z, three numbers of metres from -1 to 1, or com");
  return o;
}

}  // namespace flappy::identify
