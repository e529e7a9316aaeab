// Lanes<T, N>: N flappers in one register. Arithmetic is elementwise and the same to the bit on every instruction set:
// a product that meets a sum is one fused multiply-add *because the source says so* (operator* returns an unevaluated
// Product), never because a compiler chose to contract. The instruction set v2 has no fma instruction and emulates it.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "model/scalar.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T, int N>
struct Lanes;

/// a * b, not yet rounded: it becomes a fused multiply-add when a sum follows, a plain product otherwise.
template <class L>
struct Product {
  L a, b;
  FLAPPY_INLINE operator L() const { return L(a.raw * b.raw); }
};

template <class T, int N>
struct LaneMask {
  using Integer = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
  using Raw __attribute__((vector_size(N * sizeof(T)))) = Integer;
  Raw raw;  // all bits set or none, as a vector comparison gives them

  static FLAPPY_INLINE LaneMask of(Raw holds) { return {holds}; }
  static FLAPPY_INLINE LaneMask of(bool holds) requires(N == 1) { return {Raw{-Integer{holds}}}; }

  friend FLAPPY_INLINE LaneMask operator&(LaneMask a, LaneMask b) { return {a.raw & b.raw}; }
  friend FLAPPY_INLINE LaneMask operator|(LaneMask a, LaneMask b) { return {a.raw | b.raw}; }
  friend FLAPPY_INLINE LaneMask operator!(LaneMask a) { return {~a.raw}; }
  friend FLAPPY_INLINE bool any(LaneMask m) {
#if defined(__AVX512F__)
    if constexpr (sizeof(Raw) == 64) return _mm512_test_epi64_mask((__m512i)m.raw, (__m512i)m.raw) != 0;
#endif
    Integer bits{};
    for (int i = 0; i < N; ++i) bits |= m.raw[i];
    return bits != 0;
  }
};

template <class T, int N>
struct Lanes {
  using Raw __attribute__((vector_size(N * sizeof(T)), may_alias)) = T;  // a row of numbers may be read as lanes
  using Mask = LaneMask<T, N>;
  using P = Product<Lanes>;
  Raw raw;

  Lanes() = default;
  FLAPPY_INLINE explicit Lanes(Raw r) : raw(r) {}
  FLAPPY_INLINE Lanes(double value) : raw(static_cast<T>(value) - Raw{}) {}  // 0 + value would lose the sign of -0

  static FLAPPY_INLINE Lanes load(const T* from) {
    Lanes l;
    std::memcpy(&l.raw, from, sizeof l.raw);
    return l;
  }
  FLAPPY_INLINE void store(T* to) const { std::memcpy(to, &raw, sizeof raw); }

  friend FLAPPY_INLINE Lanes operator+(Lanes a, Lanes b) { return Lanes(a.raw + b.raw); }
  friend FLAPPY_INLINE Lanes operator-(Lanes a, Lanes b) { return Lanes(a.raw - b.raw); }
  friend FLAPPY_INLINE Lanes operator-(Lanes a) { return Lanes(-a.raw); }
  friend FLAPPY_INLINE Lanes operator/(Lanes a, Lanes b) { return Lanes(a.raw / b.raw); }
  friend FLAPPY_INLINE P operator*(Lanes a, Lanes b) { return {a, b}; }

  friend FLAPPY_INLINE P operator-(P p) { return {-p.a, p.b}; }
  friend FLAPPY_INLINE Lanes operator+(P p, Lanes c) { return fused(p.a, p.b, c); }
  friend FLAPPY_INLINE Lanes operator+(Lanes c, P p) { return fused(p.a, p.b, c); }
  friend FLAPPY_INLINE Lanes operator-(P p, Lanes c) { return fused(p.a, p.b, -c); }
  friend FLAPPY_INLINE Lanes operator-(Lanes c, P p) { return fused(-p.a, p.b, c); }
  friend FLAPPY_INLINE Lanes operator+(P p, P q) { return fused(p.a, p.b, q); }
  friend FLAPPY_INLINE Lanes operator-(P p, P q) { return fused(p.a, p.b, -Lanes(q)); }

  FLAPPY_INLINE Lanes& operator+=(Lanes b) { return *this = *this + b; }
  FLAPPY_INLINE Lanes& operator-=(Lanes b) { return *this = *this - b; }
  FLAPPY_INLINE Lanes& operator+=(P p) { return *this = *this + p; }
  FLAPPY_INLINE Lanes& operator-=(P p) { return *this = *this - p; }
  FLAPPY_INLINE Lanes& operator*=(Lanes b) { return *this = *this * b; }

  // A single lane is compared and selected as a number, because the range propagation of gcc 12 gets the masks of such
  // vectors wrong. With V and M vectors of one double and one long, at -O2 this gives 2 for V{-1}, not 1:
  //   double f(V x) { M m = x < 0; return (long)m != 0 ? ((m & (x < 1)) ? V{1} : V{2})[0] : 3; }
  FLAPPY_INLINE auto comparable() const {
    if constexpr (N == 1) return raw[0];
    else return raw;
  }
  friend FLAPPY_INLINE Mask operator<(Lanes a, Lanes b) { return Mask::of(a.comparable() < b.comparable()); }
  friend FLAPPY_INLINE Mask operator>(Lanes a, Lanes b) { return Mask::of(a.comparable() > b.comparable()); }
  friend FLAPPY_INLINE Mask operator<=(Lanes a, Lanes b) { return Mask::of(a.comparable() <= b.comparable()); }
  friend FLAPPY_INLINE Mask operator>=(Lanes a, Lanes b) { return Mask::of(a.comparable() >= b.comparable()); }
  friend FLAPPY_INLINE Mask operator==(Lanes a, Lanes b) { return Mask::of(a.comparable() == b.comparable()); }

  friend FLAPPY_INLINE Lanes where(Mask m, Lanes yes, Lanes no) { return select(m, yes, no); }
  friend FLAPPY_INLINE Lanes clamp(Lanes v, Lanes low, Lanes high) { return min(max(v, low), high); }

  // Intrinsics replace loops where the processor has them; all are correctly rounded, so the bits are the same.
  template <class Op>
  static FLAPPY_INLINE Lanes each(Op op) {
    Lanes r;
    for (int i = 0; i < N; ++i) r.raw[i] = op(i);
    return r;
  }
  friend FLAPPY_INLINE Lanes fused(Lanes a, Lanes b, Lanes c) {
#if defined(__AVX512F__)
    if constexpr (N * sizeof(T) == 64) {
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm512_fmadd_ps((__m512)a.raw, (__m512)b.raw, (__m512)c.raw));
      else return Lanes((Raw)_mm512_fmadd_pd((__m512d)a.raw, (__m512d)b.raw, (__m512d)c.raw));
    }
#endif
#if defined(__FMA__)
    if constexpr (N * sizeof(T) == 32) {
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm256_fmadd_ps((__m256)a.raw, (__m256)b.raw, (__m256)c.raw));
      else return Lanes((Raw)_mm256_fmadd_pd((__m256d)a.raw, (__m256d)b.raw, (__m256d)c.raw));
    }
#endif
#if defined(__ARM_NEON)
    if constexpr (N * sizeof(T) == 16) {
      if constexpr (sizeof(T) == 4)
        return Lanes((Raw)vfmaq_f32((float32x4_t)c.raw, (float32x4_t)a.raw, (float32x4_t)b.raw));
      else return Lanes((Raw)vfmaq_f64((float64x2_t)c.raw, (float64x2_t)a.raw, (float64x2_t)b.raw));
    }
#endif
    return fused_each(a, b, c);
  }
  static __attribute__((noinline)) Lanes fused_each(Lanes a, Lanes b, Lanes c) {
    if constexpr (sizeof(T) == 4) return each([&](int i) { return __builtin_fmaf(a.raw[i], b.raw[i], c.raw[i]); });
    else return each([&](int i) { return __builtin_fma(a.raw[i], b.raw[i], c.raw[i]); });
  }
  friend FLAPPY_INLINE Lanes sqrt(Lanes a) {
#if defined(__AVX512F__)
    if constexpr (N * sizeof(T) == 64) {
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm512_maskz_sqrt_ps(__mmask16(-1), (__m512)a.raw));
      else return Lanes((Raw)_mm512_maskz_sqrt_pd(__mmask8(-1), (__m512d)a.raw));
    }
#endif
#if defined(__AVX__)
    if constexpr (N * sizeof(T) == 32) {
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm256_sqrt_ps((__m256)a.raw));
      else return Lanes((Raw)_mm256_sqrt_pd((__m256d)a.raw));
    }
#endif
    if constexpr (N * sizeof(T) == 16) {
#if defined(__x86_64__)
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm_sqrt_ps((__m128)a.raw));
      else return Lanes((Raw)_mm_sqrt_pd((__m128d)a.raw));
#elif defined(__ARM_NEON)
      if constexpr (sizeof(T) == 4) return Lanes((Raw)vsqrtq_f32((float32x4_t)a.raw));
      else return Lanes((Raw)vsqrtq_f64((float64x2_t)a.raw));
#endif
    }
    if constexpr (sizeof(T) == 4) return each([&](int i) { return __builtin_sqrtf(a.raw[i]); });
    else return each([&](int i) { return __builtin_sqrt(a.raw[i]); });
  }
  // min and max as the x86 instructions define them: the second operand if the comparison is unordered.
  friend FLAPPY_INLINE Lanes min(Lanes a, Lanes b) {
#if defined(__AVX512F__)
    if constexpr (N * sizeof(T) == 64) {
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm512_maskz_min_ps(__mmask16(-1), (__m512)a.raw, (__m512)b.raw));
      else return Lanes((Raw)_mm512_maskz_min_pd(__mmask8(-1), (__m512d)a.raw, (__m512d)b.raw));
    }
#endif
    return select(a < b, a, b);
  }
  friend FLAPPY_INLINE Lanes max(Lanes a, Lanes b) {
#if defined(__AVX512F__)
    if constexpr (N * sizeof(T) == 64) {
      if constexpr (sizeof(T) == 4) return Lanes((Raw)_mm512_maskz_max_ps(__mmask16(-1), (__m512)a.raw, (__m512)b.raw));
      else return Lanes((Raw)_mm512_maskz_max_pd(__mmask8(-1), (__m512d)a.raw, (__m512d)b.raw));
    }
#endif
    return select(a > b, a, b);
  }
  friend FLAPPY_INLINE Lanes select(Mask m, Lanes yes, Lanes no) {
    if constexpr (N == 1) return m.raw[0] != 0 ? yes : no;
    else return Lanes(m.raw ? yes.raw : no.raw);
  }
  // Functions on bits of scalar.hpp, in every lane.
  using Unsigned = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  using Bits __attribute__((vector_size(N * sizeof(T)))) = Unsigned;
  static constexpr int kMantissaBits = sizeof(T) == 4 ? 23 : 52;
  static constexpr Unsigned kBias = sizeof(T) == 4 ? 127 : 1023;
  static constexpr Unsigned kMantissa = (Unsigned(1) << kMantissaBits) - 1;
  static constexpr Unsigned kAllButSign = ~Unsigned(0) >> 1;

  friend FLAPPY_INLINE Lanes half_to(Lanes k) {
    return Lanes((Raw)((Bits)(Lanes(kToWhole<T> + kBias) - k).raw << kMantissaBits));
  }
  friend FLAPPY_INLINE Lanes exponent(Lanes a) {
    constexpr T kWhole = T(kMantissa) + 1;  // the lowest bits of such numbers are whole numbers
    constexpr Unsigned kWholeBits = (kBias + kMantissaBits) << kMantissaBits;
    return Lanes((Raw)((Bits)a.raw >> kMantissaBits | kWholeBits)) - Lanes(kWhole + T(kBias));
  }
  friend FLAPPY_INLINE Lanes mantissa(Lanes a) {
    return Lanes((Raw)(((Bits)a.raw & kMantissa) | kBias << kMantissaBits));
  }
  friend FLAPPY_INLINE Lanes copysign(Lanes magnitude, Lanes sign) {
    return Lanes((Raw)(((Bits)magnitude.raw & kAllButSign) | ((Bits)sign.raw & ~kAllButSign)));
  }
  friend FLAPPY_INLINE Lanes abs(Lanes a) { return Lanes((Raw)((Bits)a.raw & kAllButSign)); }
};

template <class T, int N>
struct ElementOf<Lanes<T, N>> {
  using type = T;
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
