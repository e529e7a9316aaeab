// Effects of sensors in simulated flights: what the diagnosis undoes is what was done, a flapper without them sees as it did
// without, and bits do not depend on the instruction set.
#include <gtest/gtest.h>

#include <cmath>

#include "flight/fleet.hpp"
#include "gap/replay/sensor_correction.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::flight {
namespace {

const gap::EffectValues kAll = {
    {"gyro_bias", {{"x_rad_s", 0.05}, {"y_rad_s", -0.3}, {"z_rad_s", 0.1}, {"warm_up_s", 0.5}}},
    {"accelerometer_misalignment", {{"x_rad", 0.3}, {"y_rad", -0.2}, {"z_rad", 0.3}}},
    {"mocap_tilt", {{"x_rad", -0.3}, {"y_rad", 0.2}}},
    {"marker_offset", {{"x_m", 0.01}, {"y_m", -0.03}, {"z_m", 0.05}}}};

/// The log of a flight without a controller, so that what is seen does not change what is flown.
flightlog::FlightLog open_loop(const gap::EffectValues& effects, const std::vector<std::string>& sensors = {}) {
  const Folder folder;
  std::vector<std::string> overrides = {"flight.support=task", "flight.duration_s=1.0", "flight.settle_s=0",
                                        "world.ground_z_m=0", "constant_input.amplitude_V=10"};
  overrides.insert(overrides.end(), sensors.begin(), sensors.end());
  for (const auto& [id, values] : effects)
    for (const auto& [name, value] : values)
      overrides.push_back("vehicle.effects." + id + "." + name + "=" + std::to_string(value));
  rollout::fly(rollout::read_fly_config(source_path("configs/rollout::fly/open_loop.toml"), overrides),
               {.log_folder = folder / "log"});
  return flightlog::read_flight_log(folder / "log");
}

double farthest(const flightlog::Column& a, const flightlog::Column& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}
double farthest(const flightlog::FlightLog& a, const flightlog::FlightLog& b) {
  const flightlog::MocapStream &m = a.mocap, &n = b.mocap;
  const flightlog::ImuStream &s = a.imu, &t = b.imu;
  return std::max({farthest(m.x_m, n.x_m), farthest(m.y_m, n.y_m), farthest(m.z_m, n.z_m), farthest(m.qw, n.qw),
                   farthest(m.qx, n.qx), farthest(m.qy, n.qy), farthest(m.qz, n.qz),
                   farthest(s.accel_x_m_s2, t.accel_x_m_s2), farthest(s.accel_y_m_s2, t.accel_y_m_s2),
                   farthest(s.accel_z_m_s2, t.accel_z_m_s2), farthest(s.gyro_x_rad_s, t.gyro_x_rad_s),
                   farthest(s.gyro_y_rad_s, t.gyro_y_rad_s), farthest(s.gyro_z_rad_s, t.gyro_z_rad_s)});
}

// The lanes keep quaternions of length 1 to 1e-9, which an offset of 0.06 m sees; series are cut below 1e-13, and numbers up to
// some hundred rounded.
TEST(SensorEffects, AreUndoneByTheDiagnosis) {
  // the offset is taken back by the attitude that is seen, so that is seen as it is
  const std::vector<std::string> sharp = {"sensors.mocap.attitude_noise_rad=1e-12"};
  const flightlog::FlightLog plain = open_loop({}, sharp);
  ASSERT_GT(plain.imu.t_s.size(), 400u);
  for (const char* id : {"accelerometer_misalignment", "mocap_tilt", "marker_offset"}) {
    const gap::EffectValues one = {*flightlog::kAll.find(id)};
    const flightlog::FlightLog seen = open_loop(one, sharp);
    EXPECT_GT(farthest(seen, plain), 0.009) << id;
    EXPECT_LT(farthest(gap::without(one, seen), plain), 1e-9) << id;
  }
  // The drift's mean stays, as part of the constant bias; the log begins one sample later than the flight, which changes the
  // rest by less than 0.3 rad/s x 2 ms / 0.5 s.
  const gap::EffectValues drift = {*kAll.find("gyro_bias")};
  const flightlog::FlightLog seen = open_loop(drift), back = gap::without(drift, seen);
  const flightlog::ImuStream &s = back.imu, &t = plain.imu;
  const double left = s.gyro_y_rad_s[0] - t.gyro_y_rad_s[0];
  EXPECT_LT(left, -0.1);
  for (std::size_t i = 0; i < t.t_s.size(); ++i) EXPECT_NEAR(s.gyro_y_rad_s[i] - t.gyro_y_rad_s[i], left, 1.2e-3);
  EXPECT_EQ(s.accel_x_m_s2, t.accel_x_m_s2);
  // in their order, tilt of what the marker shows
  gap::EffectValues both = {*kAll.find("mocap_tilt"), *kAll.find("marker_offset")};
  EXPECT_LT(farthest(gap::without(both, open_loop(both, sharp)), plain), 1e-9);
}

// A marker shakes as the body does, not as the tracker's estimate of its attitude: noise of that leaves the point alone.
TEST(SensorEffects, CarryTheMarkerOnTheTrueAttitude) {
  const gap::EffectValues offset = {*kAll.find("marker_offset")};
  const std::string blurred = "sensors.mocap.attitude_noise_rad=0.1", sharp = "sensors.mocap.attitude_noise_rad=1e-12";
  const FlightLog seen = open_loop(offset, {blurred}), same = open_loop(offset, {sharp});
  EXPECT_GT(farthest(seen.mocap.qx, same.mocap.qx), 0.1);
  EXPECT_EQ(seen.mocap.x_m, same.mocap.x_m);
  EXPECT_EQ(seen.mocap.y_m, same.mocap.y_m);
  EXPECT_EQ(seen.mocap.z_m, same.mocap.z_m);
}

// From 0 when the flight starts: 1 - exp(-t / warm_up).
TEST(SensorEffects, WarmUpFromTheStart) {
  const flightlog::FlightLog plain = open_loop({}), seen = open_loop({*kAll.find("gyro_bias")});
  const double latency_s =
      rollout::read_fly_config(source_path("configs/fly/open_loop.toml")).fleet.sensors.imu.latency_s;
  for (std::size_t i = 0; i < plain.imu.t_s.size(); ++i) {
    const double t_s = plain.imu.t_s[i] - latency_s;
    EXPECT_NEAR(seen.imu.gyro_z_rad_s[i] - plain.imu.gyro_z_rad_s[i], 0.1 * (1 - std::exp(-t_s / 0.5)), 1e-8);
  }
}

template <class T>
Fleet<T> hover(std::size_t count, const std::string& set, bool beside) {
  rollout::FlyConfig c = rollout::read_fly_config(kHover);
  c.fleet.batch.instruction_set = set;
  c.fleet.batch.threads = 1;
  Fleet<T> fleet(count, c.vehicle, c.fleet);
  model::Vehicle other = c.vehicle;
  other.effects = kAll;
  for (std::size_t i = 0; i < count; ++i) {
    if (beside && i % 2 == 1) fleet.set_vehicle(i, other);
    fleet.start(i, 0, {.position_m = {0, 0, 0.4}}, sim::Start::flying);
  }
  for (int period = 0; period < 200; ++period) fleet.step();
  return fleet;
}

TEST(SensorEffects, LeaveOthersAlone) {
  const auto plain = hover<float>(20, "", false), beside = hover<float>(20, "", true);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(plain.hash(i, i + 1) == beside.hash(i, i + 1), i % 2 == 0) << i;
}

TEST(SensorEffects, HaveTheSameBitsOnEveryInstructionSet) {
  const std::vector<std::string> sets = sim::instruction_sets();
  for (const std::string& set : sets) {
    EXPECT_EQ(hover<float>(20, set, true).hash(), hover<float>(20, sets[0], true).hash()) << set;
    EXPECT_EQ(hover<double>(20, set, true).hash(), hover<double>(20, sets[0], true).hash()) << set;
  }
}

}  // namespace
}  // namespace flappy::flight
