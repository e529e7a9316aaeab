/* Flight logic of a policy that is the guest of an autopilot, which estimates and flies before and after it. Independent of the
   hardware; times are arguments, in microseconds that may wrap.

     flappy_guest_begin    runs the self-tests: to REFUSED or READY
     READY                 the autopilot flies; to HOVERING by the pilot's wish, if the robot flies and its estimate is a number, and,
                           with in_world, is at the place where the task begins
     HOVERING              only with a feedback controller in flappy_controller.h: it learns its trim where the task begins
     ACTING                the policy acts; to RETURNED when it hands back, at a fault, or when the wish ends
     RETURNED              the autopilot flies; to READY when the wish has ended. After a fault it stays until the next start */
#ifndef FLAPPY_GUEST_H
#define FLAPPY_GUEST_H

#include "flappy_controller.h"
#include "flappy_policy.h"

#if FLAPPY_POLICY_CONTRACT != FLAPPY_CONTROLLER_CONTRACT
#error "flappy_policy.h and flappy_controller.h differ in task, periods, signals or their order: export both from one run"
#endif

/* Limits; each may be defined on the compiler's command line. */

/* How late a control period may begin: half of one. Beyond it, the policy's observation belongs to the next. */
#ifndef FLAPPY_GUEST_LATE_US
#define FLAPPY_GUEST_LATE_US (FLAPPY_CONTROLLER_CONTROL_US / 2U)
#endif
/* How long the policy may act: the task's time. */
#ifndef FLAPPY_GUEST_ACTING_US
#define FLAPPY_GUEST_ACTING_US FLAPPY_CONTROLLER_LASTS_US
#endif
/* How far from its path the robot may be. */
#ifndef FLAPPY_GUEST_AWAY_M
#define FLAPPY_GUEST_AWAY_M 1.5F
#endif
/* With in_world, how far from the task's beginning the policy may begin. */
#ifndef FLAPPY_GUEST_PLACE_M
#define FLAPPY_GUEST_PLACE_M 0.3F
#endif
/* How long the feedback controller, if any, hovers before the policy acts. */
#ifndef FLAPPY_GUEST_HOVER_US
#define FLAPPY_GUEST_HOVER_US 2000000U
#endif

typedef enum {
  FLAPPY_GUEST_REFUSED,
  FLAPPY_GUEST_READY,
  FLAPPY_GUEST_HOVERING,
  FLAPPY_GUEST_ACTING,
  FLAPPY_GUEST_RETURNED
} flappy_guest_state;

/* Events since the start, as bits. */
#define FLAPPY_GUEST_BAD_POLICY 1U     /* the policy's self-test failed */
#define FLAPPY_GUEST_BAD_CONTROLLER 2U /* the controller's self-test failed */
#define FLAPPY_GUEST_HANDED_BACK 4U    /* the task is done, or its time is over */
#define FLAPPY_GUEST_TAKEN_BACK 8U     /* the wish ended, or the autopilot no longer flies */
#define FLAPPY_GUEST_LATE 16U          /* this and the next two are faults */
#define FLAPPY_GUEST_AWAY 32U          /* too far from its path */
#define FLAPPY_GUEST_NOT_FINITE 64U    /* estimate, observation or inputs are no numbers */
#define FLAPPY_GUEST_FAULTS 112U
#define FLAPPY_GUEST_UNREADY 128U /* a wished manoeuvre did not begin: the robot is elsewhere */

typedef struct {
  flappy_controller controller;
  flappy_guest_state state;
  uint32_t flags, ticked_us, began_us;
  uint32_t inferences; /* of the policy */
  /* The task's frame is the autopilot's; else it begins where the robot is, with its heading. Wished before the begin, then held. */
  int wishes_world, in_world;
  flappy_vector from_m;   /* place of the task's beginning in the autopilot's frame */
  flappy_quaternion back; /* turns the autopilot's frame into the task's */
  flappy_policy_state policy;
  float observation[FLAPPY_POLICY_OBS], action[4];
  float inputs[FLAPPY_CONTROLLER_INPUTS];
} flappy_guest;

static inline void flappy_guest_begin(flappy_guest *g) {
  static const flappy_guest nothing;
  *g = nothing;
  if (flappy_policy_selftest() != 0) g->flags |= FLAPPY_GUEST_BAD_POLICY;
  if (flappy_controller_selftest() != 0) g->flags |= FLAPPY_GUEST_BAD_CONTROLLER;
  g->state = g->flags == 0 ? FLAPPY_GUEST_READY : FLAPPY_GUEST_REFUSED;
}

static inline int flappy_guest_flies(const flappy_guest *g) {
  return g->state == FLAPPY_GUEST_HOVERING || g->state == FLAPPY_GUEST_ACTING;
}

static inline flappy_quaternion flappy_guest_product(flappy_quaternion a, flappy_quaternion b) {
  flappy_quaternion q;
  q.w = flappy_difference2(a.w, b.w, a.x, b.x) - flappy_sum2(a.y, b.y, a.z, b.z);
  q.x = flappy_sum2(a.w, b.x, a.x, b.w) + flappy_difference2(a.y, b.z, a.z, b.y);
  q.y = flappy_sum2(a.w, b.y, a.y, b.w) + flappy_difference2(a.z, b.x, a.x, b.z);
  q.z = flappy_sum2(a.w, b.z, a.z, b.w) + flappy_difference2(a.x, b.y, a.y, b.x);
  return q;
}

/* The autopilot's estimate in the task's frame. */
static inline flappy_motion flappy_guest_seen(const flappy_guest *g, const flappy_motion *x) {
  flappy_motion seen = *x;
  if (!g->in_world) {
    const flappy_matrix R = flappy_rotation_matrix(g->back);
    seen.position_m = flappy_plus(flappy_rotate(&R, flappy_minus(x->position_m, g->from_m)), flappy_controller_k.start_position_m);
    seen.velocity_m_s = flappy_rotate(&R, x->velocity_m_s);
    seen.attitude = flappy_guest_product(g->back, x->attitude);
  }
  return seen;
}

/* The task begins at this place and heading. */
static inline void flappy_guest_place(flappy_guest *g, const flappy_motion *x) {
  const flappy_matrix R = flappy_rotation_matrix(x->attitude);
  const flappy_sin_cos is = flappy_heading(&R);
  const float half = 0.5F * (flappy_controller_k.start_heading_rad - flappy_atan2(is.sin, is.cos));
  const flappy_sin_cos turn = flappy_sin_cos_wide(half);
  g->from_m = x->position_m;
  g->back.w = turn.cos;
  g->back.x = g->back.y = 0.0F;
  g->back.z = turn.sin;
}

static inline void flappy_guest_return(flappy_guest *g, uint32_t why) {
  g->flags |= why;
  g->state = FLAPPY_GUEST_RETURNED;
}

static inline int flappy_guest_finite(const float *numbers, uint32_t count) {
  return flappy_all_finite(numbers, count * (uint32_t)sizeof(float));
}

static inline void flappy_guest_start(flappy_guest *g, uint32_t now_us, const flappy_motion *x) {
  flappy_motion seen;
  g->in_world = g->wishes_world;
  flappy_guest_place(g, x);
  seen = flappy_guest_seen(g, x);
  if (!flappy_plausible(flappy_minus(seen.position_m, flappy_controller_k.start_position_m), FLAPPY_GUEST_PLACE_M)) {
    flappy_guest_return(g, FLAPPY_GUEST_UNREADY);
    return;
  }
  flappy_controller_start(&g->controller, now_us, seen.position_m, seen.attitude);
  g->controller.estimate = seen;
  flappy_feedback_start(&g->controller.feedback, &seen);
  g->began_us = now_us;
  g->state = FLAPPY_GUEST_ACTING;
#if FLAPPY_CONTROLLER_FEEDBACK
  flappy_controller_hover(&g->controller);
  g->state = FLAPPY_GUEST_HOVERING;
#endif
}

/* The end of the control period before this one. */
static inline void flappy_guest_watch(flappy_guest *g, uint32_t now_us, const flappy_motion *x, int flies, int wished) {
  const flappy_motion seen = flappy_guest_seen(g, x);
  const int handed_back = flappy_controller_tick_with(&g->controller, now_us, &seen);
  uint32_t segment = g->controller.segment;
  const flappy_setpoint ref = flappy_controller_reference(&g->controller, &segment);
  if (!wished || !flies) {
    flappy_guest_return(g, FLAPPY_GUEST_TAKEN_BACK);
  } else if (now_us - g->ticked_us > FLAPPY_CONTROLLER_CONTROL_US + FLAPPY_GUEST_LATE_US) {
    flappy_guest_return(g, FLAPPY_GUEST_LATE);
  } else if (!flappy_plausible(flappy_minus(seen.position_m, ref.position_m), FLAPPY_GUEST_AWAY_M)) {
    flappy_guest_return(g, FLAPPY_GUEST_AWAY);
  } else if (g->state == FLAPPY_GUEST_ACTING && (handed_back || now_us - g->began_us >= FLAPPY_GUEST_ACTING_US)) {
    flappy_guest_return(g, FLAPPY_GUEST_HANDED_BACK);
  } else if (g->state == FLAPPY_GUEST_HOVERING && now_us - g->began_us >= FLAPPY_GUEST_HOVER_US) {
    flappy_controller_begin(&g->controller);
    flappy_policy_reset(&g->policy);
    g->began_us = now_us;
    g->state = FLAPPY_GUEST_ACTING;
  }
}

/* Every control period, with the autopilot's estimate at its beginning, whether the robot flies, and whether the pilot wishes the
   manoeuvre. Returns whether the inputs of the robot are g->inputs until the next call; else the autopilot sets them. */
static inline int flappy_guest_tick(flappy_guest *g, uint32_t now_us, const flappy_motion *x, int flies, int wished) {
  if (!flappy_guest_finite((const float *)x, (uint32_t)(sizeof *x / sizeof(float)))) {
    if (flappy_guest_flies(g)) flappy_guest_return(g, FLAPPY_GUEST_NOT_FINITE);
  } else if (flappy_guest_flies(g)) {
    flappy_guest_watch(g, now_us, x, flies, wished);
  } else if (g->state == FLAPPY_GUEST_RETURNED && !wished && (g->flags & FLAPPY_GUEST_FAULTS) == 0) {
    g->state = FLAPPY_GUEST_READY;
  } else if (g->state == FLAPPY_GUEST_READY && wished && flies) {
    flappy_guest_start(g, now_us, x);
  }
  g->ticked_us = now_us;
  if (!flappy_guest_flies(g)) return 0;
  if (flappy_controller_policy_due(&g->controller)) {
    flappy_controller_observe(&g->controller, g->observation);
    ++g->inferences;
    if (flappy_policy_step_with(&g->policy, g->observation, g->action) != 0) {
      flappy_guest_return(g, FLAPPY_GUEST_NOT_FINITE);
      return 0;
    }
    flappy_controller_act(&g->controller, g->action);
  }
  flappy_controller_steer(&g->controller);
  flappy_controller_inputs(&g->controller, g->inputs);
  if (!flappy_guest_finite(g->inputs, FLAPPY_CONTROLLER_INPUTS)) flappy_guest_return(g, FLAPPY_GUEST_NOT_FINITE);
  return flappy_guest_flies(g);
}

#endif
