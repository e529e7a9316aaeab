/* Mathematics: the error of each function is a few units in the last place. */

typedef struct {
  flappy_vector x, y, z; /* rows */
} flappy_matrix;

/* For |x| <= 1.75. */
static inline flappy_sin_cos flappy_sin_cos_of(float x) {
  const float u = x * x;
  float s = (float)2.5746579492065598e-6, c = (float)-2.5731345378016664e-7;
  flappy_sin_cos r;
  s = flappy_fma(s, u, (float)-0.00019795201602044300);
  s = flappy_fma(s, u, (float)0.0083328690443799029);
  s = flappy_fma(s, u, (float)-0.16666652095508948);
  c = flappy_fma(c, u, (float)0.000024740930771132188);
  c = flappy_fma(c, u, (float)-0.00138879694924598958);
  c = flappy_fma(c, u, (float)0.041666605729632825);
  c = flappy_fma(c, u, (float)-0.49999998687300314);
  r.sin = flappy_fma(x * u, s, x);
  r.cos = flappy_fma(u, c, 1.0F);
  return r;
}

/* Of any angle up to 1e4 rad. */
static inline flappy_sin_cos flappy_sin_cos_wide(float x) {
  const float to_whole = 12582912.0F, q = flappy_fma(x, (float)0.63661977236758138, to_whole) - to_whole;
  const float r = flappy_fma(-q, (float)7.549789954891882e-08,
                             flappy_fma(-q, (float)0.0004837512969970703, flappy_fma(-q, 1.5703125F, x)));
  const flappy_sin_cos near = flappy_sin_cos_of(r);
  const float turn = flappy_fma(-4.0F, (q * 0.25F + to_whole) - to_whole, q); /* quarters, from -2 to 2 */
  const int swap = turn * turn <= 1.0F && turn * turn >= 1.0F;
  const float s = swap ? near.cos : near.sin, c = swap ? near.sin : near.cos;
  flappy_sin_cos wide;
  wide.sin = turn < 0.0F || turn > 1.0F ? -s : s;
  wide.cos = turn > 0.0F || turn < -1.0F ? -c : c;
  return wide;
}

/* Of pi x for |x| <= 1. */
static inline flappy_sin_cos flappy_sin_cos_pi(float x) {
  const float a = flappy_abs(x), b = flappy_min(a, 1.0F - a), c = 0.5F - b; /* to the x axis, to the y axis */
  const flappy_sin_cos r = flappy_sin_cos_of(flappy_min(b, c) * (float)3.1415926535897931);
  flappy_sin_cos turned;
  turned.sin = flappy_copysign(b > c ? r.cos : r.sin, x);
  turned.cos = flappy_copysign(b > c ? r.sin : r.cos, 0.5F - a);
  return turned;
}

static inline float flappy_cos_pi(float x) {
  return flappy_sin_cos_of((0.5F - flappy_abs(x)) * (float)3.1415926535897931).sin;
}

static inline float flappy_atan2(float y, float x) {
  const float a = flappy_abs(x), b = flappy_abs(y), low = flappy_min(b, a), high = flappy_max(a, b);
  const int upper = low > high * (float)0.41421356237309505; /* then by tan(angle - pi / 4), halved */
  const float over = upper ? 0.5F * (low - high) : low, under = upper ? flappy_fma(0.5F, low, 0.5F * high) : high;
  const float t = over / (!(under <= 0.0F) ? under : 1.0F), u = t * t;
  float series = (float)-0.06078217923641205, octant, quadrant;
  series = flappy_fma(series, u, (float)0.10593843460083008);
  series = flappy_fma(series, u, (float)-0.14243541657924652);
  series = flappy_fma(series, u, (float)0.19998472929000854);
  series = flappy_fma(series, u, (float)-0.33333316445350647);
  octant = (upper ? (float)0.78539816339744828 : 0.0F) + flappy_fma(t * u, series, t);
  quadrant = b > a ? (float)1.5707963267948966 - octant : octant;
  return flappy_copysign(x < 0.0F ? (float)3.1415926535897931 - quadrant : quadrant, y);
}

/* Outside [-1, 1] as at the nearer end. */
static inline float flappy_asin(float x) {
  const float a = flappy_min(1.0F, flappy_abs(x));
  const int upper = a > 0.5F; /* then by pi / 2 - 2 asin(sqrt((1 - a) / 2)) */
  const float u = upper ? 0.5F * (1.0F - a) : a * a, s = upper ? flappy_sqrt(u) : a;
  float series = (float)0.042165011167526245, small;
  series = flappy_fma(series, u, (float)0.02418058179318905);
  series = flappy_fma(series, u, (float)0.045470092445611954);
  series = flappy_fma(series, u, (float)0.07495300471782684);
  series = flappy_fma(series, u, (float)0.16666752099990845);
  small = flappy_fma(s * u, series, s);
  return flappy_copysign(upper ? flappy_fma(-2.0F, small, (float)1.5707963267948966) : small, x);
}

static inline flappy_vector flappy_vector_of(float x, float y, float z) {
  flappy_vector v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}
static inline flappy_vector flappy_plus(flappy_vector a, flappy_vector b) {
  return flappy_vector_of(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline flappy_vector flappy_minus(flappy_vector a, flappy_vector b) {
  return flappy_vector_of(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline flappy_vector flappy_times(float s, flappy_vector a) {
  return flappy_vector_of(s * a.x, s * a.y, s * a.z);
}
/* a + s b. */
static inline flappy_vector flappy_add_scaled(flappy_vector a, float s, flappy_vector b) {
  return flappy_vector_of(flappy_fma(s, b.x, a.x), flappy_fma(s, b.y, a.y), flappy_fma(s, b.z, a.z));
}
/* a b + c d and a b - c d. */
static inline float flappy_sum2(float a, float b, float c, float d) { return flappy_fma(a, b, c * d); }
static inline float flappy_difference2(float a, float b, float c, float d) { return flappy_fma(a, b, -(c * d)); }
static inline float flappy_dot(flappy_vector a, flappy_vector b) {
  return flappy_fma(a.x, b.x, flappy_sum2(a.y, b.y, a.z, b.z));
}
static inline flappy_vector flappy_cross(flappy_vector a, flappy_vector b) {
  return flappy_vector_of(flappy_difference2(a.y, b.z, a.z, b.y), flappy_difference2(a.z, b.x, a.x, b.z),
                          flappy_difference2(a.x, b.y, a.y, b.x));
}
static inline flappy_vector flappy_rotate(const flappy_matrix *m, flappy_vector v) {
  return flappy_vector_of(flappy_dot(m->x, v), flappy_dot(m->y, v), flappy_dot(m->z, v));
}
static inline flappy_vector flappy_rotate_back(const flappy_matrix *m, flappy_vector v) {
  return flappy_vector_of(flappy_fma(m->x.x, v.x, flappy_sum2(m->y.x, v.y, m->z.x, v.z)),
                          flappy_fma(m->x.y, v.x, flappy_sum2(m->y.y, v.y, m->z.y, v.z)),
                          flappy_fma(m->x.z, v.x, flappy_sum2(m->y.z, v.y, m->z.z, v.z)));
}

static inline flappy_matrix flappy_rotation_matrix(flappy_quaternion q) {
  const float x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const float wx = q.w * x2, wy = q.w * y2, wz = q.w * z2, xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
  flappy_matrix m;
  m.x = flappy_vector_of(1.0F - (yy + zz), flappy_fma(q.x, y2, -wz), flappy_fma(q.x, z2, wy));
  m.y = flappy_vector_of(flappy_fma(q.x, y2, wz), 1.0F - (xx + zz), flappy_fma(q.y, z2, -wx));
  m.z = flappy_vector_of(flappy_fma(q.x, z2, -wy), flappy_fma(q.y, z2, wx), 1.0F - (xx + yy));
  return m;
}

/* Attitude after turning by the small rotation vector 2 e in B: q (1, e), brought back to length 1 by a Newton step. */
static inline flappy_quaternion flappy_rotated(flappy_quaternion q, flappy_vector e) {
  flappy_quaternion r;
  float scale;
  r.w = q.w - flappy_fma(q.x, e.x, flappy_sum2(q.y, e.y, q.z, e.z));
  r.x = q.x + flappy_fma(q.w, e.x, flappy_difference2(q.y, e.z, q.z, e.y));
  r.y = q.y + flappy_fma(q.w, e.y, flappy_difference2(q.z, e.x, q.x, e.z));
  r.z = q.z + flappy_fma(q.w, e.z, flappy_difference2(q.x, e.y, q.y, e.x));
  scale = flappy_fma(-0.5F, flappy_fma(r.w, r.w, flappy_fma(r.x, r.x, flappy_sum2(r.y, r.y, r.z, r.z))), 1.5F);
  r.w *= scale;
  r.x *= scale;
  r.y *= scale;
  r.z *= scale;
  return r;
}

/* Rotation vector from attitude a to a near one, b: 2 asin(n)/n e for conj(a) b = (w, e) of either sign, |e| = n. */
static inline flappy_vector flappy_rotation_between(flappy_quaternion a, flappy_quaternion b) {
  const float w = flappy_fma(a.w, b.w, flappy_fma(a.x, b.x, flappy_sum2(a.y, b.y, a.z, b.z)));
  const flappy_vector e = flappy_vector_of(
      flappy_fma(a.w, b.x, -flappy_fma(a.x, b.w, flappy_difference2(a.y, b.z, a.z, b.y))),
      flappy_fma(a.w, b.y, -flappy_fma(a.y, b.w, flappy_difference2(a.z, b.x, a.x, b.z))),
      flappy_fma(a.w, b.z, -flappy_fma(a.z, b.w, flappy_difference2(a.x, b.y, a.y, b.x))));
  const float scale = flappy_fma((float)(1.0 / 3), flappy_dot(e, e), 2.0F);
  return flappy_times(w < 0.0F ? -scale : scale, e);
}

/* Where the nose points: cosine and sine of the yaw angle. */
static inline flappy_sin_cos flappy_heading(const flappy_matrix *m) {
  const float c = m->x.x, s = m->y.x;
  const float scale = 1.0F / flappy_sqrt(flappy_max(flappy_sum2(c, c, s, s), (float)1e-12));
  flappy_sin_cos heading;
  heading.sin = s * scale;
  heading.cos = c * scale;
  return heading;
}
