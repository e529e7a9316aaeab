// Cyclone DDS as ROS 2 uses it, between two participants and between processes.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "io/config.hpp"
#include "io/progress.hpp"
#include "server/dds/participant.hpp"
#include "server/dds_fixture.hpp"
#include "server/telemetry/flapper_topics.hpp"
#include "server/telemetry/ring.hpp"

namespace flappy::server {
namespace {

using std::chrono::milliseconds;

/// Waits for something that comes over the wire.
bool eventually(const std::function<bool()>& is, double at_most_s = 5) {
  for (const double until_s = io::steady_seconds() + at_most_s; io::steady_seconds() < until_s;) {
    if (is()) return true;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return is();
}

TEST(Dds, NamesTypesAsRos2Does) {
  EXPECT_EQ(ros_name("sensor_msgs::msg::dds_::Imu_"), "sensor_msgs/msg/Imu");
  EXPECT_EQ(ros_name(descriptor<CommandMessage>().m_typename), "flappy_msgs/msg/Command");
  EXPECT_EQ(topic_name("flappy", 0, "pose"), "/flappy/pose");
  EXPECT_EQ(topic_name("flappy", 3, "pose"), "/flappy_3/pose");
}

TEST(Dds, KeepsTimesToTheNanosecond) {
  const auto same = [](double t_s, std::int32_t sec, std::uint32_t nanosec) {
    const Time t = time_of(t_s);
    EXPECT_EQ(t.sec, sec) << t_s;
    EXPECT_EQ(t.nanosec, nanosec) << t_s;
    EXPECT_NEAR(seconds_of(t), t_s, 0.5e-9 + std::abs(t_s) * 1e-15);
  };
  same(0, 0, 0);
  same(1.25, 1, 250000000);
  same(0.9999999999, 1, 0);  // rounds up to a whole second
  same(-0.25, -1, 750000000);
}

TEST(Dds, CarriesWhatAFlapperShows) {
  const int domain = own_domain();
  const Participant ours(loopback(domain));
  flight::Sensors sensors;
  sensors.imu.gyro_noise_rad_s = 0.1;
  sensors.imu.accel_noise_m_s2 = 0.5;
  const FlapperTopics topics(ours, "flappy", 0, sensors, {true, true, 10});
  const Reader<Imu> imu(ours, "/flappy/imu", {true, true, 10});
  const Reader<JointState> joints(ours, "/flappy/joint_states", kSensorData);
  const Reader<PoseStamped> pose(ours, "/flappy/pose", kSensorData);
  const Reader<TFMessage> tf(ours, "/tf", kReliable);
  const Reader<WingInput> input(ours, "/flappy/wing_input", kSensorData);
  ASSERT_TRUE(eventually(
      [&] { return imu.writers() + joints.writers() + pose.writers() + tf.writers() + input.writers() == 5; }));

  rollout::FlightSample s;
  s.tick = 9, s.t_s = 0.018;
  for (int i = 0; i < 3; ++i) s.gyro_rad_s[i] = 1 + i, s.accel_m_s2[i] = 4 + i, s.state.position_m[i] = 7 + i;
  const double q[] = {0.5, -0.5, 0.5, 0.25};
  std::copy(q, q + 4, s.state.attitude);
  s.state.stroke_rad[0] = 0.1, s.state.stroke_rad[1] = 0.2, s.state.rotation_rad[0] = 0.3,
  s.state.rotation_rad[1] = 0.4;
  s.state.stroke_rate_rad_s[1] = 12;
  s.input = {10, 0.5, -0.25, 0.05};
  topics.write(s);

  int seen = 0;
  imu.take([&](const Imu& m, const dds_sample_info_t&) {
    ++seen;
    EXPECT_EQ(m.header.stamp.nanosec, 18000000U);
    EXPECT_STREQ(m.header.frame_id, "flappy/torso");
    EXPECT_EQ(m.angular_velocity.z, 3);
    EXPECT_EQ(m.linear_acceleration.x, 4);
    EXPECT_NEAR(m.angular_velocity_covariance[4], 0.01, 1e-17);
    EXPECT_NEAR(m.linear_acceleration_covariance[8], 0.25, 1e-16);
    EXPECT_EQ(m.linear_acceleration_covariance[1], 0);
    EXPECT_EQ(m.orientation_covariance[0], -1) << "which says that there is no attitude";
  });
  joints.take([&](const JointState& m, const dds_sample_info_t&) {
    ++seen;
    ASSERT_EQ(m.name._length, 4U);
    EXPECT_STREQ(m.name._buffer[1], "left_rotation");
    EXPECT_EQ(m.position._buffer[1], 0.3);
    EXPECT_EQ(m.velocity._buffer[2], 12);
    EXPECT_EQ(m.effort._length, 0U);
  });
  pose.take([&](const PoseStamped& m, const dds_sample_info_t&) {
    ++seen;
    EXPECT_STREQ(m.header.frame_id, "world");
    EXPECT_EQ(m.pose.position.y, 8);
    EXPECT_EQ(m.pose.orientation.w, 0.5);
    EXPECT_EQ(m.pose.orientation.z, 0.25);
  });
  tf.take([&](const TFMessage& m, const dds_sample_info_t&) {
    ++seen;
    ASSERT_EQ(m.transforms._length, 1U);
    EXPECT_STREQ(m.transforms._buffer[0].child_frame_id, "flappy/torso");
    EXPECT_EQ(m.transforms._buffer[0].transform.rotation.x, -0.5);
  });
  input.take([&](const WingInput& m, const dds_sample_info_t&) {
    ++seen;
    EXPECT_EQ(m.tick, 9U);
    EXPECT_EQ(m.split_cycle, 0.05);
    EXPECT_TRUE(std::isnan(m.left_voltage_v));
  });
  EXPECT_EQ(seen, 5);
}

/// Whether a process with this CYCLONEDDS_URI hears of /flappy/pose in that time.
class Seeker {
 public:
  Seeker(int domain, const char* uri, double patience_s) {
    child_ = fork();
    if (child_ != 0) return;
    if (*uri != '\0') setenv("CYCLONEDDS_URI", uri, 1);
    io::DdsConfig c = loopback(domain);
    c.from_environment = true;
    bool found = false;
    try {
      const Participant p(c);
      const Reader<PoseStamped> reader(p, "/flappy/pose", kSensorData);
      found = eventually(
          [&] {
            int seen = 0;
            reader.take([&](const PoseStamped&, const dds_sample_info_t&) { ++seen; });
            return seen > 0;
          },
          patience_s);
    } catch (...) {
      _exit(2);
    }
    _exit(found ? 0 : 1);
  }
  int exit_code() const {
    int status = 0;
    waitpid(child_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t child_;
};

/// A process that shows itself with a reach, found or not by those that look as the distributions of ROS 2 do.
TEST(Dds, IsFoundByWhomItsReachAllows) {
  struct Case {
    io::Reach reach;
    const char* uri;
    bool found;
    const char* name;
  };
  const Case cases[] = {
      {io::Reach::loopback, kHumbleLocalhost, true, "loopback, Humble with ROS_LOCALHOST_ONLY"},
      {io::Reach::loopback, kHumble, false, "loopback, Humble"},
      {io::Reach::loopback, kJazzy, false, "loopback, Jazzy"},
      {io::Reach::host, kHumble, true, "host, Humble"},
      {io::Reach::host, kJazzy, true, "host, Jazzy"},
      {io::Reach::host, kJazzyLocalhost, true, "host, Jazzy with LOCALHOST"},
      {io::Reach::network, kHumble, true, "network, Humble"},
      {io::Reach::network, kJazzy, true, "network, Jazzy"},
      {io::Reach::network, kJazzyLocalhost, true, "network, Jazzy with LOCALHOST"},
  };
  std::vector<Seeker> seekers;
  std::vector<pid_t> shown;
  std::map<io::Reach, int> domains;
  for (const Case& c : cases) {
    const bool fresh = domains.try_emplace(c.reach, own_domain()).second;
    seekers.emplace_back(domains[c.reach], c.uri, c.found ? 20 : 3);
    if (!fresh) continue;
    const pid_t child = fork();  // this process has no threads of Cyclone DDS yet
    if (child == 0) {
      io::DdsConfig config = loopback(domains[c.reach]);
      config.reach = c.reach;
      const Participant p(config);
      const FlapperTopics topics(p, "flappy", 0, {});
      for (;; std::this_thread::sleep_for(milliseconds(20))) topics.write(PoseSample{0, {}, {1, 0, 0, 0}});
    }
    shown.push_back(child);
  }
  for (std::size_t i = 0; i < std::size(cases); ++i)
    EXPECT_EQ(seekers[i].exit_code(), cases[i].found ? 0 : 1) << cases[i].name;
  for (const pid_t child : shown) kill(child, SIGKILL), waitpid(child, nullptr, 0);
}

TEST(Ring, DropsAndCountsWhatDoesNotFit) {
  Ring<int, 4> ring;
  for (int i = 0; i < 6; ++i) EXPECT_EQ(ring.push(i), i < 4);
  EXPECT_EQ(ring.dropped(), 2U);
  int next = -1;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.pop(next) && next == i);
  EXPECT_FALSE(ring.pop(next));
  EXPECT_TRUE(ring.push(7) && ring.pop(next) && next == 7);
}

TEST(Ring, HandsOverInOrderBetweenThreads) {
  Ring<std::uint64_t, 64> ring;
  constexpr std::uint64_t kItems = 20000;
  std::thread pushes([&] {
    for (std::uint64_t i = 0; i < kItems;)
      if (ring.push(i)) ++i;
      else std::this_thread::yield();
  });
  for (std::uint64_t next = 0, expected = 0; expected < kItems;)
    if (ring.pop(next)) ASSERT_EQ(next, expected++);
    else std::this_thread::yield();
  pushes.join();
}

std::string refused(const std::string& text) {
  return test::refusal([&] { io::read_dds_config(io::Config::parse(text, "c.toml").root()); });
}

TEST(DdsConfig, RefusesWhatIsNotMeant) {
  EXPECT_EQ(refused(""), "accepted");
  EXPECT_EQ(refused("[dds]\nenabled = true\ndomain = 7\nreach = \"network\"\npeers = [\"192.0.2.7\", \"lab-2.local\"]"),
            "accepted");
  const auto says = [](const std::string& text, const std::string& part) {
    EXPECT_NE(refused(text).find(part), std::string::npos) << refused(text);
  };
  says("[dds]\ndomain = 233", "c.toml:2:10: dds.domain: 233 is out of range");
  says("[dds]\ndomain = 231\nkeys = \"/\"", "231 takes no keys; accepted: with keys, a domain of at most 230");
  says("[dds]\nreach = \"lan\"", "accepted: \"loopback\", \"host\", \"network\"");
  says("[dds]\npeers = [\"192.0.2.7\"]", "reach = \"network\"");
  says("[dds]\nreach = \"network\"\npeers = [\"a\\\"/><x\"]", "is no address");
  says("[dds]\nnamespace = \"9\"", "is no name of ROS 2");
  says("[dds]\nwatch = []", "1 to 64");
  says("[dds]\nwatch = [0.5]", "whole numbers");
  says("[dds]\nenable = true", "did you mean \"enabled\"");
  says("[dds]\nreach = \"network\"\ncommands = true", "would be taken from anybody on the network");
  EXPECT_EQ(refused("[dds]\nreach = \"network\"\ncommands = true\ninsecure = true"), "accepted");
  EXPECT_EQ(refused("[dds]\nreach = \"host\"\ncommands = true"), "accepted");
  says("[dds]\nconfig = \"environment\"\ncommands = true", "would be taken from anybody on the network");
}

}  // namespace
}  // namespace flappy::server
