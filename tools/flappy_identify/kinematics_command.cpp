// flappy-identify kinematics: compares measured with simulated wing angles over one beat.
#include <cstdio>
#include <limits>
#include <memory>
#include <numbers>

#include "command.hpp"
#include "identify/kinematics.hpp"
#include "identify/measured_map.hpp"
#include "io/files.hpp"
#include "shared_options.hpp"

namespace flappy::identify {
namespace {

struct KinematicsSettings {
  MapSource source;
  std::string measured, csv, svg;
  sim::Input input;
  io::Option amplitude;
  double from_s = -std::numeric_limits<double>::infinity(), to_s = std::numeric_limits<double>::infinity();
};

Json figures(const BeatParameters& f) {
  return {{"amplitude_rad", f.amplitude_rad}, {"bias_rad", f.bias_rad}, {"phase_rad", f.phase_rad}};
}

Json run(const KinematicsSettings& s) {
  constexpr double kDegree = std::numbers::pi / 180;
  const model::Vehicle vehicle = s.source.read_vehicle();
  if (!(s.from_s < s.to_s)) throw io::InputError("--from-s: is not before --to-s; accepted: a time before it");
  for (const std::string& out : {s.csv, s.svg})
    if (!out.empty()) io::check_output(out);
  WingSamples samples = read_wing_samples(s.measured);
  cut(samples, s.from_s, s.to_s);
  if (s.amplitude.given() == false && !samples.input)
    throw io::InputError(samples.name + ": amplitude_V: column is missing; accepted: this column, or --amplitude");
  const bool given = s.amplitude.given();
  const sim::Input input = given ? s.input : *samples.input;
  check_limits(input, vehicle.driver, given ? "command line" : samples.name);
  const WingComparison c = compare_wings(vehicle, input, samples, s.source.options(vehicle));
  if (!s.csv.empty()) write_beat_csv(s.csv, c);
  if (!s.svg.empty()) write_beat_svg(s.svg, c);
  std::printf("%s at %g V, %zu samples; t_s = 0 is at %.1f deg of the beat; all angles in degrees\n",
              vehicle.name.c_str(), input.amplitude_V, samples.t_s.size(), c.shift_rad / kDegree);
  std::printf("%-18s %20s %20s %8s %8s %9s\n", "", "amplitude meas. sim.", "bias meas. sim.", "phase", "rms",
              "scatter");
  Json angles = Json::object();
  for (std::size_t i = 0; i < kAngleNames.size(); ++i) {
    const AngleComparison& a = c.angles[i];
    const std::string name = kAngleNames[i];
    std::printf("%-18s %10.2f %9.2f %10.2f %9.2f %8.2f %8.2f %9.2f\n", name.substr(0, name.size() - 4).c_str(),
                a.measured.amplitude_rad / kDegree, a.simulated.amplitude_rad / kDegree, a.measured.bias_rad / kDegree,
                a.simulated.bias_rad / kDegree, a.phase_rad / kDegree, a.rms_rad / kDegree, a.scatter_rad / kDegree);
    angles[name] = {{"measured", figures(a.measured)},
                    {"simulated", figures(a.simulated)},
                    {"phase_rad", a.phase_rad},
                    {"rms_rad", a.rms_rad},
                    {"scatter_rad", a.scatter_rad}};
  }
  return {{"vehicle", vehicle.name}, {"samples", samples.t_s.size()}, {"shift_rad", c.shift_rad}, {"angles", angles}};
}

}  // namespace

Command add_kinematics(const io::Command& program) {
  const auto s = std::make_shared<KinematicsSettings>();
  io::Command app = program.command("kinematics", "compares measured with simulated strokes and rotations");
  app.option("measured", s->measured, "table of wing angles, as a flight log's wings.csv").required();
  s->source.add(app, "vehicle to simulate, welded");
  s->amplitude = app.option("--amplitude", s->input.amplitude_V, "input in V, in place of the table's columns");
  app.option("--difference", s->input.difference_V, "in V").needs(s->amplitude);
  app.option("--bias", s->input.bias_V, "in V").needs(s->amplitude);
  app.option("--split-cycle", s->input.split_cycle, "fraction of a beat").needs(s->amplitude);
  app.option("--from-s", s->from_s, "leave out samples before");
  app.option("--to-s", s->to_s, "leave out samples after");
  app.option("--csv", s->csv, "both curves over the beat");
  app.option("--svg", s->svg, "figure of both, by gnuplot");
  return {app, [s] { return run(*s); }};
}

}  // namespace flappy::identify
