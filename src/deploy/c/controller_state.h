/* What the controller is told; all members are float. */
typedef struct {
  flappy_feedback_constants feedback;
  float velocity_share, rate_share; /* of a new value in the low-passed one */
  float period_s, per_period_Hz, gravity_m_s2;
  /* estimator: spectral densities and variances, where the IMU sits in B, variances to begin with */
  float angle_noise_rad2_s, gyro_bias_drift_rad2_s3, velocity_noise_m2_s3, accel_bias_drift_m2_s5;
  float mocap_angle_rad2, mocap_position_m2;
  flappy_vector imu_position_m;
  float start_angle_rad2, start_gyro_bias_rad2_s2, start_position_m2, start_velocity_m2_s2, start_accel_bias_m2_s4;
  /* hand-back: all at once, or at a time */
  float hand_back_x_m, hand_back_distance_m, hand_back_speed_x_m_s, hand_back_speed_m_s, hand_back_heading_cos;
  float hand_back_tilt_cos, hand_back_body_rate_rad_s, hand_back_at_s;
  float start_added[4]; /* V, V, V, split cycle: the middle of what a policy may add */
  flappy_vector start_position_m; /* where the task begins, in W, and with what heading */
  float start_heading_rad;
  /* driver */
  float driver_amplitude_V, driver_difference_V, driver_bias_V, driver_split_cycle, left_limit_V, right_limit_V;
} flappy_controller_constants;

/* Numbers that the estimator and the controller remember; all members of the first three are float. */
typedef struct {
  flappy_quaternion attitude;
  flappy_vector position_m, velocity_m_s; /* of the point where the IMU sits, in W */
} flappy_pose;

/* Turn and velocity gained over some time, in B at its middle, as measured. */
typedef struct {
  flappy_vector rotation_rad, velocity_m_s;
} flappy_increment;

typedef struct {
  flappy_pose horizon, now;
  flappy_vector gyro_bias_rad_s, accel_bias_m_s2;
  float angle, angle_bias, gyro_bias; /* covariance: of each axis of the angle and the gyro's bias */
  float position, position_velocity, position_bias, velocity, velocity_bias, accel_bias; /* of position and so on */
  flappy_increment gathered;                  /* since the last control tick */
  flappy_vector body_rate_rad_s;              /* of the newest samples, bias taken out */
  float angle_innovation, position_innovation; /* of the last pose: r.r/S, three degrees of freedom each */
} flappy_estimator;

/* Motion of the torso origin. */
typedef struct {
  flappy_vector position_m;
  flappy_quaternion attitude;
  flappy_vector velocity_m_s;    /* in W */
  flappy_vector body_rate_rad_s; /* in B */
} flappy_motion;

typedef struct {
  float amplitude_V, difference_V, bias_V, split_cycle;
} flappy_wing_beat;

typedef struct {
  float sin, cos;
} flappy_sin_cos;

/* What the IMU gathered in one control period. Times are those of what was measured: the samples', less their lag. */
typedef struct {
  flappy_increment gained;
  uint32_t from_us, to_us;
} flappy_period;

typedef struct {
  flappy_vector position_m;
  flappy_quaternion attitude;
  float valid; /* 0 or 1 */
  uint32_t taken_us;
} flappy_frame;

typedef struct {
  flappy_estimator estimator;
  flappy_motion estimate; /* at now_us */
  flappy_feedback feedback;
#if FLAPPY_CONTROLLER_PAST > 0
  float past[FLAPPY_CONTROLLER_PAST]; /* what the policy saw at its last actions, newest first */
  int remembers;
#endif
  float added[4];         /* by the policy: V, V, V, split cycle */
  flappy_wing_beat input; /* before the driver clips it */
  uint32_t phase;         /* of the wing beat, 2^32 each */
  uint32_t tick, segment; /* control periods since the start; of the path */
  uint32_t now_us;        /* the last tick */
  int handed_back, hovering;
  flappy_vector hover_m; /* where, and facing whereto */
  flappy_sin_cos hover_heading;
  uint32_t horizon_us, present_us; /* of estimator.horizon and estimator.now */
  uint32_t last_imu_us, pushed_us; /* the last sample; the last one that is in the ring */
  flappy_increment newest;         /* in the ring, or already behind the horizon */
  uint32_t newest_us;              /* how long it took; 0: none yet */
  flappy_period ring[FLAPPY_CONTROLLER_RING]; /* beyond the horizon, oldest first, from `oldest` on */
  uint32_t oldest, in_ring;
  flappy_frame frames[FLAPPY_CONTROLLER_FRAMES]; /* until the IMU has covered their time, oldest first */
  uint32_t in_frames;
} flappy_controller;
