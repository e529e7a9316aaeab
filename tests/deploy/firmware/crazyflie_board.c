/* The firmware around the app: a stabilizer loop over a serial line, one step for each record. */
#include "board.h"
#include "crazyflie_stub.h"

typedef struct {
  uint32_t us;
  float position_m[3], velocity_m_s[3], attitude[4], gyro_deg_s[3]; /* attitude: w, x, y, z */
  int32_t flies, act, in_world;                                      /* act < 0: the end */
} record_in;
typedef struct {
  float thrust;
  int32_t roll, pitch, yaw, pid; /* pid: how often the PID has been called; then where it was to go */
  float to_m[3];
  uint32_t state, flags, us, events; /* us: that the app took in all steps */
} record_out;

extern const struct stub_variable stub_params_flappy[], stub_logs_flappy[];
static record_in in;
static record_out out;
static uint64_t time_us;

void controllerPidInit(void) {}
bool controllerPidTest(void) { return true; }
void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                   const stabilizerStep_t step) {
  (void)sensors;
  (void)state;
  (void)step;
  ++out.pid;
  out.to_m[0] = setpoint->position.x;
  out.to_m[1] = setpoint->position.y;
  out.to_m[2] = setpoint->position.z;
  control->roll = control->pitch = control->yaw = 0;
  control->thrust = 0.0F;
}
bool supervisorCanFly(void) { return true; }
bool supervisorIsFlying(void) { return in.flies != 0; }
uint64_t usecTimestamp(void) { return time_us; }
static uint32_t events;
void eventTrigger(const eventtrigger *event) { events += event->name != 0; }

static bool same(const char *a, const char *b) {
  while (*a != '\0' && *a == *b) ++a, ++b;
  return *a == *b;
}
static void *named(const struct stub_variable *list, const char *name) {
  for (; list->name != 0; ++list)
    if (same(list->name, name)) return list->at;
  return 0;
}

int main(void) {
  static control_t control;
  static setpoint_t setpoint;
  static sensorData_t sensors;
  static state_t state;
  uint32_t step = 0;
  const uint8_t *mode = named(stub_logs_flappy, "state");
  const uint32_t *flags = named(stub_logs_flappy, "flags");
  const float *action = named(stub_logs_flappy, "a0");
  if (action == 0) return 4;
  controllerOutOfTreeInit();
  if (!controllerOutOfTreeTest()) return 5;
  appMain();
  setpoint.position.x = 9.0F;
  setpoint.mode.z = modeAbs;
  for (; board_read(&in, (unsigned)sizeof in) && in.act >= 0; ++step) {
    time_us = in.us;
    *(uint8_t *)named(stub_params_flappy, "act") = (uint8_t)in.act;
    *(uint8_t *)named(stub_params_flappy, "inWorld") = (uint8_t)in.in_world;
    state.position.x = in.position_m[0], state.position.y = in.position_m[1], state.position.z = in.position_m[2];
    state.velocity.x = in.velocity_m_s[0], state.velocity.y = in.velocity_m_s[1], state.velocity.z = in.velocity_m_s[2];
    state.attitudeQuaternion.w = in.attitude[0], state.attitudeQuaternion.x = in.attitude[1];
    state.attitudeQuaternion.y = in.attitude[2], state.attitudeQuaternion.z = in.attitude[3];
    sensors.gyro.x = in.gyro_deg_s[0], sensors.gyro.y = in.gyro_deg_s[1], sensors.gyro.z = in.gyro_deg_s[2];
    out.us -= board_us();
    controllerOutOfTree(&control, &setpoint, &sensors, &state, step);
    out.us += board_us();
    out.thrust = control.thrust;
    out.roll = control.roll, out.pitch = control.pitch, out.yaw = control.yaw;
    out.state = *mode, out.flags = *flags, out.events = events;
    board_write(&out, (unsigned)sizeof out);
  }
  return 0;
}
