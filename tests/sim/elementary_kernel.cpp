// The elementary functions and the noise over a sweep of arguments, for the test that compares instruction sets.
// Compiled once for each of them and once more without optimisation.
#include <cstdint>
#include <cstring>

#include "model/math.hpp"
#include "sim/lanes.hpp"
#include "sim/noise.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

std::uint64_t elementary_bits_float();
std::uint64_t elementary_bits_double();

namespace {

using namespace model;

#if defined(FLAPPY_SCALAR)
constexpr int kRegister = 0;
#elif defined(__AVX512F__)
constexpr int kRegister = 64;
#elif defined(__AVX2__)
constexpr int kRegister = 32;
#else
constexpr int kRegister = 16;
#endif
template <class T>
constexpr int kWidth = kRegister == 0 ? 1 : kRegister / sizeof(T);

constexpr int kPoints = 16, kBlocks = 256;  // of points, which any width divides

/// FNV-1a over the bits of numbers in the order of points, whatever the width.
struct Hash {
  std::uint64_t value = 0xcbf29ce484222325U;
  template <class T>
  void add(const T (&row)[kPoints]) {
    for (int i = 0; i < kPoints; ++i) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &row[i], sizeof(T));
      value = (value ^ bits) * 0x100000001b3U;
      value ^= value >> 29;
    }
  }
};

template <class T>
struct Sweep {
  using L = Lanes<T, kWidth<T>>;
  Hash hash;
  T x[kPoints], y[kPoints];

  template <class F>
  void over(double from, double to, F f) {
    for (int block = 0; block < kBlocks; ++block) {
      for (int i = 0; i < kPoints; ++i) {
        const int n = block * kPoints + i;
        x[i] = static_cast<T>(from + (to - from) * n / (kBlocks * kPoints - 1));
        y[i] = static_cast<T>(from + (to - from) * (n * 1021 % 4096) / 4095);
      }
      T out[2][kPoints] = {};
      for (int i = 0; i < kPoints; i += kWidth<T>) f(L::load(x + i), L::load(y + i), out[0] + i, out[1] + i);
      hash.add(out[0]);
      hash.add(out[1]);
    }
  }
  void noise() {
    for (std::uint32_t block = 0; block < kBlocks; ++block) {
      std::uint32_t flapper[kPoints], episode[kPoints];
      for (int i = 0; i < kPoints; ++i) flapper[i] = block * kPoints + i, episode[i] = block * 0x9e3779b9U * i;
      T n[4][kPoints], u[4][kPoints];
      for (int i = 0; i < kPoints; i += kWidth<T>) {
        const auto normal = normals<L>(0x0123456789abcdefU * block, 2, ~block, flapper + i, episode + i);
        const auto uniform = uniforms<L>(0xfedcba9876543210U * block, ~0U, block, flapper + i, episode + i);
        for (int k = 0; k < 4; ++k) normal.n[k].store(n[k] + i), uniform.u[k].store(u[k] + i);
      }
      for (int k = 0; k < 4; ++k) hash.add(n[k]), hash.add(u[k]);
    }
  }
};

template <class T>
std::uint64_t elementary_bits() {
  using L = typename Sweep<T>::L;
  Sweep<T> sweep;
  const auto both = [](const SinCos<L>& r, T* a, T* b) { r.sin.store(a), r.cos.store(b); };
  sweep.over(-100, 100, [](L x, L y, T* a, T* b) { exp(x).store(a), exp_negative(abs(y)).store(b); });
  sweep.over(-800, 800, [](L x, L y, T* a, T* b) { exp(x).store(a), exp_negative(abs(y)).store(b); });
  sweep.over(-12, 12, [](L x, L y, T* a, T* b) { tanh(x).store(a), tanh(L(y * L(1e-3))).store(b); });
  sweep.over(-3, 3, [](L x, L y, T* a, T* b) { atan2(y, x).store(a), atan2(L(y * L(1e-3)), x).store(b); });
  sweep.over(-1.1, 1.1, [](L x, L y, T* a, T* b) { asin(x).store(a), asin(L(y * L(1e-3))).store(b); });
  sweep.over(1e-7, 2, [](L x, L y, T* a, T* b) { log(x).store(a), log(L(y * L(1e20))).store(b); });
  sweep.over(-1, 1, [&](L x, L, T* a, T* b) { both(sin_cos_pi(x), a, b); });
  sweep.over(-1.75, 1.75, [&](L x, L, T* a, T* b) { both(sin_cos(x), a, b); });
  sweep.over(-1e4, 1e4, [&](L x, L, T* a, T* b) { both(sin_cos_wide(x), a, b); });
  sweep.over(-1e4, 1e4, [&](L x, L y, T* a, T* b) { nearest(x).store(a), copysign(x, y).store(b); });
  sweep.over(1e-3, 1e30, [&](L x, L y, T* a, T* b) { mantissa(x).store(a), exponent(y).store(b); });
  sweep.noise();
  return sweep.hash.value;
}

}  // namespace

std::uint64_t elementary_bits_float() { return elementary_bits<float>(); }
std::uint64_t elementary_bits_double() { return elementary_bits<double>(); }

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
