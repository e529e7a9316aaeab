#include "onboard.h"

int onboard_due(uint32_t due_us, uint32_t now_us) { return (int32_t)(now_us - due_us) >= 0; }

int onboard_flies(const onboard *o) {
  return o->state == ONBOARD_HOVERING || o->state == ONBOARD_ACTING || o->state == ONBOARD_RETURNED;
}

void onboard_begin(onboard *o, uint32_t now_us) {
  static const onboard nothing;
  *o = nothing;
  if (flappy_policy_selftest() != 0) o->flags |= ONBOARD_BAD_POLICY;
  if (flappy_controller_selftest() != 0) o->flags |= ONBOARD_BAD_CONTROLLER;
  o->state = o->flags == 0 ? ONBOARD_WAITING : ONBOARD_REFUSED;
  o->tick_us = o->drive_us = now_us;
}

/* Samples. */

/* After a sample with a stamp in the future, all good samples would be refused until the clock has caught up. */
static int in_time(uint32_t now_us, uint32_t taken_us) { return !flappy_after(taken_us, now_us + ONBOARD_LATE_US); }

/* Time at which a sample would have arrived with the latency of the training, but not after `now_us`. */
static uint32_t due_us_of(uint32_t now_us, uint32_t taken_us, uint32_t latency_us) {
  return flappy_after(taken_us + latency_us, now_us) ? now_us : taken_us + latency_us;
}

void onboard_imu(onboard *o, uint32_t now_us, const onboard_imu_sample *s) {
  if (!in_time(now_us, s->taken_us) || !flappy_plausible_imu(s->gyro_rad_s, s->accel_m_s2)) return;
  if (onboard_flies(o)) {
    o->controller.now_us = now_us; /* the controller judges stamps by it, and the last tick may be long ago */
    if (!flappy_controller_imu(&o->controller, s->taken_us, s->gyro_rad_s, s->accel_m_s2)) return;
  }
  o->has_imu = 1;
  o->imu_us = due_us_of(now_us, s->taken_us, FLAPPY_CONTROLLER_IMU_LATENCY_US);
}

void onboard_pose(onboard *o, uint32_t now_us, const onboard_pose_sample *s) {
  const int seen = s->valid != 0 && flappy_plausible_pose(s->position_m, s->attitude);
  if (!in_time(now_us, s->taken_us)) return;
  if (onboard_flies(o)) {
    o->controller.now_us = now_us;
    if (!flappy_controller_pose(&o->controller, s->taken_us, seen, s->position_m, s->attitude)) return;
  }
  if (!seen) return;
  o->has_pose = 1;
  o->pose_us = due_us_of(now_us, s->taken_us, FLAPPY_CONTROLLER_POSE_LATENCY_US);
  o->pose = *s;
}

/* Wishes. */

static void wish_for(onboard *o, onboard_wish wish) {
  if (o->wish != ONBOARD_STOP) o->wish = wish;
}
void onboard_hover(onboard *o) { wish_for(o, ONBOARD_HOVER); }
void onboard_manoeuvre(onboard *o) { wish_for(o, ONBOARD_MANOEUVRE); }
void onboard_stop(onboard *o) { wish_for(o, ONBOARD_STOP); }

/* Watching. */

static void turn_off(onboard *o, uint32_t why) {
  o->flags |= why;
  o->state = ONBOARD_OFF;
}

/* Ends the policy for good. Feedback control stays at this place, as the goal may be too far away for it. */
static void drop_policy(onboard *o, uint32_t why) {
  o->flags |= why;
  if (o->state != ONBOARD_ACTING) return;
  flappy_controller_stay(&o->controller);
  o->state = ONBOARD_RETURNED;
}

static void watch_sensors(onboard *o, uint32_t now_us) {
  const uint32_t imu_age_us = now_us - o->imu_us, pose_age_us = now_us - o->pose_us;
  if (imu_age_us > ONBOARD_IMU_STALE_US) drop_policy(o, ONBOARD_IMU_STALE);
  if (pose_age_us > ONBOARD_POSE_STALE_US) drop_policy(o, ONBOARD_POSE_STALE);
  if (imu_age_us > ONBOARD_IMU_LOST_US) turn_off(o, ONBOARD_IMU_LOST);
  if (pose_age_us > ONBOARD_POSE_LOST_US) turn_off(o, ONBOARD_POSE_LOST);
}

/* Before the flight: forgets stale samples, which would look fresh after the clock has wrapped. */
static void forget_stale(onboard *o, uint32_t now_us) {
  if (now_us - o->imu_us > ONBOARD_IMU_STALE_US) o->has_imu = 0;
  if (now_us - o->pose_us > ONBOARD_POSE_STALE_US) o->has_pose = 0;
}

/* A NaN would be clipped to full voltage, so it has to be detected before. */
static void watch_numbers(onboard *o) {
  const flappy_controller *c = &o->controller;
  if (!flappy_all_finite((const float *)&c->estimate, (uint32_t)sizeof c->estimate) ||
      !flappy_all_finite((const float *)&c->input, (uint32_t)sizeof c->input))
    turn_off(o, ONBOARD_NOT_FINITE);
}

/* Flying. */

static void take_off(onboard *o, uint32_t now_us) {
  if (!o->has_imu || !o->has_pose) return;
  flappy_controller_start(&o->controller, now_us, o->pose.position_m, o->pose.attitude);
  flappy_controller_hover(&o->controller);
  o->drive_us = now_us;
  o->state = ONBOARD_HOVERING;
}

/* Whether the vehicle is at the place and heading at which the task begins. */
static int at_place(const flappy_controller *c) {
  const flappy_matrix R = flappy_rotation_matrix(c->estimate.attitude);
  const flappy_sin_cos is = flappy_heading(&R), wanted = c->hover_heading;
  const float rotation_rad = flappy_atan2(flappy_difference2(is.sin, wanted.cos, is.cos, wanted.sin),
                                      flappy_sum2(is.cos, wanted.cos, is.sin, wanted.sin));
  return flappy_plausible(flappy_minus(c->estimate.position_m, c->hover_m), ONBOARD_PLACE_M) &&
         flappy_abs(rotation_rad) <= ONBOARD_HEADING_RAD;
}

/* Counts the time at the place up to ONBOARD_HOVER_US only: a longer hover would make the counter wrap. */
static void settle(onboard *o, uint32_t passed_us) {
  if (!at_place(&o->controller)) {
    o->settled_us = 0;
  } else if (passed_us >= ONBOARD_HOVER_US - o->settled_us) {
    o->settled_us = ONBOARD_HOVER_US;
  } else {
    o->settled_us += passed_us;
  }
}

static void begin_manoeuvre(onboard *o, uint32_t now_us) {
  const int ready = o->state == ONBOARD_HOVERING && o->settled_us >= ONBOARD_HOVER_US &&
                    (o->flags & ONBOARD_FAULTS) == 0;
  if (!ready) {
    o->flags |= ONBOARD_UNREADY;
    return;
  }
  flappy_controller_begin(&o->controller);
  flappy_policy_reset(&o->policy);
  o->act_us = now_us;
  o->state = ONBOARD_ACTING;
}

static void let_policy_act(onboard *o) {
  if (!flappy_controller_policy_due(&o->controller)) return;
  flappy_controller_observe(&o->controller, o->observation);
  ++o->inferences;
  if (flappy_policy_step_with(&o->policy, o->observation, o->action) != 0) {
    drop_policy(o, ONBOARD_POLICY_REFUSED);
    return;
  }
  flappy_controller_act(&o->controller, o->action);
}

void onboard_tick(onboard *o, uint32_t now_us) {
  const uint32_t late_us = now_us - o->tick_us;
  const onboard_wish wish = o->wish;
  const uint32_t passed_us = now_us - o->ticked_us;
  o->ticked_us = now_us;
  o->tick_us += (late_us / ONBOARD_CONTROL_US + 1U) * ONBOARD_CONTROL_US; /* missed ticks are not made up for */
  o->wish = ONBOARD_NOTHING;

  if (onboard_flies(o)) {
    const int handed_back = flappy_controller_tick(&o->controller, now_us);
    if (o->state == ONBOARD_ACTING && handed_back) {
      o->flags |= ONBOARD_HANDED_BACK;
      o->state = ONBOARD_RETURNED;
    }
    if (o->state == ONBOARD_HOVERING) settle(o, passed_us);
    if (late_us > ONBOARD_LATE_US) drop_policy(o, ONBOARD_LATE);
    if (o->state == ONBOARD_ACTING && now_us - o->act_us > ONBOARD_ACTING_US) drop_policy(o, ONBOARD_POLICY_TOO_LONG);
    watch_sensors(o, now_us);
  } else {
    forget_stale(o, now_us);
  }
  if (wish == ONBOARD_STOP && o->state != ONBOARD_REFUSED) turn_off(o, ONBOARD_STOPPED);
  if (wish == ONBOARD_HOVER && o->state == ONBOARD_WAITING) take_off(o, now_us);
  if (wish == ONBOARD_MANOEUVRE) begin_manoeuvre(o, now_us);
  if (!onboard_flies(o)) return;
  if (o->state == ONBOARD_ACTING) let_policy_act(o);
  flappy_controller_steer(&o->controller);
  watch_numbers(o);
}

/* Motors. */

static float clamped(onboard *o, float volts) {
  if (flappy_abs(volts) <= ONBOARD_LIMIT_V) return volts;
  o->flags |= ONBOARD_CLAMPED;
  return volts > 0.0F ? ONBOARD_LIMIT_V : volts < 0.0F ? -ONBOARD_LIMIT_V : 0.0F; /* NaN gives 0 V */
}

void onboard_drive(onboard *o, uint32_t now_us, float *left_V, float *right_V) {
  const uint32_t missed = (now_us - o->drive_us) / FLAPPY_CONTROLLER_DRIVE_US;
  o->drive_us += (missed + 1U) * FLAPPY_CONTROLLER_DRIVE_US;
  *left_V = *right_V = 0.0F;
  if (!onboard_flies(o)) return;
  o->controller.phase += missed * FLAPPY_CONTROLLER_PHASE_STEP; /* the beat's phase follows time, also over missed updates */
  flappy_controller_drive(&o->controller, left_V, right_V);
  *left_V = clamped(o, *left_V);
  *right_V = clamped(o, *right_V);
}
