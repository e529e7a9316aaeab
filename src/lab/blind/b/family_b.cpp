#include "lab/blind/b/family_b.hpp"

#include <cmath>
#include <string>

#include "io/files.hpp"
#include "lab/blind/b/b_bench.hpp"
#include "lab/blind/b/b_contrast.hpp"
#include "lab/blind/b/b_effects.hpp"
#include "lab/blind/b/b_escape.hpp"
#include "lab/blind/b/b_flight.hpp"
#include "lab/blind/b/b_laws.hpp"

namespace flappy::blind::b {
namespace {

void check_flight(std::size_t flight) {
  if (flight >= Family::kFlights)
    throw io::InputError("flight " + std::to_string(flight) + ": there is none of this number; accepted: 0, 1 and 2");
}

class FamilyB final : public Family {
 public:
  std::string name() const override { return "b"; }
  const std::vector<FamilyEffect>& effects() const override { return family_effects(); }
  bool has_bench() const override { return true; }
  FamilyFlight fly(const Assignment& a, std::size_t flight) const override {
    if (a.proposed) return fly_programme(a, flight, {kTrim_s, a.proposed->lasts_s});
    check_flight(flight);
    if (a.bench) return run_on_bench(a, flight);
    return fly_programme(a, flight);
  }
  Contrast contrast(const Assignment& a, std::size_t flight, const std::string& effect,
                    double magnitude) const override {
    check_flight(flight);
    return contrast_of(a, flight, effect, magnitude);
  }
  FamilyFlight fly_on_board(const Assignment& a, std::size_t number, const std::array<double, 4>& start, double lasts_s,
                            OnBoard& firmware) const override {
    Flight flown(a, make_case(a), draw_number(number, a.session), {start[0], start[1], start[2]}, start[3], 0);
    firmware.start(0, {start[0], start[1], start[2], std::cos(start[3] / 2), 0, 0, std::sin(start[3] / 2)});
    FamilyFlight out;
    while (out.how.empty() && flown.time_s() < lasts_s - 1e-9) out.how = flown.tick(firmware);
    out.crashed = !out.how.empty();
    out.log = flown.log(flown.time_s());
    return out;
  }
  std::vector<double> law(const std::string& effect, std::span<const double> at) const override {
    return law_of(effect, at);
  }
  FamilyEscape escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules) const override {
    return fly_escape(a, number, rules);
  }
};

}  // namespace

std::unique_ptr<Family> make_family_b() { return std::make_unique<FamilyB>(); }

}  // namespace flappy::blind::b
