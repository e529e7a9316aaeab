#include "bench_closed_loop.hpp"

#include "flight/flight_block.hpp"

namespace flappy::bench {
namespace {

constexpr std::size_t kFlappers = 4096;
constexpr double kControl_hz = 500;

io::Table table(const std::string& path) { return io::Config::load(path).root(); }

/// An actor of the usual size with zero weights: it costs its time and does not act.
std::shared_ptr<const policy::Actor> idle_actor(const flight::Task& task) {
  auto actor = std::make_shared<policy::Actor>();
  const int inputs = static_cast<int>(task.observation().size());
  for (const flight::Signal& s : task.observation()) actor->observation.push_back(s.name);
  for (const flight::Signal& s : task.action()) actor->action.push_back(s.name);
  actor->widths = {inputs, 32, 32, task.actions()};
  actor->weights.assign(policy::weight_count(actor->widths), 0);
  actor->mean.assign(static_cast<std::size_t>(inputs), 0);
  actor->scale.assign(static_cast<std::size_t>(inputs), 1);
  return actor;
}

class Loop {
 public:
  Loop(const model::Vehicle& vehicle, const std::string& configs, const std::string& sensors,
       const std::string& controller, bool actor)
      : fleet_(kFlappers, vehicle, hovering(configs, sensors, controller)) {
    if (actor) fleet_.set_actor(idle_actor(fleet_.options().task));
    for (int i = 0; i < 300; ++i) fleet_.step();  // 0.6 s: all flappers are in the air
  }
  /// Control steps per second over `seconds` of processor time.
  double run(double seconds) {
    double spent = 0;
    long ticks = 0;
    while (spent < seconds) {
      const double start = processor_seconds();
      for (int i = 0; i < 50; ++i) fleet_.step();
      spent += processor_seconds() - start;
      ticks += 50;
    }
    return static_cast<double>(ticks) * kFlappers / spent;
  }
  flight::Fleet<float>& fleet() { return fleet_; }

 private:
  flight::Fleet<float> fleet_;
};

}  // namespace

flight::FleetOptions hovering(const std::string& configs, const std::string& sensors, const std::string& controller) {
  flight::FleetOptions o;
  o.sensors = flight::read_sensors(table(configs + "/sensors/" + sensors + ".toml"));
  o.controller = flight::read_controller(table(configs + "/controllers/" + controller + ".toml"), kControl_hz);
  o.task = flight::read_task(table(configs + "/tasks/hover.toml"), 1 / kControl_hz);
  o.control_hz = kControl_hz;
  o.batch.threads = 1;
  return o;
}

LoopReport measure_closed_loop(const model::Vehicle& vehicle, const std::string& configs, const SpeedOptions& options) {
  struct Candidate {
    std::string name;
    Loop loop;
    std::vector<double> values;
  };
  std::vector<Candidate> candidates;
  candidates.push_back({"PID, paper's sensors", Loop(vehicle, configs, "paper", "pid", false), {}});
  candidates.push_back({"  with an actor 32-32", Loop(vehicle, configs, "paper", "pid", true), {}});
  candidates.push_back({"ARC, paper's sensors", Loop(vehicle, configs, "paper", "arc", false), {}});
  candidates.push_back({"PID, code's sensors", Loop(vehicle, configs, "code", "pid", false), {}});
  for (int round = 0; round < options.rounds; ++round)
    for (Candidate& c : candidates) c.values.push_back(c.loop.run(options.seconds));

  LoopReport report;
  for (Candidate& c : candidates) report.rows.push_back({c.name, summary(c.values)});
  report.bytes_per_flapper = candidates[0].loop.fleet().bytes_per_flapper();
  std::uint64_t cycles[flight::kStages] = {};
  candidates[0].loop.fleet().count_cycles(cycles);
  candidates[0].loop.run(options.seconds);
  const char* names[flight::kStages] = {"controller", "physics", "sensors", "estimator", "reward, end and observation"};
  double total = 0;
  for (const std::uint64_t c : cycles) total += static_cast<double>(c);
  for (int i = 0; i < flight::kStages; ++i)
    report.shares.emplace_back(names[i], static_cast<double>(cycles[i]) / total);
  return report;
}

}  // namespace flappy::bench
