// What the exported controller sees and does around a hand-back in simulation, for its self-test to repeat.
#pragma once

#include <cstdint>
#include <vector>

#include "rollout/fly_config.hpp"

namespace flappy::deploy {

/// Times are in microseconds since the first recorded period began.
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
    float estimate[13];        // rows of Estimate at the period's end
    std::int32_t handed_back;  // whether the policy had handed back at its end
  };
  // the state before the first period
  std::vector<float> estimator, estimate, feedback;  // rows of Estimator, Estimate and the controller
  std::uint32_t tick = 0, phase = 0;
  std::int32_t handed_back = 0;
  std::int32_t horizon_us = 0, present_us = 0, last_imu_us = 0;
  std::vector<Increment> ring;       // arrived increments, oldest first: after the horizon, and always the newest
  std::int32_t first_update_us = 0;  // time of the first update
  std::vector<Imu> imu;
  std::vector<Frame> frames;
  std::vector<Period> periods;
  std::vector<std::vector<float>> updates;  ///< voltages left and right, or the robot's inputs
};

/// Records the nominal vehicle under its actor. As on board, the estimate decides the hand-back, and the IMU's latency
/// is a whole number of control periods. The same to the byte for any number of threads and any processor. `begin`:
/// control periods before the recording; -1: the hand-back is in the middle of the `periods` recorded ones.
ControllerTrace record_controller(const rollout::FlyConfig& given, int periods = 50, int begin = -1);

}  // namespace flappy::deploy
