/* PX4 around the module, in lock-step with the simulator: the messages of hal_simulated.h on a serial line. The module's outputs are volts
   over 16 here, which loses no bit. */
#define FLAPPY_PX4_FULL_V 16.0F
#define private public /* what the answer has of the module's state */
#include "flappy_px4.cpp"
#undef private

extern "C" {
#include "board.h"
}
#include "hal_simulated.h"

uint64_t stub_now_us;
alignas(FlappyControl) static unsigned char stub_memory[sizeof(FlappyControl)];
void* operator new(decltype(sizeof 0)) { return stub_memory; }
void operator delete(void*) noexcept {}
void operator delete(void*, decltype(sizeof 0)) noexcept {}
extern "C" void __cxa_pure_virtual() {}
#ifdef __arm__
extern "C" int strcmp(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) ++a, ++b;
  return *a - *b;
}
#endif

static loop_input in;
static loop_output out;

static void turn(const float* from, float* to) { to[0] = from[0], to[1] = -from[1], to[2] = -from[2]; }

static void deliver() {
  for (uint32_t i = 0; i < in.imu_count; ++i) {
    sensor_combined_s s{};
    s.timestamp = in.imu[i].taken_us;
    turn(in.imu[i].gyro_rad_s, s.gyro_rad);
    turn(in.imu[i].accel_m_s2, s.accelerometer_m_s2);
    stub_sensor_combined::topic.put(s);
  }
  for (uint32_t i = 0; i < in.pose_count; ++i) {
    vehicle_odometry_s s{};
    s.timestamp_sample = in.pose[i].taken_us;
    s.pose_frame = in.pose[i].valid ? vehicle_odometry_s::POSE_FRAME_NED : vehicle_odometry_s::POSE_FRAME_UNKNOWN;
    turn(in.pose[i].position_m, s.position);
    s.q[0] = in.pose[i].attitude[0];
    turn(in.pose[i].attitude + 1, s.q + 1);
    stub_vehicle_visual_odometry::topic.put(s);
  }
}

static void wish(const char* name) {
  char word[16];
  unsigned n = 0;
  while (name[n] != '\0') word[n] = name[n], ++n;
  word[n] = '\0';
  char* argv[] = {word};
  (void)flappy_control_main(1, argv);
}

int main() {
  actuator_armed_s armed{};
  armed.armed = true;
  stub_actuator_armed::topic.put(armed);
  for (bool begun = false; board_read(&in, sizeof in) && in.wish >= 0; begun = true) {
    stub_now_us = in.now_us;
    if (!begun && FlappyControl::task_spawn(0, nullptr) != PX4_OK) return 4;
    FlappyControl& module = *FlappyControl::get_instance();
    deliver();
    if (in.wish == 1) wish("hover");
    if (in.wish == 2) wish("manoeuvre");
    if (in.wish == 3) wish("drop");
    out.drive_count = 0;
    for (; static_cast<int32_t>(in.until_us - static_cast<uint32_t>(stub_now_us)) > 0;
         stub_now_us += module.stub_interval_us) {
      auto& motors = stub_actuator_motors::topic;
      const uint32_t before = motors.written;
      module.Run();
      if (motors.written == before || out.drive_count == LOOP_DRIVES) continue;
      const float* control = motors.queue[before % 16].control;
      for (int side = 0; side < 2; ++side)
        out.volts[out.drive_count][side] = control[side] == control[side] ? 16.0F * control[side] : 0.0F;
      ++out.drive_count;
    }
    const onboard& v = module._vehicle;
    const flappy_wing_beat& u = v.controller.input;
    const bool flies = onboard_flies(&v) != 0;
    out.state = static_cast<uint32_t>(v.state), out.flags = v.flags;
    out.input[0] = flies ? u.amplitude_V : 0.0F, out.input[1] = flies ? u.difference_V : 0.0F;
    out.input[2] = flies ? u.bias_V : 0.0F, out.input[3] = flies ? u.split_cycle : 0.0F;
    board_write(&out, sizeof out);
  }
  return stub_debug_array::topic.written > 0 ? 0 : 6;
}
