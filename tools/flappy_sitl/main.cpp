// flappy-sitl: software in the loop, with the simulator as the robot of an autopilot that communicates by ROS 2 or DDS.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/program.hpp"
#include "io/progress.hpp"
#include "server/sitl/sitl.hpp"

namespace flappy::sitl {
namespace {

using Json = nlohmann::ordered_json;

void print(const server::SitlResult& r, const server::SitlOptions& options) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%s%llu control periods in %s%s\n", r.stopped ? "stopped: " : "", number(r.periods),
              options.lock_step ? "lock step" : "real time", r.crashed ? "; it crashed" : "");
  std::printf("  from a tick to its input: median %.0f us, 99 %% within %.0f us, at most %.0f us\n",
              1e6 * r.round_trip_median_s, 1e6 * r.round_trip_p99_s, 1e6 * r.round_trip_most_s);
  std::printf("  inputs missed: %llu; for another period: %llu; no numbers: %llu\n", number(r.missed), number(r.stray),
              number(r.refused));
  if (!options.log_folder.empty())
    std::printf("  %s %s\n", r.logged ? "log in" : "too short for a log:", options.log_folder.c_str());
  std::printf("  hash %s\n", io::hexadecimal(r.hash).c_str());
}

Json json_of(const server::SitlResult& r, const server::SitlOptions& options) {
  return {{"lock_step", options.lock_step},
          {"periods", r.periods},
          {"missed", r.missed},
          {"stray", r.stray},
          {"refused", r.refused},
          {"round_trip_median_s", r.round_trip_median_s},
          {"round_trip_p99_s", r.round_trip_p99_s},
          {"round_trip_most_s", r.round_trip_most_s},
          {"crashed", r.crashed},
          {"stopped", r.stopped},
          {"hash", io::hexadecimal(r.hash)},
          {"commit", io::commit()}};
}

}  // namespace
}  // namespace flappy::sitl

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-sitl",
                      "Is the robot of an autopilot: publishes sensors, flies by the inputs that come back.",
                      {"instruction set " + sim::best_instruction_set()});
  const io::Command& app = program.app();
  std::string config_name, log;
  std::vector<std::string> overrides;
  server::SitlOptions options;
  bool real_time = false;
  app.option("config", config_name, "what to fly: configs/fly/*.toml").required();
  app.flag("--real-time", real_time, "a period lasts as long as on the robot; otherwise until its input has come");
  app.option("--timeout", options.timeout_s, "seconds without an autopilot, or in lock step without its input")
      .range(0.01, 3600.0)
      .shows_default();
  app.option("--manoeuvre", options.manoeuvre_s, "seconds after which the pilot wishes for the task's manoeuvre")
      .range(0.01, 1e6);
  app.option("--log", log, "folder for the log of the flight");
  app.option("--set", overrides, "override a key: flight.duration_s=2, dds.reach=host").one_at_a_time();
  return program.run(argc, argv, [&] {
    rollout::FlyConfig config = rollout::read_fly_config(config_name, overrides);
    config.actor.reset();
    config.fleet.task.forbid_actions();
    if (options.manoeuvre_s >= config.duration_s)
      throw io::InputError("--manoeuvre: is " + io::shortest_digits(options.manoeuvre_s) +
                           " s; accepted: less than flight.duration_s, " + io::shortest_digits(config.duration_s) +
                           " s");
    options.lock_step = !real_time;
    options.log_folder = log;
    io::ProgressLine progress("flown");
    options.keep_going = [&](double done) {
      progress.show(done);
      return !io::interrupted();
    };
    io::stop_on_interrupt();
    const server::SitlResult result = server::fly_sitl(config, options);
    progress.clear();
    sitl::print(result, options);
    program.write_json(sitl::json_of(result, options));
  });
}
