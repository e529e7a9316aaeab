// The open-loop test on simulated flights: what it finds where it must find nothing, little, and much; what it refuses.
#include "identify/transitions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "io/csv.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::identify {
namespace {

using flight::Folder;
using flight::message;
using flightlog::FlightLog;
namespace fs = std::filesystem;

/// Two flights of 4 s that take off and hover at 0.4 m.
class TransitionsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<Folder>();
    rollout::FlyOptions options;
    options.count = 2;
    options.log_folder = *folder_ / "flights";
    rollout::fly(rollout::read_fly_config(flight::kHover, {"flight.duration_s=4"}), options);
    for (const std::string name : {"0000", "0001"}) {
      places().push_back(options.log_folder / name);
      logs().push_back(flightlog::read_flight_log(places().back()));
    }
  }
  static void TearDownTestSuite() {
    folder_.reset();
    places().clear();
    logs().clear();
  }
  static std::vector<fs::path>& places() {
    static std::vector<fs::path> p;
    return p;
  }
  static std::vector<FlightLog>& logs() {
    static std::vector<FlightLog> l;
    return l;
  }
  static TransitionReport run(const model::Vehicle& vehicle, TransitionOptions options = {}) {
    if (options.samples == 2500) options.samples = 200;
    Transitions t(options);
    for (std::size_t i = 0; i < logs().size(); ++i) t.add(places()[i], logs()[i], vehicle);
    return t.run();
  }
  static std::string refusal(const FlightLog& log, const model::Vehicle& vehicle = test::identified()) {
    return message([&] {
      Transitions t({});
      t.add("flights/it", log, vehicle);
    });
  }

 private:
  static inline std::unique_ptr<Folder> folder_;
};

TransitionOptions from_truth() {
  TransitionOptions o;
  o.source = Source::truth;
  return o;
}

TEST_F(TransitionsTest, NothingIsLeftFromTruthOnTheTrueVehicle) {
  const TransitionReport r = run(test::identified(), from_truth());
  ASSERT_EQ(r.errors[0].size(), 200u);
  ASSERT_EQ(r.errors[1].size(), 200u);
  EXPECT_NEAR(r.beats_s[0], 0.030, 1e-9);  // 29.4 ms in rows of 2 ms
  EXPECT_NEAR(r.beats_s[1], 0.058, 1e-9);
  // rounding of 1e-15, which landings on stops magnify
  for (const int beats : {1, 2})
    for (const double e : r.quantile(beats, 1, false)) EXPECT_LT(e, 1e-6);
}

TEST_F(TransitionsTest, SensorsLeaveTheirNoise) {
  const TransitionReport r = run(test::identified());
  EXPECT_EQ(r.diverged, 0u);
  // The start: sd 0.7 mrad, 0.06 mm and 2.3 mm/s from the smoother, 0.052 rad/s from one sample of the gyro; after 30 ms, with
  // the median of a normal at 0.67 sd: 0.67 x 0.052 x 0.03 = 1.1 mrad, 0.67 sqrt(0.07^2 + 0.06^2 + 0.06^2) = 0.07 mm.
  const StateVector median = r.quantile(1, 0.5, false), most = r.quantile(1, 0.9, false);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GT(median[k], 1e-5) << k;
    EXPECT_LT(median[k], 7e-5) << k;
    EXPECT_LT(median[k + 3], 1.8e-3) << k;
    EXPECT_LT(most[k + 3], 5e-3) << k;
    EXPECT_LT(median[k + 6], 3e-3) << k;
    EXPECT_LT(median[k + 9], 0.08) << k;
  }
  // over ranges within a beat, as the paper has it
  const StateVector of_range = r.quantile(1, 0.5, true);
  for (const std::size_t k : {0, 4, 5, 6, 7, 8, 9, 10, 11}) EXPECT_LT(of_range[k], 0.07) << k;
  EXPECT_NEAR(r.range[6], 0.38, 0.04);  // the identified vehicle hovers so
  EXPECT_NEAR(r.range[11], 11.5, 1);
  EXPECT_NEAR(r.range[3], 0.005, 1e-9);  // its roll is below the noise of motion capture
}

TEST_F(TransitionsTest, AnotherVehicleShows) {
  const TransitionReport right = run(test::identified()), wrong = run(test::nominal());
  // nominal motors pull 10 to 20 % more: of 30 m/s^2 and 1e-3 N m / 4e-6 kg m^2
  for (const std::size_t k : {2, 3, 4, 8, 9, 10})
    EXPECT_GT(wrong.quantile(1, 0.5, false)[k], 5 * right.quantile(1, 0.5, false)[k]) << k;
  EXPECT_EQ(wrong.range, right.range);
  model::Vehicle dense = test::identified();
  dense.air_density_kg_m3 *= 2;  // the log's counts
  EXPECT_EQ(run(dense).errors, right.errors);
}

TEST_F(TransitionsTest, ChoosesSamplesEvenly) {
  TransitionOptions o;
  o.samples = 1'000'000;
  const TransitionReport all = run(test::identified(), o);
  EXPECT_EQ(all.samples + all.low + all.not_covered, all.recorded);
  EXPECT_EQ(all.recorded, 2u * 599);  // of 4 s at 150/s, between the first and the last
  EXPECT_GT(all.low, 20u);            // take-off
  EXPECT_GT(all.not_covered, 30u);    // three beats before and two after
  o.every = 7;
  const TransitionReport some = run(test::identified(), o);
  ASSERT_EQ(some.samples, (all.samples + 6) / 7);
  for (std::size_t i = 0; i < some.samples; ++i) EXPECT_EQ(some.errors[0][i], all.errors[0][7 * i]);
  o.threads = 3;
  EXPECT_EQ(run(test::identified(), o).errors, [&] {
    o.threads = 1;
    return run(test::identified(), o).errors;
  }());
}

TEST_F(TransitionsTest, DistributionsAreATable) {
  const TransitionReport r = run(test::identified());
  const io::CsvTable table = io::parse_csv(distribution_csv(r), "table");
  ASSERT_EQ(table.names.size(), 26u);
  ASSERT_EQ(table.column("beats").size(), 40u);
  EXPECT_EQ(table.column("quantile")[9], 0.5);
  EXPECT_EQ(table.column("pitch_rad")[9], r.quantile(1, 0.5, false)[4]);
  EXPECT_EQ(table.column("pitch_rad_of_range")[37], r.quantile(2, 0.9, true)[4]);
  EXPECT_GT(table.column("x_m")[29], table.column("x_m")[9]);
}

TEST_F(TransitionsTest, RefusesWhatIsNoRecordOfAFreeFlight) {
  FlightLog log = logs()[0];
  log.header.ambient.ground_z_m = 0.35;
  EXPECT_EQ(refusal(log),
            "flights/it: no sample is higher than five mean chords above the ground; accepted: free flight");
  log = logs()[0];
  for (auto* w : {&log.imu.gyro_x_rad_s, &log.imu.gyro_y_rad_s, &log.imu.gyro_z_rad_s})
    for (double& value : *w) value *= 180 / flight::kPi;
  EXPECT_NE(refusal(log).find("disagree"), std::string::npos) << refusal(log);
  log = logs()[0];
  for (double& a : log.imu.accel_z_m_s2) a /= 9.81;
  EXPECT_NE(refusal(log).find("disagree"), std::string::npos) << refusal(log);
  log = logs()[0];
  for (double& t : log.command.t_s) t -= 4.2;
  EXPECT_EQ(refusal(log),
            "flights/it: no sample has 3 beats before and 2 after it in which all streams are there; accepted: longer "
            "flights");
  log = logs()[0];
  for (double& t : log.imu.t_s) t += 10;
  EXPECT_NE(refusal(log).find("share 0 poses"), std::string::npos) << refusal(log);
}

TEST_F(TransitionsTest, AcceptsALargeInnovationWhereAsked) {
  FlightLog log = logs()[0];
  for (double& a : log.imu.accel_z_m_s2) a += 3;
  EXPECT_NE(refusal(log).find("; accepted: at most 5, or any by --accept-innovation; "), std::string::npos);
  Transitions t({.accept_innovation = true});
  t.add("flights/it", log, test::identified());
  t.add("flights/other", logs()[1], test::identified());
  const TransitionReport r = t.run();
  // over the 0.2 m/s^2 that a bias may be, on one axis of three; the smoother knows it to 0.02: 3 sd are 0.17, and it
  // pulls it by (0.02/0.2)^2 towards 0, another 0.09
  EXPECT_NEAR(r.normalised_innovation, 3 / (0.2 * std::sqrt(3.0)), 0.26);
  EXPECT_GT(r.samples, 100u);
}

TEST_F(TransitionsTest, RefusesBeatsOfAnotherLength) {
  FlightLog log = logs()[1];
  log.header.flapping_Hz = 40;
  EXPECT_EQ(message([&] {
              Transitions t({});
              t.add("flights/a", logs()[0], test::identified());
              t.add("flights/b", log, test::identified());
            }),
            "flights/b: one and two of its beats are 26 and 50 ms, those of the flights before 30 and 58 ms, in whole "
            "intervals of the IMU; accepted: flights of equal beats, others in a run of their own");
}

TEST_F(TransitionsTest, RefusesTruthWithoutItsRows) {
  const Folder folder;
  const auto refused = [&](const std::string& truth) {
    folder.write("truth.csv", truth);
    return message([&] {
      Transitions t(from_truth());
      t.add(folder / "", logs()[0], test::identified());
    });
  };
  const std::string name = (folder / "truth.csv").string();
  EXPECT_EQ(refused("t_s,x_m\n"), name + ": has no row; accepted: at least two");
  EXPECT_EQ(refused("t_s,x_m\n0,0\n"), name + ": has one row; accepted: at least two");
  EXPECT_EQ(refused("t_s,x_m\n1,0\n1,0\n"),
            name + ":3: t_s: is 0 s after the row before; accepted: a whole number of steps of 0.00025 s");
  EXPECT_EQ(refused("t_s,x_m\n1,0\n1.002,0\n1.0045,0\n").substr(0, name.size() + 20), name + ":4: t_s: is 0.002499");
}

TEST_F(TransitionsTest, LeavesOutWhatTruthDoesNotSpan) {
  const Folder folder;
  io::CsvTable truth = io::read_csv(places()[0] / "truth.csv");
  const auto rows = [&](std::size_t from, std::size_t to) {
    auto columns = truth.columns;
    for (auto& c : columns)
      c = {c.begin() + static_cast<std::ptrdiff_t>(from), c.begin() + static_cast<std::ptrdiff_t>(to)};
    folder.write("truth.csv", io::csv_text(truth.names, columns));
    Transitions t(from_truth());
    t.add(folder / "", logs()[0], test::identified());
    return t.run();
  };
  const TransitionReport whole = rows(0, 2001), part = rows(600, 1301);  // of 1.2 to 2.6 s
  // from three beats and a row after 1.2 s to two and a row before 2.6: 1.4 - 0.151 s at 150/s
  EXPECT_NEAR(static_cast<double>(part.samples), 187, 2);
  EXPECT_EQ(part.samples + part.low + part.not_covered, whole.recorded);
  for (const double e : part.quantile(2, 1, false)) EXPECT_LT(e, 1e-6);
}

TEST_F(TransitionsTest, CountsWhatDivergesAsInfinitelyFarOff) {
  FlightLog log = logs()[0];
  for (std::size_t i = 0; i < log.command.t_s.size(); ++i)
    if (log.command.t_s[i] >= 2 && log.command.t_s[i] < 2.02) log.command.left_voltage_V[i] = std::nan("");
  Transitions t({.samples = 1'000'000});
  t.add("flights/it", log, test::identified());
  const TransitionReport r = t.run();
  EXPECT_GT(r.diverged, 0u);
  EXPECT_LT(r.diverged, 30u);  // whose three beats before or two after meet it: 0.167 s at 150/s, and some
  const auto last = static_cast<double>(r.samples - 1), diverged = static_cast<double>(r.diverged);
  for (int beats = 1; beats <= 2; ++beats) {
    EXPECT_EQ(r.errors[static_cast<std::size_t>(beats - 1)].size(), r.samples);
    for (const double e : r.quantile(beats, 1, true)) EXPECT_TRUE(std::isinf(e));
    for (const double e : r.quantile(beats, 1 - (diverged - 0.5) / last, false)) EXPECT_TRUE(std::isinf(e));
    for (const double e : r.quantile(beats, 1 - (diverged + 0.5) / last, false)) EXPECT_TRUE(std::isfinite(e));
  }
}

TEST(TransitionReport, QuantilesAreNumbersBesideInfiniteErrors) {
  TransitionReport r;
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double e : {infinite, 1.0, infinite, 2.0, infinite}) {
    r.errors[0].emplace_back();
    r.errors[0].back().fill(e);
  }
  r.range.fill(4);
  EXPECT_EQ(r.quantile(1, 0.125, true)[0], 1.5 / 4);
  EXPECT_EQ(r.quantile(1, 0.25, false)[0], 2);
  for (const double share : {0.3, 0.5, 0.6, 1.0}) EXPECT_EQ(r.quantile(1, share, true)[0], infinite) << share;
}

TEST_F(TransitionsTest, LeavesOutWhereStreamsHaveGaps) {
  Transitions whole({}), gappy({});
  FlightLog log = logs()[0];
  whole.add("a", log, test::identified());
  const auto cut = [](auto& t, std::initializer_list<std::vector<double>*> columns) {  // 2.0 to 2.1 s
    for (auto* c : columns) {
      std::vector<double> kept;
      for (std::size_t i = 0; i < t.size(); ++i)
        if (t[i] < 2 || t[i] > 2.1) kept.push_back((*c)[i]);
      *c = kept;
    }
    std::erase_if(t, [](double x) { return x >= 2 && x <= 2.1; });
  };
  flightlog::CommandStream& c = log.command;
  c.inputs.reset();
  c.phase_rad.reset();
  cut(c.t_s, {&c.left_voltage_V, &c.right_voltage_V});
  gappy.add("a", log, test::identified());
  const TransitionReport a = whole.run(), b = gappy.run();
  // what needs voltages from 3 beats before to 2 after: 0.1 + 0.147 s at 150/s
  EXPECT_NEAR(static_cast<double>(b.not_covered - a.not_covered), 37, 2);
  EXPECT_LT(b.quantile(1, 1, false)[4], 2 * a.quantile(1, 1, false)[4]);
}

}  // namespace
}  // namespace flappy::identify
