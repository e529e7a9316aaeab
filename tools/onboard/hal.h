/* Functions that a board has to provide for the loop. hal_simulated.c provides them over a byte stream; add your own next to it. */
#ifndef HAL
#define HAL 1

#include "onboard.h"

/* Starts clocks, sensors and motor drivers, with the motors at 0 V. */
void hal_start(void);

/* Time in us, by the clock that also stamps the samples; it may wrap. */
uint32_t hal_now_us(void);

/* Waits until that time; returns at once if it has passed. Returns 0 if the loop shall end, which happens in simulation only. */
int hal_wait_us(uint32_t until_us);

/* Takes the oldest sample that has arrived and was not taken; returns 0 if there is none. */
int hal_imu(onboard_imu_sample *sample);
int hal_pose(onboard_pose_sample *sample);

/* Returns the pilot's wish; each wish is returned once. */
onboard_wish hal_wish(void);

/* Sets the motors' voltages, which hold until the next call. */
void hal_motors(float left_V, float right_V);

/* Called after each tick. */
void hal_telemetry(const onboard *o);

#endif
