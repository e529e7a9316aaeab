// Random numbers for many flappers at once: the words of random.hpp, drawn in lanes. A word w becomes the uniform
// number ((w >> 9) + 1/2) 2^-23, which float represents exactly, so flights in float and in double have the same noise.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <cstdint>
#include <cstring>

#include "model/math.hpp"
#include "sim/lanes.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

template <class L>
struct Uniforms4 {
  L u[4];  // in (0, 1)
};
template <class L>
struct Normals4 {
  L n[4];
};

/// 32-bit words, each in the low half of 64 bits, as 64-bit multiplication needs and returns them; high half undefined.
template <int N>
struct WideWords {
  using Raw __attribute__((vector_size(N * sizeof(std::uint64_t)))) = std::uint64_t;
  Raw raw;

  friend FLAPPY_INLINE WideWords operator^(WideWords a, WideWords b) { return {a.raw ^ b.raw}; }
  friend FLAPPY_INLINE WideWords high(WideWords a) { return {a.raw >> 32}; }
  static FLAPPY_INLINE WideWords all(std::uint64_t word) { return {Raw{} + word}; }
  friend FLAPPY_INLINE WideWords times(WideWords a, std::uint32_t m) {
#if defined(__AVX512F__)
    if constexpr (N == 8) return {(Raw)_mm512_maskz_mul_epu32(__mmask8(-1), (__m512i)a.raw, _mm512_set1_epi64(m))};
#endif
#if defined(__AVX2__)
    if constexpr (N == 4) return {(Raw)_mm256_mul_epu32((__m256i)a.raw, _mm256_set1_epi64x(m))};
#endif
#if defined(__x86_64__)
    if constexpr (N == 2) return {(Raw)_mm_mul_epu32((__m128i)a.raw, _mm_set1_epi64x(m))};
#endif
    return {(a.raw & 0xffffffffU) * m};
  }
};

/// Philox 4x32-10 (Salmon et al. 2011) for `parts` times N lanes; replaces the counters by the result.
template <int N, int parts>
FLAPPY_INLINE void philox(WideWords<N> (&c)[4][parts], std::uint64_t seed) {
  auto key0 = WideWords<N>::all(seed), key1 = WideWords<N>::all(seed >> 32);
#pragma GCC unroll 10
  for (int round = 0; round < 10; ++round) {
    for (int p = 0; p < parts; ++p) {
      const WideWords<N> a = times(c[0][p], 0xd2511f53U), b = times(c[2][p], 0xcd9e8d57U);
      c[0][p] = high(b) ^ c[1][p] ^ key0, c[1][p] = b;
      c[2][p] = high(a) ^ c[3][p] ^ key1, c[3][p] = a;
    }
    key0.raw += 0x9e3779b9U, key1.raw += 0xbb67ae85U;
  }
}

/// Four uniform numbers in (0, 1) for each lane; `flapper` and `episode` point to one number per lane.
template <class L>
FLAPPY_INLINE Uniforms4<L> uniforms(std::uint64_t seed, std::uint32_t stream, std::uint32_t index,
                                    const std::uint32_t* flapper, const std::uint32_t* episode) {
  using T = model::Element<L>;
  constexpr int N = sizeof(L) / sizeof(T);
  constexpr bool kSingle = sizeof(T) == 4;
  using Raw = typename L::Raw;
  using Bits = typename L::Bits;
  const L below_one(1 - 0x1p-24);
  Uniforms4<L> r;
  if constexpr (kSingle && N % 2 == 0) {
    // two neighbouring lanes share 64 bits: even lanes are in the low half, odd ones in the high half
    using Wide = WideWords<N / 2>;
    const auto load = [](const std::uint32_t* from) {
      Wide w;
      std::memcpy(&w.raw, from, sizeof w.raw);
      return w;
    };
    const Wide f = load(flapper), e = load(episode), i = Wide::all(index), s = Wide::all(stream);
    Wide c[4][2] = {{i, i}, {s, s}, {f, high(f)}, {e, high(e)}};
    philox(c, seed);
    for (int k = 0; k < 4; ++k) {
      const Bits w = (Bits)((c[k][0].raw & 0xffffffffU) | c[k][1].raw << 32);
      r.u[k] = L((Raw)(w >> 9 | 0x3f800000U)) - below_one;
    }
  } else {
    using Wide = WideWords<N>;
    using Narrow __attribute__((vector_size(N * sizeof(std::uint32_t)))) = std::uint32_t;
    const auto load = [](const std::uint32_t* from) {
      Narrow w;
      std::memcpy(&w, from, sizeof w);
      return Wide{__builtin_convertvector(w, typename Wide::Raw)};
    };
    Wide c[4][1] = {{Wide::all(index)}, {Wide::all(stream)}, {load(flapper)}, {load(episode)}};
    philox(c, seed);
    for (int k = 0; k < 4; ++k) {
      if constexpr (kSingle) {
        for (int i = 0; i < N; ++i)
          r.u[k].raw[i] = static_cast<T>(static_cast<std::uint32_t>(c[k][0].raw[i]) >> 9) * T(0x1p-23) + T(0x1p-24);
      } else {
        r.u[k] = L((Raw)((c[k][0].raw & 0xfffffe00U) << 20 | 0x3ff0000000000000U)) - below_one;
      }
    }
  }
  return r;
}

/// Four standard normals for each lane (Box and Muller 1958).
template <class L>
FLAPPY_INLINE Normals4<L> normals(std::uint64_t seed, std::uint32_t stream, std::uint32_t index,
                                  const std::uint32_t* flapper, const std::uint32_t* episode) {
  const Uniforms4<L> u = uniforms<L>(seed, stream, index, flapper, episode);
  Normals4<L> r;
  for (int k = 0; k < 4; k += 2) {
    const L radius = sqrt(L(L(-2) * model::log(u.u[k])));
    const model::SinCos<L> angle = model::sin_cos_pi(L(L(2) * u.u[k + 1] - L(1)));
    r.n[k] = radius * angle.cos;
    r.n[k + 1] = radius * angle.sin;
  }
  return r;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
