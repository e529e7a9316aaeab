/* The flight logic around the two exported headers: from sensor samples to motor voltages, with what watches over it. It
   knows no hardware and no clock but the times it is given: microseconds that may wrap.

     onboard_begin     self-tests: REFUSED, or WAITING
     WAITING           motors off; fresh samples and a wish to hover: HOVERING
     HOVERING          feedback alone, where the task begins; the trim is learnt; a wish for the manoeuvre: ACTING
     ACTING            the policy acts until the controller hands back, or something is wrong: RETURNED
     RETURNED          feedback alone, at the goal or where it went wrong; the policy never acts again
     OFF               motors off for good: without the IMU, without motion capture for too long, without an estimate, or
                       by wish */
#ifndef ONBOARD
#define ONBOARD 1

#include "flappy_controller.h"
#include "flappy_policy.h"

/* What this loop was written for. */
#define ONBOARD_FORMAT 1
#define ONBOARD_CONTROL_US 2000U

#if FLAPPY_POLICY_FORMAT != ONBOARD_FORMAT || FLAPPY_CONTROLLER_FORMAT != ONBOARD_FORMAT
#error "flappy_policy.h or flappy_controller.h is of another format: export both with the flappy-export of this loop"
#endif
#if FLAPPY_POLICY_CONTRACT != FLAPPY_CONTROLLER_CONTRACT
#error \
    "flappy_policy.h and flappy_controller.h differ in task, periods, signals or their order: export both from one run"
#endif
#if FLAPPY_POLICY_CONTROL_US != ONBOARD_CONTROL_US || FLAPPY_CONTROLLER_CONTROL_US != ONBOARD_CONTROL_US
#error "the control period is not this loop's: set ONBOARD_CONTROL_US and whatever calls it, or export a run of 500 Hz"
#endif
#if FLAPPY_POLICY_OBS != FLAPPY_CONTROLLER_OBS || FLAPPY_POLICY_ACT != 4
#error "flappy_policy.h does not take what flappy_controller.h shows, or does not give four numbers"
#endif

/* Limits; each may be set by the compiler. A sample is as old as its arrival, or as its stamp and the latency of the training
   make it, whichever is more. */

/* Five control periods: an IMU of 500 Hz has then missed five samples, which is no jitter. The policy has never flown on an
   estimate that is extrapolated further. */
#ifndef ONBOARD_IMU_STALE_US
#define ONBOARD_IMU_STALE_US 10000U
#endif
/* A flapper is unstable: in the simulator it leans by 0.1 to 0.4 rad this long after the last sample, and has turned over
   in twice the time. */
#ifndef ONBOARD_IMU_LOST_US
#define ONBOARD_IMU_LOST_US 50000U
#endif
/* Seven frames of 150 Hz. The estimate is still good then, but the policy was trained on a better one. */
#ifndef ONBOARD_POSE_STALE_US
#define ONBOARD_POSE_STALE_US 50000U
#endif
/* In the simulator dead reckoning drifts by a few centimetres in this time, and by a metre in four times as long. */
#ifndef ONBOARD_POSE_LOST_US
#define ONBOARD_POSE_LOST_US 1500000U
#endif
/* Half a period: what the policy sees then belongs to the next tick rather than to this one. Samples from further ahead are
   dropped. */
#ifndef ONBOARD_LATE_US
#define ONBOARD_LATE_US 1000U
#endif
/* Three times as long as an escape. A task that never hands back wants more. */
#ifndef ONBOARD_ACTING_US
#define ONBOARD_ACTING_US 1000000U
#endif
/* So long at its place: the integrators have settled. */
#ifndef ONBOARD_HOVER_US
#define ONBOARD_HOVER_US 1000000U
#endif
/* Along each axis from where the task begins, for the policy to begin: twice what it was trained from. */
#ifndef ONBOARD_PLACE_M
#define ONBOARD_PLACE_M 0.1F
#endif
/* From the heading with which it begins: twice what the escape was trained from. */
#ifndef ONBOARD_HEADING_RAD
#define ONBOARD_HEADING_RAD 0.4F
#endif
/* What the motors may ever get, whatever was computed: theirs is 18 V. */
#ifndef ONBOARD_LIMIT_V
#define ONBOARD_LIMIT_V 18.0F
#endif

typedef enum {
  ONBOARD_REFUSED,
  ONBOARD_WAITING,
  ONBOARD_HOVERING,
  ONBOARD_ACTING,
  ONBOARD_RETURNED,
  ONBOARD_OFF
} onboard_state;

/* What has happened since the start, as bits. */
#define ONBOARD_BAD_POLICY 1U     /* its self-test fails */
#define ONBOARD_BAD_CONTROLLER 2U /* its self-test fails */
#define ONBOARD_HANDED_BACK 4U    /* by the controller, as the task has it */
#define ONBOARD_UNREADY 8U        /* a manoeuvre was wished for and not begun */
#define ONBOARD_IMU_STALE 16U     /* from here on: faults, after which the policy does not act */
#define ONBOARD_IMU_LOST 32U
#define ONBOARD_POSE_STALE 64U
#define ONBOARD_POSE_LOST 128U
#define ONBOARD_LATE 256U             /* a tick */
#define ONBOARD_POLICY_REFUSED 512U   /* the observation had a NaN in it */
#define ONBOARD_POLICY_TOO_LONG 1024U /* it acted longer than ONBOARD_ACTING_US */
#define ONBOARD_CLAMPED 2048U         /* a voltage was above its limit, or NaN */
#define ONBOARD_NOT_FINITE 4096U      /* estimate or inputs: motors off */
#define ONBOARD_STOPPED 8192U         /* by wish */
#define ONBOARD_FAULTS (~15U)

typedef struct {
  uint32_t taken_us;
  flappy_vector gyro_rad_s, accel_m_s2; /* in B; specific force: at rest +g upward */
} onboard_imu_sample;

typedef struct {
  uint32_t taken_us;
  uint32_t valid; /* 0: the tracker did not see the vehicle */
  flappy_vector position_m;
  flappy_quaternion attitude;
} onboard_pose_sample; /* of the torso's origin in W, where the task has its goal */

typedef enum { ONBOARD_NOTHING, ONBOARD_HOVER, ONBOARD_MANOEUVRE, ONBOARD_STOP } onboard_wish;

typedef struct {
  flappy_controller controller;
  onboard_state state;
  uint32_t flags;
  onboard_wish wish;
  uint32_t tick_us, drive_us; /* when onboard_tick() and onboard_drive() are due next */
  uint32_t ticked_us;         /* when the last tick was */
  uint32_t imu_us, pose_us;   /* when the last good sample arrived, or should have */
  uint32_t settled_us;        /* for so long it has been at its place, up to ONBOARD_HOVER_US */
  uint32_t act_us;            /* when that began */
  onboard_pose_sample pose;   /* the last good one */
  int has_imu, has_pose;
} onboard;

/* Tests both headers; `now_us`: when the first tick is due. */
void onboard_begin(onboard *o, uint32_t now_us);

/* Samples as they arrive, oldest first, before the tick. What is no sample (NaN, beyond what a sensor shows, too old, from the
   future, a quaternion not of length 1) is dropped. */
void onboard_imu(onboard *o, uint32_t now_us, const onboard_imu_sample *sample);
void onboard_pose(onboard *o, uint32_t now_us, const onboard_pose_sample *sample);

/* Wishes of whoever flies, looked at in the next tick: the last one, but nothing undoes a stop. A manoeuvre begins only from a
   hover of ONBOARD_HOVER_US at its place and heading, without a fault; otherwise nothing changes. */
void onboard_hover(onboard *o);
void onboard_manoeuvre(onboard *o);
void onboard_stop(onboard *o);

/* Every control period. */
void onboard_tick(onboard *o, uint32_t now_us);

/* Every FLAPPY_CONTROLLER_DRIVE_US: what the motors get until the next one. */
void onboard_drive(onboard *o, uint32_t now_us, float *left_V, float *right_V);

/* Whether the motors may turn. */
int onboard_flies(const onboard *o);

/* `due_us` has come. */
int onboard_due(uint32_t due_us, uint32_t now_us);

#endif
