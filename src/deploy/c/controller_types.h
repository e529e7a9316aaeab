#ifndef FLAPPY_CONTROLLER_TYPES
#define FLAPPY_CONTROLLER_TYPES 1

typedef struct {
  float x, y, z;
} flappy_vector;

typedef struct {
  float w, x, y, z; /* turns B into W, of length 1 */
} flappy_quaternion;

typedef struct {
  float p, i, d, integral_limit;
} flappy_gains;

/* What the controller is told; all members are float. */
typedef struct {
  /* cascaded PID */
  float position_xy_1_s, position_z_1_s, speed_limit_m_s, climb_limit_m_s;
  flappy_gains forward, left, up; /* m/s to m/s^2, m/s^2, V */
  float acceleration_limit_m_s2, roll_limit_rad, pitch_limit_rad, yaw_error_limit_rad;
  flappy_gains roll, pitch, yaw; /* rad to V, V, split cycle */
  float hover_V, lower_V, upper_V;
  float difference_limit_V, bias_limit_V, split_cycle_limit;
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

#endif
