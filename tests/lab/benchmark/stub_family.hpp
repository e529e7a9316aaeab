// A family of blind robots without robots, for tests that give it what they need.
#pragma once

#include "lab/blind/family.hpp"

namespace flappy::benchmark {

class StubFamily : public blind::Family {
 public:
  explicit StubFamily(std::string name, std::vector<blind::FamilyEffect> effects = {})
      : name_(std::move(name)), effects_(std::move(effects)) {}
  std::string name() const override { return name_; }
  const std::vector<blind::FamilyEffect>& effects() const override { return effects_; }
  blind::FamilyFlight fly(const blind::Assignment&, std::size_t) const override { return {}; }
  blind::Contrast contrast(const blind::Assignment&, std::size_t, const std::string&, double) const override {
    return {};
  }
  blind::FamilyFlight fly_on_board(const blind::Assignment&, std::size_t, const std::array<double, 4>&, double,
                                   blind::OnBoard&) const override {
    return {};
  }
  blind::FamilyEscape escape(const blind::Assignment&, std::size_t, const blind::EscapeAssignment&) const override {
    return {};
  }

 private:
  std::string name_;
  std::vector<blind::FamilyEffect> effects_;
};

}  // namespace flappy::benchmark
