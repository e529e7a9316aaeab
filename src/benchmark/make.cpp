#include "benchmark/make.hpp"

#include <cstdio>
#include <optional>

#include "benchmark/records.hpp"
#include "benchmark/work.hpp"
#include "blind/sampled_robot.hpp"
#include "io/append_file.hpp"
#include "io/config.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

class Maker {
 public:
  explicit Maker(const MakeCommand& command)
      : command_(command),
        sealed_(command.out / "sealed"),
        detectability_(read_detectability(command.detectable)),
        plan_(plan_cases(detectability_, command.plan)),
        declared_(blind::declared_case(command.vehicle)),
        as_declared_(declared_.vehicle),
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

  /// Half a benchmark goes on with the same plan only.
  void agree_with_what_is_there() const {
    Json plan = Json::array();
    for (const PlannedCase& p : plan_) plan.push_back(to_json(p));
    const std::string text = plan.dump() + declared_.vehicle_sha256 + io::sha256(io::read_text(command_.randomise));
    const fs::path file = sealed_ / "plan.sha256";
    if (!fs::exists(file)) io::write_atomically(file, io::sha256(text) + "\n");
    else if (io::read_text(file) != io::sha256(text) + "\n")
      throw io::InputError(command_.out.string() +
                           ": begun with another plan; accepted: the same options, or a name for a new folder");
  }

  void make(const PlannedCase& p) const {
    blind::Case c = declared_;
    c.sizes = blind::Sizes(p.effects);
    c.programme = p.hover ? blind::Programme::hover : blind::Programme::rich;
    c.power = p.power;
    Json label;
    try {
      fs::remove_all(case_folder(p));  // half of it may be there
      io::make_folder(case_folder(p));
      const blind::SampledRobot flown = blind::fly_sampled(c, p.randomised ? sampled_ : as_declared_, p.seed);
      for (std::size_t k = 0; k < flown.flights.size(); ++k)
        flightlog::write_flight_log(case_folder(p) / ("flight_" + std::to_string(k + 1)), flown.flights[k].log);
      label = to_json(Label{p, flown.draw, true_values(p, flown.flown)});
    } catch (const blind::NeverFlies&) {
      label = to_json(Label{p, 0, {}});
      label["never_flies"] = true;
    }
    io::write_atomically(label_file(p), label.dump(1) + "\n");
  }

  std::map<std::string, double> true_values(const PlannedCase& p, const blind::Case& flown) const {
    std::map<std::string, double> known;
    if (!command_.true_values || (p.part != "singles" && p.part != "typical")) return known;
    for (const auto& [name, value] : command_.true_values(flown, p.effects))
      if (value) known[name] = *value;
    return known;
  }

  void seal() const {
    Manifest m{command_.plan.reported ? "reported" : "development",
               command_.vehicle.string(),
               declared_.vehicle_sha256,
               {},
               io::commit(),
               {}};
    Json cases = Json::array(), never = Json::array(), undetectable = Json::array();
    for (const PlannedCase& p : plan_) {
      Json label = read_json(label_file(p));
      if (label.contains("never_flies")) {
        never.push_back(std::move(label));
        continue;
      }
      cases.push_back(std::move(label));
      PublicCase c{p.number, p.withheld, {}};
      for (const fs::directory_entry& e : fs::recursive_directory_iterator(case_folder(p)))
        if (e.is_regular_file())
          c.files[e.path().lexically_relative(command_.out).string()] = io::sha256(io::read_text(e.path()));
      m.cases.push_back(std::move(c));
    }
    for (const auto& [id, d] : detectability_)
      if (d.undetectable) undetectable.push_back(id);
    const std::string labels =
        Json{{"schema", 1}, {"set", m.set}, {"undetectable", undetectable}, {"never_fly", never}, {"cases", cases}}
            .dump(1) +
        "\n";
    m.labels_sha256 = io::sha256(labels);
    io::write_atomically(sealed_ / "labels.json", labels);
    io::write_atomically(command_.out / "manifest.json", to_json(m).dump(1) + "\n");
    for (const PlannedCase& p : plan_) fs::remove(label_file(p));
    std::printf("%s: %zu cases, %zu that never fly, %zu effects undetectable\n", command_.out.c_str(), m.cases.size(),
                never.size(), undetectable.size());
  }

  const MakeCommand& command_;
  fs::path sealed_;
  std::map<std::string, Detectability> detectability_;
  std::vector<PlannedCase> plan_;
  blind::Case declared_;
  sim::Randomisation as_declared_, sampled_;
};

}  // namespace

bool make_bench(const MakeCommand& command) { return Maker(command).run(); }

}  // namespace flappy::benchmark
