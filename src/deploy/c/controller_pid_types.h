/* The feedback controller, a cascaded PID: what it is told and what it remembers; all members are float. */
typedef struct {
  float p, i, d, integral_limit;
} flappy_gains;

typedef struct {
  float position_xy_1_s, position_z_1_s, speed_limit_m_s, climb_limit_m_s;
  flappy_gains forward, left, up; /* m/s to m/s^2, m/s^2, V */
  float acceleration_limit_m_s2, roll_limit_rad, pitch_limit_rad, yaw_error_limit_rad;
  flappy_gains roll, pitch, yaw; /* rad to V, V, split cycle */
  float hover_V, lower_V, upper_V;
  float difference_limit_V, bias_limit_V, split_cycle_limit;
  float notch_hz, notch_near, notch_far, notch_back; /* 0 Hz: no notch */
} flappy_feedback_constants;

typedef struct {
  float integral_x, integral_y, integral_z;          /* m/s^2, m/s^2 in W; V */
  float integral_roll, integral_pitch, integral_yaw; /* V, V, split cycle */
  flappy_vector velocity_m_s, body_rate_rad_s;       /* low-passed */
  float notch_next, notch_after;                     /* memory of the notch */
} flappy_feedback;
