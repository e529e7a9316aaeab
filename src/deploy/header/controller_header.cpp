#include "deploy/header/controller_header.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <sstream>
#include <type_traits>
#include <utility>

#include "deploy/embedded.hpp"
#include "deploy/header/c_text.hpp"
#include "flight/constants.hpp"
#include "flight/schedule.hpp"
#include "io/files.hpp"
#include "model/jointed.hpp"

namespace flappy::deploy {
namespace {

constexpr const char* kControllerCodes = R"(/* What flappy_controller_selftest() finds. */
#define FLAPPY_CONTROLLER_FAILED_CRC 1   /* the numbers are not those of the run */
#define FLAPPY_CONTROLLER_FAILED_TRACE 2 /* the recorded flight comes out otherwise */
#define FLAPPY_CONTROLLER_FAILED_NAN 3   /* what is no sample is taken */
)";

using Members = std::vector<std::pair<std::string, std::vector<float>>>;

/// Collects the arrays of the header and the checksum over them in their order.
class Constants {
 public:
  void add(const std::string& name, const std::string& count, const std::vector<float>& numbers) {
    crc_ = crc32(crc_, numbers);
    text_ << c_array<float>("static const float flappy_controller_" + name + "[" + count + "]", numbers);
  }
  void add(const std::string& name, const std::string& count, const std::vector<std::int32_t>& words) {
    crc_ = crc32(crc_, words);
    text_ << c_array<std::int32_t>("static const int32_t flappy_controller_" + name + "[" + count + "]", words);
  }
  /// Adds a struct, with braces where a member has several numbers; the first member is itself a struct.
  void add_struct(const std::string& declaration, const std::string& first, const Members& members_of_first,
                  const Members& members) {
    text_ << declaration << " = {\n    {\n";
    for (const auto& member : members_of_first) add_member("        ", member);
    text_ << "    }, /* " << first << " */\n";
    for (const auto& member : members) add_member("    ", member);
    text_ << "};\n";
  }
  std::string take() {
    std::string text = text_.str();
    text_.str("");
    return text;
  }
  std::uint32_t crc() const { return crc_; }

 private:
  void add_member(const char* indent, const Members::value_type& member) {
    const auto& [name, numbers] = member;
    crc_ = crc32(crc_, numbers);
    std::string list;
    for (const float x : numbers) list += (list.empty() ? "" : ", ") + c_number(x);
    text_ << indent << (numbers.size() > 1 ? "{" + list + "}" : list) << ", /* " << name << " */\n";
  }

  std::ostringstream text_;
  std::uint32_t crc_ = 0;
};

/// In place of a feedback controller where there is none.
struct NoFeedback {
  static constexpr const char* kName = "none";
  static constexpr const char* kSource = "controller_none";
};

flight::LoopConstants<double> loop_of(const flight::FlightConstants& all, NoFeedback) {
  return {1, 1, all.period_s, 1 / all.period_s, all.estimator.gravity_m_s2};
}
template <class C>
flight::LoopConstants<double> loop_of(const flight::FlightConstants& all, C) {
  return all.controller.of<C>();
}

template <class C>
Members exported_feedback_of(const flight::FlightConstants& all) {
  Members list;
  const auto k = flight::rounded<float>(all.controller.of<C>());
  C::exported(k, [&](const char* name, const auto& numbers) {
    const float* first = reinterpret_cast<const float*>(&numbers);
    // NOLINTNEXTLINE(bugprone-sizeof-expression): numbers, not a pointer to them
    constexpr std::size_t kCount = sizeof(std::remove_cvref_t<decltype(numbers)>) / sizeof(float);
    list.push_back({name, {first, first + kCount}});
  });
  return list;
}

template <class C>
Members feedback_of(const flight::FlightConstants& all) {
  if constexpr (std::is_same_v<C, NoFeedback>) return {{"none", {0}}};
  else return exported_feedback_of<C>(all);
}

template <class C>
void add_constants(const rollout::FlyConfig& config, Constants& to) {
  const flight::FlightConstants all = flight::flight_constants(config.fleet);
  const auto k = flight::rounded<float, flight::LoopConstants>(loop_of(all, C{}));
  const auto f = flight::rounded<float>(all.estimator);
  const auto task = flight::rounded<float>(all.task);
  const auto start = flight::rounded<float>(flight::start_covariance(config.fleet.sensors));
  const auto& h = task.hand_back;
  const model::Driver& d = config.vehicle.driver;
  Members list;
  const auto one = [&](const char* name, auto x) { list.push_back({name, {static_cast<float>(x)}}); };
  one("velocity_share", k.velocity_share);
  one("rate_share", k.rate_share);
  one("period_s", k.period_s);
  one("per_period_Hz", k.per_period_Hz);
  one("gravity_m_s2", k.gravity_m_s2);
  one("angle_noise_rad2_s", f.angle_noise_rad2_s);
  one("gyro_bias_drift_rad2_s3", f.gyro_bias_drift_rad2_s3);
  one("velocity_noise_m2_s3", f.velocity_noise_m2_s3);
  one("accel_bias_drift_m2_s5", f.accel_bias_drift_m2_s5);
  one("mocap_angle_rad2", f.mocap_angle_rad2);
  one("mocap_position_m2", f.mocap_position_m2);
  list.push_back({"imu_position_m", {f.imu_position_m[0], f.imu_position_m[1], f.imu_position_m[2]}});
  one("start_angle_rad2", start.angle);
  one("start_gyro_bias_rad2_s2", start.gyro_bias);
  one("start_position_m2", start.position);
  one("start_velocity_m2_s2", start.velocity);
  one("start_accel_bias_m2_s4", start.accel_bias);
  one("hand_back_x_m", h.x_m);
  one("hand_back_distance_m", h.distance_m);
  one("hand_back_speed_x_m_s", h.speed_x_m_s);
  one("hand_back_speed_m_s", h.speed_m_s);
  one("hand_back_heading_cos", h.heading_cos);
  one("hand_back_tilt_cos", h.tilt_cos);
  one("hand_back_body_rate_rad_s", h.body_rate_rad_s);
  one("hand_back_at_s", h.at_s);
  std::vector<float> middle;  // the same rounding as in scaled_action()
  for (int i = 0; i < config.fleet.task.actions(); ++i)
    middle.push_back(static_cast<float>(0.5 * static_cast<double>(task.action_low[i] + task.action_high[i])));
  list.push_back({"start_added", middle});
  const flight::StartRange& begin = config.fleet.task.start;
  std::vector<float> place;
  for (const flight::Spread& axis : begin.position_m) place.push_back(static_cast<float>(axis.centre));
  place[0] = static_cast<float>(std::clamp(begin.position_m[0].centre, begin.x_low_m, begin.x_high_m));
  list.push_back({"start_position_m", place});
  one("start_heading_rad", begin.rotation_rad[2].centre);
  one("driver_amplitude_V", d.amplitude_limit_V);
  one("driver_difference_V", d.difference_limit_V);
  one("driver_bias_V", d.bias_limit_V);
  one("driver_split_cycle", d.split_cycle_limit);
  one("left_limit_V", config.vehicle.left.motor.voltage_limit_V);
  one("right_limit_V", config.vehicle.right.motor.voltage_limit_V);
  to.add_struct("static const flappy_controller_constants flappy_controller_k", "feedback", feedback_of<C>(all), list);
}

void add_path(const flight::Task& task, Constants& to) {
  std::vector<float> numbers;
  std::vector<std::int32_t> starts;
  for (const flight::Segment<double>& s : task.path) {
    starts.push_back(static_cast<std::int32_t>(s.start_tick));
    for (const auto& quintic : s.coefficients)
      for (const double a : quintic) numbers.push_back(static_cast<float>(a));
  }
  to.add("path", "24 * FLAPPY_CONTROLLER_SEGMENTS", numbers);
  to.add("path_start", "FLAPPY_CONTROLLER_SEGMENTS", starts);
}

void add_mix(const std::vector<model::BeatAveraged::Input>& inputs, Constants& to) {
  std::vector<float> numbers;
  for (const model::BeatAveraged::Input& i : inputs)
    for (const double x : {i.neutral, i.mix[0], i.mix[1], i.mix[2], i.mix[3], i.low, i.high})
      numbers.push_back(static_cast<float>(x));
  if (!inputs.empty()) to.add("mix", "7 * FLAPPY_CONTROLLER_INPUTS", numbers);
}

void add_trace(const ControllerTrace& t, Constants& to) {
  std::vector<float> numbers = t.estimator;
  const auto append = [&](const auto& list) { numbers.insert(numbers.end(), std::begin(list), std::end(list)); };
  append(t.estimate);
  append(t.feedback);
  to.add("test_state", "FLAPPY_CONTROLLER_TEST_STATE", numbers);
  to.add("test_clock", "FLAPPY_CONTROLLER_TEST_CLOCK",
         std::vector<std::int32_t>{static_cast<std::int32_t>(t.tick), static_cast<std::int32_t>(t.phase), t.handed_back,
                                   t.horizon_us, t.present_us, t.last_imu_us, t.first_update_us});
  std::vector<std::int32_t> times;
  const auto put = [&](const char* name, const std::string& count) { to.add(name, count, std::exchange(numbers, {})); };
  const auto put_times = [&](const char* name, const std::string& count) {
    to.add(name, count, std::exchange(times, {}));
  };
  numbers.clear();
  for (const auto& i : t.ring) {
    append(i.rotation_rad), append(i.velocity_m_s);
    times.insert(times.end(), {i.from_us, i.to_us});
  }
  put("test_ring", "6 * FLAPPY_CONTROLLER_TEST_RING");
  put_times("test_ring_us", "2 * FLAPPY_CONTROLLER_TEST_RING");
  for (const auto& s : t.imu) {
    append(s.gyro_rad_s), append(s.accel_m_s2);
    times.insert(times.end(), {s.taken_us, s.arrived_us});
  }
  put("test_imu", "6 * FLAPPY_CONTROLLER_TEST_IMU");
  put_times("test_imu_us", "2 * FLAPPY_CONTROLLER_TEST_IMU");
  for (const auto& f : t.frames) {
    append(f.position_m), append(f.attitude);
    times.insert(times.end(), {f.taken_us, f.arrived_us, f.valid});
  }
  put("test_frames", "7 * FLAPPY_CONTROLLER_TEST_FRAMES");
  put_times("test_frames_us", "3 * FLAPPY_CONTROLLER_TEST_FRAMES");
  for (const auto& p : t.periods) {
    append(p.added), append(p.input), append(p.estimate);
    times.push_back(p.handed_back);
  }
  put("test_periods", "21 * FLAPPY_CONTROLLER_TEST_PERIODS");
  put_times("test_handed_back", "FLAPPY_CONTROLLER_TEST_PERIODS");
  for (const auto& driven : t.updates) append(driven);
  put("test_driven", "FLAPPY_CONTROLLER_TEST_WIDTH * FLAPPY_CONTROLLER_TEST_UPDATES");
}

std::string milliseconds(double s) { return io::shortest_digits(std::round(s * 1e9) / 1e6) + " ms"; }

std::string about(const rollout::FlyConfig& config, const policy::RunInfo& run, const Periods& periods, int ring) {
  const flight::Sensors& s = config.fleet.sensors;
  const auto& at = s.imu.position_m;
  std::ostringstream text;
  text
      << "Estimator and feedback controller of a trained policy, exported by flappy-export. C99 or C++17, gcc or "
         "clang;\n"
      << "nothing else is needed.\n\n"
      << contract_text(config, run) << "\nEvery control period:\n"
      << "  1. flappy_controller_observe() where flappy_controller_policy_due(), the policy, flappy_controller_act()\n"
      << (model::mixed_inputs(config.vehicle).empty()
              ? "  2. flappy_controller_steer(), then flappy_controller_drive() every " +
                    std::to_string(periods.driver_us) + " us\n"
              : "  2. flappy_controller_steer(), then flappy_controller_inputs()\n")
      << "  3. flappy_controller_imu() and flappy_controller_pose() with what has arrived, oldest first\n"
      << "  4. flappy_controller_tick() at its end; or, in place of 3 and 4, flappy_controller_tick_with() the "
         "estimate\n"
      << "     of the autopilot around it\n"
      << "Times are microseconds of one clock that may wrap; no more than 2^31 of them may pass between two ticks.\n"
      << (config.fleet.controller.kind == flight::kNoController
              ? "flappy_controller_start() comes first, then flappy_controller_begin(): there is no feedback "
                "controller.\n"
              : "flappy_controller_start() comes first, then flappy_controller_hover() until the trim is learnt, then\n"
                "flappy_controller_begin().\n")
      << "What a sample holds is at the function that takes it.\n\n"
      << "It was trained with an IMU of " << io::shortest_digits(s.imu.rate_hz) << " Hz, "
      << milliseconds(s.imu.latency_s) << " late, at (" << io::shortest_digits(at.x) << ", "
      << io::shortest_digits(at.y) << ", " << io::shortest_digits(at.z) << ") m in B,\n"
      << "and motion capture of " << io::shortest_digits(s.mocap.rate_hz) << " Hz, " << milliseconds(s.mocap.latency_s)
      << " late; what is later than " << milliseconds(1e-6 * ring * static_cast<double>(periods.control_us))
      << " is dropped.\n"
      << "What the IMU hands over in one control period is one increment: where its latency is no whole number of\n"
      << "periods, the training server groups its samples otherwise.\n"
      << "Angular rates are in B, accelerations the specific force in B: at rest +g upward. Poses are those of the "
         "torso's\n"
      << "origin in W, attitude as a quaternion w, x, y, z from B to W. The hand-back is judged on the estimate.\n";
  return text.str();
}

}  // namespace

std::string no_controller(const rollout::FlyConfig& config) {
  const flight::Task& task = config.fleet.task;
  if (task.sets_voltages()) return "the policy sets the motors' voltages by itself";
  if (task.parts >> static_cast<int>(flight::Part::wings) & 1)
    return "the policy sees the wings, which it has no sensor for";
  if (task.constants.hand_back.touching > 0 || task.constants.hand_back.rests > 0)
    return "it rests when the robot touches something, which it has no sensor for";
  return "";
}

std::string controller_header(const rollout::FlyConfig& config, const policy::RunInfo& run,
                              const ControllerTrace& trace) {
  const flight::FleetOptions& o = config.fleet;
  if (const std::string why_not = no_controller(config); !why_not.empty())
    throw io::InputError("controller: cannot be exported: " + why_not + "; accepted: a task that leaves it to fly");
  Constants constants;
  std::string source = NoFeedback::kSource, accepted;
  if (o.controller.kind == flight::kNoController) add_constants<NoFeedback>(config, constants);
  else source.clear();
  for (int kind = 0; kind < flight::kControllers; ++kind)
    flight::with_controller(kind, [&]<class C>(C) {
      if constexpr (requires { C::kSource; }) {
        accepted += (accepted.empty() ? "kind = \"" : " or \"") + std::string(C::kName) + "\"";
        if (kind != o.controller.kind) return;
        source = C::kSource;
        add_constants<C>(config, constants);
      }
    });
  if (source.empty()) throw io::InputError("controller: is none that can be exported; accepted: " + accepted);
  if (trace.ring.empty() || trace.imu.empty() || trace.frames.empty() || trace.updates.empty())
    throw io::InputError("controller: its test flight has no samples; accepted: sensors and a driver that are faster");
  const Periods periods = periods_of(config);
  const flight::Schedule schedule(o.sensors, o.batch.step_s,
                                  static_cast<int>(std::lround(1 / (o.control_hz * o.batch.step_s))));
  const auto inputs = model::mixed_inputs(config.vehicle);
  const auto phase_step = static_cast<std::uint32_t>(
      inputs.empty() ? std::llround(config.vehicle.driver.flapping_Hz * config.vehicle.driver.hold_s * 0x1p32) : 0);
  const auto number = [](auto n) { return std::to_string(n) + "U"; };

  add_path(o.task, constants);
  add_mix(inputs, constants);
  const std::string numbers = constants.take();
  add_trace(trace, constants);
  const std::string test_numbers = constants.take();

  std::ostringstream text;
  const auto define = [&](const char* name, const std::string& value) {
    text << "#define FLAPPY_CONTROLLER_" << name << " " << value << "\n";
  };
  text << c_comment(about(config, run, periods, schedule.ring_slots()))
       << "#ifndef FLAPPY_CONTROLLER_H\n#define FLAPPY_CONTROLLER_H\n\n#include <stdint.h>\n\n"
       << kEmbedded.at("begin.h") << "\n"
       << contract_macros("FLAPPY_CONTROLLER_", config, run);
  define("DRIVE_US", number(periods.driver_us));
  define("PHASE_STEP", number(phase_step) + " /* of the wing beat, 2^32 each, in that time */");
  define("ACTION_REPEAT", number(o.task.action_repeat) + " /* control periods for which the policy's output stays */");
  define("OBS", std::to_string(o.task.observation().size()));
  define("PAST", std::to_string(o.task.observation().size() / o.task.history * (o.task.history - 1)) +
                     " /* numbers of it that are of the policy's last actions */");
  define("PARTS", number(o.task.parts) + " /* of the observation: bits in flappy_controller_observe() */");
  define("HANDS_BACK", o.task.constants.hand_back.enabled > 0 ? "1" : "0");
  define("IMU_LATENCY_US", number(std::lround(o.sensors.imu.latency_s * 1e6)) + " /* as trained with */");
  define("POSE_LATENCY_US", number(std::lround(o.sensors.mocap.latency_s * 1e6)) + " /* the same */");
  define("IMU_LAG_US", number(std::lround(schedule.imu_lag_s() * 1e6)) + " /* of its low-pass */");
  define("RING", number(schedule.ring_slots()) + " /* control periods that a pose may be late */");
  define("FRAMES", number(schedule.queue_slots()) + " /* poses that may wait for the IMU */");
  define("AHEAD_US", number(schedule.ring_slots() * periods.control_us) + " /* no further does it extrapolate */");
  define("SEGMENTS", number(o.task.path.size()));
  const double lasts_s = std::min({o.task.constants.limits.time_s, config.duration_s, 2000.0});
  define("LASTS_US", number(std::lround(lasts_s * 1e6)) + " /* the task's time */");
  define("FEEDBACK", o.controller.kind == flight::kNoController ? "0" : "1");
  define("INPUTS",
         std::to_string(inputs.size()) + " /* of the robot; 0: the driver sets the voltages of two motors */");
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::string name = "INPUT_" + inputs[i].name;
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    define(name.c_str(), std::to_string(i));
  }
  define("CRC32", number(constants.crc()));
  define("TEST_STATE", number(trace.estimator.size() + trace.estimate.size() + trace.feedback.size()));
  define("TEST_CLOCK", "7U");
  define("TEST_RING", number(trace.ring.size()));
  define("TEST_IMU", number(trace.imu.size()));
  define("TEST_FRAMES", number(trace.frames.size()));
  define("TEST_PERIODS", number(trace.periods.size()));
  define("TEST_UPDATES", number(trace.updates.size()));
  define("TEST_WIDTH", number(trace.updates.front().size()));
  text << kControllerCodes << "\n"
       << kEmbedded.at("arithmetic.h") << "\n"
       << kEmbedded.at("controller_types.h") << "\n"
       << kEmbedded.at(source + "_types.h") << "\n"
       << kEmbedded.at("controller_state.h") << "\n"
       << numbers << "\n"
       << kEmbedded.at("controller_math.h") << "\n"
       << kEmbedded.at("controller_estimator.h") << "\n"
       << kEmbedded.at("controller_path.h") << "\n"
       << kEmbedded.at(source + ".h") << "\n"
       << kEmbedded.at("controller.h") << "\n"
       << "/* A recorded flight: state to begin with; tick, phase, handed back, times of horizon, present, last IMU "
          "sample "
          "and\n   first driver update; increments; samples; and for each control period what is added, input, "
          "estimate. */\n"
       << test_numbers << "\n"
       << kEmbedded.at("controller_selftest.h") << "\n"
       << kEmbedded.at("end.h") << "\n"
       << end_of_header("CONTROLLER", constants.crc());
  return text.str();
}

}  // namespace flappy::deploy
