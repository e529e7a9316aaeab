// What an exported feedback controller saw and did around a hand-back, as the lanes flew it: its self-test flies it again.
#pragma once

#include <cstdint>
#include <vector>

#include "rollout/fly_config.hpp"

namespace flappy::deploy {

/// Times in microseconds since its first period began.
struct ControllerTrace {
  struct Imu {
    std::int32_t taken_us, arrived_us;
    float gyro_rad_s[3], accel_m_s2[3];
  };
  struct Frame {
    std::int32_t taken_us, arrived_us, valid;
    float position_m[3], attitude[4];
  };
  struct Increment {
    float rotation_rad[3], velocity_m_s[3];
    std::int32_t from_us, to_us;
  };
  struct Period {
    float added[4], input[4];  // V, V, V, split cycle
    float estimate[13];        // rows of Estimate at its end
    std::int32_t handed_back;  //   the same
  };
  struct Update {
    float left_V, right_V;
  };
  // before the first period
  std::vector<float> estimator, estimate, feedback;  // rows of Estimator, Estimate and the controller
  std::uint32_t tick = 0, phase = 0;
  std::int32_t handed_back = 0;
  std::int32_t horizon_us = 0, present_us = 0, last_imu_us = 0;
  std::vector<Increment> ring;  // what has arrived, oldest first: beyond the horizon, and the newest at least
  // and then
  std::int32_t first_update_us = 0;  // of the driver
  std::vector<Imu> imu;
  std::vector<Frame> frames;
  std::vector<Period> periods;
  std::vector<Update> updates;
};

/// A flight of the configuration's vehicle under its actor, the nominal one. The hand-back is the estimate's, and the IMU's
/// latency counts in whole control periods, as on board. Same bytes for any number of threads, on any processor. `begin`:
/// control periods before the first that is recorded; -1: half of `periods` before the hand-back.
ControllerTrace record_controller(const rollout::FlyConfig& given, int periods = 50, int begin = -1);

}  // namespace flappy::deploy
