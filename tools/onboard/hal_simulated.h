/* Messages between the simulator and the loop, in lock-step. The simulator sends a loop_input; the loop runs until until_us on its
   clock, answers with a loop_output, and waits for the next input. Each message has a fixed size; all members have four bytes, lowest
   first, so there is no padding. The loop ends at the end of the input stream, or upon wish = -1. */
#ifndef HAL_SIMULATED
#define HAL_SIMULATED 1

#include <stdint.h>

enum { LOOP_IMU = 4, LOOP_POSES = 2, LOOP_DRIVES = 4 };

typedef struct {
  uint32_t now_us, until_us; /* now_us is later than the previous until_us if the loop was late */
  int32_t wish;              /* an onboard_wish */
  uint32_t imu_count, pose_count;
  struct {
    uint32_t taken_us;
    float gyro_rad_s[3], accel_m_s2[3];
  } imu[LOOP_IMU];
  struct {
    uint32_t taken_us, valid;
    float position_m[3], attitude[4];
  } pose[LOOP_POSES];
} loop_input;

typedef struct {
  uint32_t state, flags; /* an onboard_state, and the ONBOARD_ flags */
  float input[4];        /* inputs of the wing beat at the last tick: V, V, V, split cycle; 0 with the motors off */
  uint32_t drive_count;
  float volts[LOOP_DRIVES][2]; /* left, right; each holds until the next */
} loop_output;

#endif
