// Counts the arithmetic of a step by running it with a number type that counts operations.
#define FLAPPY_ISA counted
#include "roof.hpp"
#include "sim/physics_step.hpp"

namespace flappy::model {
inline namespace counted {

static bench::Operations count;

struct Mask {
  bool raw;
  friend Mask operator&(Mask a, Mask b) { return {a.raw && b.raw}; }
  friend Mask operator|(Mask a, Mask b) { return {a.raw || b.raw}; }
  friend Mask operator!(Mask a) { return {!a.raw}; }
  friend bool any(Mask a) { return a.raw; }
};

struct Counted {
  using Mask = counted::Mask;
  double v;
  Counted() = default;
  Counted(double value) : v(value) {}
};
using C = Counted;

/// A product; as in lanes, a product and a sum become one fused multiply-add.
struct P {
  double a, b;
  operator C() const { return ++count.multiply, C(a * b); }
};

static C fused(P p, double c) { return ++count.fused, C(p.a * p.b + c); }
static C other(double value) { return ++count.other, C(value); }

static C operator+(C a, C b) { return ++count.add, C(a.v + b.v); }
static C operator-(C a, C b) { return ++count.add, C(a.v - b.v); }
static C operator-(C a) { return other(-a.v); }
static C operator/(C a, C b) { return ++count.divide, C(a.v / b.v); }
static P operator*(C a, C b) { return {a.v, b.v}; }
static P operator-(P p) { return ++count.other, P{-p.a, p.b}; }
static C operator+(P p, C c) { return fused(p, c.v); }
static C operator+(C c, P p) { return fused(p, c.v); }
static C operator-(P p, C c) { return fused(p, -c.v); }
static C operator-(C c, P p) { return fused({-p.a, p.b}, c.v); }
static C operator+(P p, P q) { return fused(p, C(q).v); }
static C operator-(P p, P q) { return fused(p, -C(q).v); }
static C& operator+=(C& a, C b) { return a = a + b; }
static C& operator-=(C& a, P b) { return a = a - b; }
static Mask operator<(C a, C b) { return ++count.other, Mask{a.v < b.v}; }
static Mask operator>(C a, C b) { return ++count.other, Mask{a.v > b.v}; }
static Mask operator==(C a, C b) { return ++count.other, Mask{a.v == b.v}; }
static C where(Mask m, C yes, C no) { return other(m.raw ? yes.v : no.v); }
static C min(C a, C b) { return other(a.v < b.v ? a.v : b.v); }
static C max(C a, C b) { return other(a.v > b.v ? a.v : b.v); }
static C clamp(C v, C low, C high) { return min(max(v, low), high); }
static C abs(C a) { return other(a.v < 0 ? -a.v : a.v); }
static C nearest(C a) { return other(model::nearest(a.v)); }
static C exponent(C a) { return other(model::exponent(a.v)); }
static C half_to(C a) { return other(model::half_to(a.v)); }
static C sqrt(C a) { return ++count.root, C(__builtin_sqrt(a.v)); }

template <>
struct ElementOf<Counted> {
  using type = float;
};

}  // namespace counted
}  // namespace flappy::model

namespace flappy::bench {

Operations count_operations() {
  using model::Counted;
  // the values do not matter as long as no stroke reaches its stop, which is the only branch of the step
  model::Parameters<Counted> p;
  Counted* row = reinterpret_cast<Counted*>(&p);
  for (std::size_t i = 0; i < sizeof p / sizeof *row; ++i) row[i] = 1e-3 * static_cast<double>(i + 1);
  for (model::SideParameters<Counted>* side : {&p.left, &p.right})
    side->stroke_lower_rad = -1e9, side->stroke_upper_rad = 1e9;
  model::State<Counted> x{};
  x.attitude.w = 1;
  model::Vec3<Counted> com{0, 0, 0};
  model::count = {};
  sim::physics_step<false>(p, x, sim::Voltages<Counted>{}, com, sim::ActiveEffects<Counted>{},
                           sim::Constants<Counted>{250e-6, 125e-6, 4e3, 9.81, 0, 0});
  return model::count;
}

}  // namespace flappy::bench
