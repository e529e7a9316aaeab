// flappy-blind: flies robots of simulators written apart, with or without effects, and writes their logs; makes and scores benchmarks.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "escapes.hpp"
#include "io/installation.hpp"
#include "io/sha256.hpp"
#include "lab/benchmark/calibrate.hpp"
#include "lab/benchmark/families.hpp"
#include "lab/benchmark/foresee_bench.hpp"
#include "lab/benchmark/laws.hpp"
#include "lab/benchmark/make.hpp"
#include "lab/benchmark/score_bench.hpp"
#include "lab/blind/a/family_a.hpp"
#include "lab/blind/firmware/faulty_firmware.hpp"
#include "loop.hpp"
#include "policy/policy.hpp"

namespace flappy::blind {
namespace {

using Json = nlohmann::ordered_json;

struct FamilyOptions {
  std::string family;     ///< empty: family A with its own options
  std::string reference;  ///< folder for a session without effects that the robot flies before; empty: none
  std::size_t reference_sessions = 1;  ///< how many sessions the flights of `reference` are of
  bool calm_reference = false;
  bool hover = false, bench = false, own_parameters = false, conventions = false;
};

/// Flies a robot through the interface of all families; fly_case() is the counterpart with family A's own options.
Json fly_family(const RobotOptions& o, const FamilyOptions& f) {
  const Family& family = benchmark::family_named(f.family);
  if (o.randomise != "none")
    throw io::InputError("--randomise: draws robots without --family; accepted: --own-parameters");
  Assignment a;
  a.vehicle_file = o.vehicle;
  for (const BlindEffect& e : effects_of(o.effects)) a.effects.emplace_back(e.id, e.magnitude);
  a.hover = f.hover, a.own_parameters = f.own_parameters, a.conventions = f.conventions;
  a.power = o.power || f.bench, a.wings = o.wings, a.bench = f.bench;
  if (a.bench) benchmark::require_bench(family);
  std::optional<Assignment> reference;
  if (!f.reference.empty()) {
    reference = a;
    reference->effects.clear();
    reference->calm = f.calm_reference;
    a.session = 1;
  }
  const benchmark::FlownRobot robot = benchmark::fly_drawn(family, a, o.seed, {}, reference, f.reference_sessions);
  for (std::size_t draw = 0; draw < robot.lost.size(); ++draw)
    std::printf("draw %zu: %s; the next draw\n", draw, robot.lost[draw].c_str());
  Json folders = Json::array();
  const auto write_all = [&](const std::vector<FamilyFlight>& flights, const std::string& to) {
    for (std::size_t k = 0; k < flights.size(); ++k) {
      folders.push_back((std::filesystem::path(to) / ("flight_" + std::to_string(k + 1))).string());
      flightlog::write_flight_log(folders.back().get<std::string>(), flights[k].log);
      std::printf("%s: %g s\n", folders.back().get<std::string>().c_str(),
                  flights[k].log.command.t_s.empty() ? 0 : std::round(flights[k].log.command.t_s.back()));
    }
  };
  write_all(robot.reference, f.reference);
  write_all(robot.flights, o.out);
  return {{"family", f.family}, {"seed", o.seed}, {"draw", robot.draw}, {"crashes", robot.lost}, {"flights", folders}};
}

constexpr double kOrigin_m = 1;  ///< of the task's world above the ground, so that its goal is in mid-air

/// Poses in the task's world.
class InTask final : public OnBoard {
 public:
  explicit InTask(OnBoard& firmware) : firmware_(firmware) {}
  void start(double now_s, const Pose& pose) override { firmware_.start(now_s, lowered(pose)); }
  void imu(double arrived_s, const std::array<double, 3>& rate, const std::array<double, 3>& force) override {
    firmware_.imu(arrived_s, rate, force);
  }
  void pose(double arrived_s, const Pose& pose) override { firmware_.pose(arrived_s, lowered(pose)); }
  std::array<double, 2> volts(double now_s) override { return firmware_.volts(now_s); }

 private:
  static Pose lowered(Pose pose) {
    pose[2] -= kOrigin_m;
    return pose;
  }
  OnBoard& firmware_;
};

/// A robot under exported C: it hovers from rest on, and from `begin_s` on the policy acts.
struct OnBoardOptions {
  std::string exported, firmware = "none";
  double begin_s = 2, lasts_s = 5;
  std::vector<double> start = {0, 0, 0, 0};  ///< x, y, z in m in the task's world, heading in rad
};

Json fly_with_firmware(const RobotOptions& o, const FamilyOptions& f, const OnBoardOptions& b) {
  const Family& family = benchmark::family_named(f.family);
  Assignment a;
  a.vehicle_file = o.vehicle;
  for (const BlindEffect& e : effects_of(o.effects)) a.effects.emplace_back(e.id, e.magnitude);
  a.own_parameters = f.own_parameters, a.conventions = f.conventions;
  a.power = o.power, a.wings = o.wings;
  a.seed = o.seed;
  const std::array<double, 4> start = {b.start[0], b.start[1], b.start[2] + kOrigin_m, b.start[3]};
  // what the laboratory declares of the sensors is what its firmware knows
  const flightlog::FlightHeader declared = family.fly_on_board(a, 0, start, 0.01, *silent_firmware()).log.header;
  const auto firmware =
      make_firmware(b.exported, b.firmware, {declared.imu.latency_s, declared.mocap.latency_s}, b.begin_s);
  InTask in_task(*firmware);
  FamilyFlight flown = family.fly_on_board(a, 0, start, b.lasts_s, in_task);
  for (double& z : flown.log.mocap.z_m) z -= kOrigin_m;
  flown.log.header.ambient.ground_z_m -= kOrigin_m;
  flown.log.header.ambient.ceiling_z_m -= kOrigin_m;
  flightlog::FlownHeader& h = flown.log.header.flown.emplace();
  h.start_pose = {b.start[0], b.start[1], b.start[2], std::cos(start[3] / 2), 0, 0, std::sin(start[3] / 2)};
  h.mode = "task";
  h.begin_s = b.begin_s;
  flightlog::write_flight_log(o.out, flown.log);
  const double lasted_s = flown.log.command.t_s.back();
  std::printf("%s: %.3f s%s%s\n", o.out.c_str(), lasted_s, flown.crashed ? ", then " : "", flown.how.c_str());
  return {{"family", f.family},   {"seed", o.seed},           {"firmware", b.firmware},
          {"lasted_s", lasted_s}, {"crashed", flown.crashed}, {"how", flown.how}};
}

Json fly_case(const RobotOptions& o, Programme programme) {
  const Robots robots(o);
  const std::filesystem::path folder(o.out);
  std::error_code error;
  if (std::filesystem::exists(folder, error)) io::make_folder(folder);
  const SampledRobot sampled = robots.fly(programme);
  Json crashes = Json::array(), list = Json::array();
  for (std::size_t draw = 0; draw < sampled.lost.size(); ++draw) {
    const Crash& lost = sampled.lost[draw];
    std::printf("draw %zu: flight %zu %s; the next draw\n", draw, lost.flight, lost.how.c_str());
    crashes.push_back(lost.how);
  }
  io::make_folder(folder);
  for (std::size_t k = 0; k < kFlights; ++k) {
    const RobotFlight& flight = sampled.flights[k];
    const std::filesystem::path to = folder / ("flight_" + std::to_string(k + 1));
    write(flight, to, !o.no_truth);
    std::printf("%s: %g s, up to %.0f mm off, tilted up to %.0f deg\n", to.c_str(), kFlight_s, 1e3 * flight.farthest_m,
                flight.most_tilt_rad * 180 / kPi);
    list.push_back(
        {{"folder", to.string()}, {"farthest_m", flight.farthest_m}, {"most_tilt_rad", flight.most_tilt_rad}});
  }
  return {{"seed", o.seed}, {"draw", sampled.draw}, {"crashes", crashes}, {"flights", list}};
}

/// Prints all pairs of laws, and which are refused.
Json check_laws(const std::vector<std::string>& names, const std::filesystem::path& page) {
  std::vector<const Family*> families;
  for (const std::string& name : names) families.push_back(&benchmark::family_named(name));
  if (!page.empty()) io::write_atomically(page, benchmark::laws_page(families));
  Json all = Json::array();
  std::size_t refused = 0;
  std::printf("%-30s %-9s %-9s %8s\n", "effect", "of", "and", "distance");
  for (const benchmark::LawPair& p : benchmark::compare_laws(families)) {
    Json pair = {{"effect", p.effect}, {"first", p.first}, {"second", p.second}, {"refused", p.refused()}};
    pair["distance"] = p.distance ? Json(*p.distance) : Json();
    pair["equal_number"] = p.equal_number ? Json(*p.equal_number) : Json();
    pair["missing"] = p.missing;
    all.push_back(std::move(pair));
    if (p.distance)
      std::printf("%-30s %-9s %-9s %8.3f", p.effect.c_str(), p.first.c_str(), p.second.c_str(), *p.distance);
    else std::printf("%-30s %-9s %-9s %8s", p.effect.c_str(), p.first.c_str(), p.second.c_str(), "-");
    if (!p.missing.empty()) std::printf("  no %s", p.missing.c_str());
    if (p.equal_number) std::printf("  both have %s", io::shortest_digits(*p.equal_number).c_str());
    std::printf("%s\n", p.refused() ? "  refused" : "");
    refused += p.refused();
  }
  std::printf("%zu pairs, %zu refused: nearer than %g, an equal number, or nothing written down\n", all.size(), refused,
              benchmark::kMinDistance);
  return {{"refused", refused}, {"pairs", all}};
}

void add_question_options(io::Command& c, benchmark::BenchQuestions& q) {
  c.option("--vehicle", q.vehicle, "the robot as declared, where it is elsewhere now");
  c.option("--priors", q.priors, "what is uncertain of the vehicle").shows_default();
  c.option("--discrepancy", q.discrepancy,
           "what models get wrong; of a family: configs/lab/discrepancy/without_FAMILY.toml")
      .shows_default();
  c.option("--sessions", q.sessions, "what differs between sessions, for a contrast").shows_default();
  c.option("--verdict", q.verdict,
           "constants of the verdict; none: configs/gap/verdict.toml, for a contrast contrast_verdict.toml");
  c.option("--threads", q.threads, "cases at a time; 0: one for each processor").range(0, 1024);
}

}  // namespace
}  // namespace flappy::blind

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-blind",
                      "Robots of simulators A, B and C, written apart: flies, diagnoses and scores them.", {});
  io::Command list = program.app().command("effects", "lists the effects that a robot may have");
  blind::FamilyOptions of;
  constexpr const char* kFamily = "a, b or c; none: a with the options of this command";
  list.option("--family", of.family, kFamily);
  io::Command fly = program.app().command("fly", "flies three times and writes the logs");
  blind::RobotOptions robot;
  std::string programme = "rich";
  blind::add_robot_options(fly, robot);
  const io::Option programmed = fly.option("--programme", programme, "rich: excitation, a path, turns; hover: calm")
                                    .one_of({"rich", "hover"})
                                    .shows_default();
  const io::Option family = fly.option("--family", of.family, kFamily);
  const io::Option hovers = fly.flag("--hover", of.hover, "as --programme hover");
  const io::Option reference =
      fly.option("--reference", of.reference,
                 "of a family: folder for a session of the same robot without the effects, flown before")
          .needs(family);
  fly.option("--reference-sessions", of.reference_sessions,
             "sessions of the flights of --reference, in turn; with --bench each has all runs")
      .range(std::size_t{1}, blind::Family::kFlights)
      .needs(reference)
      .shows_default();
  fly.flag("--calm-reference", of.calm_reference, "the reference hovers and follows slow paths").needs(reference);
  const io::Option bench =
      fly.flag("--bench", of.bench, "of family b or c: clamped to a force sensor and filmed, in place of flights")
          .needs(family)
          .excludes(hovers);
  fly.flag("--own-parameters", of.own_parameters, "of a family: draw the parameters of each body").needs(family);
  fly.flag("--conventions", of.conventions, "of a family: draw sensors and declarations as laboratories have them")
      .needs(family);
  blind::OnBoardOptions on_board;
  const io::Option exported = fly.option("--exported", on_board.exported,
                                         "of a family: one flight under what flappy-export wrote, into --out itself")
                                  .needs(family)
                                  .excludes(reference)
                                  .excludes(programmed)
                                  .excludes(hovers)
                                  .excludes(bench);
  fly.option("--firmware", on_board.firmware, "mistake of the firmware around it").needs(exported).shows_default();
  fly.option("--begin", on_board.begin_s, "when the policy acts, s").range(0.0, 60.0).needs(exported).shows_default();
  fly.option("--duration", on_board.lasts_s, "of that flight, s").range(0.1, 60.0).needs(exported).shows_default();
  fly.option("--start", on_board.start, "x, y, z in m and heading in rad").needs(exported);
  fly.option("--out", robot.out, "folder for flight_1, flight_2, flight_3").required();
  io::Command escape = program.app().command("escape", "flies a policy's manoeuvre many times over");
  blind::EscapeOptions escapes{.robot = {}, .policy = {}, .config = io::config_path("fly/escape.toml")};
  blind::add_robot_options(escape, escapes.robot);
  escape.option("--policy", escapes.policy, policy::kPolicyFiles).required();
  escape.option("--config", escapes.config, "task and controller that it was trained with").shows_default();
  escape.option("--draw", escapes.draw, "which of the seed's robots: that of fly, in its --json")
      .range(std::uint64_t{0}, blind::kTries - 1)
      .shows_default();
  escape.option("--count", escapes.count, "escapes, each from another start").range(1, 10000).shows_default();
  escape.option("--out", escapes.robot.out, "folder for the logs: escape_1, escape_2, ...");
  io::Command laws = program.app().command("laws", "compares laws of effects: those of families, and the catalogue's");
  std::vector<std::string> compared = {"a", "b", "c"};
  std::filesystem::path laws_file;
  laws.option("--family", compared, "these families").one_of({"a", "b", "c"}).shows_default();
  laws.option("--page", laws_file, "file for a table of laws and sources");
  io::Command make = program.app().command("make", "flies the cases of a benchmark and seals what they are");
  benchmark::MakeCommand made;
  std::string set;
  make.option("--family", made.family, "of whose robots: a, b or c").shows_default();
  make.option("--out", made.out, "folder for the cases").required();
  make.option("--set", set, "development or reported: which seeds").one_of({"development", "reported"}).required();
  const io::Option contrast =
      make.flag("--contrast", made.plan.contrast, "robots with reference flights of other sessions");
  std::vector<std::string> parts(std::begin(benchmark::kParts), std::end(benchmark::kParts));
  parts.insert(parts.end(), std::begin(benchmark::kContrastParts), std::end(benchmark::kContrastParts));
  make.option("--part", made.plan.parts, "these parts alone").one_of(parts);
  make.option("--cases", made.plan.at_most, "of each part at most").range(1, 1000);
  make.option("--skip", made.plan.skip, "of each part, so many cases before: robots whose labels are open")
      .range(0, 1000);
  make.option("--only", made.plan.only, "of these cases those of these numbers alone");
  make.option("--flights", made.plan.flights, "of each session at most, with --contrast")
      .range(std::size_t{1}, blind::Family::kFlights)
      .needs(contrast)
      .shows_default();
  make.option("--reference-sessions", made.plan.reference_sessions,
              "of the references of each robot, in turn; with --bench each has all runs")
      .range(std::size_t{1}, blind::Family::kFlights)
      .needs(contrast)
      .shows_default();
  make.option("--effects", made.plan.effects, "of robots that have one: these alone");
  make.flag("--bench", made.plan.bench, "robots are clamped to a force sensor and filmed, with --contrast")
      .needs(contrast);
  make.option("--vehicle", made.vehicle, "the robot as declared").shows_default();
  make.option("--randomise", made.randomise, "what robots of the part parameters are drawn from").shows_default();
  make.option("--threads", made.threads, "0: one for each processor").range(0, 1024);
  io::Command score = program.app().command("score", "diagnoses every case, then opens the labels and compares");
  benchmark::ScoreCommand scored;
  score.option("folders", scored.folders, "of flappy-blind make");
  blind::add_question_options(score, scored);
  score.option("--cases", scored.cases, "cases.jsonl of other scores, of other machines or days: added to the table");
  score.option("--out", scored.out, "folder for score.md, score.csv and cases.jsonl; none: the first of those");
  score.flag("--proposals", scored.proposals,
             "fly what undecided diagnoses of part singles propose, changes to the robot included");
  io::Command plan = program.app().command("plan", "before scoring: what plans expect of the diagnoses of each case");
  benchmark::BenchQuestions foreseen;
  plan.option("folders", foreseen.folders, "of flappy-blind make").required();
  blind::add_question_options(plan, foreseen);
  io::Command calibrate = program.app().command("calibrate", "learns from scored cases how much evidence counts");
  benchmark::CalibrateCommand calibrated;
  calibrate.option("folders", calibrated.folders, "of flappy-blind score").required();
  calibrate.option("--verdict", calibrated.verdict, "constants to start from").shows_default();
  calibrate.option("--out", calibrated.out, "file for the constants").required();
  io::Command loop =
      program.app().command("loop", "trains on with what was diagnosed, and flies robots with it and without");
  blind::LoopCommand looped;
  loop.option("folders", looped.folders, "of flappy-blind score; without --run, of make").required();
  loop.option("--run", looped.run, "run folder of flappy-train, whose best policy is trained on");
  loop.option("--out", looped.out, "folder for what is trained, loop.csv and loop.md").required();
  loop.option("--also", looped.also, "other run folders, whose best policies the robots fly as they are");
  loop.option("--set", looped.overrides, "override a key of the run: learn.updates=20000").one_at_a_time();
  loop.option("--robots", looped.robots, "of each folder at most").range(1, 1000);
  loop.option("--costly", looped.costly, "run folder: only robots whose effect costs its best policy escapes");
  loop.option("--escapes", looped.escapes, "of each robot and policy").range(1, 10000).shows_default();
  loop.option("--threads", looped.threads, "robots at a time; 0: one for each processor").range(0, 1024);
  program.app().expect_commands(1, 1);
  program.takes_ranks();
  return program.run(argc, argv, [&] {
    using blind::Programme;
    if (make.given()) {
      made.plan.reported = set == "reported";
      made.ranks = program.ranks("work: make\n");
      if (benchmark::make_bench(made)) program.write_json({{"out", made.out.string()}});
      else std::printf("stopped; what has flown stays: the same command goes on\n");
    } else if (plan.given()) {
      if (benchmark::foresee_bench(foreseen)) program.write_json({{"folders", foreseen.folders.size()}});
      else std::printf("stopped; what is planned stays: the same command goes on\n");
    } else if (score.given()) {
      scored.ranks = program.ranks("priors: " + io::sha256(io::read_text(scored.priors)) +
                                   ", discrepancy: " + io::sha256(io::read_text(scored.discrepancy)) + ", verdict: " +
                                   (scored.verdict.empty() ? "" : io::sha256(io::read_text(scored.verdict))) + "\n");
      const nlohmann::ordered_json scores = benchmark::score_bench(scored);
      if (!scores.is_null()) program.write_json(scores);
    } else if (loop.given()) {
      const nlohmann::ordered_json found = blind::run_loop(looped);
      if (!found.is_null()) program.write_json(found);
    } else if (calibrate.given()) program.write_json(benchmark::calibrate(calibrated));
    else if (laws.given()) program.write_json(blind::check_laws(compared, laws_file));
    else if (list.given()) {
      nlohmann::ordered_json all = nlohmann::ordered_json::object();  // effect: its typical magnitude in words, or null
      if (of.family.empty())
        for (const std::string& name : blind::effect_names()) all[name] = nullptr, std::printf("%s\n", name.c_str());
      else
        for (const blind::FamilyEffect& e : benchmark::family_named(of.family).effects())
          all[e.id] = e.typical, std::printf("%-30s %s\n", e.id.c_str(), e.typical.c_str());
      program.write_json(all);
    } else if (escape.given()) program.write_json(blind::fly_escapes(escapes));
    else {
      of.hover = of.hover || programme == "hover";
      if (!of.reference.empty() && of.reference == robot.out)
        throw io::InputError("--reference " + of.reference + ": is also --out; accepted: two folders");
      if (!on_board.exported.empty()) {
        if (on_board.start.size() != 4) throw io::InputError("--start: accepted: four numbers, x y z heading");
        program.write_json(blind::fly_with_firmware(robot, of, on_board));
        return;
      }
      program.write_json(of.family.empty() ? blind::fly_case(robot, of.hover ? Programme::hover : Programme::rich)
                                           : blind::fly_family(robot, of));
      std::printf("%s\n", io::shown_by(robot.out).c_str());
    }
  });
}
