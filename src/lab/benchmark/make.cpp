#include "lab/benchmark/make.hpp"

#include <cstdio>
#include <optional>

#include "flappy/vehicle_file.hpp"
#include "io/append_file.hpp"
#include "io/config.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"
#include "lab/benchmark/records.hpp"
#include "lab/benchmark/work.hpp"
#include "lab/blind/a/sampled_robot.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

class Maker {
 public:
  explicit Maker(const MakeCommand& command)
      : command_(command),
        family_(family_named(command.family)),
        sealed_(command.out / "sealed"),
        plan_(plan_cases(family_, command.plan)),
        declared_(blind::declared_case(command.vehicle)),
        sampled_(sim::read_randomisation(declared_.vehicle, io::Config::load(command.randomise).root())) {}

  bool run() {
    io::make_folder(sealed_);
    io::make_folder(command_.out / "cases");
    std::optional<io::FolderLock> lock;
    if (io::writes(command_.ranks)) {
      lock.emplace(command_.out);
      agree_with_what_is_there();
    }
    io::wait(command_.ranks);
    if (!lock) agree_with_what_is_there();
    if (fs::exists(command_.out / "manifest.json")) {
      std::printf("%s: made already\n", command_.out.c_str());
      return true;
    }
    std::vector<const PlannedCase*> open;
    for (const PlannedCase& p : plan_)
      if (!fs::exists(label_file(p))) open.push_back(&p);
    const bool all =
        work_through("flying", open.size(), command_.threads, command_.ranks, [&](std::size_t i) { make(*open[i]); });
    if (all && io::writes(command_.ranks)) seal();
    return all;
  }

 private:
  fs::path label_file(const PlannedCase& p) const { return sealed_ / (number_text(p.number) + ".json"); }
  fs::path case_folder(const PlannedCase& p) const { return command_.out / "cases" / number_text(p.number); }

  /// Stores the plan's hash; InputError if it differs from that of an unfinished benchmark in the folder.
  void agree_with_what_is_there() const {
    Json plan = {command_.family};
    for (const PlannedCase& p : plan_) plan.push_back(to_json(p));
    const std::string text = plan.dump() + declared_.vehicle_sha256 + io::sha256(io::read_text(command_.randomise));
    const fs::path file = sealed_ / "plan.sha256";
    if (!fs::exists(file)) io::write_atomically(file, io::sha256(text) + "\n");
    else if (io::read_text(file) != io::sha256(text) + "\n")
      throw io::InputError(command_.out.string() +
                           ": begun with another plan; accepted: the same options, or a name for a new folder");
  }

  void make(const PlannedCase& p) const {
    const blind::Assignment a = assignment_of(p, command_.vehicle);
    // a vehicle file drawn by the published randomisation stays sealed, and is removed after its flights
    const fs::path drawn = sealed_ / ("vehicle_" + number_text(p.number));
    const auto prepare = [&](blind::Assignment& now) {
      if (!p.published) return;
      now.vehicle_file = drawn / command_.vehicle.filename();
      io::make_folder(drawn);
      io::write_atomically(now.vehicle_file,
                           model::vehicle_text(sampled_.sample({now.seed, 0, 0, sim::Stream::vehicle})));
    };
    Label label{p, 0, {}, {}, {}};
    for (const blind::FamilyEffect& e : family_.effects())
      if (std::ranges::count(p.effects, e.id, &blind::BlindEffect::id) > 0) {
        label.channels.insert(label.channels.end(), e.channels.begin(), e.channels.end());
        label.regimes.insert(label.regimes.end(), e.regimes.begin(), e.regimes.end());
      }
    Json json;
    try {
      fs::remove_all(case_folder(p));  // an interrupted run may have left a part of it
      io::make_folder(case_folder(p));
      FlownRobot flown =
          fly_drawn(family_, a, p.seed, prepare, reference_of(p, command_.vehicle), p.reference_sessions);
      for (std::size_t k = 0; k < p.references; ++k)
        flightlog::write_flight_log(case_folder(p) / (kReferenceFolder + std::to_string(k + 1)),
                                    flown.reference[k].log);
      for (std::size_t k = 0; k < p.flights; ++k) {
        flightlog::FlightLog& log = flown.flights[k].log;
        if (p.published) {
          log.header.vehicle_sha256 = declared_.vehicle_sha256;
          log.header.ambient.air_density_kg_m3 = declared_.declared_density_kg_m3;
        }
        flightlog::write_flight_log(case_folder(p) / (kFlightFolder + std::to_string(k + 1)), log);
      }
      label.draw = flown.draw;
      std::vector<flightlog::FlightLog> logs;
      for (std::size_t k = 0; k < p.flights; ++k) logs.push_back(std::move(flown.flights[k].log));
      if (!p.effects.empty())
        label.over_sessions = change_over_sessions(family_, flown.assignment, logs, command_.other_sessions);
      if (p.bench && p.references == 0) run_on_bench(p, flown.assignment, label.over_sessions);
      json = to_json(label);
    } catch (const blind::NeverFlies&) {
      json = to_json(label);
      json["never_flies"] = true;
    }
    fs::remove_all(drawn);
    io::write_atomically(label_file(p), json.dump(1) + "\n");
  }

  /// Clamps the robot after its flights. An effect counts if the flights or the bench show it.
  void run_on_bench(const PlannedCase& p, blind::Assignment a, std::vector<OverSessions>& over_sessions) const {
    a.bench = a.power = true;
    std::vector<flightlog::FlightLog> logs;
    for (std::size_t k = 0; k < blind::Family::kFlights; ++k) {
      logs.push_back(family_.fly(a, k).log);
      logs.back().header.session = "session " + std::to_string(a.session);
      flightlog::write_flight_log(case_folder(p) / (kFlightFolder + std::to_string(p.flights + k + 1)), logs.back());
    }
    if (p.effects.empty()) return;
    over_sessions =
        larger_of(std::move(over_sessions), change_over_sessions(family_, a, logs, command_.other_sessions));
  }

  void seal() const {
    Manifest m{command_.family,
               command_.plan.reported ? "reported" : "development",
               command_.vehicle.string(),
               declared_.vehicle_sha256,
               {},
               io::commit(),
               family_.engine(),
               {}};
    Json cases = Json::array(), never = Json::array();
    std::size_t lost = 0;
    for (const PlannedCase& p : plan_) {
      Json label = read_json(label_file(p));
      if (label.contains("never_flies")) {
        never.push_back(std::move(label));
        continue;
      }
      lost += label.at("draw").get<std::size_t>();
      cases.push_back(std::move(label));
      PublicCase c{p.number, p.withheld, {}};
      for (const fs::directory_entry& e : fs::recursive_directory_iterator(case_folder(p)))
        if (e.is_regular_file())
          c.files[e.path().lexically_relative(command_.out).string()] = io::sha256(io::read_text(e.path()));
      m.cases.push_back(std::move(c));
    }
    const std::string labels =
        Json{{"schema", 1}, {"set", m.set}, {"never_fly", never}, {"cases", cases}}.dump(1) + "\n";
    m.labels_sha256 = io::sha256(labels);
    io::write_atomically(sealed_ / "labels.json", labels);
    io::write_atomically(command_.out / "manifest.json", to_json(m).dump(1) + "\n");
    for (const PlannedCase& p : plan_) fs::remove(label_file(p));
    std::printf("%s: %zu cases of family %s, %zu robots that crashed drawn again, %zu that never fly\n",
                command_.out.c_str(), m.cases.size(), command_.family.c_str(), lost, never.size());
  }

  const MakeCommand& command_;
  const blind::Family& family_;
  fs::path sealed_;
  std::vector<PlannedCase> plan_;
  blind::Case declared_;
  sim::Randomisation sampled_;
};

}  // namespace

bool make_bench(const MakeCommand& command) { return Maker(command).run(); }

}  // namespace flappy::benchmark
