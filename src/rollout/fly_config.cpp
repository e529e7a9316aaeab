#include "rollout/fly_config.hpp"

#include <algorithm>
#include <cmath>

#include "flappy/vehicle_file.hpp"
#include "flight/schedule.hpp"
#include "io/sha256.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "model/beat_averaged.hpp"
#include "model/coarse_step.hpp"
#include "model/contact.hpp"
#include "model/effects/registry.hpp"

namespace flappy::rollout {
namespace {

/// Number of steps that a command_delay keeps its commands.
constexpr int kKeptSteps = model::CommandDelay::kSlots - 2;

using Overrides = std::vector<std::string>;

const Overrides kFiles = {"vehicle", "task", "sensors", "controller", "randomisation"};

/// Sorts overrides by the file to which they apply; "": the configuration itself.
std::map<std::string, Overrides> routed(const Overrides& overrides) {
  std::map<std::string, Overrides> to;
  for (const std::string& text : overrides) {
    const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    const std::size_t dot = text.find_first_of(".=", begin);
    const std::string first = text.substr(begin, dot - begin);
    const bool passed_on = dot != std::string::npos && text[dot] == '.' && std::ranges::count(kFiles, first) > 0;
    if (passed_on) to[first].push_back(text.substr(dot + 1));
    else to[""].push_back(text);
  }
  return to;
}

/// Runs `read`. In an error message about an override, restores the prefix "name." that routed() removed.
template <class Read>
auto for_file(const std::string& name, const Read& read) {
  try {
    return read();
  } catch (const io::InputError& e) {
    const std::string line = e.what(), start = "--set ";
    throw io::InputError(line.starts_with(start) ? start + name + "." + line.substr(start.size()) : line);
  }
}

void read_shapes(const io::Table& world, sim::World& w) {
  constexpr io::Range kPlace{-1e4, 1e4}, kAngle{-100, 100};
  constexpr double kShortest_m = 1e-6;  // else rounding could join the ends of an axis
  double a[3], b[3], c[3];
  const auto read = [](const io::Table& t, const char* key, io::Range range, double(&to)[3]) {
    std::ranges::copy(t.numbers(key, 3, range), to);
  };
  for (const io::Table& t : world.tables("sphere")) {
    read(t, "centre_m", kPlace, a);
    w.shapes.push_back(sim::sphere(a, t.number("radius_m", io::positive(1e4))));
  }
  for (const io::Table& t : world.tables("box")) {
    read(t, "centre_m", kPlace, a);
    read(t, "edges_m", io::positive(1e4), b);
    std::ranges::fill(c, 0);
    if (t.has("rotation_rad")) read(t, "rotation_rad", kAngle, c);
    w.shapes.push_back(sim::box(a, b, c));
  }
  for (const io::Table& t : world.tables("cylinder")) {
    read(t, "from_m", kPlace, a);
    read(t, "to_m", kPlace, b);
    if (std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) < kShortest_m)
      t.fail("to_m", "is where from_m is", "the other end of the axis");
    w.shapes.push_back(sim::cylinder(a, b, t.number("radius_m", io::positive(1e4))));
  }
}

sim::World read_world(const io::Table& root) {
  constexpr io::Range kPlace{-1e4, 1e4};
  sim::World w;
  const auto table = root.optional_table("world");
  if (!table) return w;
  w.gravity_m_s2 = table->number_or("gravity_m_s2", w.gravity_m_s2, {0, 100});
  w.ground_z_m = table->number_or("ground_z_m", w.ground_z_m, kPlace);
  w.ceiling_z_m = table->number_or("ceiling_z_m", w.ceiling_z_m, kPlace);
  if (w.ceiling_z_m <= w.ground_z_m)
    table->fail("ceiling_z_m", "is not above the ground", "a ceiling above ground_z_m");
  read_shapes(*table, w);
  if (!table->has("walls")) return w;
  for (const auto& row : table->rows("walls", 4, kPlace)) {
    const double length = std::sqrt(row[2] * row[2] + row[3] * row[3]);
    if (std::abs(length - 1) > 1e-3)
      table->fail("walls",
                  "normal of wall " + std::to_string(w.walls.size()) + " has length " + io::shortest_digits(length),
                  "[x_m, y_m, normal_x, normal_y], the normal of length 1");
    w.walls.push_back({row[0], row[1], row[2] / length, row[3] / length});
  }
  return w;
}

LogOptions read_log(const io::Table& root, double control_hz) {
  const io::Range rate = io::positive(control_hz), noise = io::non_negative(10);
  LogOptions log;
  if (const auto t = root.optional_table("log")) log.wing_loads = t->boolean_or("wing_loads", false);
  if (const auto t = root.optional_table("log.power"))
    log.power = {t->number("battery_nominal_V", io::positive(100)), t->number("rate_hz", rate),
                 t->number("latency_s", noise), t->number("voltage_noise_V", noise),
                 t->number("current_noise_A", noise)};
  if (const auto t = root.optional_table("log.wings"))
    log.wings = {t->number("rate_hz", rate), t->number("noise_rad", io::non_negative(1))};
  if (const auto t = root.optional_table("log.rig")) {
    log.rig = flightlog::read_rig(*t);
    log.rig->rate_hz = control_hz;
  }
  return log;
}

bool whole(double number) { return number > 0.5 && std::abs(number - std::round(number)) < 1e-6; }

/// Reads the actor. Throws io::InputError unless its observation and action are those of the task.
std::shared_ptr<const policy::Actor> fitting_actor(const io::Table& root, const flight::Task& task) {
  auto actor = std::make_shared<const policy::Actor>(policy::read_actor(root.file("actor")));
  const auto check = [&](const char* does, const std::vector<std::string>& has,
                         const std::vector<flight::Signal>& wanted) {
    std::string list;
    for (const flight::Signal& s : wanted) list += (list.empty() ? "" : ", ") + s.name;
    if (!std::ranges::equal(has, wanted, {}, {}, &flight::Signal::name))
      root.fail("actor", std::string(does) + " something else than task " + io::toml_string(task.name), list);
  };
  check("observes", actor->observation, task.observation());
  check("does", actor->action, task.action());
  return actor;
}

/// By how much a pose may be later than by its latency: the motion before is remembered for so long.
double longest_lateness_s(const flight::FleetOptions& fleet) {
  const double step_s = fleet.batch.step_s;
  const int period_steps = static_cast<int>(std::lround(1 / (fleet.control_hz * step_s)));
  return (model::MocapDelay::kSlots - 1) * period_steps * step_s -
         flight::Schedule(fleet.sensors, step_s, period_steps).longest_wait_s();
}

class Reader {
 public:
  Reader(const std::filesystem::path& path, const Overrides& overrides)
      : to_(routed(overrides)), main_(io::Config::load(path, to_[""])), root_(main_.root()) {}

  FlyConfig read() {
    root_.schema(1);
    root_.accept({"schema", "precision", "flight", "world", "constant_input", "excitation", "log", "vehicle", "task",
                  "sensors", "controller", "randomisation", "drawn_effects", "drawn_jitter", "actor", "dds",
                  "changes"});
    c_.precision = root_.choice("precision", {"float", "double"});
    read_flight();
    c_.fleet.batch.world = read_world(root_);
    c_.excitation = flight::read_excitation(root_, c_.duration_s);
    c_.log = read_log(root_, c_.fleet.control_hz);
    c_.changes = model::read_changes(root_);
    c_.dds = io::read_dds_config(root_);
    read_files();
    if (const auto t = root_.optional_table("drawn_effects")) {
      c_.drawn_effects = read_drawn_effects(*t, c_.vehicle, c_.fleet.batch.world.has_ground());
      c_.vehicle_sha256.clear();
    }
    if (const auto t = root_.optional_table("drawn_jitter")) read_drawn_jitter(*t);
    if (root_.has("actor")) c_.actor = fitting_actor(root_, c_.fleet.task);
    root_.finish();
    if (c_.fleet.task.sets_voltages()) refuse_inputs();
    if (c_.vehicle.beat_averaged) refuse_wings();
    if (!c_.vehicle.contact.empty() && !c_.fleet.task.says_contact) c_.fleet.task.constants.contact_ends = 0;
    if (c_.vehicle.jointed) refuse_motors();
    if (c_.log.rig && !c_.welded) root_.fail("log.rig", "is of a robot on a stand", "[flight] support = \"welded\"");
    if (c_.welded && c_.fleet.task.start.settled)
      root_.fail("flight.support",
                 "is \"welded\", but task " + io::toml_string(c_.fleet.task.name) + " starts from hover", "\"task\"");
    if (c_.vehicle.effects.contains("tether") && !c_.fleet.batch.world.has_ground())
      root_.fail("world.ground_z_m", "is missing, and the vehicle's tether hangs down to it", "the ground's height, m");
    if (c_.changes.swapped_wings && (c_.vehicle.beat_averaged || c_.vehicle.jointed))
      root_.fail("changes.swapped_wings", "is of a vehicle whose wings are no bodies of their own",
                 "a vehicle with wings and motors");
    if (c_.fleet.task.start.settled && c_.fleet.controller.kind == flight::kNoController)
      root_.fail("task",
                 io::toml_string(c_.fleet.task.name) + " starts from hover, but there is no controller that hovers",
                 "a controller, or a task of another start");
    check_times();
    keep_texts();
    return std::move(c_);
  }

 private:
  void read_flight() {
    const io::Table t = root_.table("flight");
    c_.duration_s = t.number("duration_s", io::positive(1e5));
    c_.settle_s = t.number_or("settle_s", 3, io::non_negative(1e5));
    c_.fleet.seed = static_cast<std::uint64_t>(t.integer("seed", 0, INT64_MAX));
    c_.fleet.first_flapper = static_cast<std::uint32_t>(t.integer_or("first_flapper", 0, 0, 1'000'000'000));
    c_.fleet.control_hz = t.number_or("control_hz", 500, {10, 10000});
    c_.fleet.batch.step_s = t.number_or("step_s", sim::kDefaultStep_s, {1e-6, 1e-3});
    c_.fleet.batch.threads = static_cast<int>(t.integer_or("threads", 0, 0, 1024));
    c_.welded = t.choice_or("support", "task", {"task", "welded"}) == "welded";
  }

  io::Config file(const std::string& key) {
    const std::filesystem::path path = root_.file(key);
    return for_file(key, [&] {
      io::Config config = io::Config::load(path, to_[key]);
      files_.emplace(key, config);
      return config;
    });
  }

  void read_files() {
    const std::filesystem::path vehicle = root_.file("vehicle");
    c_.vehicle = for_file("vehicle", [&] { return model::read_flyable_vehicle(vehicle, to_["vehicle"]); });
    const io::Config vehicle_config = file("vehicle");
    if (c_.vehicle.beat_averaged && c_.vehicle.beat_averaged->inputs.size() > model::kMaxInputs)
      vehicle_config.root().fail("input", "there are too many to be flown",
                                 "at most " + std::to_string(model::kMaxInputs));
    c_.vehicle_file_name = vehicle.filename().string();
    const bool as_filed = to_["vehicle"].empty();
    c_.vehicle_text = as_filed ? io::read_text(vehicle) : vehicle_config.resolved();
    if (as_filed) c_.vehicle_sha256 = io::sha256(c_.vehicle_text);
    const auto read = [&](const std::string& key, const auto& reader) {
      const io::Config config = file(key);
      return for_file(key, [&] { return reader(config.root()); });
    };
    c_.fleet.task = read("task", [&](const io::Table& t) { return flight::read_task(t, 1 / c_.fleet.control_hz); });
    c_.fleet.sensors = read("sensors", flight::read_sensors);
    c_.fleet.controller =
        read("controller", [&](const io::Table& t) { return flight::read_controller(t, c_.fleet.control_hz); });
    c_.controller_file = root_.file("controller");
    if (root_.has("randomisation") && root_.string("randomisation") == "posterior") {
      if (!c_.vehicle.posterior)
        root_.fail("randomisation", "the vehicle has no [posterior]",
                   "a file of [[randomise]] tables, or a vehicle that flappy-gap corrected");
      if (!to_["randomisation"].empty())
        root_.fail("randomisation", "is \"posterior\", but overridden", "a file of [[randomise]] tables");
      c_.randomisation = sim::Randomisation::of_posterior(c_.vehicle);
      c_.vehicle_sha256.clear();
    } else if (root_.has("randomisation")) {
      c_.randomisation =
          read("randomisation", [&](const io::Table& t) { return sim::read_randomisation(c_.vehicle, t); });
      c_.vehicle_sha256.clear();
    } else if (!to_["randomisation"].empty()) {
      root_.fail("randomisation", "is missing, but overridden", "a file of [[randomise]] tables");
    }
  }

  /// Each flight draws how much the latencies of poses and actions vary in it.
  void read_drawn_jitter(const io::Table& t) {
    t.accept({"mocap_s", "action_s"});
    const auto take = [&](const char* key, bool fixed, const char* where, double most) {
      const double value = t.number_or(key, 0, io::non_negative(most));
      if (value > 0 && fixed) t.fail(key, std::string("is drawn, but ") + where + " is fixed", "one of both");
      return value;
    };
    flight::MocapSensor& mocap = c_.fleet.sensors.mocap;
    if (const double s = take("mocap_s", mocap.jitter_s > 0, "mocap.jitter_s of the sensors", 0.1); s > 0)
      mocap.jitter_s = s, mocap.jitter_drawn = true;
    flight::Task& task = c_.fleet.task;
    const double action_s = take("action_s", task.action_late_most > 0, "action.jitter_s of the task", 1);
    const double periods = action_s * c_.fleet.control_hz;
    if (std::abs(periods - std::round(periods)) > 1e-6 || std::round(periods) >= task.action_repeat)
      t.fail("action_s", "is no whole number of control periods below action.repeat_s of the task",
             "n x " + io::shortest_digits(1 / c_.fleet.control_hz) + " s, less than " +
                 io::shortest_digits(task.action_repeat / c_.fleet.control_hz) + " s");
    if (action_s > 0)
      task.action_late_most = static_cast<std::uint32_t>(std::lround(periods)), task.action_late_drawn = true;
  }

  /// Throws io::InputError if the task's actions are motor voltages and a controller or an excitation is given as well.
  void refuse_inputs() const {
    const std::string sets =
        "but the actions of task " + io::toml_string(c_.fleet.task.name) + " are the motors' voltages";
    if (c_.fleet.controller.kind != flight::kNoController)
      root_.fail("controller", "is " + io::toml_string(flight::controller_name(c_.fleet.controller.kind)) + ", " + sets,
                 "a file of kind = \"none\"");
    flight::Excitation constant;
    constant.constant = c_.excitation.constant;
    if (constant.acts()) root_.fail("constant_input", "is added to inputs of the wing beat, " + sets, "none");
    if (c_.excitation.changes()) root_.fail("excitation", "is added to inputs of the wing beat, " + sets, "none");
  }

  /// Refuses what needs motors or wings, which a beat-averaged robot does not have.
  void refuse_wings() {
    const std::string but = ", but vehicle " + io::toml_string(c_.vehicle.name) + " is beat-averaged";
    const flight::Task& task = c_.fleet.task;
    if (task.sets_voltages())
      root_.fail("task", io::toml_string(task.name) + " sets voltages of motors" + but,
                 "a task whose actions are of the wing beat");
    for (const auto part : {flight::Part::beat_phase, flight::Part::wings})
      if (task.parts >> static_cast<int>(part) & 1)
        root_.fail("task", io::toml_string(task.name) + " observes wings or their phase" + but,
                   "a task of other parts");
    for (const char* key : {"log.power", "log.wings", "log.rig", "log.wing_loads"})
      if (root_.has(key)) root_.fail(key, "is asked for" + but, "no such log");
    c_.fleet.task.input_unit = "1";
  }

  /// Refuses what needs motors, which articulated wings do not have.
  void refuse_motors() {
    const std::string but = ", but the wings of vehicle " + io::toml_string(c_.vehicle.name) + " have no motors";
    if (c_.fleet.task.sets_voltages())
      root_.fail("task", io::toml_string(c_.fleet.task.name) + " sets voltages of motors" + but,
                 "a task whose actions are of the wing beat");
    if (root_.has("log.power"))
      root_.fail("log.power", "is asked for" + but, "no such log; joints.csv has their muscles'");
    for (const char* key : {"log.rig", "log.wing_loads"})
      if (root_.has(key)) root_.fail(key, "is asked for" + but, "no such log");
    c_.fleet.task.input_unit = "1";
  }

  void check_times() const {
    const flight::FleetOptions& o = c_.fleet;
    const double step = o.batch.step_s;
    if (!whole(1 / (o.control_hz * step)))
      root_.fail("flight.control_hz", "its period is no whole number of steps", "1 / (n step_s)");
    if (!c_.vehicle.beat_averaged && !c_.vehicle.jointed && !whole(c_.vehicle.driver.hold_s / step))
      root_.fail("flight.step_s",
                 "does not divide the driver's hold of " + io::shortest_digits(c_.vehicle.driver.hold_s) + " s",
                 "hold_s / n");
    if (!c_.vehicle.beat_averaged && !c_.vehicle.jointed &&
        c_.vehicle.driver.hold_s * c_.vehicle.driver.flapping_Hz > 0.25)
      root_.fail("vehicle", "its driver.hold_s is longer than a quarter of a beat",
                 "a hold_s of at most 0.25 / flapping_Hz");
    check_beat(step);
    for (const flight::Wave& w : c_.excitation.waves)
      if (std::max(w.from_hz, w.to_hz) > 0.5 * o.control_hz)
        root_.fail(
            "excitation",
            "goes up to " + io::shortest_digits(std::max(w.from_hz, w.to_hz)) + " Hz, and is held for a control period",
            "at most half of flight.control_hz");
    for (const double rate : {o.sensors.imu.rate_hz, o.sensors.mocap.rate_hz})
      if (rate * step > 1 + 1e-9)
        root_.fail("flight.step_s",
                   "is longer than the " + io::shortest_digits(1 / rate) + " s between samples of a sensor",
                   "a shorter step, or a slower sensor");
    const flight::MocapSensor& mocap = o.sensors.mocap;
    const double room_s = longest_lateness_s(o);
    if (mocap.jitter_s > 0 && mocap.longest_jitter_s() > room_s) {
      const auto fail = [&](const io::Table& table, const char* key) {
        const double most_s = mocap.jitter_exponential ? room_s / flight::kJitterCut : room_s;
        table.fail(key,
                   "lets poses be " + io::format("%.4g", mocap.longest_jitter_s()) +
                       " s late, and the motion is remembered for " + std::to_string(model::MocapDelay::kSlots) +
                       " control periods",
                   "at most " + io::format("%.3g", std::max(0.0, most_s)));
        return 0;
      };
      if (mocap.jitter_drawn) fail(root_, "drawn_jitter.mocap_s");
      else for_file("sensors", [&] { return fail(files_.at("sensors").root(), "mocap.jitter_s"); });
    }
    if (const auto fault = model::contact_fault(c_.vehicle, step))
      for_file("vehicle", [&] {
        files_.at("vehicle").root().fail(fault->path, fault->what, fault->accepted);
        return 0;
      });
    if (const auto found = c_.vehicle.effects.find(model::MocapDelay::kInfo.id); found != c_.vehicle.effects.end()) {
      const auto e = static_cast<std::size_t>(model::effect_index(model::MocapDelay::kInfo.id));
      const double delay_s = model::effects()[e].values(found->second)[0];
      if (delay_s < -o.sensors.mocap.latency_s)
        root_.fail("sensors",
                   "has a mocap.latency_s of " + io::shortest_digits(o.sensors.mocap.latency_s) +
                       " s, and the vehicle's mocap_delay of " + io::shortest_digits(delay_s) +
                       " s shows poses before they were",
                   "a longer latency, or a delay of at least its negative");
    }
    const char* const delay = model::CommandDelay::kInfo.id;
    if (const auto found = c_.vehicle.effects.find(delay);
        found != c_.vehicle.effects.end() && !c_.vehicle.beat_averaged) {
      const auto e = static_cast<std::size_t>(model::effect_index(delay));
      const double late_s = model::effects()[e].values(found->second)[0];
      if (late_s > kKeptSteps * step)
        root_.fail("flight.step_s",
                   "is too short for a command_delay of " + io::shortest_digits(late_s) + " s, of which " +
                       std::to_string(kKeptSteps) + " steps are kept",
                   "a longer step, or a shorter delay");
    }
  }

  /// Refuses, or warns of, a step that is long for the beat of the wings.
  void check_beat(double step_s) const {
    const auto coarse = model::coarse_step(c_.vehicle, step_s);
    if (!coarse) return;
    // the longest step that does, and is a whole share of the control period and of the driver's hold
    const double period_s = 1 / c_.fleet.control_hz, hold_s = c_.vehicle.jointed ? period_s : c_.vehicle.driver.hold_s;
    double shares = std::ceil(period_s / coarse->enough_s - 1e-6);
    constexpr double kMaxShares = 1e6;
    while (shares < kMaxShares && !whole(hold_s * shares / period_s)) ++shares;
    const double fits_s = period_s / shares;
    const std::string what = coarse->what + " (vehicle " + io::toml_string(c_.vehicle.name) + ")";
    if (coarse->refused) root_.fail("flight.step_s", what, "at most " + io::format("%.6g", fits_s));
    root_.warn("flight.step_s", what + " for a lift within a per cent; " + io::format("%.6g", fits_s) + " does");
  }

  void keep_texts() {
    Overrides names;
    for (const auto& [key, config] : files_) {
      c_.resolved[key + ".toml"] = config.resolved();
      names.push_back(key + "=" + key + ".toml");
    }
    // copy the file of the path too
    const io::Table task = files_.at("task").root();
    if (task.has("path.file")) {
      const std::filesystem::path csv = task.file("path.file");
      const std::string name = csv.filename().string();
      c_.resolved[name] = io::read_text(csv);
      c_.resolved["task.toml"] =
          io::Config::parse(c_.resolved["task.toml"], "task.toml", {"path.file=" + io::toml_string(name)}).resolved();
    }
    c_.resolved["fly.toml"] = io::Config::parse(main_.resolved_without("dds"), "fly.toml", names).resolved();
  }

  std::map<std::string, Overrides> to_;
  io::Config main_;
  io::Table root_;
  std::map<std::string, io::Config> files_;
  FlyConfig c_;
};

/// Limits drawn delays to what can be flown: no pose is seen before it was, and commands are kept for so many steps.
void limit_delays(const flight::FleetOptions& fleet, model::Vehicle& v) {
  const auto limit = [&](const char* effect, double low, double high) {
    const auto found = v.effects.find(effect);
    if (found == v.effects.end()) return;
    const auto e = static_cast<std::size_t>(model::effect_index(effect));
    double& delay_s = found->second[model::effects()[e].parameters[0].name];
    delay_s = std::max(low, std::min(delay_s, high));
  };
  limit(model::MocapDelay::kInfo.id, -fleet.sensors.mocap.latency_s,
        longest_lateness_s(fleet) - fleet.sensors.mocap.longest_jitter_s());
  if (!v.beat_averaged) limit(model::CommandDelay::kInfo.id, 0, kKeptSteps * fleet.batch.step_s);
}

}  // namespace

model::Vehicle FlyConfig::vehicle_of(std::uint32_t flapper, std::uint32_t episode) const {
  model::Vehicle v = randomisation ? randomisation->sample({fleet.seed, flapper, episode}) : vehicle;
  if (drawn_effects) drawn_effects->add({fleet.seed, flapper, episode}, v);
  if (draws_vehicles()) limit_delays(fleet, v);
  for (const auto& [id, values] : added_effects) v.effects[id] = values;
  apply(changes, v);
  return v;
}

void FlyConfig::draw_no_vehicles() {
  randomisation.reset();
  drawn_effects.reset();
}

model::Vehicle FlyConfig::roomy_vehicle() const {
  model::Vehicle v = vehicle;
  if (drawn_effects) drawn_effects->make_room(v);
  return v;
}

FlyConfig unwatched(FlyConfig config) { return config.watch.reset(), config; }

FlyConfig read_fly_config(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  return Reader(path, overrides).read();
}

}  // namespace flappy::rollout
