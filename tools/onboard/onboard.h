/* Flight logic around the two exported headers: from sensor samples to motor voltages, with safety checks. It is independent of the
   hardware and has no clock: all times are arguments, in microseconds that may wrap.

     onboard_begin     runs the self-tests: to REFUSED or WAITING
     WAITING           motors off; to HOVERING by the wish to hover, if samples are fresh
     HOVERING          feedback control at the start of the task, which learns the trim; to ACTING by the wish for the manoeuvre
     ACTING            the policy acts; to RETURNED when the controller hands back, or at a fault
     RETURNED          feedback control at the goal, or at the place of the fault; the policy never acts again
     OFF               motors off for good: IMU lost, motion capture lost for too long, estimate not finite, or by wish */
#ifndef ONBOARD
#define ONBOARD 1

#include "flappy_controller.h"
#include "flappy_policy.h"

/* Format and control period that this loop requires of the headers. */
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
#if !FLAPPY_CONTROLLER_FEEDBACK
#error "the run has no controller, which this loop flies when the policy does not act"
#endif
#if FLAPPY_CONTROLLER_INPUTS > 0
#error "the vehicle has inputs in place of two motors: flappy-export --for crazyflie writes its firmware"
#endif

/* Limits; each may be defined on the compiler's command line. The age of a sample counts from the time at which it would have arrived
   with the latency of the training, but not from later than its real arrival. */

/* Five control periods: an IMU of 500 Hz has then missed five samples, which is more than jitter. In training the policy never flew on
   an estimate that was extrapolated further. */
#ifndef ONBOARD_IMU_STALE_US
#define ONBOARD_IMU_STALE_US 10000U
#endif
/* A flapper is unstable: in the simulator it leans by 0.1 to 0.4 rad at this age of the last sample, and has turned over after twice
   the time. */
#ifndef ONBOARD_IMU_LOST_US
#define ONBOARD_IMU_LOST_US 50000U
#endif
/* Seven frames at 150 Hz. The estimate is still good then, but the policy was trained on a better one. */
#ifndef ONBOARD_POSE_STALE_US
#define ONBOARD_POSE_STALE_US 50000U
#endif
/* In the simulator dead reckoning drifts by a few centimetres in this time, and by a metre in four times as long. */
#ifndef ONBOARD_POSE_LOST_US
#define ONBOARD_POSE_LOST_US 1500000U
#endif
/* Half a period: beyond it, the policy's observation belongs to the next tick rather than to this one. Samples whose stamps are further
   in the future are dropped. */
#ifndef ONBOARD_LATE_US
#define ONBOARD_LATE_US 1000U
#endif
/* Longest action of the policy: three times as long as an escape. A task that never hands back needs more. */
#ifndef ONBOARD_ACTING_US
#define ONBOARD_ACTING_US 1000000U
#endif
/* Time of hover at its place after which the integrators have settled. */
#ifndef ONBOARD_HOVER_US
#define ONBOARD_HOVER_US 1000000U
#endif
/* Largest distance along each axis from the start of the task at which the policy may begin: twice the range of its training. */
#ifndef ONBOARD_PLACE_M
#define ONBOARD_PLACE_M 0.1F
#endif
/* Largest error of the heading at which the policy may begin: twice the range of the escape's training. */
#ifndef ONBOARD_HEADING_RAD
#define ONBOARD_HEADING_RAD 0.4F
#endif
/* Limit of the motor voltages, whatever was computed; the motors are rated for 18 V. */
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

/* Events since the start, as bits. */
#define ONBOARD_BAD_POLICY 1U     /* the policy's self-test failed */
#define ONBOARD_BAD_CONTROLLER 2U /* the controller's self-test failed */
#define ONBOARD_HANDED_BACK 4U    /* by the controller, at the task's condition */
#define ONBOARD_UNREADY 8U        /* a wished manoeuvre did not begin */
#define ONBOARD_IMU_STALE 16U     /* this and all that follow are faults, after which the policy does not act */
#define ONBOARD_IMU_LOST 32U
#define ONBOARD_POSE_STALE 64U
#define ONBOARD_POSE_LOST 128U
#define ONBOARD_LATE 256U             /* a tick was late by more than ONBOARD_LATE_US */
#define ONBOARD_POLICY_REFUSED 512U   /* the observation contained a NaN */
#define ONBOARD_POLICY_TOO_LONG 1024U /* it acted longer than ONBOARD_ACTING_US */
#define ONBOARD_CLAMPED 2048U         /* a voltage was above its limit, or NaN */
#define ONBOARD_NOT_FINITE 4096U      /* estimate or inputs are not finite: motors off */
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
} onboard_pose_sample; /* pose of the torso's origin in W, the frame of the task's goal */

typedef enum { ONBOARD_NOTHING, ONBOARD_HOVER, ONBOARD_MANOEUVRE, ONBOARD_STOP } onboard_wish;

typedef struct {
  flappy_controller controller;
  onboard_state state;
  uint32_t flags;
  onboard_wish wish;
  uint32_t tick_us, drive_us; /* times at which onboard_tick() and onboard_drive() are due next */
  uint32_t ticked_us;         /* time of the last tick */
  uint32_t imu_us, pose_us;   /* time at which the last good sample arrived, or should have */
  uint32_t settled_us;        /* duration of the hover at its place, up to ONBOARD_HOVER_US */
  uint32_t act_us;            /* time at which the policy began to act */
  onboard_pose_sample pose;   /* the last good sample */
  int has_imu, has_pose;
  uint32_t inferences; /* of the policy; what it got and gave at the last one */
  flappy_policy_state policy;
  float observation[FLAPPY_POLICY_OBS], action[FLAPPY_POLICY_ACT];
} onboard;

/* Runs the self-tests of both headers. `now_us`: time at which the first tick is due. */
void onboard_begin(onboard *o, uint32_t now_us);

/* Pass samples as they arrive, oldest first, before the tick. Invalid samples are dropped: NaN, outside a sensor's range, too old, from
   the future, a quaternion that has not length 1. */
void onboard_imu(onboard *o, uint32_t now_us, const onboard_imu_sample *sample);
void onboard_pose(onboard *o, uint32_t now_us, const onboard_pose_sample *sample);

/* The pilot's wishes. The next tick obeys the last one; nothing undoes a stop. A manoeuvre begins only after a hover of ONBOARD_HOVER_US
   at its place and heading without a fault; otherwise it sets ONBOARD_UNREADY. */
void onboard_hover(onboard *o);
void onboard_manoeuvre(onboard *o);
void onboard_stop(onboard *o);

/* Call every control period. */
void onboard_tick(onboard *o, uint32_t now_us);

/* Call every FLAPPY_CONTROLLER_DRIVE_US; returns the motors' voltages until the next call. */
void onboard_drive(onboard *o, uint32_t now_us, float *left_V, float *right_V);

/* Whether the motors may turn. */
int onboard_flies(const onboard *o);

/* Whether the time `due_us` has come. */
int onboard_due(uint32_t due_us, uint32_t now_us);

#endif
