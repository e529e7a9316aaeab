// flappy-identify transitions: open-loop test of a vehicle on recorded flights.
#include <chrono>
#include <cstdio>
#include <memory>
#include <numbers>

#include "command.hpp"
#include "flappy/vehicle_file.hpp"
#include "identify/transitions.hpp"
#include "io/sha256.hpp"

namespace flappy::identify {
namespace {

namespace fs = std::filesystem;

struct Request {
  std::vector<std::string> flights;
  std::string vehicle, csv;
  bool truth = false;
  TransitionOptions options;
};

/// The requested vehicle file, or the one that the log names, searched in the log's folder and in its parent.
fs::path vehicle_path(const Request& request, const fs::path& folder, const flightlog::FlightHeader& header) {
  if (!request.vehicle.empty()) return request.vehicle;
  for (const fs::path& place : {folder / header.vehicle, folder / ".." / header.vehicle}) {
    if (!fs::exists(place)) continue;
    if (!header.vehicle_sha256.empty() && io::sha256(io::read_text(place)) != header.vehicle_sha256)
      throw io::InputError(place.string() + ": is not the file that " + folder.string() +
                           " was flown with (SHA-256); accepted: that file, or any by --vehicle");
    return place;
  }
  throw io::InputError(folder.string() + ": its vehicle " + header.vehicle +
                       " is neither in it nor next to it; accepted: one of these, or --vehicle");
}

/// Scale and unit for printing a state: millimetres, degrees.
struct Shown {
  double scale;
  const char* unit;
};
Shown shown(std::size_t state) {
  if (state < 3) return {1e3, "mm"};
  if (state < 6) return {180 / std::numbers::pi, "deg"};
  return state < 9 ? Shown{1e3, "mm/s"} : Shown{1, "rad/s"};
}

void print(const Request& request, const TransitionReport& r, double wall_s) {
  std::printf(
      "%zu flights, %zu samples replayed of %zu (%zu too low, %zu where streams are missing), %zu diverged; %.2f s\n",
      request.flights.size(), r.samples, r.recorded, r.low, r.not_covered, r.diverged, wall_s);
  if (r.diverged > 0) std::printf("those that diverged count as infinitely far off\n");
  if (request.options.accept_innovation)
    std::printf("motion capture and IMU disagree by up to %.1f times their declared noise\n", r.normalised_innovation);
  std::printf("one beat is %.1f ms, two are %.1f: whole intervals of %s\n", 1e3 * r.beats_s[0], 1e3 * r.beats_s[1],
              request.options.source == Source::truth ? "truth.csv" : "the IMU");
  std::printf(request.options.source == Source::truth ? "from truth.csv: what is left is the vehicle's error alone\n"
                                                      : "with what the sensors leave unknown of a start and an end: of "
                                                        "a simulated flight, --truth leaves it out\n");
  std::printf("  %-6s %11s  %25s  %33s\n", "", "range", "after one beat", "after two beats");
  std::printf("  %-6s %11s", "state", "in a beat");
  for (int beats = 1; beats <= 2; ++beats) std::printf(" %9s %7s %7s %7s", "median", "90 %", "median", "90 %");
  std::printf("\n");
  for (std::size_t k = 0; k < kStateNames.size(); ++k) {
    const Shown s = shown(k);
    const std::string name = kStateNames[k];
    std::printf("  %-6s %6.2f %-5s", name.substr(0, name.find('_')).c_str(), s.scale * r.range[k], s.unit);
    for (int beats = 1; beats <= 2; ++beats)
      std::printf("  %8.3f %7.3f %5.1f %% %5.1f %%", s.scale * r.quantile(beats, 0.5, false)[k],
                  s.scale * r.quantile(beats, 0.9, false)[k], 100 * r.quantile(beats, 0.5, true)[k],
                  100 * r.quantile(beats, 0.9, true)[k]);
    std::printf("\n");
  }
  std::printf(
      "  paper  after one beat under 5 %%, angles under 1 deg, position about 1 mm; more in pitch and vx after two\n");
}

/// Values by names of states; infinite values, of diverged samples, become null.
Json by_state(const StateVector& values, const char* unit) {
  Json json = {{"unit", unit}};
  for (std::size_t k = 0; k < values.size(); ++k) json[kStateNames[k]] = values[k];
  return json;
}

Json run(const Request& request) {
  const auto begin = std::chrono::steady_clock::now();
  if (!request.csv.empty()) io::check_output(request.csv);
  Transitions transitions(request.options);
  flightlog::check_each_once(request.flights);
  for (const fs::path folder : request.flights) {
    const flightlog::FlightLog log = flightlog::read_flight_log(folder);
    flightlog::require_flown(log, folder);
    transitions.add(folder, log, model::read_vehicle(vehicle_path(request, folder, log.header)));
  }
  const TransitionReport r = transitions.run();
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  print(request, r, wall_s);
  if (!request.csv.empty()) io::write_atomically(request.csv, distribution_csv(r));
  constexpr const char *kShare = "fraction of range", *kAbsolute = "as each name says";
  return {{"flights", request.flights.size()},
          {"samples", r.samples},
          {"recorded", r.recorded},
          {"low", r.low},
          {"not_covered", r.not_covered},
          {"diverged", r.diverged},
          {"beat_s", r.beats_s[0]},
          {"two_beats_s", r.beats_s[1]},
          {"normalised_innovation", r.normalised_innovation},
          {"from_truth", request.options.source == Source::truth},
          {"range", by_state(r.range, kAbsolute)},
          {"error_1beat", by_state(r.quantile(1, 0.5, true), kShare)},
          {"error_2beats", by_state(r.quantile(2, 0.5, true), kShare)},
          {"error_1beat_p90", by_state(r.quantile(1, 0.9, true), kShare)},
          {"error_2beats_p90", by_state(r.quantile(2, 0.9, true), kShare)},
          {"absolute_1beat", by_state(r.quantile(1, 0.5, false), kAbsolute)},
          {"absolute_2beats", by_state(r.quantile(2, 0.5, false), kAbsolute)},
          {"absolute_1beat_p90", by_state(r.quantile(1, 0.9, false), kAbsolute)},
          {"absolute_2beats_p90", by_state(r.quantile(2, 0.9, false), kAbsolute)},
          {"wall_s", wall_s}};
}

}  // namespace

Command add_transitions(const io::Command& program) {
  io::Command sub = program.command("transitions", "replays recorded voltages from recorded states, one and two beats");
  const auto request = std::make_shared<Request>();
  sub.option("flight", request->flights, "folders of flight logs").required();
  sub.option("--vehicle", request->vehicle, "vehicle file; otherwise that of the log, in its folder or next to it");
  io::Option samples = sub.option("--samples", request->options.samples, "samples to start from, evenly chosen")
                           .range(1, 10'000'000)
                           .shows_default();
  sub.option("--every", request->options.every, "start from every so many samples instead")
      .range(1, 10'000'000)
      .excludes(samples);
  sub.option("--csv", request->csv, "write the distributions of all errors to this file");
  sub.flag("--accept-innovation", request->options.accept_innovation,
           "also flights whose motion capture and IMU disagree by more than 5 times their declared noise");
  sub.flag("--truth", request->truth,
           "states and wings from truth.csv of simulated flights: the floor without sensors");
  return {sub, [request] {
            request->options.source = request->truth ? Source::truth : Source::sensors;
            return run(*request);
          }};
}

}  // namespace flappy::identify
