#include "design/wing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/chord.hpp"

namespace flappy::design {
namespace {

/// Integral of f from `from` to `to`: Gauss's rule with five points, exact up to x^9.
double integral(double from, double to, const auto& f) {
  constexpr double kPoint[] = {0, 0.53846931010568309, 0.90617984593866399};
  constexpr double kWeight[] = {0.56888888888888889, 0.47862867049936647, 0.23692688505618908};
  const double middle = (from + to) / 2, half = (to - from) / 2;
  double sum = kWeight[0] * f(middle);
  for (int i : {1, 2}) sum += kWeight[i] * (f(middle - half * kPoint[i]) + f(middle + half * kPoint[i]));
  return half * sum;
}

double power(double x, int n) {
  double product = 1;
  for (int i = 0; i < n; ++i) product *= x;
  return product;
}

}  // namespace

double chord_at(const WingShape& s, double x) {
  const double a1 = (s.tip_chord - s.root_chord) / 2, a2 = (s.root_chord + s.tip_chord) / 2 - 1;
  return 1 + a1 * (2 * x - 1) + a2 * (6 * x * x - 6 * x + 1);
}

double least_chord(const WingShape& s) {
  const double a1 = (s.tip_chord - s.root_chord) / 2, a2 = (s.root_chord + s.tip_chord) / 2 - 1;
  const double ends = std::min(s.root_chord, s.tip_chord);
  if (!(a2 > 0)) return ends;
  return std::min(ends, chord_at(s, std::clamp(0.5 - a1 / (6 * a2), 0.0, 1.0)));
}

model::Planform planform_of(const WingShape& s, double rotational_damping_coefficient) {
  const auto moment = [&](int of_chord, int of_span) {
    return integral(0, 1, [&](double x) { return power(chord_at(s, x), of_chord) * power(x, of_span); });
  };
  return {s.length_m,
          s.mean_chord_m,
          moment(1, 3),
          moment(1, 2),
          moment(1, 1),
          moment(1, 0),
          moment(2, 2),
          moment(2, 1),
          moment(2, 0),
          moment(4, 0),
          rotational_damping_coefficient};
}

WingShape shape_of(const model::Planform& p) {
  const model::QuadraticChord chord(p);
  return {p.wing_length_m, p.mean_chord_m * p.r00, chord.at(-1) / p.r00, chord.at(1) / p.r00};
}

Mass panel_of(const WingShape& s, const Panel& panel, int side) {
  const double R = s.length_m, c = s.mean_chord_m, w = panel.sleeve_m / c;  // in mean chords, as chord_at
  const auto moment = [&](int of_chord, int of_span) {
    return integral(panel.hub_m / R, 1, [&](double x) {
      return (power(chord_at(s, x), of_chord) + power(w, of_chord)) * power(x, of_span);
    });
  };
  const double unit = panel.kg_m2 * R * c;
  Mass m;
  m.mass_kg = unit * moment(1, 0);
  m.first_kg_m = {0, side * unit * R * moment(1, 1), -unit * c / 2 * moment(2, 0)};
  m.second_kg_m2 = {
      0, unit * R * R * moment(1, 2), unit * c * c / 3 * moment(3, 0), 0, -side * unit * R * c / 2 * moment(2, 1), 0};
  return m;
}

Mass rod_of(double length_m, double diameter_m, double density_kg_m3, int side) {
  const double per_m = density_kg_m3 * std::numbers::pi / 4 * diameter_m * diameter_m, m = per_m * length_m;
  const double across = m * diameter_m * diameter_m / 16;
  return {m, {0, side * m * length_m / 2, 0}, {across, m * length_m * length_m / 3, across, 0, 0, 0}};
}

Mass wheel_of(double radius_m, double known_radius_m, double known_inertia_kg_m2) {
  const double m = known_inertia_kg_m2 / (known_radius_m * known_radius_m) * radius_m / known_radius_m;
  const double half = m * radius_m * radius_m / 2;
  return {m, {0, 0, 0}, {half, half, 0, 0, 0, 0}};
}

double stiff_diameter_m(double length_m, double known_length_m, double known_diameter_m) {
  return known_diameter_m * std::sqrt(length_m / known_length_m);
}

}  // namespace flappy::design
