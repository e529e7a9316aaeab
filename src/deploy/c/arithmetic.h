#ifndef FLAPPY_ARITHMETIC
#define FLAPPY_ARITHMETIC 1

typedef union {
  float number;
  uint32_t bits;
} flappy_float;

/* a b + c, rounded once. */
#if defined __OPTIMIZE__ && (defined __FMA__ || (defined __ARM_FEATURE_FMA && defined __ARM_FP) || defined __riscv_flen)
static inline float flappy_fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
#else
/* The product is exact in double. The sum is rounded to odd there, so that rounding it to float is the only rounding. */
__attribute__((noinline, unused)) static float flappy_fma(float a, float b, float c) {
  union {
    double number;
    uint64_t bits;
  } sum;
  const double product = (double)a * (double)b;
  double of_c, lost;
  sum.number = product + (double)c;
  of_c = sum.number - product;
  lost = (product - (sum.number - of_c)) + ((double)c - of_c);
  if ((lost > 0 || lost < 0) && (sum.bits & 1U) == 0U) sum.bits += (lost > 0) == (sum.number > 0) ? 1U : ~(uint64_t)0;
  return (float)sum.number;
}
#endif

static inline int flappy_is_nan(float x) {
  flappy_float f;
  f.number = x;
  return (f.bits & 0x7fffffffU) > 0x7f800000U;
}

static inline float flappy_min(float a, float b) { return a < b ? a : b; }
static inline float flappy_max(float a, float b) { return a > b ? a : b; }
static inline float flappy_clamp(float x, float low, float high) { return flappy_min(flappy_max(x, low), high); }

static inline float flappy_abs(float x) {
  flappy_float f;
  f.number = x;
  f.bits &= 0x7fffffffU;
  return f.number;
}

/* The magnitude of one number with the sign of another. */
static inline float flappy_copysign(float magnitude, float sign) {
  flappy_float m, s;
  m.number = magnitude;
  s.number = sign;
  m.bits = (m.bits & 0x7fffffffU) | (s.bits & 0x80000000U);
  return m.number;
}

/* Correctly rounded; NaN below 0. */
static inline float flappy_sqrt(float x) {
  flappy_float f;
  int32_t exponent;
  uint64_t mantissa, rest, root = 0, bit = (uint64_t)1 << 48;
  f.number = x;
  if (!(x > 0.0F)) return x < 0.0F ? (x - x) / (x - x) : x;
  if (f.bits >= 0x7f800000U) return x;
  exponent = (int32_t)(f.bits >> 23);
  mantissa = f.bits & 0x007fffffU;
  if (exponent > 0) {
    mantissa |= 0x00800000U;
  } else {
    for (exponent = 1; mantissa < 0x00800000U; --exponent) mantissa <<= 1;
  }
  /* x = mantissa 2^(exponent - 150); two bits more, or one, make the exponent even */
  mantissa <<= exponent % 2 != 0 ? 1 : 2;
  exponent -= exponent % 2 != 0 ? 151 : 152;
  for (rest = mantissa << 24; bit != 0; bit >>= 2) {
    if (rest >= root + bit) {
      rest -= root + bit;
      root = (root >> 1) + bit;
    } else {
      root >>= 1;
    }
  }
  /* root has one bit too many; half-way between two numbers there is none whose square is x */
  f.bits = ((uint32_t)(exponent / 2 + 138) << 23) + (uint32_t)((root + 1) >> 1);
  return f.number;
}

static inline float flappy_tanh(float x) {
  /* from exp(-2 |x|) - 1 = 2^-k (1 - r + r^2 e) - 1 with a whole k and |r| < 0.35 */
  const float to_whole = 12582912.0F, y = flappy_min(87.0F, 2.0F * flappy_abs(x));
  const float k = flappy_fma(y, (float)1.4426950408889634, to_whole) - to_whole;
  const float r = flappy_fma(-k, (float)3.1946184945309417e-5, flappy_fma(-k, (float)0.693115234375, y));
  flappy_float half; /* 2^-k */
  float e = (float)0.0013950475325785419, below_one;
  e = flappy_fma(e, r, (float)-0.0083688890749988058);
  e = flappy_fma(e, r, (float)0.041666206047268758);
  e = flappy_fma(e, r, (float)-0.16666518843506661);
  e = flappy_fma(e, r, (float)0.50000000951192014);
  half.number = 12583039.0F - k;
  half.bits <<= 23;
  below_one = flappy_fma(half.number, flappy_fma(r * r, e, -r), half.number - 1.0F);
  return flappy_copysign(below_one / (2.0F + below_one), x);
}

/* CRC-32 (IEEE 802.3) of the four bytes of a number, lowest first; `crc`: of what came before, or 0. */
static inline uint32_t flappy_crc32_word(uint32_t crc, uint32_t word) {
  static const uint32_t of_nibble[16] = {0x00000000U, 0x1db71064U, 0x3b6e20c8U, 0x26d930acU, 0x76dc4190U, 0x6b6b51f4U,
                                         0x4db26158U, 0x5005713cU, 0xedb88320U, 0xf00f9344U, 0xd6d6a3e8U, 0xcb61b38cU,
                                         0x9b64c2b0U, 0x86d3d2d4U, 0xa00ae278U, 0xbdbdf21cU};
  uint32_t nibble;
  crc = ~crc;
  for (nibble = 0; nibble < 8; ++nibble) crc = crc >> 4 ^ of_nibble[(crc ^ word >> 4 * nibble) & 15U];
  return ~crc;
}

static inline uint32_t flappy_crc32(uint32_t crc, const float *numbers, uint32_t count) {
  uint32_t i;
  for (i = 0; i < count; ++i) {
    flappy_float f;
    f.number = numbers[i];
    crc = flappy_crc32_word(crc, f.bits);
  }
  return crc;
}

#endif
