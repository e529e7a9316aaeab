/* The policy as an out-of-tree controller of the Crazyflie's firmware on a Flapper Nimble+: the firmware's estimator and PID fly it, and
   the policy while the parameter flappy.act is 1. Interface: github.com/bitcraze/crazyflie-firmware, examples/app_out_of_tree_controller,
   src/modules/interface/stabilizer_types.h and src/modules/src/power_distribution_flapper.c (PCB revision D). */
#include <stdbool.h>
#include <stdint.h>

#define DEBUG_MODULE "FLAPPY"

#include "FreeRTOS.h"
#include "app.h"
#include "controller.h"
#include "controller_pid.h"
#include "debug.h"
#include "eventtrigger.h"
#include "flappy_guest.h"
#include "log.h"
#include "param.h"
#include "stabilizer_types.h"
#include "supervisor.h"
#include "task.h"
#include "usec_time.h"

#if FLAPPY_CONTROLLER_CONTROL_US % 1000U != 0
#error "the control period is no whole number of the stabilizer's steps of 1 ms"
#endif
#define FLAPPY_STEPS (FLAPPY_CONTROLLER_CONTROL_US / 1000U)

/* control_t carries thrust from 0 to 65535 and the others as int16_t; the power distribution makes of them, as shares of 65535:
     left, right = thrust +- roll / 2      pitch servo = neutral + 0.4 pitch      yaw servo = neutral - yaw */
#define FLAPPY_FULL 65535.0F
#define FLAPPY_PITCH_SHARE 0.4F
#define FLAPPY_MIDDLE 0.5F /* of the servos, as trained; their trimmed neutral takes its place on the robot */
#define FLAPPY_RAD_PER_DEG 0.017453292519943295F

static flappy_guest guest;
#include "flappy_log.h" /* made for this policy */
static uint8_t act, in_world; /* parameters */
static uint8_t state_now;
static uint32_t flags_now;
static setpoint_t stay; /* at the last place of the manoeuvre */
static int ended;       /* a manoeuvre, and the pilot still wishes it */

static int16_t flappy_rounded(float x) {
  const float limited = flappy_clamp(x, -32767.0F, 32767.0F);
  return (int16_t)(limited < 0.0F ? limited - 0.5F : limited + 0.5F);
}

static void flappy_set(control_t *control, const float *inputs) {
  const float left = inputs[FLAPPY_CONTROLLER_INPUT_LEFT_FLAP], right = inputs[FLAPPY_CONTROLLER_INPUT_RIGHT_FLAP];
  control->controlMode = controlModeLegacy;
  control->thrust = FLAPPY_FULL * (0.5F * (left + right));
  control->roll = flappy_rounded(FLAPPY_FULL * (left - right));
  control->pitch = flappy_rounded(FLAPPY_FULL / FLAPPY_PITCH_SHARE * (inputs[FLAPPY_CONTROLLER_INPUT_PITCH_SERVO] - FLAPPY_MIDDLE));
  control->yaw = flappy_rounded(FLAPPY_FULL * (FLAPPY_MIDDLE - inputs[FLAPPY_CONTROLLER_INPUT_YAW_SERVO]));
}

static flappy_motion flappy_estimate(const state_t *state, const sensorData_t *sensors) {
  flappy_motion x;
  x.position_m = flappy_vector_of(state->position.x, state->position.y, state->position.z);
  x.velocity_m_s = flappy_vector_of(state->velocity.x, state->velocity.y, state->velocity.z);
  x.attitude.w = state->attitudeQuaternion.w;
  x.attitude.x = state->attitudeQuaternion.x;
  x.attitude.y = state->attitudeQuaternion.y;
  x.attitude.z = state->attitudeQuaternion.z;
  x.body_rate_rad_s = flappy_times(FLAPPY_RAD_PER_DEG, flappy_vector_of(sensors->gyro.x, sensors->gyro.y, sensors->gyro.z));
  return x;
}

/* The commander's set point, at this place. */
static setpoint_t flappy_stay(const setpoint_t *setpoint, const state_t *state) {
  setpoint_t s = *setpoint;
  s.mode.x = s.mode.y = s.mode.z = s.mode.yaw = modeAbs;
  s.mode.roll = s.mode.pitch = s.mode.quat = modeDisable;
  s.position = state->position;
  s.attitude.yaw = state->attitude.yaw;
  s.velocity.x = s.velocity.y = s.velocity.z = 0.0F;
  return s;
}

void controllerOutOfTreeInit(void) { controllerPidInit(); }

bool controllerOutOfTreeTest(void) { return controllerPidTest(); }

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const uint32_t step) {
  const int flies = supervisorIsFlying() && supervisorCanFly();
  if (step % FLAPPY_STEPS == 0) {
    const flappy_motion estimate = flappy_estimate(state, sensors);
    const int flew = flappy_guest_flies(&guest);
    const uint32_t inferences = guest.inferences;
    guest.wishes_world = in_world != 0;
    if (flappy_guest_tick(&guest, (uint32_t)usecTimestamp(), &estimate, flies, act != 0)) {
      flappy_set(control, guest.inputs);
      stay = flappy_stay(setpoint, state); /* an estimate that is a number */
    }
    ended = act != 0 && (ended || flew) && !flappy_guest_flies(&guest);
    state_now = (uint8_t)guest.state;
    flags_now = guest.flags;
    if (guest.inferences != inferences) flappy_log_inference();
  }
  if (flappy_guest_flies(&guest)) return; /* the PID stands still while the policy acts */
  /* a set point without a height is the supervisor's, and stops the motors */
  controllerPid(control, ended && flies && setpoint->mode.z != modeDisable ? &stay : setpoint, sensors, state, step);
}

/* The self-tests take more stack than the firmware's start has. Until they have passed, the policy is refused. */
void appMain(void) {
  flappy_guest_begin(&guest);
  DEBUG_PRINT("flappy: %s\n", guest.state == FLAPPY_GUEST_READY ? "ready" : "REFUSED: a self-test failed");
  for (;;) vTaskDelay(M2T(1000));
}

PARAM_GROUP_START(flappy)
PARAM_ADD(PARAM_UINT8, act, &act)          /* 1: the manoeuvre; 0 before its end takes it back */
PARAM_ADD(PARAM_UINT8, inWorld, &in_world) /* 1: the task's frame is the estimator's; 0: it begins where the robot is */
PARAM_GROUP_STOP(flappy)

LOG_GROUP_START(flappy)
LOG_ADD(LOG_UINT8, state, &state_now)
LOG_ADD(LOG_UINT32, flags, &flags_now)
FLAPPY_LOG
LOG_GROUP_STOP(flappy)
