// Robots that touch in the closed loop: what fleets keep, hand on and restore of it, and tasks that ask for a touch.
#include <gtest/gtest.h>

#include <algorithm>

#include "flight/fleet_storage.hpp"
#include "flight/fleets.hpp"

namespace flappy::flight {
namespace {

model::Vehicle legs() { return model::read_vehicle(test::source_path("configs/vehicles/hummingbird_legs.toml")); }

FleetOptions on_the_ground(const std::string& task_text, const std::string& controller_name) {
  FleetOptions o = fleet_options(sensors("paper"), controller(controller_name), task(task_text));
  o.batch.threads = 1;
  o.batch.world.ground_z_m = -0.03;
  return o;
}

sim::FlapperState sliding() {
  sim::FlapperState s;
  s.position_m[0] = 0.4, s.position_m[2] = 5e-4;
  s.velocity_m_s[0] = 0.2;
  return s;
}

TEST(Touch, SnapshotsTakeAnchorsAlong) {
  const FleetOptions o = on_the_ground(staying(), "none");
  Fleet<float> fleet(2, legs(), o);
  fleet.start(0, 0, sliding(), sim::Start::flying);
  for (int i = 0; i < 200; ++i) fleet.step();
  ASSERT_TRUE(fleet.batch().status(0) & sim::kTouching);
  const Snapshot<float> before = fleet.snapshot(0);
  ASSERT_EQ(before.contact.second.size(), 7u * 4);
  EXPECT_NE(before.contact.second[0], 0);
  fleet.start(1, 0, before);  // the task starts where the snapshot's path was: nothing is moved
  EXPECT_EQ(fleet.snapshot(1).contact, before.contact);
  for (int i = 0; i < 100; ++i) fleet.step();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(fleet.truth(1).position_m[i], fleet.truth(0).position_m[i]);
  EXPECT_NE(fleet.snapshot(0).contact.second, before.contact.second) << "it has slid on";
  // elsewhere, the anchors are as far from the robot as they were
  const FleetOptions moved = on_the_ground(staying("kind = \"flying\"\n[start.position_m]\nx = 3.0"), "none");
  Fleet<float> other(1, legs(), moved);
  other.start(0, 0, before);
  EXPECT_NEAR(other.snapshot(0).contact.second[0], before.contact.second[0] + 3, 1e-6);
  // a reset forgets
  fleet.start(0, 1, {}, sim::Start::flying);
  for (const float number : fleet.snapshot(0).contact.second) EXPECT_EQ(number, 0);
}

TEST(Touch, IsPartOfHashAndMemory) {
  const FleetOptions o = on_the_ground(staying(), "none");
  Fleet<float> a(3, legs(), o), b(3, legs(), o);
  for (std::size_t i = 0; i < 3; ++i) a.start(i, 0, sliding(), sim::Start::flying);
  for (int i = 0; i < 100; ++i) a.step();
  const auto from = a.memory(), to = b.memory();
  ASSERT_EQ(from.size(), to.size());
  for (std::size_t k = 0; k < from.size(); ++k) {
    ASSERT_EQ(from[k].size(), to[k].size());
    std::ranges::copy(from[k], to[k].begin());
  }
  b.restored(a.periods());
  EXPECT_EQ(a.hash(), b.hash());
  for (int i = 0; i < 100; ++i) a.step(), b.step();
  EXPECT_EQ(a.hash(), b.hash());
  *sim::storage_of(b.batch()).memory_of_contact(1) += 1e-5F;
  EXPECT_NE(a.hash(), b.hash());
}

TEST(Touch, HandsBackToRest) {
  std::string text = staying();
  text.insert(text.find("[reward]"),
              "[hand_back]\nto = \"rest\"\ntouching = true\n"
              "[success.capture]\nby_s = 2.0\ntouching = true\ndistance_m = 0.1\nspeed_m_s = 1.0\n"
              "body_rate_rad_s = 50.0\ntilt_rad = 1.0\nheading_rad = 3.0\n[success.keep]\nfrom_s = 0.1\n"
              "until_s = 0.2\ndistance_m = 1.0\ntilt_rad = 1.0\nheading_rad = 3.0\n");
  const FleetOptions o = on_the_ground(text, "pid");
  Fleet<double> fleet(1, legs(), o);
  sim::FlapperState s;
  s.position_m[2] = 0.02;
  s.velocity_m_s[2] = -0.5;  // it meets the ground before the controller has caught it
  fleet.start(0, 0, s, sim::Start::flying);
  bool touched = false;
  for (int i = 0; i < 300; ++i) {
    fleet.step();
    const bool touches = (fleet.batch().status(0) & sim::kTouching) != 0;
    if (!touched && !touches) {
      EXPECT_FALSE(fleet.handed_back(0));
      EXPECT_EQ(fleet.captured_s(0), 0);
      EXPECT_GT(fleet.input(0).amplitude_V, 1);
    }
    touched |= touches;
    EXPECT_EQ(fleet.handed_back(0), touched);
    if (touched && i > 100) EXPECT_EQ(fleet.input(0).amplitude_V, 0);
  }
  EXPECT_TRUE(touched);
  EXPECT_GT(fleet.captured_s(0), 0);
  EXPECT_EQ(fleet.ended(0), 0u) << "the task says that contact does not end it";
  EXPECT_EQ(fleet.events(0), 0u) << "and so it is no event";
}

}  // namespace
}  // namespace flappy::flight
