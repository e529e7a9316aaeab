/* Main loop: at 500 Hz from sensors to inputs of the wing beat; motor voltages every FLAPPY_CONTROLLER_DRIVE_US. */
#include "hal.h"

static onboard vehicle;

static void take_samples(uint32_t now_us) {
  onboard_imu_sample imu;
  onboard_pose_sample pose;
  while (hal_imu(&imu)) onboard_imu(&vehicle, now_us, &imu);
  while (hal_pose(&pose)) onboard_pose(&vehicle, now_us, &pose);
}

static void take_wish(void) {
  switch (hal_wish()) {
    case ONBOARD_HOVER:
      onboard_hover(&vehicle);
      break;
    case ONBOARD_MANOEUVRE:
      onboard_manoeuvre(&vehicle);
      break;
    case ONBOARD_STOP:
      onboard_stop(&vehicle);
      break;
    case ONBOARD_NOTHING:
      break;
  }
}

int main(void) {
  uint32_t next_us;
  hal_start();
  onboard_begin(&vehicle, hal_now_us());
  vehicle.tick_us = vehicle.drive_us = hal_now_us(); /* the self-tests have taken time */
  do {
    const uint32_t now_us = hal_now_us();
    if (onboard_due(vehicle.tick_us, now_us)) {
      take_samples(now_us);
      take_wish();
      onboard_tick(&vehicle, now_us);
      hal_telemetry(&vehicle);
    }
    if (onboard_due(vehicle.drive_us, now_us)) {
      float left_V, right_V;
      onboard_drive(&vehicle, now_us, &left_V, &right_V);
      hal_motors(left_V, right_V);
    }
    next_us = onboard_due(vehicle.tick_us, vehicle.drive_us) ? vehicle.tick_us : vehicle.drive_us;
  } while (hal_wait_us(next_us));
  return 0;
}
