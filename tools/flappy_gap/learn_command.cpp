#include "learn_command.hpp"

#include <algorithm>
#include <cstdio>

#include "flappy/vehicle_file.hpp"
#include "flightlog/check/data_faults.hpp"
#include "gap/learn/learn_discrepancy.hpp"
#include "gap/replay/prediction.hpp"
#include "gap/replay/recording.hpp"
#include "io/config.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> flights_of(const fs::path& robot) {
  std::vector<fs::path> flights = flightlog::flights_in(robot);
  if (flights.empty()) throw io::InputError(robot.string() + ": no flight; accepted: a folder of flight logs");
  return flights;
}

FlightList read_flights(const std::string& from, const model::Vehicle& vehicle) {
  FlightList list;
  for (const fs::path& folder : flights_of(from))
    list.push_back(prediction_of(vehicle, folder, flightlog::read_faultless_log(folder)));
  return list;
}

std::string learnt_from(std::size_t count, const char* of) {
  return std::to_string(count) + " " + of + ", commit " + io::commit();
}

}  // namespace

void run_learn_discrepancy(const LearnCommand& command) {
  io::check_output(command.out);
  model::Vehicle vehicle = model::read_any_vehicle(command.vehicle);
  if (!vehicle.beat_averaged) vehicle = model::read_vehicle_for_steps(command.vehicle, kHoldStep_s);
  const sim::Randomisation uncertain = sim::read_randomisation(vehicle, io::Config::load(command.priors).root());
  ModelDiscrepancy start = read_model_discrepancy(command.discrepancy);
  if (start.beat_averaged != vehicle.beat_averaged.has_value())
    throw io::InputError("--discrepancy " + command.discrepancy + ": is of vehicles " +
                         (start.beat_averaged ? "that are beat-averaged" : "with wings") +
                         "; accepted: one that was learnt from vehicles like " + vehicle.name);
  if (command.robots.empty() && command.pairs.empty())
    throw io::InputError("nothing to learn from; accepted: either --robots or --pairs");
  if (!command.robots.empty() && !command.pairs.empty())
    throw io::InputError("--robots and --pairs: are both given; accepted: one of them");
  std::vector<Flights> robots;
  for (const std::string& robot : command.robots) robots.push_back({{}, read_flights(robot, vehicle)});
  std::vector<SessionPair> pairs;
  for (const std::string& pair : command.pairs) {
    std::vector<std::string> parts(1);
    for (const char c : pair) {
      if (c == ':') parts.emplace_back();
      else parts.back() += c;
    }
    if (parts.size() < 2 || parts.size() > 3)
      throw io::InputError("--pairs " + pair +
                           ": accepted: REFERENCE:TEST, two folders of flights, or REFERENCE:TEST:EFFECT");
    pairs.push_back({{read_flights(parts[0], vehicle), read_flights(parts[1], vehicle)}, ""});
    if (parts.size() < 3) continue;
    if (model::find_effect(vehicle, parts[2]) == nullptr)
      throw io::InputError("--pairs " + pair + ": no effect " + parts[2] +
                           "; accepted: those that flappy-gap effects lists");
    pairs.back().effect = parts[2];
  }
  io::stop_on_interrupt();
  if (!command.pairs.empty()) {
    start.session = read_session_variation(command.sessions);
    const SessionVariation learnt = learn_sessions(pairs, uncertain, start, command.threads);
    io::write_atomically(command.out, session_text(learnt, learnt_from(pairs.size(), "pairs of sessions")));
    std::printf("%s: learnt from %zu pairs of sessions\n", command.out.c_str(), pairs.size());
    return;
  }
  const ModelDiscrepancy learnt = learn_discrepancy(robots, uncertain, start, command.threads);
  io::write_atomically(command.out, discrepancy_text(learnt, learnt_from(robots.size(), "robots")));
  std::printf("%s: learnt from %zu robots\n", command.out.c_str(), robots.size());
}

}  // namespace flappy::gap
