#include "gap/diagnose/diagnose.hpp"

#include <algorithm>
#include <iterator>

#include "flightlog/check/data_faults.hpp"
#include "gap/answer/contrast_warnings.hpp"
#include "gap/answer/corrected_vehicle.hpp"
#include "gap/answer/result.hpp"
#include "gap/next/closed_loop_prediction.hpp"
#include "gap/replay/beat_averaged_prediction.hpp"
#include "gap/replay/believed_vehicle.hpp"
#include "gap/replay/prediction.hpp"
#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

namespace fs = std::filesystem;

/// A next flight is proposed if the second hypothesis has at least this probability. Choice.
constexpr double kMinRival = 0.01;
/// Largest number of effects in a hypothesis, of a beat-averaged vehicle. Choice: its file may lack many at once, and
/// another fit costs little.
constexpr int kMaxBeatAveragedEffects = 8;

std::vector<int> read_channels(const std::vector<std::string>& names, bool beat_averaged) {
  if (!names.empty() && !beat_averaged)
    throw io::InputError("--channels: is for a beat-averaged vehicle; accepted: all channels of this one");
  std::vector<std::string> known;
  for (int channel = kAngularAccelerationX; channel <= kSpecificForceZ; ++channel)
    known.emplace_back(channel_name(channel));
  std::vector<int> list;
  for (const std::string& name : names) {
    const auto at = std::ranges::find(known, name);
    if (at == known.end())
      throw io::InputError("--channels " + name + ": no such channel; accepted: " + io::joined(known) +
                           io::did_you_mean(name, known));
    list.push_back(static_cast<int>(at - known.begin()));
  }
  return list;
}

/// Whether all of these logs are of a clamped robot.
bool on_bench(const std::vector<std::string>& logs) {
  return std::ranges::all_of(
      logs, [](const std::string& log) { return fs::exists(fs::path(log) / flightlog::log_file::kForces); });
}

/// The flights of each folder of a session in its place, by their names.
std::vector<std::string> flights_of(const std::vector<std::string>& given,
                                    std::map<std::string, std::string>& sessions) {
  std::vector<std::string> flights;
  std::error_code error;
  const auto is_log = [&](const fs::path& folder) { return fs::exists(folder / "flight.toml", error); };
  for (const std::string& folder : given) {
    std::vector<std::string> own;
    if (!is_log(folder))
      for (const auto& entry : fs::directory_iterator(folder, error))
        if (is_log(entry.path())) own.push_back(entry.path().string());
    std::ranges::sort(own);
    for (const std::string& flight : own) sessions[flight] = folder;
    if (own.empty()) own = {folder};
    flights.insert(flights.end(), own.begin(), own.end());
  }
  return flights;
}

rollout::FlyConfig read_pilot(const std::string& manoeuvre) {
  rollout::FlyConfig pilot =
      rollout::read_fly_config(manoeuvre.empty() ? fs::path(io::config_path("fly/hover.toml")) : fs::path(manoeuvre));
  if (pilot.fleet.task.sets_voltages())
    throw io::InputError(manoeuvre +
                         ": is flown by voltages alone, but what is predicted is flown by a controller; accepted: a "
                         "task whose action is of kind \"wing_beat\"");
  return pilot;
}

}  // namespace

std::vector<NamedFlights> sets_of(const std::vector<std::string>& reference) {
  std::vector<NamedFlights> sets;
  std::size_t now = 0;
  for (const std::string& given : reference) {
    const std::size_t equals = given.find('=');
    const bool named = equals != std::string::npos && !fs::exists(given);
    const std::string name = named ? given.substr(0, equals) : "";
    if (named && (name.empty() || name.find_first_of("/.\\ ") != std::string::npos))
      throw io::InputError("--reference " + given + ": no name before \"=\"; accepted: LOG, or NAME=LOG as far=LOG");
    if (named || sets.empty()) {
      const auto same = std::ranges::find(sets, name, &NamedFlights::name);
      now = static_cast<std::size_t>(same - sets.begin());
      if (same == sets.end()) sets.push_back({name, {}});
    }
    sets[now].flights.push_back(named ? given.substr(equals + 1) : given);
  }
  return sets;
}

DiagnosisRequest read_request(const DiagnosisSettings& settings) {
  DiagnosisSettings s = settings;
  std::vector<NamedFlights> sets = sets_of(settings.reference);
  std::map<std::string, std::string> sessions;
  for (NamedFlights& set : sets) set.flights = flights_of(set.flights, sessions);
  s.flights = flights_of(s.flights, sessions);
  std::vector<std::string> all;
  for (const NamedFlights& set : sets) all.insert(all.end(), set.flights.begin(), set.flights.end());
  all.insert(all.end(), s.flights.begin(), s.flights.end());
  flightlog::check_each_once(all);
  if (!sets.empty()) {
    s.reference = sets.front().flights;
    sets.erase(sets.begin());
  }
  model::Vehicle vehicle = read_believed_vehicle(s.vehicle);
  const bool beat_averaged = vehicle.beat_averaged.has_value();
  for (const std::string& id : s.withheld) check_effect("--withhold", id, vehicle);
  rollout::FlyConfig pilot = read_pilot(s.manoeuvre);
  const auto file = [&](const std::string& given, const std::string& name) {
    return given.empty() ? fs::path(io::config_path((beat_averaged ? "gap/beat_averaged/" : "gap/") + name))
                         : fs::path(given);
  };
  sim::Randomisation uncertain =
      sim::read_randomisation(vehicle, io::Config::load(file(s.priors, "priors.toml")).root());
  std::vector<Manoeuvre> manoeuvres =
      read_manoeuvres(s.experiments.empty() ? fs::path(io::config_path("gap/experiments")) : fs::path(s.experiments));
  InferenceOptions options;
  options.threads = s.threads;
  if (beat_averaged) {
    options.max_finalists = static_cast<int>(model::catalogue_of(vehicle).size());
    options.max_effects = kMaxBeatAveragedEffects;
  }
  options.withheld = s.withheld;
  const bool contrast = !s.reference.empty();
  // what a beat-averaged model gets wrong counts as noise, but in a contrast it cancels
  options.discrepancy = read_model_discrepancy(
      file(s.discrepancy, contrast && beat_averaged ? "contrast_discrepancy.toml" : "model_discrepancy.toml"));
  options.rule =
      read_verdict_rule(contrast && s.verdict.empty() ? fs::path(io::config_path("gap/contrast_verdict.toml"))
                                                      : file(s.verdict, "verdict.toml"));
  if (options.discrepancy.beat_averaged != beat_averaged)
    throw io::InputError("--discrepancy " + s.discrepancy + ": is of vehicles " +
                         (beat_averaged ? "with wings" : "that are beat-averaged") +
                         "; accepted: one that was learnt from vehicles like " + vehicle.name);
  if (contrast && beat_averaged) options.sessions = read_session_prior(file(s.sessions, "session_scatter.toml"));
  // a contrast of a beat-averaged vehicle uses only the errors of laws of the session variation
  if (contrast)
    options.discrepancy.session =
        beat_averaged ? read_session_variation()
                      : read_session_variation(file(
                            s.sessions, on_bench(all) ? "bench_session_variation.toml" : "session_variation.toml"));
  return {s,
          std::move(sets),
          std::move(sessions),
          std::move(vehicle),
          std::move(uncertain),
          std::move(options),
          read_channels(s.channels, beat_averaged),
          std::move(pilot),
          std::move(manoeuvres)};
}

namespace {

/// The logs of one set of flights, until predictions are made of them.
struct CheckedLogs {
  std::vector<std::string> folders;
  std::vector<flightlog::FlightLog> logs;
  std::vector<flightlog::FlightHeader> headers;
  std::vector<flightlog::DataFault>
      faults;                         ///< faults of all flights of the set; empty unless more than half have some
  std::vector<std::string> left_out;  ///< why each doubtful flight is left out, one line each
};

/// Leaves out flights with faults, as long as half of them remain.
void leave_out_faulty(CheckedLogs& set, std::vector<std::vector<flightlog::DataFault>> faults) {
  const auto sound = static_cast<std::size_t>(std::ranges::count_if(faults, [](const auto& f) { return f.empty(); }));
  if (2 * sound < faults.size() || sound == 0) {  // then the fault is not of one flight
    for (auto& f : faults) std::ranges::move(f, std::back_inserter(set.faults));
    return;
  }
  CheckedLogs rest;
  rest.left_out = std::move(set.left_out);
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (faults[i].empty()) {
      rest.folders.push_back(std::move(set.folders[i]));
      rest.headers.push_back(std::move(set.headers[i]));
      rest.logs.push_back(std::move(set.logs[i]));
    } else {
      const flightlog::DataFault& first = faults[i].front();
      rest.left_out.push_back(first.file + ":" + std::to_string(first.line) + ": " + first.what);
    }
  }
  set = std::move(rest);
}

/// Reads and checks the references, then each set of flights; all are of one robot, so they are checked together.
std::vector<CheckedLogs> read_sets(const DiagnosisRequest& request) {
  std::vector<CheckedLogs> sets = {{request.settings.reference, {}, {}, {}}, {request.settings.flights, {}, {}, {}}};
  for (const NamedFlights& other : request.others) sets.push_back({other.flights, {}, {}, {}});
  std::vector<std::string> folders;
  std::vector<flightlog::FlightLog> logs;
  for (const CheckedLogs& set : sets)
    for (const std::string& folder : set.folders) {
      folders.push_back(folder);
      logs.push_back(flightlog::read_flight_log(folder));
      const auto session = request.sessions.find(folder);
      if (session != request.sessions.end() && logs.back().header.session.empty())
        logs.back().header.session = session->second;
    }
  if (!request.settings.reference.empty()) check_same_streams(logs, folders, request.settings.reference.size());
  const std::vector<flightlog::CheckReport> reports = flightlog::check_flights(logs);
  std::size_t next = 0;
  for (CheckedLogs& set : sets) {
    std::vector<std::vector<flightlog::DataFault>> faults;
    for (std::size_t i = 0; i < set.folders.size(); ++i, ++next) {
      faults.push_back(flightlog::data_faults(logs[next], reports[next], folders[next]));
      set.headers.push_back(logs[next].header);
      set.logs.push_back(std::move(logs[next]));
    }
    leave_out_faulty(set, std::move(faults));
  }
  return sets;
}

/// Takes the logs of the set. Leaves out flights that are too short, as long as others remain.
FlightList predictions_of(const DiagnosisRequest& request, CheckedLogs& set) {
  FlightList list;
  std::vector<std::string> folders;
  std::vector<flightlog::FlightHeader> headers;
  std::vector<flightlog::TooLittleSeen> refused;
  std::size_t instants = 0;
  for (std::size_t i = 0; i < set.logs.size(); ++i) try {
      list.push_back(prediction_of(request.vehicle, set.folders[i], std::move(set.logs[i]), request.channels));
      instants += list.back()->beats();
      folders.push_back(std::move(set.folders[i]));
      headers.push_back(std::move(set.headers[i]));
    } catch (const flightlog::TooLittleSeen& e) {
      refused.push_back(e);
    }
  set.logs.clear();
  if (list.empty() && !refused.empty()) throw refused.front();
  if (!list.empty() && list.front()->is_averaged() && instants < kMinInstants)
    throw io::InputError(folders.front() + ": all flights together have " + std::to_string(instants) +
                         " instants; accepted: " + std::to_string(kMinInstants) + " or more");
  for (const flightlog::TooLittleSeen& e : refused) set.left_out.emplace_back(e.what());
  set.folders = std::move(folders);
  set.headers = std::move(headers);
  return list;
}

/// Reference flights and their fit, for all sets that are compared with them.
struct Reference {
  CheckedLogs read;
  FlightList flights;
  std::unique_ptr<const ReferenceFit> fit;
};

void warn_of_left_out(std::initializer_list<const CheckedLogs*> sets, Diagnosis& result) {
  for (const CheckedLogs* set : sets)
    for (const std::string& why : set->left_out) result.warnings.push_back("left out: " + why);
}

Diagnosed diagnose_set(const DiagnosisRequest& request, CheckedLogs& tests, Reference& reference,
                       const std::function<bool(double share, const std::string& what)>& progress) {
  std::vector<flightlog::DataFault> faults = reference.read.faults;
  faults.insert(faults.end(), tests.faults.begin(), tests.faults.end());
  Diagnosed d;
  if (!faults.empty()) {
    d.result = result_of(tests.folders, std::move(faults));
    d.result.reference = request.settings.reference;
    warn_of_left_out({&reference.read, &tests}, d.result);
    return d;
  }
  if (reference.flights.empty()) reference.flights = predictions_of(request, reference.read);
  d.flights = {reference.flights, predictions_of(request, tests)};
  InferenceOptions options = request.options;
  options.progress = progress;
  if (!reference.flights.empty() && !reference.fit) {
    if (progress) progress(0, "fitting the reference");
    reference.fit = std::make_unique<const ReferenceFit>(reference.flights, request.uncertain, options);
  }
  d.inference = infer(d.flights, request.uncertain, options, reference.fit.get());
  d.uncertain = request.uncertain;
  d.uncertain->set_minors(d.inference.minors);
  d.result = result_of(tests.folders, d.flights, *d.uncertain, d.inference);
  d.result.reference = reference.read.folders;
  if (!reference.flights.empty()) {
    std::vector<flightlog::FlightHeader> headers = reference.read.headers;
    headers.insert(headers.end(), tests.headers.begin(), tests.headers.end());
    d.result.warnings = contrast_warnings(headers, d.flights);
  }
  warn_of_left_out({&reference.read, &tests}, d.result);
  if (d.inference.complete) d.corrected = corrected_vehicle(request.vehicle, d.inference, request.uncertain);
  return d;
}

}  // namespace

Diagnosed diagnose(const DiagnosisRequest& request,
                   const std::function<bool(double share, const std::string& what)>& progress) {
  std::vector<CheckedLogs> sets = read_sets(request);
  Reference reference{std::move(sets[0]), {}, {}};
  Diagnosed d = diagnose_set(request, sets[1], reference, progress);
  bool goes_on = d.result.complete;
  for (std::size_t i = 0; i < request.others.size(); ++i) {
    Diagnosis of_set;
    of_set.complete = false;
    if (goes_on) of_set = diagnose_set(request, sets[2 + i], reference, progress).result;
    goes_on = of_set.complete;
    d.result.sets.push_back({request.others[i].name, std::move(of_set)});
  }
  return d;
}

void fly_closed_loop(const DiagnosisRequest& request, Diagnosed& d) {
  if (!d.corrected || request.vehicle.beat_averaged || !request.settings.reference.empty()) return;
  FlightList flown;
  for (const auto& flight : d.flights.tests)
    if (!flight->recording()->clamped()) flown.push_back(flight);
  ClosedLoopOptions options;
  options.own_path = !request.settings.manoeuvre.empty();
  options.threads = request.settings.threads;
  d.result.closed_loop = predict_closed_loop(flown, request.vehicle, *d.corrected, request.pilot, options);
}

void propose_experiment(const DiagnosisRequest& request, Diagnosed& d) {
  if (!d.corrected || request.vehicle.beat_averaged) return;
  if (d.inference.hypotheses.size() < 2 || d.inference.hypotheses[1].probability < kMinRival) return;
  NextOptions options;
  options.threads = request.settings.threads;
  options.references = d.flights.references;
  // as before: a laboratory has a force sensor or not, and what references do not show does not cancel
  const FlightList& before = d.flights.references.empty() ? d.flights.tests : d.flights.references;
  const auto clamped = [](const auto& flight) { return flight->recording()->clamped(); };
  options.on_bench = std::ranges::any_of(before, clamped);
  options.in_flight = !std::ranges::all_of(before, clamped);
  options.discrepancy = request.options.discrepancy;
  options.rule = request.options.rule;
  const std::vector<NextExperiment> ranked = rank_experiments(d.inference, *d.uncertain, request.manoeuvres, options);
  if (!ranked.empty()) d.result.next = ranked.front();
}

}  // namespace flappy::gap
