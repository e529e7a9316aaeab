#include "gap/replay/recording.hpp"

#include <gtest/gtest.h>

#include "gap/flown_flights.hpp"
#include "gap/replay/stream_rows.hpp"

namespace flappy::gap::recording_test {
namespace {

TEST(Recording, FliesWhatWasDriven) {
  const Flights flights = flown("hummingbird_nominal",
                                {"log.power.battery_nominal_V=18", "log.power.rate_hz=500", "log.power.latency_s=0.001",
                                 "log.power.voltage_noise_V=0.02", "log.power.current_noise_A=0.01"});
  const Recording& whole = *flights[0]->recording();
  flightlog::FlightLog log = whole.log;
  flightlog::CommandStream& c = log.command;
  const double start_s = c.t_s.front(), from_s = start_s + 3, to_s = start_s + 3.5, end_s = start_s + 6;
  const flightlog::Column t_s = c.t_s;
  for (flightlog::Column* column :
       {&c.t_s, &c.left_voltage_V, &c.right_voltage_V, &*c.phase_rad, &c.inputs->amplitude_V, &c.inputs->difference_V,
        &c.inputs->bias_V, &c.inputs->split_cycle}) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < t_s.size(); ++i)
      if ((t_s[i] < from_s || t_s[i] > to_s) && t_s[i] < end_s) (*column)[kept++] = (*column)[i];
    column->resize(kept);
  }
  for (double& v : log.power->battery_V) v *= 1.1;
  const Recording r("flight", log, nominal_vehicle());
  EXPECT_LT(r.end_s.back(), end_s);
  EXPECT_GT(r.end_s.back(), end_s - 0.1);
  // until the wings have forgotten: six beats of 34 Hz
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    const double begin_s = r.end_s[k] - r.interval_s(k);
    if (begin_s > from_s + 0.006 && r.end_s[k] < to_s + 6.0 / 34) EXPECT_FALSE(r.valid[k]) << begin_s - start_s;
    else if (r.end_s[k] < from_s || begin_s > to_s + 6.1 / 34)
      EXPECT_EQ(r.valid[k], whole.valid[k]) << begin_s - start_s;
  }
  // a battery fuller than nominal drives that much harder; 0.02 V of noise in each of twenty samples of 18 V
  EXPECT_NEAR(r.full, 1.1, 5 * 0.02 / 18 / std::sqrt(20));
  EXPECT_DOUBLE_EQ(r.left_V[1000], r.full * whole.left_V[1000]);
  EXPECT_EQ(whole.full, 1);
}

// Another delay of motion capture moves all poses: a grid that begins before the first of them, or ends after the last, says nothing there.
TEST(Recording, KnowsNoMotionWhereThereIsNoPose) {
  const Flights flights = flown("hummingbird_nominal", {"flight.duration_s=4"});
  const Recording& whole = *flights[0]->recording();
  for (const double moved_s : {0.1, -0.1}) {
    flightlog::FlightLog log = whole.log;
    log.header.mocap.latency_s -= moved_s;
    const Recording r(whole, log);
    ASSERT_EQ(r.intervals(), whole.intervals());
    int unknown = 0;
    for (std::size_t k = 0; k < r.intervals(); ++k) {
      const bool known = r.end_s[k] > r.smoother->begin_s() && r.end_s[k] - r.interval_s(k) < r.smoother->end_s();
      unknown += known ? 0 : 1;
      if (!known) EXPECT_FALSE(r.valid[k]) << moved_s << " s: " << r.end_s[k];
    }
    // 0.05 s of them, at 500 Hz, but for one that a pose halves
    EXPECT_NEAR(unknown, 25, 5) << moved_s;
    for (const StreamRow& row : stream_rows(r)) EXPECT_TRUE(row.path_m_s2.allFinite()) << moved_s;
  }
}

}  // namespace
}  // namespace flappy::gap::recording_test
