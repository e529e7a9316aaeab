#include "lab/blind/c/family_c.hpp"

#include "lab/blind/c/c_bench.hpp"
#include "lab/blind/c/c_contrast.hpp"
#include "lab/blind/c/c_effects.hpp"
#include "lab/blind/c/c_escape.hpp"
#include "lab/blind/c/c_flight.hpp"
#include "lab/blind/c/c_law.hpp"
#include "lab/blind/c/mechanism.hpp"

namespace flappy::blind::c {
namespace {

/// Only Family::fly() knows the bench.
Assignment off_the_bench(Assignment a) {
  a.bench = false;
  return a;
}

class FamilyC final : public Family {
 public:
  std::string name() const override { return "c"; }
  std::string engine() const override { return std::string("MuJoCo ") + mj_versionString(); }
  const std::vector<FamilyEffect>& effects() const override { return effect_table(); }
  bool has_bench() const override { return true; }
  FamilyFlight fly(const Assignment& a, std::size_t flight) const override {
    if (a.bench) return run_on_bench(a, flight);
    if (!a.proposed) return fly_one(a, flight).flight;
    return fly_one(a, flight, false, {.flight_s = a.proposed->lasts_s}).flight;
  }
  Contrast contrast(const Assignment& a, std::size_t flight, const std::string& effect,
                    double magnitude) const override {
    return contrast_of(off_the_bench(a), flight, effect, magnitude);
  }
  FamilyFlight fly_on_board(const Assignment& a, std::size_t number, const std::array<double, 4>& start, double lasts_s,
                            OnBoard& firmware) const override {
    return c::fly_on_board(off_the_bench(a), number, start, lasts_s, firmware);
  }
  FamilyEscape escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules) const override {
    return escape_of(off_the_bench(a), number, rules);
  }
  std::vector<double> law(const std::string& effect, std::span<const double> at) const override {
    return law_of(effect, at);
  }
};

}  // namespace

std::unique_ptr<Family> make_family_c() { return std::make_unique<FamilyC>(); }

}  // namespace flappy::blind::c
