#include "flightlog/ros/flight_mcap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>

#include "flightlog/ros/cdr.hpp"
#include "flightlog/ros/mcap.hpp"
#include "flightlog/ros/ros_messages.hpp"
#include "flightlog/ros/type_hash.hpp"

namespace flappy::flightlog::ros {
namespace {

constexpr const char *kWorld = "world", *kTorso = "torso";
constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::int64_t to_ns(double t_s) { return std::llround(1e9 * t_s); }

void put_time(Members& m, const std::string& path, std::int64_t t_ns) {
  const std::int64_t sec = t_ns >= 0 ? t_ns / kSecond_ns : -((kSecond_ns - 1 - t_ns) / kSecond_ns);
  m[path + ".sec"] = sec;
  m[path + ".nanosec"] = t_ns - sec * kSecond_ns;
}

void put_header(Members& m, std::int64_t t_ns, const char* frame, const std::string& path = "header") {
  put_time(m, path + ".stamp", t_ns);
  m[path + ".frame_id"] = frame;
}

void put_variance(Members& m, const std::string& path, double sd) {
  for (const int i : {0, 4, 8}) m[path + "[" + std::to_string(i) + "]"] = sd * sd;
}

using Vector = std::array<double, 3>;

void put_vector(Members& m, const std::string& path, const Vector& v) {
  m[path + ".x"] = v[0], m[path + ".y"] = v[1], m[path + ".z"] = v[2];
}

struct Feed {
  const Column* t_s;
  std::function<void(std::size_t i)> write;
  std::size_t next = 0;
};

class FlightFile {
 public:
  FlightFile(const std::filesystem::path& path, const FlightLog& log, const std::vector<VehicleTopics>& vehicles,
             const std::vector<Column>& wing_loads)
      : log_(log), wing_loads_(wing_loads), file_(path) {
    feeds_ = {{&log.command.t_s, [this](std::size_t i) { write_command(i); }},
              {&log.mocap.t_s, [this](std::size_t i) { write_mocap(i); }},
              {&log.imu.t_s, [this](std::size_t i) { write_imu(i); }}};
    if (log.power && log.header.power) feeds_.push_back({&log.power->t_s, [this](std::size_t i) { write_power(i); }});
    if (log.wings && log.header.wings) feeds_.push_back({&log.wings->t_s, [this](std::size_t i) { write_wings(i); }});
    if (!wing_loads.empty()) feeds_.push_back({&wing_loads[0], [this](std::size_t i) { write_loads(i); }});
    for (const VehicleTopics& v : vehicles) {
      Column& imu_s = times_.emplace_back();
      for (const VehicleTopics::Imu& i : v.imu) imu_s.push_back(log.imu.t_s[i.sample]);
      feeds_.push_back({&imu_s, [this, &v](std::size_t i) { write_predicted_imu(v.name, v.imu[i]); }});
      Column& beat_s = times_.emplace_back();
      for (const VehicleTopics::Beat& b : v.beats) beat_s.push_back(b.t_s + log.header.imu.latency_s);
      feeds_.push_back({&beat_s, [this, &v](std::size_t i) { write_beat(v.name, v.beats[i]); }});
    }
  }

  /// Writes all samples in the order of their arrival, as a recorder would have.
  std::uint64_t write() {
    while (true) {
      Feed* first = nullptr;
      for (Feed& feed : feeds_)
        if (feed.next < feed.t_s->size() && (!first || (*feed.t_s)[feed.next] < (*first->t_s)[first->next]))
          first = &feed;
      if (!first) break;
      first->write(first->next++);
    }
    file_.finish();
    return file_.messages();
  }

 private:
  struct Topic {
    std::uint16_t number;
    std::shared_ptr<const Layout> layout;
  };

  void send(const std::string& name, const char* type, double t_s, double latency_s, const Members& members) {
    auto found = topics_.find(name);
    if (found == topics_.end()) {
      const auto layout = standard_messages().layout(type);
      const auto number = file_.add_topic(name, type, standard_messages().concatenated(type), type_hash(*layout));
      found = topics_.emplace(name, Topic{number, layout}).first;
    }
    file_.write(found->second.number, to_ns(t_s), to_ns(t_s - latency_s), encode(*found->second.layout, members));
  }

  void write_command(std::size_t i) {
    const CommandStream& c = log_.command;
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    const auto input = [&](Column BeatInputs::*column) { return c.inputs ? ((*c.inputs).*column)[i] : kUnknown; };
    Members m = {{"tick", std::uint64_t{i}},
                 {"amplitude_v", input(&BeatInputs::amplitude_V)},
                 {"difference_v", input(&BeatInputs::difference_V)},
                 {"bias_v", input(&BeatInputs::bias_V)},
                 {"split_cycle", input(&BeatInputs::split_cycle)},
                 {"left_voltage_v", c.left_voltage_V[i]},
                 {"right_voltage_v", c.right_voltage_V[i]},
                 {"phase_rad", c.phase_rad ? (*c.phase_rad)[i] : kUnknown}};
    put_header(m, to_ns(c.t_s[i]), kTorso);
    send("/wing_input", type_name::kWingInput, c.t_s[i], 0, m);
  }

  void write_mocap(std::size_t i) {
    const MocapStream& s = log_.mocap;
    const double t_s = s.t_s[i], late_s = log_.header.mocap.latency_s;
    const std::array<std::pair<const char*, double>, 3> place = {{{"x", s.x_m[i]}, {"y", s.y_m[i]}, {"z", s.z_m[i]}}};
    const std::array<std::pair<const char*, double>, 4> turn = {
        {{"w", s.qw[i]}, {"x", s.qx[i]}, {"y", s.qy[i]}, {"z", s.qz[i]}}};
    Members pose, tf, clock;
    put_header(pose, to_ns(t_s - late_s), kWorld);
    put_header(tf, to_ns(t_s - late_s), kWorld, "transforms[0].header");
    tf["transforms[0].child_frame_id"] = kTorso;
    for (const auto& [axis, value] : place) {
      pose[std::string("pose.position.") + axis] = value;
      tf[std::string("transforms[0].transform.translation.") + axis] = value;
    }
    for (const auto& [axis, value] : turn) {
      pose[std::string("pose.orientation.") + axis] = value;
      tf[std::string("transforms[0].transform.rotation.") + axis] = value;
    }
    put_time(clock, "clock", to_ns(t_s));
    send("/clock", type_name::kClock, t_s, 0, clock);
    send("/pose", type_name::kPoseStamped, t_s, late_s, pose);
    send("/tf", type_name::kTFMessage, t_s, late_s, tf);
  }

  void write_imu(std::size_t i) { send_imu("/imu", i, rate_of(i), force_of(i)); }

  Vector rate_of(std::size_t i) const {
    return {log_.imu.gyro_x_rad_s[i], log_.imu.gyro_y_rad_s[i], log_.imu.gyro_z_rad_s[i]};
  }
  Vector force_of(std::size_t i) const {
    return {log_.imu.accel_x_m_s2[i], log_.imu.accel_y_m_s2[i], log_.imu.accel_z_m_s2[i]};
  }

  void send_imu(const std::string& topic, std::size_t sample, const Vector& rate_rad_s, const Vector& force_m_s2) {
    const ImuHeader& h = log_.header.imu;
    const double t_s = log_.imu.t_s[sample];
    Members m = {{"orientation.w", 1.0},
                 {"orientation_covariance[0]", -1.0}};  // -1: no orientation, as sensor_msgs/Imu specifies
    put_vector(m, "angular_velocity", rate_rad_s);
    put_vector(m, "linear_acceleration", force_m_s2);
    put_header(m, to_ns(t_s - h.latency_s), kTorso);
    put_variance(m, "angular_velocity_covariance", h.gyro_noise_rad_s);
    put_variance(m, "linear_acceleration_covariance", h.accel_noise_m_s2);
    send(topic, type_name::kImu, t_s, h.latency_s, m);
  }

  void write_predicted_imu(const std::string& vehicle, const VehicleTopics::Imu& left) {
    Vector rate = rate_of(left.sample), force = force_of(left.sample);
    for (std::size_t k = 0; k < 3; ++k) rate[k] -= left.rate_rad_s[k], force[k] -= left.force_m_s2[k];
    send_imu("/" + vehicle + "/imu", left.sample, rate, force);
    send_imu("/" + vehicle + "/residual", left.sample, left.rate_rad_s, left.force_m_s2);
  }

  void write_beat(const std::string& vehicle, const VehicleTopics::Beat& left) {
    Members m;
    put_vector(m, "accel.linear", left.force_m_s2);
    put_vector(m, "accel.angular", left.turning_rad_s2);
    put_header(m, to_ns(left.t_s), kTorso);
    const double late_s = log_.header.imu.latency_s;
    send("/" + vehicle + "/beat_residual", type_name::kAccelStamped, left.t_s + late_s, late_s, m);
  }

  void write_power(std::size_t i) {
    const PowerStream& s = *log_.power;
    const double t_s = s.t_s[i], late_s = log_.header.power->latency_s;
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    Members battery = {{"voltage", s.battery_V[i]},   {"current", -(s.left_current_A[i] + s.right_current_A[i])},
                       {"present", std::uint64_t{1}}, {"temperature", kUnknown},
                       {"charge", kUnknown},          {"capacity", kUnknown},
                       {"design_capacity", kUnknown}, {"percentage", kUnknown}};
    Members motors = {{"name[0]", "left_motor"},
                      {"name[1]", "right_motor"},
                      {"effort[0]", s.left_current_A[i]},
                      {"effort[1]", s.right_current_A[i]}};
    put_header(battery, to_ns(t_s - late_s), kTorso);
    put_header(motors, to_ns(t_s - late_s), kTorso);
    send("/motors", type_name::kJointState, t_s, late_s, motors);
    send("/battery", type_name::kBatteryState, t_s, late_s, battery);
  }

  void write_wings(std::size_t i) {
    const WingsStream& s = *log_.wings;
    Members m = {{"name[0]", "left_stroke"},
                 {"name[1]", "left_rotation"},
                 {"name[2]", "right_stroke"},
                 {"name[3]", "right_rotation"},
                 {"position[0]", s.left_stroke_rad[i]},
                 {"position[1]", s.left_rotation_rad[i]},
                 {"position[2]", s.right_stroke_rad[i]},
                 {"position[3]", s.right_rotation_rad[i]}};
    put_header(m, to_ns(s.t_s[i]), kTorso);
    send("/joint_states", type_name::kJointState, s.t_s[i], 0, m);
  }

  void write_loads(std::size_t i) {
    Members m;
    std::size_t k = 1;
    const auto next = [&] { return wing_loads_[k++][i]; };
    for (const std::string side : {"left", "right"}) {
      for (const char* vector : {"_force_n", "_moment_nm"})
        for (const char* axis : {".x", ".y", ".z"}) m[side + vector + axis] = next();
      for (const char* number : {"_lift_n", "_drag_n", "_aerodynamic_power_w", "_mechanical_power_w"})
        m[side + number] = next();
    }
    put_header(m, to_ns(wing_loads_[0][i]), kTorso);
    send("/wing_loads", type_name::kWingLoads, wing_loads_[0][i], 0, m);
  }

  const FlightLog& log_;
  const std::vector<Column>& wing_loads_;
  McapWriter file_;
  std::map<std::string, Topic> topics_;
  std::deque<Column> times_;  ///< of the vehicles' feeds
  std::vector<Feed> feeds_;
};

}  // namespace

std::uint64_t write_flight_mcap(const std::filesystem::path& path, const FlightLog& log,
                                const std::vector<VehicleTopics>& vehicles, const std::vector<Column>& wing_loads) {
  require_flown(log, path.string());
  require_voltages(log, path.string());
  return FlightFile(path, log, vehicles, wing_loads).write();
}

}  // namespace flappy::flightlog::ros
