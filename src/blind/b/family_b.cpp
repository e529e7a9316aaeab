#include "blind/b/family_b.hpp"

#include <string>

#include "blind/b/contrast.hpp"
#include "blind/b/effects.hpp"
#include "blind/b/escape.hpp"
#include "blind/b/flight.hpp"
#include "io/files.hpp"

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
  FamilyFlight fly(const Assignment& a, std::size_t flight) const override {
    if (a.proposed) return fly_programme(a, flight, {kTrim_s, a.proposed->lasts_s});
    check_flight(flight);
    return fly_programme(a, flight);
  }
  Contrast contrast(const Assignment& a, std::size_t flight, const std::string& effect,
                    double magnitude) const override {
    check_flight(flight);
    return contrast_of(a, flight, effect, magnitude);
  }
  FamilyEscape escape(const Assignment& a, std::size_t number, const EscapeAssignment& rules) const override {
    return fly_escape(a, number, rules);
  }
};

}  // namespace

std::unique_ptr<Family> make_family_b() { return std::make_unique<FamilyB>(); }

}  // namespace flappy::blind::b
