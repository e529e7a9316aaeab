// Effects of sensors in simulated flights: what the diagnosis undoes is what was done, a flapper without them sees as it did
// without, and bits do not depend on the instruction set.
#include <gtest/gtest.h>

#include <cmath>

#include "flappy/batch.hpp"
#include "flight/fleet.hpp"
#include "gap/replay/sensor_correction.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::flight {
namespace {

using flightlog::Column, flightlog::FlightLog, flightlog::ImuStream, flightlog::MocapStream;
using rollout::FlyConfig, rollout::read_fly_config;

const gap::EffectValues kAll = {
    {"gyro_bias", {{"x_rad_s", 0.05}, {"y_rad_s", -0.3}, {"z_rad_s", 0.1}, {"warm_up_s", 0.5}}},
    {"accelerometer_misalignment", {{"x_rad", 0.3}, {"y_rad", -0.2}, {"z_rad", 0.3}}},
    {"vibration_rectification", {{"gain_s2_m", 0.002}}},
    {"mocap_tilt", {{"x_rad", -0.3}, {"y_rad", 0.2}}},
    {"mocap_delay", {{"delay_s", 0.0123}}},
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
  rollout::fly(rollout::read_fly_config(source_path("configs/fly/open_loop.toml"), overrides),
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
    const gap::EffectValues one = {*kAll.find(id)};
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
  const std::string blurred = "sensors.mocap.attitude_noise_rad=0.05", sharp = "sensors.mocap.attitude_noise_rad=1e-12";
  const flightlog::FlightLog seen = open_loop(offset, {blurred}), same = open_loop(offset, {sharp});
  EXPECT_GT(farthest(seen.mocap.qx, same.mocap.qx), 0.05);
  EXPECT_EQ(seen.mocap.x_m, same.mocap.x_m);
  EXPECT_EQ(seen.mocap.y_m, same.mocap.y_m);
  EXPECT_EQ(seen.mocap.z_m, same.mocap.z_m);
}

/// Without noise, in the air at once and not for long.
const std::vector<std::string> kQuiet = {"flight.duration_s=0.5",
                                         "constant_input.amplitude_V=12.5",
                                         "task.start.kind=flying",
                                         "world.ground_z_m=-9",
                                         "sensors.mocap.position_noise_m=1e-12",
                                         "sensors.mocap.attitude_noise_rad=1e-12",
                                         "sensors.imu.accel_noise_m_s2=1e-12"};

// gain (mean f^2 - (mean f)^2) over the samples of the beat before, f as the turned axes have it; to the rounding of sums of some
// 1e4 m^2/s^4, as noise is none.
TEST(SensorEffects, RectifyTheVibrationOfTheBeatBefore) {
  const gap::EffectValues turned = {*kAll.find("accelerometer_misalignment")},
                          shaken = {*kAll.find("vibration_rectification")};
  gap::EffectValues both = turned;
  both.insert(shaken.begin(), shaken.end());
  const FlightLog plain = open_loop(turned, kQuiet), seen = open_loop(both, kQuiet);
  const FlyConfig c = read_fly_config(source_path("configs/fly/open_loop.toml"));
  const auto per_hold =
      static_cast<std::uint32_t>(std::llround(c.vehicle.driver.flapping_Hz * c.vehicle.driver.hold_s * 0x1p32));
  for (flightlog::Column ImuStream::*axis :
       {&ImuStream::accel_x_m_s2, &ImuStream::accel_y_m_s2, &ImuStream::accel_z_m_s2}) {
    const Column &f = plain.imu.*axis, &y = seen.imu.*axis;
    double bias = 0, largest = 0, mean_of_bias = 0;
    std::vector<double> beat;
    std::int32_t last = 0;  // wraps half-way through the phase
    ASSERT_EQ(f.size(), y.size());
    for (std::size_t i = 0; i < f.size(); ++i) {
      const double t_s = plain.imu.t_s[i] - c.fleet.sensors.imu.latency_s;
      const auto updates = static_cast<std::uint32_t>(std::lround(t_s / c.vehicle.driver.hold_s));
      const auto phase = static_cast<std::int32_t>(updates * per_hold);
      if (phase < last) {
        double mean = 0, square = 0;
        for (const double x : beat) mean += x / static_cast<double>(beat.size());
        for (const double x : beat) square += (x - mean) * (x - mean) / static_cast<double>(beat.size());
        bias = 0.002 * square;
        beat.clear();
      }
      beat.push_back(f[i]);
      last = phase;
      EXPECT_NEAR(y[i] - f[i], bias, 1e-9) << i;
      largest = std::max(largest, bias);
      mean_of_bias += bias;
    }
    EXPECT_GT(largest, 1e-3);
    // A diagnosis takes the variance of 14 samples around, of 14.7 of a beat, and has it in the first two beats, too.
    const FlightLog back = gap::without(shaken, seen);
    double taken = 0;
    for (std::size_t i = 0; i < y.size(); ++i) taken += y[i] - (back.imu.*axis)[i];
    EXPECT_NEAR(taken / mean_of_bias, 1, 0.1);
  }
}

/// The poses of a log that was to be of `t_s`; every physics step's in `fine`.
void expect_poses_of(const FlightLog& seen, const FlightLog& fine, double latency_s, double delay_s) {
  const MocapStream &m = seen.mocap, &n = fine.mocap;
  double position_m = 0, attitude = 0;
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    const double t_s = m.t_s[i] - latency_s - delay_s;
    if (t_s < sim::kDefaultStep_s) continue;  // the first of `fine`
    const auto k = static_cast<std::size_t>(std::lround(t_s / sim::kDefaultStep_s)) - 1;
    ASSERT_NEAR(n.t_s[k] - latency_s, t_s, 1e-8);
    for (flightlog::Column MocapStream::*axis : {&MocapStream::x_m, &MocapStream::y_m, &MocapStream::z_m})
      position_m = std::max(position_m, std::abs((m.*axis)[i] - (n.*axis)[k]));
    for (flightlog::Column MocapStream::*axis :
         {&MocapStream::qw, &MocapStream::qx, &MocapStream::qy, &MocapStream::qz})
      attitude = std::max(attitude, std::abs((m.*axis)[i] - (n.*axis)[k]));
  }
  // a jump of v within a period of h, as of wings that meet their stops, is cut by v h / 8: up to 0.05 m/s, 3 rad/s
  EXPECT_LT(position_m, 1.2e-5);
  EXPECT_LT(attitude, 4e-4);
}

TEST(SensorEffects, ShowPosesOfTheTimeBefore) {
  std::vector<std::string> every_step = kQuiet;
  every_step.push_back("sensors.mocap.rate_hz=4000");
  const FlightLog plain = open_loop({}, kQuiet), fine = open_loop({}, every_step);
  const double latency_s = plain.header.mocap.latency_s;
  for (const double delay_s : {0.01225, 0.02, -0.00725, -0.02}) {
    const gap::EffectValues late = {{"mocap_delay", {{"delay_s", delay_s}}}};
    const flightlog::FlightLog seen = open_loop(late, kQuiet);
    ASSERT_GT(seen.mocap.t_s.size() + 10, plain.mocap.t_s.size());
    for (std::size_t i = 0; i < seen.mocap.t_s.size(); ++i) ASSERT_EQ(seen.mocap.t_s[i], plain.mocap.t_s[i]);
    expect_poses_of(seen, fine, latency_s, delay_s);
    EXPECT_NEAR(gap::without(late, seen).header.mocap.latency_s, latency_s + delay_s, 1e-15);
    EXPECT_EQ(seen.imu.gyro_x_rad_s, plain.imu.gyro_x_rad_s);
  }
  // one that would show what was before the flight shows its start, at 0; the next is of 1 ms after it
  const FlightLog late = open_loop({*kAll.find("mocap_delay")}, kQuiet);
  EXPECT_NEAR(late.mocap.z_m[0], 0, 1e-11);
  EXPECT_LT(late.mocap.z_m[1], -1e-6);
}

/// How late each pose of a flight is beyond its latency, s; a free fall along x tells.
std::vector<double> lateness(const std::vector<std::string>& sensors, double delay_s = 0) {
  std::vector<std::string> overrides = kQuiet;
  overrides.push_back("sensors.mocap.rate_hz=1000");
  overrides.insert(overrides.end(), sensors.begin(), sensors.end());
  const gap::EffectValues late = {{"mocap_delay", {{"delay_s", delay_s}}}};
  std::vector<std::string> every_step = kQuiet;
  every_step.push_back("sensors.mocap.rate_hz=4000");
  const FlightLog fine = open_loop({}, every_step),
                  seen = open_loop(delay_s != 0 ? late : gap::EffectValues{}, overrides);
  const double latency_s = seen.header.mocap.latency_s;
  std::vector<double> list;
  for (std::size_t i = 0; i < seen.mocap.t_s.size(); ++i) {
    if (seen.mocap.t_s[i] - latency_s < 0.3) continue;  // it falls fast enough by then
    std::size_t k = 0;
    while (k < fine.mocap.z_m.size() && fine.mocap.z_m[k] > seen.mocap.z_m[i]) ++k;
    if (k == 0 || k == fine.mocap.z_m.size()) continue;
    const double above = fine.mocap.z_m[k - 1] - seen.mocap.z_m[i], step = fine.mocap.z_m[k - 1] - fine.mocap.z_m[k];
    const double of_s = fine.mocap.t_s[k - 1] + above / step * sim::kDefaultStep_s;
    list.push_back(seen.mocap.t_s[i] - of_s);
  }
  return list;
}

TEST(SensorEffects, VaryFromPoseToPose) {
  const auto mean = [](const std::vector<double>& list) {
    double sum = 0;
    for (const double x : list) sum += x;
    return sum / static_cast<double>(list.size());
  };
  for (const double delay_s : {0.0, 0.004}) {
    const auto uniform = lateness({"sensors.mocap.jitter_s=0.008"}, delay_s),
               exponential =
                   lateness({"sensors.mocap.jitter_s=0.004", "sensors.mocap.jitter_law=exponential"}, delay_s);
    ASSERT_GT(uniform.size(), 100U);
    EXPECT_NEAR(mean(uniform), delay_s + 0.004, 8e-4);
    EXPECT_NEAR(mean(exponential), delay_s + 0.004, 1.2e-3);
    EXPECT_GT(std::ranges::min(uniform), delay_s - 2e-4);
    EXPECT_LT(std::ranges::max(uniform), delay_s + 0.0082);
    EXPECT_GT(std::ranges::max(uniform) - std::ranges::min(uniform), 0.006);
    EXPECT_GT(std::ranges::max(exponential), delay_s + 0.01);
    EXPECT_GT(std::ranges::min(exponential), delay_s - 2e-4);
  }
  for (const double x : lateness({})) EXPECT_NEAR(x, 0, 1e-4);
}

// The poses of one flight are late by at most its own draw, which is uniform up to jitter_s.
TEST(SensorEffects, MayVaryByADrawOfEachFlight) {
  std::vector<double> most;
  for (int flapper = 0; flapper < 12; ++flapper)
    most.push_back(
        std::ranges::max(lateness({"drawn_jitter.mocap_s=0.008", "flight.first_flapper=" + std::to_string(flapper)})));
  EXPECT_LT(std::ranges::max(most), 0.0082);
  EXPECT_GT(std::ranges::max(most), 0.006);  // 12 draws all below 3 / 4: one in 32; these draws are fixed
  EXPECT_LT(std::ranges::min(most), 0.002);
}

TEST(SensorEffects, VaryAlikeOnEveryInstructionSet) {
  const auto hash = [](const std::string& set, double jitter_s) {
    rollout::FlyConfig c = rollout::read_fly_config(kHover, {"sensors.mocap.jitter_law=exponential"});
    c.fleet.sensors.mocap.jitter_s = jitter_s;
    c.fleet.batch.instruction_set = set;
    Fleet<float> fleet(20, c.vehicle, c.fleet);
    for (std::size_t i = 0; i < 20; ++i) fleet.start(i, 0, {.position_m = {0, 0, 0.4}}, sim::Start::flying);
    for (int period = 0; period < 100; ++period) fleet.step();
    return fleet.hash();
  };
  const std::vector<std::string> sets = sim::instruction_sets();
  for (const std::string& set : sets) EXPECT_EQ(hash(set, 0.003), hash(sets[0], 0.003)) << set;
  EXPECT_NE(hash("", 0.003), hash("", 0));
}

TEST(SensorEffects, RefuseADelayThatCannotBe) {
  rollout::FlyConfig c = rollout::read_fly_config(kHover);
  const auto refusal = [&](double delay_s) -> std::string {
    model::Vehicle v = c.vehicle;
    v.effects["mocap_delay"]["delay_s"] = delay_s;
    try {
      Fleet<float>(1, v, c.fleet);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(-0.02), "");
  c.fleet.sensors.mocap.latency_s = 0.01;
  EXPECT_EQ(
      refusal(-0.02),
      "effects.mocap_delay.delay_s: -0.020000 is before the pose was; accepted: down to -mocap.latency_s, -0.010000");
  c.fleet.sensors.mocap.latency_s = 0.11;
  EXPECT_EQ(refusal(0.02),
            "effects.mocap_delay.delay_s: 0.020000 is more than 64 control periods remember; accepted: less, a "
            "lower mocap.latency_s or control rate");
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
Fleet<T> hover(std::size_t count, const std::string& set, bool beside, const gap::EffectValues& effects = kAll) {
  rollout::FlyConfig c = rollout::read_fly_config(kHover);
  c.fleet.batch.instruction_set = set;
  c.fleet.batch.threads = 1;
  Fleet<T> fleet(count, c.vehicle, c.fleet);
  model::Vehicle other = c.vehicle;
  other.effects = effects;
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

TEST(SensorEffects, OfNoSizeChangeNoBit) {
  gap::EffectValues none = kAll;
  for (auto& [id, values] : none)
    for (auto& [name, value] : values)
      if (name != "warm_up_s") value = 0;
  EXPECT_EQ(hover<float>(20, "", true, none).hash(), hover<float>(20, "", false).hash());
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
