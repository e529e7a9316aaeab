// Whole flights: what a configuration may say, what is added to the inputs, how flights are scored, and what their logs
// hold against what the simulator knows.
#include "flight/fly.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <complex>
#include <fstream>
#include <numbers>

#include "flight/recorder.hpp"
#include "io/csv.hpp"
#include "io/sha256.hpp"
#include "sim/storage.hpp"
#include "vehicles.hpp"

namespace flappy::flight {
namespace {

namespace fs = std::filesystem;
using test::source_path;
constexpr double kPi = std::numbers::pi;

/// Gone at the end of its test.
class Folder {
 public:
  Folder()
      : path_(fs::temp_directory_path() / ("fly_test_" + std::to_string(getpid()) + "_" + std::to_string(++count_))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path operator/(const std::string& name) const { return path_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }

 private:
  static inline int count_ = 0;
  fs::path path_;
};

const std::string kHover = source_path("configs/fly/hover.toml");

std::string message(const auto& action) {
  try {
    action();
    return "accepted";
  } catch (const io::InputError& e) {
    return e.what();
  }
}
std::string refusal(const std::vector<std::string>& overrides, const std::string& path = kHover) {
  return message([&] { read_fly_config(path, overrides); });
}

// ---- configuration

TEST(FlyConfig, ShippedOnesAreRead) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(source_path("configs/fly"))) {
    EXPECT_EQ(refusal({}, entry.path()), "accepted") << entry.path();
    ++count;
  }
  EXPECT_GE(count, 8);
  const FlyConfig c = read_fly_config(kHover);
  EXPECT_EQ(c.vehicle_file_name, "hummingbird_identified.toml");
  EXPECT_EQ(c.vehicle_sha256, io::sha256(io::read_text(source_path("configs/vehicles/hummingbird_identified.toml"))));
  EXPECT_EQ(c.fleet.control_hz, 500);
  EXPECT_EQ(c.fleet.batch.world.ground_z_m, 0);
  EXPECT_EQ(c.settle_s, 3);
  EXPECT_FALSE(c.excitation.changes());
}

TEST(FlyConfig, OverridesReachTheFileTheyName) {
  const FlyConfig c =
      read_fly_config(kHover, {"vehicle.left.motor.resistance_ohm=14", "sensors.mocap.loss_probability = 0.1",
                               "controller.attitude.pitch.p=4.25", "task.end.time_s=7", "flight.seed=9",
                               "world.walls=[[1.0, 0, -1, 0]]"});
  EXPECT_EQ(c.vehicle.left.motor.resistance_ohm, 14);
  EXPECT_EQ(c.vehicle_sha256, "");
  EXPECT_EQ(c.fleet.sensors.mocap.loss_probability, 0.1);
  EXPECT_EQ(c.fleet.controller.pid.pitch.p, 4.25);
  EXPECT_EQ(c.fleet.task.constants.limits.time_s, 7);
  EXPECT_EQ(c.fleet.seed, 9u);
  ASSERT_EQ(c.fleet.batch.world.walls.size(), 1u);
  EXPECT_EQ(c.fleet.batch.world.walls[0].normal_x, -1);

  const FlyConfig arc = read_fly_config(kHover, {"controller=../controllers/arc.toml", "controller.heading.k_1_s=3"});
  EXPECT_EQ(arc.fleet.controller.kind, Controller::Kind::arc);
  EXPECT_EQ(arc.fleet.controller.arc.heading.k_1_s, 3);

  const FlyConfig random = read_fly_config(kHover, {"randomisation=../randomisation/published.toml"});
  EXPECT_EQ(random.vehicle_sha256, "");
  EXPECT_NE(random.vehicle_of(0).torso.mass_kg, random.vehicle_of(1).torso.mass_kg);
  EXPECT_EQ(c.vehicle_of(0).torso.mass_kg, c.vehicle_of(1).torso.mass_kg);
}

TEST(FlyConfig, RefusesInOneLine) {
  const std::string pid = source_path("configs/fly/../controllers/pid.toml");
  EXPECT_EQ(
      refusal({"flight.duration_s=0"}),
      "--set flight.duration_s=0: flight.duration_s: 0 is out of range; accepted: a number above 0, at most 1e+05");
  EXPECT_EQ(
      refusal({"controller.attitude.pitch.p=-1"}),
      "--set controller.attitude.pitch.p=-1: attitude.pitch.p: -1 is out of range; accepted: a number from 0 to 1000");
  EXPECT_EQ(refusal({"controller=3"}), "--set controller=3: controller: is an integer; accepted: the name of a file");
  EXPECT_EQ(refusal({"controller=none_such.toml"}),
            source_path("configs/fly/none_such.toml") + ": cannot be read: No such file or directory");
  EXPECT_EQ(refusal({"vehicle.torso.mass_g=12"}),
            "--set vehicle.torso.mass_g=12: torso.mass_g: unknown key; accepted here with another unit: \"mass_kg\"");
  EXPECT_EQ(refusal({"flight.control_hz=300"}),
            "--set flight.control_hz=300: flight.control_hz: its period is no whole number of steps; accepted: 1 / (n "
            "step_s)");
  EXPECT_EQ(
      refusal({"flight.step_s=4e-4"}),
      "--set flight.step_s=4e-4: flight.step_s: does not divide the driver's hold of 0.001 s; accepted: hold_s / n");
  EXPECT_EQ(
      refusal({"flight.step_s=5e-4", "sensors.imu.rate_hz=4000"}),
      "--set flight.step_s=5e-4: flight.step_s: is longer than the 0.00025 s between samples of a sensor; accepted: a "
      "shorter step, or a slower sensor");
  EXPECT_EQ(refusal({"flight.support=glued"}),
            "--set flight.support=glued: flight.support: \"glued\" is not known; accepted: \"task\", \"welded\"");
  EXPECT_EQ(refusal({"world.walls=[[0, 0, 1, 1]]"}),
            "--set world.walls=[[0, 0, 1, 1]]: world.walls: normal of wall 0 has length 1.4142135623730951; accepted: "
            "[x_m, y_m, normal_x, normal_y], the normal of length 1");
  EXPECT_EQ(refusal({"randomisation.schema=1"}),
            kHover + ": randomisation: is missing, but overridden; accepted: a file of [[randomise]] tables");
  EXPECT_EQ(refusal({"log.power={battery_nominal_V=8, rate_hz=600, latency_s=0, voltage_noise_V=0, current_noise_A=0}"})
                .substr(0, 10),
            "--set log.");
  EXPECT_EQ(refusal({"actor=none_such.json"}),
            source_path("configs/fly/none_such.json") + ": cannot be read: No such file or directory");
  EXPECT_EQ(refusal({"fligth.seed=1"}).substr(0, 60), "--set fligth.seed=1: fligth: unknown key; accepted: actor, c");
  EXPECT_EQ(message([&] { read_fly_config(pid); }).find(": flight"), std::string::npos);
}

TEST(FlyConfig, RefusesAnActorOfAnotherTask) {
  const Folder folder;
  Actor a;
  a.task = "hover";
  for (const Signal& s : read_fly_config(kHover).fleet.task.observation()) a.observation.push_back(s.name);
  a.action = {"amplitude", "difference", "bias", "split_cycle"};
  a.widths = {static_cast<int>(a.observation.size()), 4};
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 1);
  a.weights.assign(weight_count(a.widths), 0);
  write_actor(folder / "good.json", a);
  EXPECT_EQ(refusal({"actor=" + (folder / "good.json").string()}), "accepted");
  std::swap(a.observation[0], a.observation[1]);
  write_actor(folder / "swapped.json", a);
  const std::string line = refusal({"actor=" + (folder / "swapped.json").string()});
  EXPECT_NE(line.find("actor: observes something else than task \"hover\"; accepted: R_xx, R_xy"), std::string::npos)
      << line;
}

TEST(FlyConfig, ResolvedTextsFlyTheSame) {
  for (const char* name : {"hover_randomised", "figure_eight"}) {
    const Folder folder;
    const FlyConfig c = read_fly_config(source_path(std::string("configs/fly/") + name + ".toml"),
                                        {"flight.duration_s=0.1", "controller.attitude.yaw.p=0.1", "flight.seed=3"});
    for (const auto& [file, text] : c.resolved) folder.write(file, text);
    EXPECT_EQ(fly(read_fly_config(folder / "fly.toml"), {.count = 2}).hash, fly(c, {.count = 2}).hash) << name;
  }
}

// ---- excitation

Excitation excitation(const std::string& text, const std::string& name = "e.toml") {
  const io::Table root = io::Config::parse(text, name).root();
  Excitation e = read_excitation(root, 10);
  root.finish();
  return e;
}

TEST(Excitation, StepLastsAsLongAsItSays) {
  const Excitation e = excitation(
      "constant_input = {amplitude_V = 9}\n"
      "[[excitation]]\nkind = \"step\"\ninput = \"amplitude_V\"\nstart_s = 0.3\nduration_s = 0.1\nheight = 2.5\n");
  int ticks = 0;
  for (int tick = 0; tick < 500; ++tick) {
    const double extra = e.at(tick * 0.002).amplitude_V - 9;
    EXPECT_TRUE(extra == 0 || extra == 2.5);
    if (extra != 0) ++ticks;
  }
  EXPECT_EQ(ticks, 50);
  EXPECT_EQ(e.at(150 * 0.002).amplitude_V, 11.5);
  EXPECT_EQ(e.at(200 * 0.002).amplitude_V, 9);
}

TEST(Excitation, SweepGoesThroughItsFrequencies) {
  const Excitation e = excitation(
      "[[excitation]]\nkind = \"sweep\"\ninput = \"bias_V\"\nstart_s = 1\nduration_s = 4\nfrom_hz = 2\nto_hz = "
      "6\namplitude = 0.5\n");
  EXPECT_EQ(e.at(0.999).bias_V, 0);
  EXPECT_EQ(e.at(5).bias_V, 0);
  for (const double t : {0.0, 0.3, 1.7, 3.99})
    EXPECT_NEAR(e.at(1 + t).bias_V, 0.5 * std::sin(2 * kPi * (2 * t + 0.5 * t * t)), 1e-12) << t;
}

std::string multisine(const std::string& input, const std::string& more = "") {
  return "[[excitation]]\nkind = \"multisine\"\ninput = \"" + input +
         "\"\nrms = 0.2\nfrom_hz = 0.5\nto_hz = 12\ncount = 20\nperiod_s = 10\n" + more;
}

TEST(Excitation, MultisinesAreOrthogonalAndAsStrongAsStated) {
  const Excitation e =
      excitation(multisine("amplitude_V") + multisine("difference_V") + multisine("bias_V") + multisine("split_cycle"));
  constexpr int kTicks = 5000;
  std::array<std::vector<double>, 4> u;
  for (int tick = 0; tick < kTicks; ++tick) {
    const sim::Input x = e.at(tick * 0.002);
    u[0].push_back(x.amplitude_V), u[1].push_back(x.difference_V), u[2].push_back(x.bias_V),
        u[3].push_back(x.split_cycle);
  }
  const auto product = [&](int a, int b) {
    double sum = 0;
    for (int k = 0; k < kTicks; ++k) sum += u[a][k] * u[b][k];
    return sum / kTicks;
  };
  for (int a = 0; a < 4; ++a) {
    EXPECT_NEAR(product(a, a), 0.04, 1e-12);
    for (int b = 0; b < a; ++b) EXPECT_NEAR(product(a, b), 0, 1e-12) << a << b;
    const double peak = *std::ranges::max_element(u[a], {}, [](double x) { return std::abs(x); });
    EXPECT_LT(std::abs(peak), 2.5 * 0.2);  // 20 sines in phase would reach 6.3
    const std::vector<int>& h = e.waves[static_cast<std::size_t>(a)].harmonics;
    EXPECT_EQ(h.size(), 20u);
    EXPECT_GE(h.front(), 5);
    EXPECT_LE(h.back(), 120);
  }
}

TEST(Excitation, MultisineRefusals) {
  EXPECT_EQ(message([] { excitation(multisine("bias_V") + multisine("bias_V", "start_s = -1\n")); }),
            "e.toml:17:11: excitation[1].start_s: -1 is out of range; accepted: a number from 0 to 1e+05");
  std::string other = multisine("bias_V");
  other.replace(other.find("period_s = 10"), 13, "period_s = 20");
  EXPECT_EQ(message([&] { excitation(multisine("bias_V") + other); }),
            "e.toml:16:12: excitation[1].period_s: differs from that of another multisine; accepted: one period, so "
            "that they "
            "do not correlate");
  std::string many = multisine("bias_V");
  many.replace(many.find("count = 20"), 10, "count = 117");
  EXPECT_EQ(message([&] { excitation(many); }),
            "e.toml:7:9: excitation[0].count: the band holds 116 harmonics of this multisine's own; accepted: at most "
            "that many; "
            "a longer period_s has more");
  EXPECT_EQ(message([] { excitation("[[excitation]]\nkind = \"noise\"\n"); }),
            "e.toml:2:8: excitation[0].kind: \"noise\" is not known; accepted: \"step\", \"sweep\", \"multisine\", "
            "\"script\"");
}

TEST(Excitation, ScriptHoldsEachRow) {
  const Folder folder;
  folder.write("s.csv", "t_s,amplitude_V,difference_V,bias_V,split_cycle\n0.1,9,0,0,0\n0.3,10,0.5,-1,0.02\n");
  const std::string text = "[[excitation]]\nkind = \"script\"\nfile = \"s.csv\"\n";
  const Excitation e = excitation(text, (folder / "e.toml").string());
  EXPECT_EQ(e.at(0.098).amplitude_V, 0);
  EXPECT_EQ(e.at(50 * 0.002).amplitude_V, 9);
  EXPECT_EQ(e.at(150 * 0.002).amplitude_V, 10);
  EXPECT_EQ(e.at(99).split_cycle, 0.02);
  EXPECT_EQ(e.at(99).bias_V, -1);
  folder.write("s.csv", "t_s,amplitude_V,difference_V,bias_V,split_cycle\n0.3,9,0,0,0\n0.3,10,0,0,0\n");
  EXPECT_EQ(message([&] { excitation(text, (folder / "e.toml").string()); }),
            (folder / "s.csv").string() +
                ":3: t_s does not come after that of the line before; accepted: times that increase");
}

// ---- scores

Motion upright_at(double x, double y, double z) { return {{x, y, z}, {1, 0, 0, 0}, {0.1, 0, 0}, {0, 0, 0}}; }
const Target kOrigin{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 1, 0, 0};

TEST(Score, EulerAnglesAboutTheCommandedHeading) {
  // ZYX: yaw 3.1, pitch 0.3, roll -0.2; the commanded heading is -3.1: 0.083 rad away, across the wrap
  const double y = 3.1, p = 0.3, r = -0.2;
  const double cy = std::cos(y / 2), sy = std::sin(y / 2), cp = std::cos(p / 2), sp = std::sin(p / 2),
               cr = std::cos(r / 2), sr = std::sin(r / 2);
  Motion m = upright_at(0.1, 0.2, 0.3);
  const double q[4] = {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                       cr * cp * sy - sr * sp * cy};
  std::copy(q, q + 4, m.attitude);
  Target t = kOrigin;
  t.heading_cos = std::cos(-3.1), t.heading_sin = std::sin(-3.1);
  t.position_m[2] = 0.4;
  const Errors e = errors_of(m, t);
  EXPECT_NEAR(e[0], r, 1e-12);
  EXPECT_NEAR(e[1], p, 1e-12);
  EXPECT_NEAR(e[2], 6.2 - 2 * kPi, 1e-12);
  EXPECT_NEAR(e[3], 0.1, 1e-12);
  EXPECT_NEAR(e[5], -0.1, 1e-12);
}

TEST(Score, NamesWhatHappenedFirst) {
  Motion tipped = upright_at(0.1, 0, 0), held = upright_at(0.4, 0, 0);
  tipped.attitude[0] = std::cos(0.55), tipped.attitude[1] = std::sin(0.55);  // 63 degrees
  held.velocity_m_s[0] = 0;
  const auto failure = [](std::initializer_list<std::pair<Motion, std::uint32_t>> flight) {
    FlightScore s;
    double t = 0;
    for (const auto& [m, status] : flight) s.add(m, kOrigin, status, t += 0.002, true);
    return s;
  };
  const Motion good = upright_at(0.29, 0, 0), away = upright_at(0.2, 0.2, 0.15);
  EXPECT_EQ(failure({{good, 0}}).failure, Failure::none);
  EXPECT_EQ(failure({{good, 0}, {away, 0}, {tipped, 0}}).failure, Failure::drifted_away);
  EXPECT_EQ(failure({{good, 0}, {away, 0}, {tipped, 0}}).failed_s, 0.004);
  EXPECT_EQ(failure({{tipped, 0}, {tipped, sim::kTouchedGround}}).failure, Failure::tipped_over);
  EXPECT_TRUE(failure({{tipped, 0}, {tipped, sim::kTouchedGround}}).crashed);
  EXPECT_FALSE(failure({{tipped, 0}}).crashed);
  EXPECT_EQ(failure({{good, sim::kTouchedGround}}).failure, Failure::touched_ground);
  EXPECT_EQ(failure({{good, sim::kFrozen}}).failure, Failure::frozen);
  EXPECT_EQ(failure({{good, sim::kTouchedWall}}).failure, Failure::touched_wall_or_ceiling);
  EXPECT_FALSE(failure({{good, sim::kTouchedWall}}).crashed);
  EXPECT_EQ(failure({{held, 0}, {held, 0}}).failure, Failure::never_took_off);
  EXPECT_EQ(failure({{held, 0}, {away, 0}}).failure, Failure::drifted_away);
}

TEST(Score, PoolsFlightsThatDidNotCrash) {
  std::vector<FlightScore> flights(3);
  for (int tick = 1; tick <= 10; ++tick) {
    flights[0].add(upright_at(0.01, 0, 0), kOrigin, 0, tick, tick > 5);
    flights[1].add(upright_at(tick > 5 ? 0.03 : 0, 0.4, 0), kOrigin, 0, tick, tick > 5);
    flights[2].add(upright_at(9, 9, 9), kOrigin, tick > 3 ? sim::kTouchedGround : 0u, tick, tick > 5);
  }
  const FlightSummary s = summarise(flights);
  EXPECT_EQ(s.crashed, 1u);
  EXPECT_EQ(s.failed, 2u);
  EXPECT_NEAR(s.within_share, 1.0 / 3, 1e-12);
  EXPECT_NEAR(s.settled[3], std::sqrt((0.01 * 0.01 + 0.03 * 0.03) / 2), 1e-12);
  EXPECT_NEAR(s.takeoff[3], std::sqrt((10 * 1e-4 + 5 * 9e-4) / 20), 1e-12);
  EXPECT_NEAR(s.settled[4], 0.4 / std::sqrt(2), 1e-12);
  const FailureCount& away = s.failures[static_cast<std::size_t>(Failure::drifted_away)];
  EXPECT_EQ(away.flights, 2u);
  EXPECT_EQ(away.first_flight, 1u);
  EXPECT_EQ(away.first_s, 1);
}

TEST(Fly, HoversAndDependsOnNothingButItsNumber) {
  const FlyConfig c = read_fly_config(kHover, {"flight.duration_s=0.5", "flight.settle_s=0.2", "flight.threads=1"});
  const FlyResult r = fly(c, {.count = 3});
  EXPECT_EQ(r.summary.flights, 3u);
  EXPECT_EQ(r.summary.crashed, 0u);
  EXPECT_EQ(r.summary.within_share, 1);
  EXPECT_LT(r.summary.takeoff[5], 0.1);
  EXPECT_EQ(r.steps, 3 * 5000);
  const Folder folder;
  const FlyResult logged = fly(c, {.count = 3, .log_folder = folder / "log", .log_bytes = 1});  // one by one
  EXPECT_EQ(logged.hash, r.hash);
  EXPECT_EQ(logged.logs, 3u);
  FlyConfig third = c;
  third.fleet.first_flapper = 2;
  fly(third, {.log_folder = folder / "third"});
  EXPECT_EQ(io::read_text(folder / "log" / "0002" / "truth.csv"), io::read_text(folder / "third" / "truth.csv"));
  EXPECT_NE(io::read_text(folder / "log" / "0001" / "truth.csv"), io::read_text(folder / "third" / "truth.csv"));
  EXPECT_NE(fly(read_fly_config(kHover, {"flight.duration_s=0.5", "flight.seed=2"}), {.count = 3}).hash, r.hash);
  // of many, on threads: the same flights, the same sums
  const FlyResult one = fly(c, {.count = 130});
  const FlyResult two = fly(
      read_fly_config(kHover, {"flight.duration_s=0.5", "flight.settle_s=0.2", "flight.threads=2"}), {.count = 130});
  EXPECT_EQ(one.hash, two.hash);
  EXPECT_EQ(one.summary.settled, two.summary.settled);
}

TEST(Fly, StopsWhenAsked) {
  const FlyConfig c = read_fly_config(kHover);
  double last = 0;
  const FlyResult r = fly(c, {.count = 2, .keep_going = [&](double done) { return (last = done) < 0.0199; }});
  EXPECT_TRUE(r.stopped);
  EXPECT_NEAR(last, 0.02, 1e-9);
  EXPECT_NEAR(r.flown_s, 0.2, 1e-9);
  EXPECT_EQ(r.summary.flights, 2u);
  EXPECT_TRUE(std::isnan(r.summary.settled[0]));
}

TEST(Fly, RefusesFoldersOfOthers) {
  const Folder folder;
  const FlyConfig c = read_fly_config(kHover, {"flight.duration_s=0.002"});
  const std::string accepted = "; accepted: a new folder, an empty one, or logs of as many flights to replace";
  folder.write("file", "");
  EXPECT_EQ(message([&] { fly(c, {.log_folder = folder / "file"}); }),
            (folder / "file").string() + ": is no folder" + accepted);
  fs::create_directories(folder / "many/0002");
  EXPECT_EQ(message([&] { fly(c, {.count = 2, .log_folder = folder / "many"}); }),
            (folder / "many").string() + ": holds 0002" + accepted);
  EXPECT_EQ(message([&] { fly(c, {.count = 3, .log_folder = folder / "many"}); }), "accepted");
}

// ---- logs

template <class T>
void expect_voltages_to_the_bit(const std::string& control_hz) {
  const FlyConfig c =
      read_fly_config(source_path("configs/fly/hover_randomised.toml"),
                      {"flight.control_hz=" + control_hz, "task.start.kind=flying", "flight.threads=1"});
  constexpr std::size_t kFlights = 20;
  Fleet<T> fleet(kFlights, c.vehicle, c.fleet);
  for (std::size_t i = 0; i < kFlights; ++i) {
    model::Vehicle v = c.vehicle_of(static_cast<std::uint32_t>(i));
    v.driver.flapping_Hz += 0.3 * static_cast<double>(i);
    fleet.set_vehicle(i, v);
    // beyond every limit of the driver for some
    fleet.set_added(i, {static_cast<double>(i) - 9, 0.4 * static_cast<double>(i), 0.3 * static_cast<double>(i) - 3,
                        0.01 * static_cast<double>(i)});
  }
  std::int64_t next = 0;
  for (int tick = 0; tick < 200; ++tick) {
    fleet.step();
    for (std::size_t i = 0; i < kFlights; ++i) {
      const std::vector<DriverUpdate> updates = driver_updates(fleet, i);
      ASSERT_FALSE(updates.empty());
      if (i == 0) {
        for (const DriverUpdate& u : updates) EXPECT_EQ(u.step, std::exchange(next, next + 10));
        EXPECT_LT(updates.back().step, fleet.batch().storage().steps);
      }
      const auto [block, lane] = fleet.batch().storage().at(i);
      const auto held = sim::get<sim::Drive<double>>(block.drive, lane).voltages;
      ASSERT_EQ(std::bit_cast<std::uint64_t>(updates.back().left_V), std::bit_cast<std::uint64_t>(held.left_V)) << tick;
      ASSERT_EQ(std::bit_cast<std::uint64_t>(updates.back().right_V), std::bit_cast<std::uint64_t>(held.right_V))
          << tick;
    }
  }
}
TEST(Recorder, VoltagesEqualThoseOfTheSimulatorToTheBit) {
  for (const char* hz : {"500", "400", "1000"}) {
    expect_voltages_to_the_bit<float>(hz);
    expect_voltages_to_the_bit<double>(hz);
  }
}

TEST(Recorder, ImuIsDeclaredAsItIs) {
  for (const double low_pass_hz : {0.0, 30.0, 150.0}) {
    ImuSensor imu;
    imu.rate_hz = 500;
    imu.latency_s = 3e-3;
    imu.low_pass_hz = low_pass_hz;
    const ImuHeader h = imu_header(imu);
    // response of mean and low-pass at a frequency, from a long sum over what the filter does to a sampled sine
    const double interval = 1 / imu.rate_hz, share = low_pass_share(low_pass_hz, interval);
    const auto response = [&](double hz) {
      const std::complex<double> w(0, 2 * kPi * hz);
      std::complex<double> sum = 0;
      double weight = share;
      for (int k = 0; k < 2000; ++k, weight *= 1 - share)
        for (int part = 0; part < 50; ++part) sum += weight / 50 * std::exp(-w * (interval * (k + (part + 0.5) / 50)));
      return sum;
    };
    EXPECT_NEAR(std::abs(response(h.bandwidth_hz)), std::sqrt(0.5), 1e-3);
    const double slow_hz = 0.1, delay_s = -std::arg(response(slow_hz)) / (2 * kPi * slow_hz) + imu.latency_s;
    const double declared_s = h.latency_s + std::atan(slow_hz / h.bandwidth_hz) / (2 * kPi * slow_hz);
    EXPECT_NEAR(declared_s, delay_s, 2e-7) << low_pass_hz;
  }
}

TEST(Recorder, LogReadsBackAsFlown) {
  const Folder folder;
  std::vector<std::string> overrides = {"flight.duration_s=0.5",       "excitation=[]",
                                        "log.power.voltage_noise_V=0", "log.power.current_noise_A=0",
                                        "log.power.rate_hz=200",       "log.power.latency_s=0.004",
                                        "log.wings.noise_rad=0",       "world.walls=[[2, 0, -1, 0]]"};
  const FlyConfig c = read_fly_config(source_path("configs/fly/identify_multisine.toml"), overrides);
  EXPECT_EQ(fly(c, {.log_folder = folder / "log"}).logs, 1u);
  const FlightLog log = read_flight_log(folder / "log");
  EXPECT_EQ(log.header.vehicle, "hummingbird_identified.toml");
  EXPECT_EQ(log.header.vehicle_sha256, c.vehicle_sha256);
  EXPECT_EQ(log.header.flapping_Hz, 34);
  EXPECT_EQ(log.header.ambient.ground_z_m, 0);
  ASSERT_EQ(log.header.ambient.walls.size(), 1u);
  EXPECT_EQ(log.header.mocap.latency_s, 0.03);
  EXPECT_EQ(log.header.imu, imu_header(c.fleet.sensors.imu));

  ASSERT_EQ(log.command.t_s.size(), 500u);
  for (std::size_t k = 0; k < 500; ++k) EXPECT_EQ(log.command.t_s[k], static_cast<double>(k) / 1000);
  EXPECT_EQ((*log.command.phase_rad)[0], 0);
  EXPECT_NEAR((*log.command.phase_rad)[10], 2 * kPi * 34 * 0.01, 1e-6);
  EXPECT_EQ(log.imu.t_s.size(), 250u);
  EXPECT_EQ(log.imu.t_s[0], 0.002);
  EXPECT_EQ(log.mocap.t_s.size(), 75u);
  EXPECT_NEAR(log.mocap.t_s[0], 0.0067 + 0.03, 1e-9);  // the first step at or after 1/150 s

  const io::CsvTable truth = io::read_csv(folder / "log" / "truth.csv");
  const auto &t = truth.column("t_s"), &rate = truth.column("right_stroke_rate_rad_s"),
             &stroke = truth.column("left_stroke_rad");
  ASSERT_EQ(t.size(), 251u);
  EXPECT_EQ(truth.column("support").front(), 1);
  EXPECT_EQ(truth.column("support").back(), 0);
  EXPECT_EQ(truth.column("velocity_x_m_s")[1], 0);  // it stands still
  EXPECT_EQ(truth.column("qw").front(), 1);

  // mocap within its noise of the truth it saw; the gyro too, whose samples are means over its interval
  for (std::size_t k = 5; k < log.mocap.t_s.size(); ++k) {
    const auto tick = static_cast<std::size_t>(std::lround((log.mocap.t_s[k] - 0.03) / 0.002));
    EXPECT_NEAR(log.mocap.z_m[k], truth.column("z_m")[tick], 5e-4 + 0.5 * 0.001);
  }
  double turned = 0, bias = truth.column("gyro_bias_z_rad_s")[0];
  for (const double r : log.imu.gyro_z_rad_s) turned += (r - bias) * 0.002;
  EXPECT_NEAR(turned, 2 * std::atan2(truth.column("qz").back(), truth.column("qw").back()),
              4 * 0.0524 * 0.002 * std::sqrt(250.0) + 0.02);

  ASSERT_TRUE(log.power && log.wings);
  EXPECT_EQ(log.power->t_s.size(), 100u);  // on every second or third tick
  EXPECT_EQ(log.power->battery_V[0], 18);
  const model::Motor& motor = c.vehicle.right.motor;
  for (std::size_t k = 0; k < log.power->t_s.size(); ++k) {
    const double now = log.power->t_s[k] - 0.004;
    const auto tick = static_cast<std::size_t>(std::lround(now / 0.002));
    ASSERT_NEAR(static_cast<double>(tick) * 0.002, now, 1e-9);
    EXPECT_LT(now - static_cast<double>(k) * 0.005, 0.002 + 1e-9);
    // the voltage from that instant on
    const double volts = log.command.right_voltage_V[2 * tick];
    EXPECT_EQ(log.command.t_s[2 * tick], t[tick]);
    EXPECT_NEAR(log.power->right_current_A[k],
                (volts - motor.torque_constant_Nm_A * motor.gear_ratio * rate[tick]) / motor.resistance_ohm, 1e-12);
  }
  ASSERT_EQ(log.wings->t_s.size(), 250u);
  for (std::size_t k = 0; k < 250; ++k) {
    EXPECT_EQ(log.wings->t_s[k], t[k]);
    EXPECT_EQ(log.wings->left_stroke_rad[k], stroke[k]);
  }
}

TEST(Recorder, NoiseIsAsDeclaredAndTheSumHidesNothing) {
  const Folder folder;
  const std::string path = source_path("configs/fly/open_loop.toml");
  fly(read_fly_config(path), {.log_folder = folder / "noisy"});
  fly(read_fly_config(path, {"log.power.voltage_noise_V=0", "log.power.current_noise_A=0", "log.wings.noise_rad=0"}),
      {.log_folder = folder / "clean"});
  const FlightLog noisy = read_flight_log(folder / "noisy"), clean = read_flight_log(folder / "clean");
  EXPECT_EQ(noisy.command, clean.command);
  EXPECT_EQ(noisy.imu, clean.imu);
  const auto expect_noise = [](const Column& a, const Column& b, double sd) {
    ASSERT_EQ(a.size(), b.size());
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    const double n = static_cast<double>(a.size());
    EXPECT_NEAR(std::sqrt(sum / n), sd, 4 * sd / std::sqrt(2 * n));
  };
  expect_noise(noisy.power->battery_V, clean.power->battery_V, 0.02);
  expect_noise(noisy.power->left_current_A, clean.power->left_current_A, 0.01);
  expect_noise(noisy.wings->right_rotation_rad, clean.wings->right_rotation_rad, 0.01);
  // welded: the body stays, the inputs are those of the configuration
  EXPECT_EQ(io::read_csv(folder / "clean" / "truth.csv").column("z_m").back(), 0);
  EXPECT_EQ(io::read_csv(folder / "clean" / "truth.csv").column("support").back(), 2);
  EXPECT_EQ(clean.command.inputs->amplitude_V[100], 9);
  EXPECT_EQ(clean.command.inputs->amplitude_V[600], 11);
  EXPECT_EQ(clean.command.inputs->difference_V[1600], 1);
}

TEST(Recorder, DeclaresTheVehicleOnlyWhereItIsThatOfTheFile) {
  const Folder folder;
  fly(read_fly_config(kHover, {"flight.duration_s=0.1", "vehicle.torso.mass_kg=11e-3"}),
      {.log_folder = folder / "log"});
  EXPECT_EQ(read_flight_log(folder / "log").header.vehicle_sha256, "");
  // a flight without a pose in it leaves no log
  EXPECT_EQ(fly(read_fly_config(kHover, {"flight.duration_s=0.02"}), {.log_folder = folder / "short"}).logs, 0u);
}

}  // namespace
}  // namespace flappy::flight
