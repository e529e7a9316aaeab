/* What the flight logic makes of samples, stamps and wishes: a vehicle at rest in the hand of this program. */
#include <stdio.h>

#include "onboard.h"

static onboard o;
static uint32_t now_us;
static onboard_imu_sample imu;
static onboard_pose_sample pose;

#define CHECK(what)                        \
  if (!(what)) {                           \
    printf("%d: %s\n", __LINE__, #what);   \
    return 1;                              \
  }

static flappy_quaternion facing(float heading_rad) {
  const flappy_sin_cos half = flappy_sin_cos_wide(0.5F * heading_rad);
  flappy_quaternion q;
  q.w = half.cos;
  q.x = q.y = 0.0F;
  q.z = half.sin;
  return q;
}

static flappy_quaternion all(float x) {
  flappy_quaternion q;
  q.w = q.x = q.y = q.z = x;
  return q;
}

/* Waiting, at the place where the task begins. */
static void begin(void) {
  static int tested;
  static onboard waiting;
  now_us = 0xfff00000U; /* wraps after a second */
  if (!tested++) {
    onboard_begin(&o, now_us);
    waiting = o;
  }
  o = waiting;
  imu.gyro_rad_s = flappy_vector_of(0.0F, 0.0F, 0.0F);
  imu.accel_m_s2 = flappy_vector_of(0.0F, 0.0F, flappy_controller_k.gravity_m_s2);
  pose.valid = 1;
  pose.position_m = flappy_controller_k.start_position_m;
  pose.attitude = facing(flappy_controller_k.start_heading_rad);
}

static void wait_us(uint32_t us) { o.tick_us = now_us += us; }

/* Samples as old as this, and a tick. */
static void tick(uint32_t imu_age_us, uint32_t pose_age_us) {
  imu.taken_us = now_us - imu_age_us;
  pose.taken_us = now_us - pose_age_us;
  onboard_imu(&o, now_us, &imu);
  onboard_pose(&o, now_us, &pose);
  onboard_tick(&o, now_us);
}

static const uint32_t kImu = FLAPPY_CONTROLLER_IMU_LATENCY_US, kPose = FLAPPY_CONTROLLER_POSE_LATENCY_US;

static void fly(int periods) {
  for (; periods > 0; --periods) {
    wait_us(ONBOARD_CONTROL_US);
    tick(kImu, kPose);
  }
}

static void fly_until_settled(void) {
  begin();
  onboard_hover(&o);
  fly(502);
}

/* Whether it takes off from samples of such an age. */
static int takes_off(uint32_t imu_age_us, uint32_t pose_age_us) {
  onboard_hover(&o);
  wait_us(ONBOARD_CONTROL_US);
  tick(imu_age_us, pose_age_us);
  return o.state == ONBOARD_HOVERING;
}

static int judges_before_the_flight(void) {
  begin();
  CHECK(o.state == ONBOARD_WAITING);
  CHECK(!takes_off(kImu + ONBOARD_IMU_STALE_US + 1U, kPose));
  CHECK(!takes_off(kImu, kPose + ONBOARD_POSE_STALE_US + 1U));
  begin();
  CHECK(takes_off(kImu + ONBOARD_IMU_STALE_US, kPose + ONBOARD_POSE_STALE_US));
  begin();
  CHECK(!takes_off(0U - ONBOARD_LATE_US - 1U, kPose)); /* from the future */
  CHECK(!takes_off(kImu + 0x80000000U, kPose));
  begin();
  CHECK(!takes_off(kImu, 0U - ONBOARD_LATE_US - 1U));
  begin();
  CHECK(takes_off(0U - ONBOARD_LATE_US, 0U - ONBOARD_LATE_US));
  begin();
  imu.gyro_rad_s.y = 201.0F;
  CHECK(!takes_off(kImu, kPose));
  imu.gyro_rad_s.y = 0.0F;
  imu.accel_m_s2.x = -1001.0F;
  CHECK(!takes_off(kImu, kPose));
  begin();
  pose.position_m.z = 20001.0F;
  CHECK(!takes_off(kImu, kPose));
  begin();
  pose.attitude = all(0.0F);
  CHECK(!takes_off(kImu, kPose));
  pose.attitude = all(2.0F);
  CHECK(!takes_off(kImu, kPose));
  pose.attitude = facing(0.0F);
  CHECK(takes_off(kImu, kPose));
  return 0;
}

/* A silence of a turn of the clock does not look like none. */
static int forgets(void) {
  uint32_t i;
  begin();
  tick(kImu, kPose);
  for (i = 0; i < 16; ++i) {
    wait_us(0x10000000U);
    onboard_tick(&o, now_us);
  }
  onboard_hover(&o);
  onboard_tick(&o, now_us);
  CHECK(o.state == ONBOARD_WAITING);
  return 0;
}

static int judges_in_flight(void) {
  uint32_t i;
  fly_until_settled();
  CHECK(o.state == ONBOARD_HOVERING && o.flags == 0);
  wait_us(ONBOARD_CONTROL_US);
  tick(0U - ONBOARD_LATE_US - 1U, 0U - ONBOARD_LATE_US - 1U); /* one from the future */
  fly(100);
  CHECK(o.state == ONBOARD_HOVERING && o.flags == 0);
  wait_us(ONBOARD_CONTROL_US);
  tick(0U - 3U * ONBOARD_CONTROL_US, 0U - 3U * ONBOARD_CONTROL_US);
  fly(100);
  CHECK(o.state == ONBOARD_HOVERING && o.flags == 0);

  pose.attitude = all(0.0F); /* not seen */
  fly(25);
  CHECK(o.flags == 0);
  fly(1);
  CHECK(o.flags == ONBOARD_POSE_STALE);

  fly_until_settled(); /* samples that fall behind arrive no less often: after 12 ms the IMU's are 6 ms late */
  for (i = 1; i <= 10; ++i) {
    wait_us(ONBOARD_CONTROL_US);
    tick(kImu + i * ONBOARD_CONTROL_US / 2U, kPose);
  }
  CHECK(o.flags == 0);
  wait_us(ONBOARD_CONTROL_US);
  tick(kImu + 11U * ONBOARD_CONTROL_US / 2U, kPose);
  CHECK(o.flags == ONBOARD_IMU_STALE);

  fly_until_settled(); /* the same, but beyond 44 ms they are dropped as well */
  for (i = 1; i <= 35; ++i) {
    wait_us(ONBOARD_CONTROL_US);
    tick(kImu, kPose + i * ONBOARD_CONTROL_US / 2U);
  }
  CHECK(o.flags == ONBOARD_POSE_STALE);

  fly_until_settled(); /* a loop that stood still takes what it missed */
  wait_us(30U * ONBOARD_CONTROL_US);
  pose.taken_us = now_us - kPose;
  onboard_pose(&o, now_us, &pose);
  for (i = 0; i < 30; ++i) {
    imu.taken_us = now_us - kImu - (29U - i) * ONBOARD_CONTROL_US;
    onboard_imu(&o, now_us, &imu);
  }
  onboard_tick(&o, now_us);
  CHECK(o.state == ONBOARD_HOVERING && o.flags == 0);
  return 0;
}

static int stops(void) {
  begin();
  tick(kImu, kPose);
  onboard_stop(&o);
  onboard_hover(&o);
  fly(1);
  CHECK(o.state == ONBOARD_OFF);
  fly_until_settled();
  onboard_manoeuvre(&o);
  onboard_stop(&o);
  onboard_manoeuvre(&o);
  fly(1);
  CHECK(o.state == ONBOARD_OFF);
  return 0;
}

static int begins_only_at_its_place(void) {
  uint32_t i;
  fly_until_settled();
  onboard_manoeuvre(&o);
  fly(1);
  CHECK(o.state == ONBOARD_ACTING && o.flags == 0);

  for (i = 0; i < 3; ++i) { /* off its place or heading, and back */
    const float heading_rad = flappy_controller_k.start_heading_rad;
    fly_until_settled();
    if (i == 0) pose.attitude = facing(heading_rad + 0.5F);
    if (i == 1) pose.attitude = facing(heading_rad - 0.5F);
    if (i == 2) pose.position_m.y += 0.15F;
    fly(200);
    onboard_manoeuvre(&o);
    fly(1);
    CHECK(o.state == ONBOARD_HOVERING && o.flags == ONBOARD_UNREADY);
    pose.attitude = facing(heading_rad);
    pose.position_m = flappy_controller_k.start_position_m;
    fly(490); /* at its place again, but not for a second */
    CHECK(flappy_abs(o.controller.estimate.position_m.y - pose.position_m.y) < 0.01F);
    onboard_manoeuvre(&o);
    fly(1);
    CHECK(o.state == ONBOARD_HOVERING);
    fly(200);
    onboard_manoeuvre(&o);
    fly(1);
    CHECK(o.state == ONBOARD_ACTING);
  }

  fly_until_settled();
  pose.attitude = facing(flappy_controller_k.start_heading_rad + 0.3F); /* within the limit */
  fly(200);
  onboard_manoeuvre(&o);
  fly(1);
  CHECK(o.state == ONBOARD_ACTING && o.flags == 0);

  fly_until_settled(); /* a hover that outlasts the clock, by half a second */
  for (i = 0; i < 0xffffffffU / 20000U - 25U; ++i) {
    wait_us(20000U);
    tick(kImu, kPose);
  }
  onboard_manoeuvre(&o);
  fly(1);
  CHECK(o.state == ONBOARD_ACTING && o.flags == 0);
  return 0;
}

int main(void) {
  if (judges_before_the_flight() || forgets() || judges_in_flight() || stops() || begins_only_at_its_place()) return 1;
  printf("all hold\n");
  return 0;
}
