// The determinism contract for closed-loop flight: sensors, estimator, controllers, actors and tasks too give one hash for any
// number of threads, batch size, place in the batch, instruction set and optimisation level.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "determinism/tried.hpp"
#include "flight/fleets.hpp"
#include "sim/randomise.hpp"

namespace flappy::flight {
namespace {

/// Golden hashes; a change means that every recorded run and every trained policy flies differently: say so in the commit.
struct Case {
  const char* name;
  std::uint64_t in_float, in_double;
};
constexpr Case kCases[] = {
    {"pid", 0xc10ee1b178424d2a, 0xe75aa050a549d8be},    {"notched", 0x061cdb6374941593, 0xa666deb590bb004a},
    {"arc", 0xf5c1f353f7772075, 0x09d4e56cfd8d8bca},    {"memory", 0x92a1f1c47b60df07, 0x16cea4b7124201d0},
    {"actor", 0x54f8be77e5f165bc, 0xb59c7058671bf3b3},  {"beat_averaged", 0x72d2f06ed6f723ff, 0x0b27535666c0d83e},
    {"jointed", 0x62fe5c1d3fae5f04, 0x14833ce5fd84951f}};

constexpr std::size_t kFlappers = 272, kSmall = 17;
constexpr int kPeriods = 10;

/// Known by the beat.
model::Vehicle beat_averaged() {
  using model::BeatAveraged;
  model::Vehicle v;
  v.name = "beat_averaged";
  v.air_density_kg_m3 = 1.2;
  v.torso = {0.1, {0.004, -0.003, 0.006}, {5e-4, 3e-4, 4e-4, 3e-5, -2e-5, 4e-5}};
  v.extent = {0.01, 0.1, 0.2};
  BeatAveraged& b = v.beat_averaged.emplace();
  b.nominal_Hz = 15;
  b.bandwidth_Hz = 3;
  b.inputs = {{"left", 0, 1, 0.5, {0.05, 0.03, 0, 0}},
              {"right", 0, 1, 0.5, {0.05, -0.03, 0, 0}},
              {"servo", -1, 1, 0, {0, 0, -0.1, 0.2}}};
  b.actuators = {{"left_Hz", "left", BeatAveraged::Role::flapping, 25, 1, 0.05},
                 {"right_Hz", "right", BeatAveraged::Role::flapping, 25, 1, 0},
                 {"tilt", "servo", BeatAveraged::Role::stroke_plane, 1, 0, 0.03}};
  b.coefficients = {{"k", 0.03, 0.003}, {"d", 0.004, 0.001}, {"r", 2e-5, 0}};
  b.wrenches = {{"left", {0, 0.08, 0.02}, {"0.1 * tilt", "", "k * left_Hz", "", "", ""}},
                {"right", {0, -0.08, 0.02}, {"0.1 * tilt", "", "k * right_Hz", "", "", ""}},
                {"air",
                 {},
                 {"-d * (left_Hz + right_Hz) * v_x", "-2 * d * speed * v_y", "", "-r * 30 * w_x", "-r * 30 * w_y",
                  "-r * 30 * w_z^2 * w_z"}}};
  return v;
}

/// Whose coefficients and effects differ.
model::Vehicle beat_averaged(std::size_t id) {
  static const sim::Randomisation randomisation(beat_averaged(), io::Config::parse("", "none").root());
  model::Vehicle v = randomisation.sample({.seed = 11, .flapper = static_cast<std::uint32_t>(id), .episode = 2});
  if (id % 5 == 0) v.effects["flapping_counter_force"] = {{"x_per_s", 3}, {"y_per_s", 2}, {"z_per_s", 1}};
  if (id % 7 == 0) v.effects["ground_effect"] = {{"gain", 0.2}, {"length_m", 0.05}};
  if (id % 3 == 0) v.effects["command_delay"] = {{"delay_s", 0.0017}};
  if (id % 11 == 0) v.effects["marker_offset"] = {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0.02}};
  return v;
}

/// Of four angles a wing: fixed, driven and free ones, strips on the left and a single point on the right.
model::Vehicle jointed(std::size_t id) {
  using model::Jointed;
  using Mode = Jointed::Mode;
  model::Vehicle v;
  v.name = "jointed";
  v.air_density_kg_m3 = 1.2;
  v.torso = {
      0.01 + 1e-4 * static_cast<double>(id % 17), {2e-4, -1e-4, -1e-3}, {4e-6, 3.8e-6, 2.4e-6, -7e-8, 1e-9, 2e-8}};
  v.extent = {0.01, 0.02, 0.08};
  v.left = v.right = {.leading_edge = {7e-4, {-3e-4, 3e-3, -6e-3}, {1.3e-7, 5e-8, 9e-8, 0, 1e-8, 0}},
                      .wing = {6e-5, {0, 0.037, -0.01}, {2.1e-8, 2.2e-9, 1.9e-8, 0, 2e-10, 0}},
                      .shoulder_m = {0, 0.014, 0.019},
                      .planform = {0.07, 0.0212, 0.206, 0.284, 0.451, 0.999, 0.246, 0.416, 1.028, 1.175, 5}};
  Jointed& j = v.jointed.emplace();
  j.frequency_Hz = 34;
  j.inputs = {{{"flap", -5, 5, 0, {0.3, 0.1, 0, 0}}, 0.004, 0.02, 0.01, 0, {0, 0.05, 0, 0.01}, {0, 0.02, 0, 0}},
              {{"tilt", -1, 1, 0.1, {0, 0, 0.2, 0.5}}, 0.006, 0, 0, 0.1, {}, {}, {0.1, 0.05, 0, 0}, {0.05, 0, 0, 0}}};
  const Jointed::Angle fixed{.mean_rad = 0.05};
  const Jointed::Angle hinge{Mode::free, 0, {}, {}, 2e-3, 0.1, 1e-6, -0.9, 0.9, 1, 1e-5};
  j.left.angles = {fixed, Jointed::Angle{Mode::driven, 0.02, {0.8, 0.05}, {0, 0.02}},
                   Jointed::Angle{Mode::driven, 0, {0.05, 0.1}, {0, 0}}, hinge};
  j.right.angles = {fixed, Jointed::Angle{Mode::driven, 0.02, {0.8, 0.05}, {0, 0.02}, 1e-3, 0, 1e-6},
                    Jointed::Angle{Mode::free, 0, {}, {}, 0.02, 0, 1e-6}, Jointed::Angle{Mode::driven, 0, {0}, {0.8}}};
  for (int i = 0; i < 5; ++i) j.left.strips.push_back({0.007 + 0.014 * i, 0.014, 0.024 - 0.002 * i, 0.004});
  j.left.rotational_lift = 1, j.left.added_mass = 0.5, j.left.rotational_damping_coefficient = 2;
  j.left.normal_sin = {3.4, 0.1}, j.left.tangential_cos = {0.2};
  v.right.shoulder_m.y = -0.014;
  for (model::RigidBody* b : {&v.right.leading_edge, &v.right.wing})
    b->com_m.y = -b->com_m.y, b->inertia_kg_m2.yz = -b->inertia_kg_m2.yz;
  if (id % 11 == 0) v.effects["marker_offset"] = {{"x_m", 0.01}, {"y_m", 0}, {"z_m", 0.02}};
  return v;
}

model::Vehicle vehicle(std::size_t id) {
  static const sim::Randomisation randomisation = [] {
    const auto config = io::Config::load(test::source_path("configs/randomisation/published.toml"));
    return sim::Randomisation(test::identified(), config.root());
  }();
  model::Vehicle v = randomisation.sample({.seed = 11, .flapper = static_cast<std::uint32_t>(id), .episode = 2});
  if (id % 5 == 0) v.effects["body_drag"] = {{"drag_area_m2", 0.001}, {"centre_z_m", 0.01}};
  if (id % 7 == 0) v.effects["ground_effect"] = {{"gain", 0.2}, {"length_m", 0.05}};
  return v;
}

std::shared_ptr<const policy::Actor> actor(const Task& task, bool recurrent) {
  policy::Actor a;
  for (const Signal& s : task.observation()) {
    a.observation.push_back(s.name);
    a.mean.push_back(0.125 * s.low);
    a.scale.push_back(2 / (s.high - s.low));
  }
  for (const Signal& s : task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), 11, 9, static_cast<int>(a.action.size())};
  a.hidden = policy::Activation::tanh;
  a.recurrent = recurrent;
  for (std::size_t i = 0; i < policy::weight_count(a.widths, false, recurrent); ++i)
    a.weights.push_back(static_cast<double>(i * 37 % 101) / 128 - 0.375);
  return std::make_shared<policy::Actor>(std::move(a));
}

/// Rates that divide neither each other nor the control rate, delays, losses, a path, every part of an observation,
/// actions that are held, and exploration. All numbers
/// stand here, so that tuning the shipped ones changes no hash.
FleetOptions options(const std::string& name) {
  const bool adaptive = name == "arc";
  Controller c;
  c.kind = adaptive ? kind_of<ArcController>() : kind_of<PidController>();
  double gain = 0.5;
  for (ControllerField& f : fields(c)) {
    if (f.otherwise) {
      *f.value = *f.otherwise;
      continue;
    }
    *f.value = std::min(std::max(gain, f.range.low + 0.01), f.range.high);
    gain = gain < 3 ? gain * 1.3 : 0.4;
  }
  if (name == "notched") c.constants.of<PidController>().notch_hz = 34;
  c.velocity_low_pass_hz = 20, c.body_rate_low_pass_hz = 30;
  if (adaptive) {
    ArcConstants<double>& k = c.constants.of<ArcController>();
    k.inertia_x_kg_m2 = k.inertia_y_kg_m2 = 5e-6, k.inertia_z_kg_m2 = 3e-6;
    k.roll_Nm_V = 1e-3, k.pitch_Nm_V = 6e-4, k.yaw_Nm_split = 4e-3, k.thrust_N_V = 0.0165;
    k.initial_mass_kg = 0.0125, k.mass_kg = {0.05, 0.008, 0.02};
    for (auto* a : {&k.roll_Nm, &k.pitch_Nm, &k.yaw_Nm}) *a = {1e-4, -1e-5, 1e-5};
    k.disturbance_m_s2 = {5, -0.5, 0.5};
  }
  Sensors s;
  s.imu = {333, 0.0005, 90, {0.01, 0, -0.005}, 0.05235987755982989, 0.5, {0.02, 0.03, 0.015}};
  s.mocap = {470, 0.003, 1e-4, 0.005, 0.3, 2};
  s.estimator = {1e-3, 0.02, 1e-4, 0.1, 0.01, 0.01};
  const Task t = task(
      along(waypoint(0, 0, 0, 0.3) + waypoint(0.004, 0.1, 0.05, 0.4, 1) + waypoint(0.02, 0, 0, 0.3, -2),
            "kind = \"flying\"\n[start.position_m]\nx_half = 0.3\ny_half = 0.3\nz = 0.4\nz_half = 0.1\n"
            "[start.rotation_rad]\nx_half = 0.5\ny_half = 0.5\nz_half = 3.0\n[start.velocity_m_s]\nx_half = 1.0\n"
            "[start.body_rate_rad_s]\nx_half = 5.0\nz_half = 5.0",
            "\"rotation_matrix\", \"position_error\", \"velocity\", \"body_rate\", \"beat_phase\", \"heading_error\", "
            "\"previous_action\", \"goal_rotation\", \"time\", \"trim\""),
      0.001);
  FleetOptions o = fleet_options(s, c, t);
  o.control_hz = 1000;
  o.seed = 0x123456789abcULL;
  o.batch.world.ground_z_m = 0;
  o.batch.world.walls = {{1, 0, -1, 0}};
  o.task.constants.hand_back = {1, 0, -1, 0.3, 2, 2, 0.5, 0.5, 8, 1e9};
  o.task.constants.limits.x_high_m = 0.1;
  o.task.constants.reward = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7,   0.8, 0.9, 1, 1.1, 0.1, 1.2,
                             0.3, 0.2, 10,  0.5, 20,  3,   0.006, 1.5, 0.1, 2, 1.3, 0.7};
  o.task.action_repeat = 3;
  return o;
}

template <class T>
Fleet<T> fly(const FleetOptions& common, const std::string& name, std::size_t first, std::size_t count, int threads,
             const std::string& set) {
  FleetOptions o = common;
  o.first_flapper = static_cast<std::uint32_t>(first);
  o.batch.threads = threads;
  o.batch.instruction_set = set;
  const auto of_kind = [&](std::size_t id) {
    return name == "beat_averaged" ? beat_averaged(id) : name == "jointed" ? jointed(id) : vehicle(id);
  };
  Fleet<T> fleet(count,
                 name == "beat_averaged" ? beat_averaged()
                 : name == "jointed"     ? jointed(0)
                                         : test::identified(),
                 o);
  if (name == "actor" || name == "memory") fleet.set_actor(actor(o.task, name == "memory"));
  fleet.set_exploration({0.3, 0.3, 0.4});
  const auto start = [&](std::size_t i, std::uint32_t episode) {
    if ((first + i) % 3 == 0) fleet.start(i, episode, {}, sim::Start::standing);
    else fleet.start(i, episode);
  };
  for (std::size_t i = 0; i < count; ++i) {
    fleet.set_vehicle(i, of_kind(first + i));
    start(i, 0);
    if (!o.task.sets_voltages()) fleet.set_added(i, {0.1 * static_cast<double>((first + i) % 9), 0, 0, 0.001});
  }
  for (int period = 0; period < kPeriods; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < count && period == 5; ++i)
      if ((first + i) % 13 == 0) start(i, 1);
  }
  return fleet;
}

template <class T>
void one_hash(const Case& c, std::uint64_t golden) {
  const FleetOptions o = options(c.name);
  std::uint64_t small = 0;
  for (const std::string& set : test::instruction_sets())
    for (const int threads : test::kThreads) {
      const Fleet<T> fleet = fly<T>(o, c.name, 0, kFlappers, threads, set);
      EXPECT_EQ(fleet.hash(), golden) << c.name << ", " << set << ", " << threads << " threads: 0x" << std::hex
                                      << fleet.hash();
      EXPECT_EQ(fleet.batch().count_status(sim::kFrozen), 0u);
      small = 0;
      for (std::size_t i = 0; i < kSmall; ++i) small = small * 31 + fleet.hash(i, i + 1);
    }
  for (const std::string& set : test::instruction_sets())
    for (const std::size_t size : test::batch_sizes(set)) {
      std::uint64_t all = 0;
      for (std::size_t first = 0; first < kSmall; first += size) {
        const Fleet<T> fleet = fly<T>(o, c.name, first, size, 2, set);
        for (std::size_t i = 0; i < size; ++i) all = all * 31 + fleet.hash(i, i + 1);
      }
      EXPECT_EQ(all, small) << c.name << ", " << set << ", batches of " << size;
    }
}

TEST(ClosedLoopDeterminism, Float) {
  for (const Case& c : kCases) one_hash<float>(c, c.in_float);
}
TEST(ClosedLoopDeterminism, Double) {
  for (const Case& c : kCases) one_hash<double>(c, c.in_double);
}

constexpr std::uint64_t kGoldenTakeOffFloat = 0x66fb087bbe1462f2;
constexpr std::uint64_t kGoldenTakeOffDouble = 0x003ee2dfe57e8d8f;

/// Flappers that leave the ground; some of them, the first among them, fall back on it and leave it again.
template <class T>
Fleet<T> take_off(std::size_t count, const std::string& set) {
  FleetOptions o = options("pid");
  o.batch.threads = 1;
  o.batch.instruction_set = set;
  Fleet<T> fleet(count, test::identified(), o);
  for (std::size_t i = 0; i < count; ++i) {
    fleet.start(i, 0, {}, sim::Start::standing);
    fleet.set_added(i, {9.5 + 0.5 * static_cast<double>(i), 0, 0, 0});
  }
  int falls_back = 0;
  sim::Start support = sim::Start::standing;
  for (int period = 0; period < 150; ++period) {
    fleet.step();
    const sim::Start before = std::exchange(support, fleet.batch().support(0));
    falls_back += before == sim::Start::flying && support == sim::Start::standing;
  }
  EXPECT_EQ(falls_back, 1) << set;
  return fleet;
}

template <class T>
void one_take_off(std::uint64_t golden) {
  for (const std::string& set : test::instruction_sets()) {
    const Fleet<T> fleet = take_off<T>(9, set);
    EXPECT_EQ(fleet.hash(), golden) << set << ": 0x" << std::hex << fleet.hash();
    EXPECT_EQ(take_off<T>(1, set).hash(), fleet.hash(0, 1)) << set << ", alone";
  }
}

TEST(ClosedLoopDeterminism, TakeOffInFloat) { one_take_off<float>(kGoldenTakeOffFloat); }
TEST(ClosedLoopDeterminism, TakeOffInDouble) { one_take_off<double>(kGoldenTakeOffDouble); }

// ---- a policy that sets voltages and sees the wings, under exploration

constexpr std::uint64_t kGoldenVoltagesFloat = 0x1cf9f1668fe8bee3;
constexpr std::uint64_t kGoldenVoltagesDouble = 0x7a2104974d94d41b;

template <class T>
std::uint64_t hash_by_voltages(std::size_t size, int threads, const std::string& set) {
  FleetOptions o = options("pid");
  o.controller = {};
  o.task = task(voltages_task("\"goal_rotation\", \"velocity\", \"body_rate\", \"previous_action\", \"wings\""), 0.001);
  o.task.action_repeat = 2, o.task.history = 2;
  std::uint64_t all = 0;
  for (std::size_t first = 0; first < kSmall; first += size) {
    const Fleet<T> fleet = fly<T>(o, "actor", first, std::min(size, kSmall - first), threads, set);
    EXPECT_EQ(fleet.batch().count_status(sim::kFrozen), 0u);
    for (std::size_t i = 0; i < fleet.size(); ++i) all = all * 31 + fleet.hash(i, i + 1);
  }
  return all;
}

template <class T>
void one_hash_by_voltages(std::uint64_t golden) {
  for (const std::string& set : test::instruction_sets())
    for (const std::size_t size : test::batch_sizes(set)) {
      const int threads = size == 1 ? 1 : 3;
      const std::uint64_t hash = hash_by_voltages<T>(size, threads, set);
      EXPECT_EQ(hash, golden) << set << ", batches of " << size << ", " << threads << " threads: 0x" << std::hex
                              << hash;
    }
}

TEST(ClosedLoopDeterminism, VoltagesInFloat) { one_hash_by_voltages<float>(kGoldenVoltagesFloat); }
TEST(ClosedLoopDeterminism, VoltagesInDouble) { one_hash_by_voltages<double>(kGoldenVoltagesDouble); }

TEST(ClosedLoopDeterminism, HashSeesNoiseActionsAndTime) {
  const FleetOptions o = options("pid");
  Fleet<float> a = fly<float>(o, "pid", 0, 3, 1, ""), b = fly<float>(o, "pid", 0, 3, 1, "");
  EXPECT_EQ(a.hash(), b.hash());
  b.set_adds(1, std::array{0.0, 0.0, 0.0, 1e-6});
  EXPECT_NE(a.hash(), b.hash());
  EXPECT_EQ(a.hash(0, 1), b.hash(0, 1));
  FleetOptions other = o;
  other.seed += std::uint64_t{1} << 40;
  EXPECT_NE(fly<float>(other, "pid", 0, 3, 1, "").hash(), a.hash());
  // losses, corrections, contact with a task's limits: all of it happened to someone
  const Fleet<float> many = fly<float>(o, "pid", 0, kFlappers, 1, "");
  int corrected = 0, out = 0, back = 0;
  for (std::size_t i = 0; i < kFlappers; ++i) {
    corrected += many.innovation(i).first > 0;
    out += (many.ended(i) & kOutOfBounds) != 0;
    back += many.handed_back(i);
  }
  for (const int n : {corrected, out, back}) {
    EXPECT_GT(n, 10);
    EXPECT_LT(n, static_cast<int>(kFlappers) - 10);
  }
}

}  // namespace
}  // namespace flappy::flight
