/* The part of PX4 that the exported module uses, as version 1.14 declares it (github.com/PX4/PX4-Autopilot:
   platforms/common/include/px4_platform_common/module.h and px4_work_queue/ScheduledWorkItem.hpp, src/modules/uORB, src/drivers/drv_hrt.h,
   the messages in msg). The test includes it by their names. Freestanding: the board has no C++ library. */
#ifndef PX4_STUB
#define PX4_STUB 1

#include <stdint.h>

extern "C" { /* the board has no string.h */
void* memcpy(void* to, const void* from, decltype(sizeof 0) bytes);
int strcmp(const char* a, const char* b);
}

#define MODULE_NAME "flappy_control"
#define __EXPORT
#define PX4_OK 0
#define PX4_ERROR (-1)
#define PX4_INFO(...) stub_say(__VA_ARGS__)
#define PX4_WARN(...) stub_say(__VA_ARGS__)
#define PRINT_MODULE_DESCRIPTION(text) stub_say(text)
#define PRINT_MODULE_USAGE_NAME(name, category) stub_say(name category)
#define PRINT_MODULE_USAGE_COMMAND(name) stub_say(name)
#define PRINT_MODULE_USAGE_COMMAND_DESCR(name, text) stub_say(name text)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS() stub_say("stop")

template <class... T>
void stub_say(const char*, T...) {}

extern uint64_t stub_now_us;
inline uint64_t hrt_absolute_time() { return stub_now_us; }

template <class T>
class stub_atomic {
 public:
  T load() const { return value_; }
  void store(T value) { value_ = value; }

 private:
  T value_{};
};

static const int task_id_is_work_queue = -2;

template <class T>
class ModuleBase {
 public:
  static int main(int argc, char* argv[]) { return T::custom_command(argc, argv); }
  static bool is_running() { return _object.load() != nullptr; }
  static T* get_instance() { return _object.load(); }
  virtual int print_status() { return 0; }

 protected:
  bool should_exit() const { return false; }
  static void exit_and_cleanup() {}
  inline static stub_atomic<T*> _object;
  inline static int _task_id = -1;
};

namespace px4 {
struct wq_config_t {};
namespace wq_configurations {
static const wq_config_t rate_ctrl{};
}
class ScheduledWorkItem {
 public:
  ScheduledWorkItem(const char*, const wq_config_t&) {}
  void ScheduleOnInterval(uint32_t interval_us) { stub_interval_us = interval_us; }
  void ScheduleClear() {}
  uint32_t stub_interval_us = 0;

 protected:
  virtual void Run() = 0;
};
}  // namespace px4

struct sensor_combined_s {
  uint64_t timestamp;
  float gyro_rad[3], accelerometer_m_s2[3];
};
struct vehicle_odometry_s {
  static const uint8_t POSE_FRAME_UNKNOWN = 0, POSE_FRAME_NED = 1;
  uint64_t timestamp, timestamp_sample;
  uint8_t pose_frame;
  float position[3], q[4];
};
struct actuator_armed_s {
  uint64_t timestamp;
  bool armed, prearmed, ready_to_arm, lockdown, manual_lockdown, force_failsafe;
};
struct actuator_motors_s {
  uint64_t timestamp, timestamp_sample;
  uint16_t reversible_flags;
  float control[12];
};
struct debug_array_s {
  static const uint8_t ARRAY_SIZE = 58;
  uint64_t timestamp;
  uint16_t id;
  char name[10];
  float data[58];
};

/* A topic: the last few messages. */
template <class T>
struct stub_topic {
  T queue[16];
  uint32_t written = 0, read = 0;
  void put(const T& message) { queue[written++ % 16] = message; }
};
#define STUB_TOPIC(name, type)            \
  struct stub_##name {                    \
    using Message = type;                 \
    inline static stub_topic<type> topic; \
  };                                      \
  inline stub_##name stub_id_##name;
STUB_TOPIC(sensor_combined, sensor_combined_s)
STUB_TOPIC(vehicle_visual_odometry, vehicle_odometry_s)
STUB_TOPIC(actuator_armed, actuator_armed_s)
STUB_TOPIC(actuator_motors, actuator_motors_s)
STUB_TOPIC(debug_array, debug_array_s)
#define ORB_ID(name) stub_id_##name

namespace uORB {
class Subscription {
 public:
  template <class Id>
  explicit Subscription(Id&) : topic_(&Id::topic) {}
  template <class T>
  bool update(T* message) {
    stub_topic<T>& from = *static_cast<stub_topic<T>*>(topic_);
    if (from.read == from.written) return false;
    *message = from.queue[from.read++ % 16];
    return true;
  }

 private:
  void* topic_;
};
template <class T>
class Publication {
 public:
  template <class Id>
  explicit Publication(Id&) : topic_(&Id::topic) {}
  bool publish(const T& message) {
    topic_->put(message);
    return true;
  }

 private:
  stub_topic<T>* topic_;
};
}  // namespace uORB

#endif
