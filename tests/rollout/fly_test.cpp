// Whole flights: how they are scored, and what their logs hold against what the simulator knows.
#include "rollout/fly.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <numeric>

#include "flappy/vehicle_file.hpp"
#include "flightlog/flight_log.hpp"
#include "io/csv.hpp"
#include "io/files.hpp"
#include "io/sha256.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/recorder.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"

namespace flappy::flight {
namespace {

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
  const rollout::Errors e = rollout::errors_of(m, t);
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
    rollout::FlightScore s;
    double t = 0;
    for (const auto& [m, status] : flight) s.add(m, kOrigin, status, t += 0.002, true);
    return s;
  };
  const Motion good = upright_at(0.29, 0, 0), away = upright_at(0.2, 0.2, 0.15);
  EXPECT_EQ(failure({{good, 0}}).failure, rollout::FlightFailure::none);
  EXPECT_EQ(failure({{good, 0}, {away, 0}, {tipped, 0}}).failure, rollout::FlightFailure::drifted_away);
  EXPECT_EQ(failure({{good, 0}, {away, 0}, {tipped, 0}}).failed_s, 0.004);
  EXPECT_EQ(failure({{tipped, 0}, {tipped, sim::kTouchedGround}}).failure, rollout::FlightFailure::tipped_over);
  EXPECT_TRUE(failure({{tipped, 0}, {tipped, sim::kTouchedGround}}).crashed);
  EXPECT_FALSE(failure({{tipped, 0}}).crashed);
  EXPECT_EQ(failure({{good, sim::kTouchedGround}}).failure, rollout::FlightFailure::touched_ground);
  EXPECT_EQ(failure({{good, sim::kFrozen}}).failure, rollout::FlightFailure::frozen);
  EXPECT_EQ(failure({{good, sim::kTouchedWall}}).failure, rollout::FlightFailure::touched_wall_or_ceiling);
  EXPECT_FALSE(failure({{good, sim::kTouchedWall}}).crashed);
  EXPECT_EQ(failure({{held, 0}, {held, 0}}).failure, rollout::FlightFailure::never_took_off);
  EXPECT_EQ(failure({{held, 0}, {away, 0}}).failure, rollout::FlightFailure::drifted_away);
}

TEST(Score, PoolsFlightsThatDidNotCrash) {
  std::vector<rollout::FlightScore> flights(3);
  for (int tick = 1; tick <= 10; ++tick) {
    flights[0].add(upright_at(0.01, 0, 0), kOrigin, 0, tick, tick > 5);
    flights[1].add(upright_at(tick > 5 ? 0.03 : 0, 0.4, 0), kOrigin, 0, tick, tick > 5);
    flights[2].add(upright_at(9, 9, 9), kOrigin, tick > 3 ? sim::kTouchedGround : 0u, tick, tick > 5);
  }
  const rollout::FlightSummary s = summarise(flights);
  EXPECT_EQ(s.crashed, 1u);
  EXPECT_EQ(s.failed, 2u);
  EXPECT_NEAR(s.within_share, 1.0 / 3, 1e-12);
  EXPECT_NEAR(s.settled[3], std::sqrt((0.01 * 0.01 + 0.03 * 0.03) / 2), 1e-12);
  EXPECT_NEAR(s.takeoff[3], std::sqrt((10 * 1e-4 + 5 * 9e-4) / 20), 1e-12);
  EXPECT_NEAR(s.settled[4], 0.4 / std::sqrt(2), 1e-12);
  ASSERT_EQ(s.each.size(), 2u);
  EXPECT_NEAR(s.each[0][3], 0.01, 1e-12);
  EXPECT_NEAR(s.each[1][3], 0.03, 1e-12);
  const rollout::FailureCount& away = s.failures[static_cast<std::size_t>(rollout::FlightFailure::drifted_away)];
  EXPECT_EQ(away.flights, 2u);
  EXPECT_EQ(away.first_flight, 1u);
  EXPECT_EQ(away.first_s, 1);
}

TEST(Fly, HoversAndDependsOnNothingButItsNumber) {
  const rollout::FlyConfig c =
      rollout::read_fly_config(kHover, {"flight.duration_s=0.5", "flight.settle_s=0.2", "flight.threads=1"});
  const rollout::FlyResult r = fly(c, {.count = 3});
  EXPECT_EQ(r.summary.flights, 3u);
  EXPECT_EQ(r.summary.crashed, 0u);
  EXPECT_EQ(r.summary.within_share, 1);
  EXPECT_LT(r.summary.takeoff[5], 0.1);
  EXPECT_EQ(r.steps, 3 * 2000);
  const Folder folder;
  const rollout::FlyResult logged = fly(c, {.count = 3, .log_folder = folder / "log", .log_bytes = 1});  // one by one
  EXPECT_EQ(logged.hash, r.hash);
  EXPECT_EQ(logged.logs, 3u);
  rollout::FlyConfig third = c;
  third.fleet.first_flapper = 2;
  fly(third, {.log_folder = folder / "third"});
  EXPECT_EQ(io::read_text(folder / "log" / "0002" / "truth.csv"), io::read_text(folder / "third" / "truth.csv"));
  EXPECT_NE(io::read_text(folder / "log" / "0001" / "truth.csv"), io::read_text(folder / "third" / "truth.csv"));
  EXPECT_NE(
      rollout::fly(rollout::read_fly_config(kHover, {"flight.duration_s=0.5", "flight.seed=2"}), {.count = 3}).hash,
      r.hash);
  // of many, on threads: the same flights, the same sums
  const rollout::FlyResult one = fly(c, {.count = 130});
  const rollout::FlyResult two = rollout::fly(
      rollout::read_fly_config(kHover, {"flight.duration_s=0.5", "flight.settle_s=0.2", "flight.threads=2"}),
      {.count = 130});
  EXPECT_EQ(one.hash, two.hash);
  EXPECT_EQ(one.summary.settled, two.summary.settled);
}

// Wings that a gait drives, mixed of the same controller's outputs; its log has what their muscles do.
TEST(Fly, HoversWithDrivenWings) {
  const Folder folder;
  const auto config = test::source_path("configs/fly/hummingbird_driven.toml");
  const rollout::FlyResult r =
      fly(rollout::read_fly_config(config, {"flight.duration_s=5.0"}), {.count = 2, .log_folder = folder / "log"});
  EXPECT_EQ(r.summary.crashed, 0u);
  for (int k = 3; k < 6; ++k) EXPECT_LT(r.summary.settled[static_cast<std::size_t>(k)], 0.005) << k;  // m
  const io::CsvTable joints = io::read_csv(folder / "log" / "0000" / "joints.csv"),
                     truth = io::read_csv(folder / "log" / "0000" / "truth.csv"),
                     command = io::read_csv(folder / "log" / "0000" / "command.csv");
  EXPECT_EQ(joints.column("left_stroke_rad"), truth.column("left_stroke_rad"));
  EXPECT_EQ(command.names.size(), 5u);
  const double work_J = joints.column("positive_work_J").back();
  EXPECT_GT(work_J, joints.column("work_J").back());
  // a robot of 12 g on wings of 84 mm draws a few W; its wings take a share of them
  EXPECT_GT(work_J / 5, 0.2);
  EXPECT_LT(work_J / 5, 4);
  const std::string what = message([&] {
    rollout::read_fly_config(config, {"log.power={ rate_hz = 100.0, battery_nominal_V = 11.1, latency_s = 0.0, "
                                      "voltage_noise_V = 0.0, current_noise_A = 0.0 }"});
  });
  EXPECT_NE(
      what.find(
          ": log.power: is asked for, but the wings of vehicle \"hummingbird_driven\" have no motors; accepted: "),
      std::string::npos)
      << what;
}

/// On a stand the sums of both wings are the impulse that the air gave: its mean over the flight, by the batch itself. Numbers of
/// the file have nine digits or more, and lanes of single precision round each step to 6e-8.
TEST(Fly, WritesTheLoadsOfEachWing) {
  const Folder folder;
  const auto config = test::source_path("configs/fly/bench.toml");
  const std::vector<std::string> short_one = {"flight.duration_s=0.4"};
  std::vector<std::string> with = short_one;
  with.emplace_back("log.wing_loads=true");
  fly(rollout::read_fly_config(config, short_one), {.count = 1, .log_folder = folder / "without"});
  fly(rollout::read_fly_config(config, with), {.count = 1, .log_folder = folder / "with"});
  const auto flight = folder / "with", other = folder / "without";
  EXPECT_FALSE(std::filesystem::exists(other / "wing_loads.csv"));
  // they change nothing of the flight, and are no part of the log
  for (const char* name : {"forces.csv", "command.csv", "truth.csv"})
    EXPECT_EQ(io::read_text(flight / name), io::read_text(other / name)) << name;
  EXPECT_EQ(flightlog::read_flight_log(flight), flightlog::read_flight_log(other));
  const io::CsvTable loads = io::read_csv(flight / "wing_loads.csv"), forces = io::read_csv(flight / "forces.csv");
  EXPECT_EQ(loads.names.size(), 21u);
  const auto mean = [](const std::vector<double>& x) {
    return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
  };
  // over beats the wings' own momentum returns: what is left of it, and the sensor's noise of 3 mN over the samples
  ASSERT_EQ(loads.column("t_s").size(), forces.column("t_s").size());
  const double lift_N = mean(loads.column("left_force_z_N")) + mean(loads.column("right_force_z_N"));
  EXPECT_GT(lift_N, 0.05);
  EXPECT_NEAR(mean(forces.column("force_z_N")), lift_N, 0.05 * lift_N);
  for (const std::string side : {"left_", "right_"}) {
    EXPECT_GT(mean(loads.column(side + "aerodynamic_power_W")), 0.1);
    EXPECT_GT(mean(loads.column(side + "mechanical_power_W")), mean(loads.column(side + "aerodynamic_power_W")));
    EXPECT_GT(mean(loads.column(side + "drag_N")), 0);
  }
  EXPECT_NE(message([&] {
              rollout::read_fly_config(test::source_path("configs/fly/hummingbird_driven.toml"),
                                       {"log.wing_loads=true"});
            })
                .find(": log.wing_loads: is asked for, but the wings of vehicle \"hummingbird_driven\" have no motors; "
                      "accepted: no such log"),
            std::string::npos);
}

TEST(Fly, StopsWhenAsked) {
  const rollout::FlyConfig c = rollout::read_fly_config(kHover);
  double last = 0;
  const rollout::FlyResult r = fly(c, {.count = 2, .keep_going = [&](double done) { return (last = done) < 0.0199; }});
  EXPECT_TRUE(r.stopped);
  EXPECT_NEAR(last, 0.02, 1e-9);
  EXPECT_NEAR(r.flown_s, 0.2, 1e-9);
  EXPECT_EQ(r.summary.flights, 2u);
  EXPECT_TRUE(std::isnan(r.summary.settled[0]));
}

TEST(Fly, RefusesFoldersOfOthers) {
  const Folder folder;
  const rollout::FlyConfig c = rollout::read_fly_config(kHover, {"flight.duration_s=0.002"});
  const std::string accepted = "; accepted: a new folder, an empty one, or logs of as many flights to replace";
  folder.write("file", "");
  EXPECT_EQ(message([&] { fly(c, {.log_folder = folder / "file"}); }),
            (folder / "file").string() + ": is no folder" + accepted);
  fs::create_directories(folder / "many/0002");
  EXPECT_EQ(message([&] { fly(c, {.count = 2, .log_folder = folder / "many"}); }),
            (folder / "many").string() + ": holds 0002" + accepted);
  EXPECT_EQ(message([&] { fly(c, {.count = 3, .log_folder = folder / "many"}); }), "accepted");
  fs::create_directories(folder / "many/0001");
  folder.write("many/0001/flight.toml", "");
  folder.write("many/0001/notes.txt", "");
  EXPECT_EQ(message([&] { fly(c, {.count = 3, .log_folder = folder / "many"}); }),
            (folder / "many/0001").string() +
                ": holds notes.txt, which is no part of a flight log; accepted: a new folder, an empty one, or a "
                "flight log to replace");
  // a flight that is too short for a log leaves none of before
  fs::create_directories(folder / "one");
  folder.write("one/flight.toml", "");
  folder.write("one.mcap", "");
  fly(c, {.log_folder = folder / "one", .mcap = folder / "one.mcap"});
  EXPECT_TRUE(fs::is_empty(folder / "one"));
  EXPECT_FALSE(fs::exists(folder / "one.mcap"));
}

// ---- logs

template <class T>
void expect_voltages_to_the_bit(const std::string& control_hz) {
  const rollout::FlyConfig c =
      rollout::read_fly_config(source_path("configs/fly/hover_randomised.toml"),
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
      const std::vector<rollout::DriverUpdate> updates = rollout::driver_updates(fleet, i);
      ASSERT_FALSE(updates.empty());
      if (i == 0) {
        for (const rollout::DriverUpdate& u : updates) EXPECT_EQ(u.step, std::exchange(next, next + 4));
        EXPECT_LT(updates.back().step, sim::storage_of(fleet.batch()).steps);
      }
      const auto [block, lane] = sim::storage_of(fleet.batch()).at(i);
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

/// Held over a control period, and read back without inputs of a wing beat, which there is not.
TEST(Recorder, LogsVoltagesThatAPolicySets) {
  rollout::FlyConfig c =
      rollout::read_fly_config(source_path("configs/fly/hover_voltages.toml"),
                               {"flight.duration_s=0.1",
                                "log.power={battery_nominal_V=18, rate_hz=500, latency_s=0, voltage_noise_V=0, "
                                "current_noise_A=0}"});
  auto a = std::make_shared<policy::Actor>();
  for (const Signal& s : c.fleet.task.observation()) a->observation.push_back(s.name);
  for (const Signal& s : c.fleet.task.action()) a->action.push_back(s.name);
  a->widths = {static_cast<int>(a->observation.size()), 2};
  a->mean.assign(a->observation.size(), 0), a->scale.assign(a->observation.size(), 1);
  for (std::size_t k = 0; k < policy::weight_count(a->widths); ++k)
    a->weights.push_back(static_cast<double>(k * 29 % 61) / 64 - 0.5);
  c.actor = a;
  rollout::Rollout<float> flight(c, 1);
  flight.record();
  std::vector<double> left_V, right_V;
  while (!flight.over()) {
    flight.step();
    left_V.push_back(flight.fleet().adds(0)[0]);
    right_V.push_back(flight.fleet().adds(0)[1]);
  }
  const Folder folder;
  ASSERT_TRUE(flight.recorders()[0].write(folder / "log"));
  flightlog::write_vehicle(folder / "log", c.vehicle_file_name, c.vehicle_text);
  const flightlog::FlightLog log = flightlog::read_flight_log(folder / "log");
  EXPECT_FALSE(log.command.inputs || log.command.phase_rad);
  EXPECT_EQ(log.command.left_voltage_V, left_V);
  EXPECT_EQ(log.command.right_voltage_V, right_V);
  EXPECT_NE(left_V.front(), left_V.back());
  for (std::size_t k = 0; k < left_V.size(); ++k) EXPECT_NEAR(log.command.t_s[k], 0.002 * static_cast<double>(k), 1e-9);
  // at the start the wings rest: currents are V / R
  EXPECT_NEAR(log.power->left_current_A.front(), left_V.front() / c.vehicle.left.motor.resistance_ohm, 1e-6);
}

TEST(Recorder, ImuIsDeclaredAsItIs) {
  for (const double low_pass_hz : {0.0, 30.0, 150.0}) {
    ImuSensor imu;
    imu.rate_hz = 500;
    imu.latency_s = 3e-3;
    imu.low_pass_hz = low_pass_hz;
    const flightlog::ImuHeader h = rollout::imu_header(imu);
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

/// "accepted", or why the log of a short flight is refused.
std::string logged(rollout::FlyConfig c, double duration_s = 0.05) {
  c.duration_s = duration_s;
  return message([&] {
    rollout::Rollout<double> flight(std::move(c), 1);
    flight.record();
    while (!flight.over()) flight.step();
    const auto log = flight.recorders()[0].log();
    if (!log) throw io::InputError("no log");
    flightlog::parse_flight_log(flightlog::flight_log_files(*log), "log");
  });
}

// A log holds what any vehicle file and any flight may have: nothing is flown to its end, and then lost.
TEST(Recorder, LogsWhateverAVehicleFileMayHave) {
  for (const char* name : {"hover", "hummingbird_driven", "flapper_nimble"}) {
    const std::string path = source_path("configs/fly/" + std::string(name) + ".toml");
    const rollout::FlyConfig c = rollout::read_fly_config(path);
    model::Vehicle list = c.vehicle;
    const std::size_t count = model::parameters(list).size();
    for (std::size_t k = 0; k < count; ++k)
      for (const bool high : {false, true}) {
        rollout::FlyConfig one = c;
        const model::Parameter p = model::parameters(one.vehicle)[k];
        if (p.path == "driver.hold_s") continue;  // of which step_s is a share
        *p.value = high ? p.high : p.low;
        EXPECT_EQ(logged(one), "accepted") << name << " " << p.path << " = " << *p.value;
      }
    if (!c.vehicle.beat_averaged) continue;
    for (const double hz : {1e-3, 1e4}) {
      rollout::FlyConfig one = c;
      one.vehicle.beat_averaged->nominal_Hz = hz;
      EXPECT_EQ(logged(one), "accepted") << hz;
    }
  }
}

TEST(Recorder, LogsWhateverAFlightMayHave) {
  const std::vector<std::vector<std::string>> flights = {
      {"world.gravity_m_s2=0", "vehicle.air.density_kg_m3=0"},
      {"world.gravity_m_s2=100", "world.ground_z_m=-1e4", "world.ceiling_z_m=1e4"},
      {"world.walls=[[1e4, -1e4, 0, 1.0009]]"},
      {"world.sphere=[{centre_m=[1e4, 0, 1e4], radius_m=1e4}, {centre_m=[1, 0, 1], radius_m=1e-9}]"},
      {"world.box=[{centre_m=[1e4, 0, 0], edges_m=[1e4, 1e-9, 1], rotation_rad=[100, -100, 7]}]"},
      {"world.cylinder=[{from_m=[1e4, 1e4, 1e4], to_m=[1e4, 1e4, 9999.999998], radius_m=1e4}]"},
      {"flight.control_hz=10"},
      {"flight.control_hz=10000", "flight.step_s=1e-4"},
      {"flight.step_s=1e-5", "vehicle.driver.flapping_Hz=1000", "vehicle.driver.hold_s=1e-5"},
      {"flight.support=welded"},
      {"constant_input.amplitude_V=18", "constant_input.bias_V=-18", "constant_input.split_cycle=18"},
      {"sensors.imu.rate_hz=10", "sensors.mocap.rate_hz=10", "sensors.imu.latency_s=0.1",
       "sensors.mocap.latency_s=0.5"},
      {"sensors.imu.rate_hz=4000", "sensors.mocap.rate_hz=4000", "sensors.imu.low_pass_hz=10000"},
      {"sensors.imu.low_pass_hz=1e-3", "sensors.imu.position_m.x=-1", "sensors.imu.position_m.y=1"},
      {"sensors.imu.gyro_noise_rad_s=100", "sensors.imu.accel_noise_m_s2=100", "sensors.imu.gyro_bias_sd_rad_s.x=100",
       "sensors.imu.gyro_bias_sd_rad_s.y=100", "sensors.imu.gyro_bias_sd_rad_s.z=100"},
      {"sensors.mocap.position_noise_m=1", "sensors.mocap.attitude_noise_rad=0.05"},
      {"log.power={battery_nominal_V=100, rate_hz=500, latency_s=10, voltage_noise_V=10, current_noise_A=10}",
       "log.wings={rate_hz=500, noise_rad=1}", "vehicle.left.motor.resistance_ohm=1e-3"}};
  for (const std::vector<std::string>& flight : flights)
    EXPECT_EQ(logged(rollout::read_fly_config(kHover, flight), 12 * (flight[0].find("log.power") == 0) + 1.5),
              "accepted")
        << flight[0];
  // and the longest of a gait
  EXPECT_EQ(logged(rollout::read_fly_config(source_path("configs/fly/hummingbird_driven.toml"),
                                            {"flight.step_s=1e-5", "vehicle.gait.frequency_Hz=2000"})),
            "accepted");
}

TEST(Recorder, LogReadsBackAsFlown) {
  const Folder folder;
  std::vector<std::string> overrides = {"flight.duration_s=0.5",       "excitation=[]",
                                        "log.power.voltage_noise_V=0", "log.power.current_noise_A=0",
                                        "log.power.rate_hz=200",       "log.power.latency_s=0.004",
                                        "log.wings.noise_rad=0",       "world.walls=[[2, 0, -1, 0]]"};
  const rollout::FlyConfig c = rollout::read_fly_config(source_path("configs/fly/identify_multisine.toml"), overrides);
  EXPECT_EQ(fly(c, {.log_folder = folder / "log"}).logs, 1u);
  const flightlog::FlightLog log = flightlog::read_flight_log(folder / "log");
  EXPECT_EQ(log.header.vehicle, "hummingbird_identified.toml");
  EXPECT_EQ(log.header.vehicle_sha256, c.vehicle_sha256);
  EXPECT_EQ(log.header.flapping_Hz, 34);
  EXPECT_EQ(log.header.ambient.ground_z_m, 0);
  ASSERT_EQ(log.header.ambient.walls.size(), 1u);
  EXPECT_EQ(log.header.mocap.latency_s, 0.03);
  EXPECT_EQ(log.header.imu, rollout::imu_header(c.fleet.sensors.imu));

  ASSERT_EQ(log.command.t_s.size(), 500u);
  for (std::size_t k = 0; k < 500; ++k) EXPECT_EQ(log.command.t_s[k], static_cast<double>(k) / 1000);
  EXPECT_EQ((*log.command.phase_rad)[0], 0);
  EXPECT_NEAR((*log.command.phase_rad)[10], 2 * kPi * 34 * 0.01, 1e-6);
  EXPECT_EQ(log.imu.t_s.size(), 250u);
  EXPECT_EQ(log.imu.t_s[0], 0.002);
  EXPECT_EQ(log.mocap.t_s.size(), 75u);
  EXPECT_NEAR(log.mocap.t_s[0], 0.00675 + 0.03, 1e-9);  // the first step at or after 1/150 s

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
  rollout::fly(rollout::read_fly_config(path), {.log_folder = folder / "noisy"});
  rollout::fly(rollout::read_fly_config(
                   path, {"log.power.voltage_noise_V=0", "log.power.current_noise_A=0", "log.wings.noise_rad=0"}),
               {.log_folder = folder / "clean"});
  const flightlog::FlightLog noisy = flightlog::read_flight_log(folder / "noisy"),
                             clean = flightlog::read_flight_log(folder / "clean");
  EXPECT_EQ(noisy.command, clean.command);
  EXPECT_EQ(noisy.imu, clean.imu);
  const auto expect_noise = [](const flightlog::Column& a, const flightlog::Column& b, double sd) {
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

// A battery of 2 ohm that fades by 0.1 V/C: with what both motors draw from it, I = (V_l i_l + V_r i_r) / nominal, the log
// holds nominal - 2 I - 0.1 Q, but for what Q is summed from here: 500 samples a second of currents that the beat shakes.
TEST(Recorder, LogsABatteryThatGivesWay) {
  const Folder folder;
  rollout::fly(
      rollout::read_fly_config(
          source_path("configs/fly/open_loop.toml"),
          {"vehicle.effects.battery_sag.source_ohm=2", "vehicle.effects.battery_sag.fade_V_C=0.1",
           "vehicle.effects.battery_sag.nominal_V=18", "log.power.voltage_noise_V=0", "log.power.current_noise_A=0"}),
      {.log_folder = folder / "log"});
  const flightlog::FlightLog log = flightlog::read_flight_log(folder / "log");
  const flightlog::PowerStream& p = *log.power;
  const double nominal_V = log.header.power->battery_nominal_V;
  ASSERT_EQ(nominal_V, 18);
  double charge_C = 0, least_V = nominal_V;
  for (std::size_t k = 0; k + 1 < p.t_s.size(); ++k) {
    const double t_s = p.t_s[k] - log.header.power->latency_s;
    const auto at =
        static_cast<std::size_t>(std::ranges::upper_bound(log.command.t_s, t_s + 1e-9) - log.command.t_s.begin()) - 1;
    const double drawn_A = (log.command.left_voltage_V[at] * p.left_current_A[k] +
                            log.command.right_voltage_V[at] * p.right_current_A[k]) /
                           nominal_V;
    EXPECT_NEAR(p.battery_V[k], nominal_V - 2 * drawn_A - 0.1 * charge_C, 0.02 + 0.02 * 0.1 * charge_C) << k;
    charge_C += drawn_A * (p.t_s[k + 1] - p.t_s[k]);
    least_V = std::min(least_V, p.battery_V[k]);
  }
  EXPECT_LT(least_V, 17.5) << "nothing was tested";
}

TEST(Recorder, DeclaresTheVehicleOnlyWhereItIsThatOfTheFile) {
  const Folder folder;
  rollout::fly(rollout::read_fly_config(kHover, {"flight.duration_s=0.1", "vehicle.torso.mass_kg=11e-3"}),
               {.log_folder = folder / "log"});
  EXPECT_EQ(flightlog::read_flight_log(folder / "log").header.vehicle_sha256, "");
  const fs::path copy = folder / "log" / "hummingbird_identified.toml";
  EXPECT_EQ(model::read_vehicle(copy).torso.mass_kg, 11e-3);
  // replaced by that of another flight, byte for byte the file
  rollout::fly(rollout::read_fly_config(kHover, {"flight.duration_s=0.1"}), {.log_folder = folder / "log"});
  EXPECT_EQ(io::sha256(io::read_text(copy)), flightlog::read_flight_log(folder / "log").header.vehicle_sha256);
  // one whose name the log needs itself
  fs::copy_file(source_path("configs/vehicles/hummingbird_identified.toml"), folder / "flight.toml");
  const rollout::FlyConfig clashes = rollout::read_fly_config(
      kHover, {"flight.duration_s=0.1", "vehicle=\"" + (folder / "flight.toml").string() + "\""});
  EXPECT_EQ(message([&] { fly(clashes, {.log_folder = folder / "clash"}); }),
            "vehicle: flight.toml is also the name of a file of the log; accepted: another name");
  // a flight without a pose in it leaves no log
  EXPECT_EQ(
      rollout::fly(rollout::read_fly_config(kHover, {"flight.duration_s=0.02"}), {.log_folder = folder / "short"}).logs,
      0u);
}

}  // namespace
}  // namespace flappy::flight
