/* HAL over a network: flappy-sitl provides clock, sensors and motors. Messages of ROS 2 by Cyclone DDS.

   In every control period flappy-sitl sends a tick with the number of samples that it has sent since the start. The loop takes these
      samples, runs until the next tick is due, and answers with the inputs of the wing beat. */
#include <stdio.h>
#include <stdlib.h>

#include "dds/dds.h"
#include "flappy_msgs.h"
#include "hal.h"
#include "ros2_msgs.h"

#define OVER 255
#define RING 64U /* largest number of samples between two ticks; older ones are lost, as on a board */

typedef flappy_msgs_msg_dds__Tick_ tick_message;
typedef sensor_msgs_msg_dds__Imu_ imu_message;
typedef geometry_msgs_msg_dds__PoseStamped_ pose_message;
typedef flappy_msgs_msg_dds__WingInput_ input_message;

static dds_entity_t participant, tick_reader, imu_reader, pose_reader, input_writer, waiting;
static onboard_imu_sample imus[RING];
static onboard_pose_sample poses[RING];
static uint32_t imu_count, imu_taken, pose_count, pose_taken; /* since the start */
static tick_message tick;
static input_message input;
static char no_frame[] = "";
static uint32_t now_us;
static int wished, goes_on = 1;

static void fail(const char *what, dds_return_t code) {
  fprintf(stderr, "onboard: %s: %s\n", what, dds_strretcode(-code));
  exit(1);
}

static dds_entity_t made(dds_entity_t entity, const char *what) {
  if (entity < 0) fail(what, entity);
  return entity;
}

/* Time of the flight in us; it wraps like the clock of a board. */
static uint32_t microseconds(const builtin_interfaces_msg_dds__Time_ *t) {
  return (uint32_t)t->sec * 1000000U + (t->nanosec + 500U) / 1000U;
}

static dds_entity_t endpoint(const dds_topic_descriptor_t *type, const char *name, int writes) {
  dds_qos_t *qos = dds_create_qos();
  dds_entity_t topic, entity;
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, (int32_t)RING);
  topic = made(dds_create_topic(participant, type, name, NULL, NULL), name);
  entity = writes ? dds_create_writer(participant, topic, qos, NULL) : dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return made(entity, name);
}

static dds_entity_t reader(const dds_topic_descriptor_t *type, const char *name) {
  const dds_entity_t r = endpoint(type, name, 0);
  const dds_entity_t ready = made(dds_create_readcondition(r, DDS_ANY_STATE), name);
  const dds_return_t code = dds_waitset_attach(waiting, ready, 0);
  if (code < 0) fail(name, code);
  return r;
}

/* ROS_DOMAIN_ID and CYCLONEDDS_URI select the network of flappy-sitl. */
static void connect_to_simulator(void) {
  const char *domain = getenv("ROS_DOMAIN_ID");
  participant = made(dds_create_participant(domain != NULL ? (dds_domainid_t)atoi(domain) : 0U, NULL, NULL), "no participant");
  waiting = made(dds_create_waitset(participant), "no wait set");
  imu_reader = reader(&sensor_msgs_msg_dds__Imu__desc, "rt/flappy/imu");
  pose_reader = reader(&geometry_msgs_msg_dds__PoseStamped__desc, "rt/flappy/pose");
  input_writer = endpoint(&flappy_msgs_msg_dds__WingInput__desc, "rt/flappy/wing_input", 1);
  tick_reader = reader(&flappy_msgs_msg_dds__Tick__desc, "rt/flappy/tick");
}

static void *next(dds_entity_t from, void **sample) {
  dds_sample_info_t info;
  *sample = NULL;
  if (dds_take(from, sample, &info, 1, 1) <= 0) return NULL;
  return info.valid_data ? *sample : NULL;
}

static flappy_vector vector(double x, double y, double z) { return flappy_vector_of((float)x, (float)y, (float)z); }

static void take_samples(void) {
  void *sample;
  const imu_message *imu;
  const pose_message *pose;
  while ((imu = (const imu_message *)next(imu_reader, &sample)) != NULL) {
    onboard_imu_sample *to = &imus[imu_count++ % RING];
    to->taken_us = microseconds(&imu->header.stamp);
    to->gyro_rad_s = vector(imu->angular_velocity.x, imu->angular_velocity.y, imu->angular_velocity.z);
    to->accel_m_s2 = vector(imu->linear_acceleration.x, imu->linear_acceleration.y, imu->linear_acceleration.z);
    dds_return_loan(imu_reader, &sample, 1);
  }
  while ((pose = (const pose_message *)next(pose_reader, &sample)) != NULL) {
    onboard_pose_sample *to = &poses[pose_count++ % RING];
    to->taken_us = microseconds(&pose->header.stamp);
    to->valid = 1;
    to->position_m = vector(pose->pose.position.x, pose->pose.position.y, pose->pose.position.z);
    to->attitude.w = (float)pose->pose.orientation.w;
    to->attitude.x = (float)pose->pose.orientation.x;
    to->attitude.y = (float)pose->pose.orientation.y;
    to->attitude.z = (float)pose->pose.orientation.z;
    dds_return_loan(pose_reader, &sample, 1);
  }
}

static int before(uint32_t a, uint32_t b) { return (int32_t)(a - b) < 0; }

/* Waits for the newest tick and for all samples that it counts. */
static void receive(void) {
  int has_tick = 0;
  while (!has_tick || before(imu_count, tick.imu) || before(pose_count, tick.poses)) {
    void *sample;
    const tick_message *t;
    while ((t = (const tick_message *)next(tick_reader, &sample)) != NULL) {
      tick = *t;
      has_tick = 1;
      wished = t->wish;
      dds_return_loan(tick_reader, &sample, 1);
    }
    take_samples();
    if (has_tick && tick.wish == OVER) {
      goes_on = 0;
      return;
    }
    if (!has_tick || before(imu_count, tick.imu) || before(pose_count, tick.poses))
      if (dds_waitset_wait(waiting, NULL, 0, DDS_SECS(10)) == 0) {
        fprintf(stderr, "onboard: flappy-sitl says nothing for 10 s\n");
        exit(1);
      }
  }
  now_us = microseconds(&tick.stamp);
}

void hal_start(void) {
  connect_to_simulator();
  input.header.frame_id = no_frame;
  receive();
}

uint32_t hal_now_us(void) { return now_us; }

int hal_wait_us(uint32_t until_us) {
  if (!onboard_due(microseconds(&tick.until), until_us)) {
    now_us = until_us;
    return goes_on;
  }
  if (goes_on) {
    dds_return_t code;
    input.header.stamp = tick.stamp;
    input.tick = tick.tick;
    code = dds_write(input_writer, &input);
    if (code < 0) fail("an input cannot be sent", code);
    receive();
  }
  if (!goes_on) dds_delete(participant); /* at once, so that the simulator does not wait for this loop */
  return goes_on;
}

int hal_imu(onboard_imu_sample *sample) {
  if (!before(imu_taken, tick.imu)) return 0;
  if (imu_count - imu_taken > RING) imu_taken = imu_count - RING;
  *sample = imus[imu_taken++ % RING];
  return 1;
}

int hal_pose(onboard_pose_sample *sample) {
  if (!before(pose_taken, tick.poses)) return 0;
  if (pose_count - pose_taken > RING) pose_taken = pose_count - RING;
  *sample = poses[pose_taken++ % RING];
  return 1;
}

onboard_wish hal_wish(void) {
  const int wish = wished;
  wished = 0;
  return (onboard_wish)wish;
}

void hal_motors(float left_V, float right_V) {
  input.left_voltage_v = (double)left_V;
  input.right_voltage_v = (double)right_V;
}

void hal_telemetry(const onboard *o) {
  const flappy_wing_beat *u = &o->controller.input;
  const int flies = onboard_flies(o);
  input.amplitude_v = flies ? (double)u->amplitude_V : 0.0;
  input.difference_v = flies ? (double)u->difference_V : 0.0;
  input.bias_v = flies ? (double)u->bias_V : 0.0;
  input.split_cycle = flies ? (double)u->split_cycle : 0.0;
  input.phase_rad = (double)o->controller.phase * (6.283185307179586 / 4294967296.0);
}
