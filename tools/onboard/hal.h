/* What a board has to do for the loop. hal_simulated.c does it over a byte stream; write your own beside it. */
#ifndef HAL
#define HAL 1

#include "onboard.h"

/* Clocks, sensors and motor drivers begin to work, motors at 0 V. */
void hal_start(void);

/* Microseconds of the clock that also stamps the samples; it may wrap. */
uint32_t hal_now_us(void);

/* Returns at that time, or at once if it has passed. 0: there is nothing to go on for, which no robot says. */
int hal_wait_us(uint32_t until_us);

/* The oldest sample that has arrived and not been taken; 0 if there is none. */
int hal_imu(onboard_imu_sample *sample);
int hal_pose(onboard_pose_sample *sample);

/* What the pilot wishes, once. */
onboard_wish hal_wish(void);

/* Holds until the next call. */
void hal_motors(float left_V, float right_V);

/* After each tick. */
void hal_telemetry(const onboard *o);

#endif
