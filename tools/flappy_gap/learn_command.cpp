#include "learn_command.hpp"

#include <algorithm>
#include <cstdio>

#include "flappy/vehicle_file.hpp"
#include "flightlog/check/data_faults.hpp"
#include "gap/diagnose/diagnose.hpp"
#include "gap/learn/learn_discrepancy.hpp"
#include "gap/learn/learn_scatter.hpp"
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

/// Parts of what is given with colons between them.
std::vector<std::string> parts_of(const std::string& given) {
  std::vector<std::string> parts(1);
  for (const char c : given) {
    if (c == ':') parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
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
    const std::vector<std::string> parts = parts_of(pair);
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

namespace {

RobotSessions read_robot(const std::string& given, const LearnSessionsCommand& command, SessionPrior& start) {
  const std::vector<std::string> parts = parts_of(given);
  if (parts.size() < 2)
    throw io::InputError("--robots " + given +
                         ": accepted: VEHICLE.toml:DIR, with more folders as VEHICLE.toml:DIR:DIR");
  RobotSessions robot{given, {}};
  for (std::size_t i = 1; i < parts.size(); ++i) {
    DiagnosisSettings settings;
    settings.vehicle = parts[0];
    for (const fs::path& folder : flights_of(parts[i])) settings.reference.push_back(folder.string());
    settings.sessions = command.sessions;
    settings.threads = command.threads;
    const DiagnosisRequest request = read_request(settings);
    if (!request.vehicle.beat_averaged)
      throw io::InputError("--robots " + given + ": " + request.vehicle.name +
                           " is not beat-averaged; accepted: a beat-averaged vehicle");
    start = request.options.sessions;
    robot.groups.push_back(sessions_of(read_flights(parts[i], request.vehicle), request.uncertain, request.options));
  }
  return robot;
}

}  // namespace

nlohmann::ordered_json run_learn_sessions(const LearnSessionsCommand& command) {
  io::check_output(command.out);
  io::stop_on_interrupt();
  io::ProgressLine line("learning");
  SessionPrior start;
  std::vector<RobotSessions> robots;
  for (const std::string& given : command.robots) {
    line.show(static_cast<double>(robots.size()) / static_cast<double>(command.robots.size()), given);
    robots.push_back(read_robot(given, command, start));
    if (io::interrupted()) throw io::InputError("stopped: nothing was learnt; accepted: all robots");
  }
  std::size_t groups = 0;
  for (const RobotSessions& r : robots) groups += r.groups.size();
  nlohmann::ordered_json told = nlohmann::ordered_json::array();
  if (robots.size() > 1)
    std::printf(
        "foretold by what the other robots say: %% of quantities outside of %g %%, nats a quantity over --sessions\n",
        100 * kInside);
  for (std::size_t r = 0; r < robots.size() && robots.size() > 1; ++r) {
    std::vector<RobotSessions> others = robots;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(r));
    const SessionPrior learnt = learn_scatter(others, start);
    nlohmann::ordered_json of_robot = {{"robot", robots[r].name}};
    std::printf("%s:", robots[r].name.c_str());
    for (const bool later : {false, true}) {
      const Foretold f = foretold(robots[r], learnt, start, later);
      if (f.number == 0) continue;  // too few sessions
      of_robot[later ? "second_half" : "next"] = {
          {"number", f.number}, {"outside", f.outside / f.number}, {"log_score", f.log_score / f.number}};
      std::printf(" %s of %.0f %.1f %%, %+.2f;", later ? "second half," : "next,", f.number, 100 * f.outside / f.number,
                  f.log_score / f.number);
    }
    std::printf("\n");
    told.push_back(of_robot);
  }
  const SessionPrior learnt = learn_scatter(robots, start);
  io::write_atomically(command.out, session_prior_text(learnt, learnt_from(groups, "groups of sessions")));
  std::printf("%s: learnt from %zu groups of sessions of %zu robots\n", command.out.c_str(), groups, robots.size());
  return {{"out", command.out}, {"robots", told}};
}

}  // namespace flappy::gap
