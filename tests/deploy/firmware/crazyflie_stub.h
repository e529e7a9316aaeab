/* The part of the Crazyflie's firmware that the exported app uses, as its headers of 2025 declare it
   (github.com/bitcraze/crazyflie-firmware: src/modules/interface/stabilizer_types.h, controller/controller.h,
   controller/controller_pid.h, supervisor.h, param.h, log.h, eventtrigger.h, app.h; src/utils/interface/debug.h; src/hal/interface/usec_time.h). The test includes it by their names. */
#ifndef CRAZYFLIE_STUB
#define CRAZYFLIE_STUB 1

#include <stdbool.h>
#include <stdint.h>

typedef uint32_t stabilizerStep_t;
typedef struct {
  float x, y, z;
} Axis3f;
typedef struct {
  uint32_t timestamp;
  float roll, pitch, yaw;
} attitude_t;
typedef struct {
  uint32_t timestamp;
  float x, y, z;
} point_t;
typedef point_t velocity_t;
typedef point_t acc_t;
typedef struct {
  float x, y, z, w;
} quaternion_t;
typedef struct {
  Axis3f acc;  /* G */
  Axis3f gyro; /* degrees/s */
} sensorData_t;
typedef struct {
  attitude_t attitude; /* degrees, pitch inverted */
  quaternion_t attitudeQuaternion;
  point_t position;
  velocity_t velocity;
  acc_t acc;
} state_t;
typedef enum { controlModeLegacy = 0, controlModeForceTorque = 1, controlModeForce = 2 } control_mode_t;
typedef struct {
  int16_t roll, pitch, yaw;
  float thrust;
  control_mode_t controlMode;
} control_t;
typedef enum { modeDisable = 0, modeAbs, modeVelocity } stab_mode_t;
typedef struct {
  uint32_t timestamp;
  attitude_t attitude, attitudeRate;
  quaternion_t attitudeQuaternion;
  float thrust;
  point_t position;
  velocity_t velocity;
  acc_t acceleration;
  bool velocity_body;
  struct {
    stab_mode_t x, y, z, roll, pitch, yaw, quat;
  } mode;
} setpoint_t;

void controllerPidInit(void);
bool controllerPidTest(void);
void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                   const stabilizerStep_t step);
void controllerOutOfTreeInit(void);
bool controllerOutOfTreeTest(void);
void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const stabilizerStep_t step);
bool supervisorCanFly(void);
bool supervisorIsFlying(void);
uint64_t usecTimestamp(void);
void appMain(void);
#define vTaskDelay(ticks) return /* there is one task */
#define M2T(ms) (ms)
#define DEBUG_PRINT(...) ((void)0)
typedef struct {
  const char *name;
} eventtrigger;
#define EVENTTRIGGER(name) static eventtrigger eventTrigger_##name = {#name};
void eventTrigger(const eventtrigger *event);

/* Tables of pointers, in place of the firmware's sections. */
struct stub_variable {
  const char *name;
  void *at;
};
#define PARAM_UINT8 8
#define PARAM_GROUP_START(group) extern const struct stub_variable stub_params_##group[]; const struct stub_variable stub_params_##group[] = {
#define PARAM_ADD(type, name, at) {#name, at},
#define PARAM_GROUP_STOP(group) {0, 0}};
#define LOG_UINT8 1
#define LOG_UINT32 3
#define LOG_FLOAT 7
#define LOG_GROUP_START(group) extern const struct stub_variable stub_logs_##group[]; const struct stub_variable stub_logs_##group[] = {
#define LOG_ADD(type, name, at) {#name, at},
#define LOG_GROUP_STOP(group) {0, 0}};

#endif
