#include "model/derive_jointed.hpp"

#include <cmath>
#include <numbers>

#include "model/derive.hpp"

namespace flappy::model {
namespace {

JointParameters<double> joint(const Jointed::Angle& a) {
  return {a.mean_rad,  a.stiffness_Nm_rad,      a.rest_rad,         a.damping_Nm_s, a.lower_rad,
          a.upper_rad, a.stop_stiffness_Nm_rad, a.stop_damping_Nm_s};
}

/// Constants of one side; y of a strip is `side` times its distance along the span.
JointedSide<double> jointed_side(const Side& s, const Jointed::Wing& w, double air_density, double side) {
  JointedSide<double> p{};
  p.shoulder_m = {s.shoulder_m.x, s.shoulder_m.y, s.shoulder_m.z};
  p.mass_kg = s.leading_edge.mass_kg + s.wing.mass_kg;
  p.edge_moment_kg_m = first_moment(s.leading_edge);
  p.edge_second_kg_m2 = second_moment(s.leading_edge);
  p.wing_moment_kg_m = first_moment(s.wing);
  p.wing_second_kg_m2 = second_moment(s.wing);
  for (std::size_t k = 0; k < w.angles.size(); ++k) p.joints[k] = joint(w.angles[k]);
  for (const Jointed::Strip& strip : w.strips) {
    const double c = strip.chord_m, below = c - strip.leading_edge_m, y = side * strip.span_m;
    const double z = strip.leading_edge_m - c / 2,
                 plate = w.added_mass * air_density * std::numbers::pi * strip.width_m;
    const double m = plate / 4 * c * c, turned = plate / 128 * c * c * c * c;
    p.added = p.added + Sym3<double>{m, m * z * z + turned, m * y * y, m * z, -m * z * y, -m * y};
    const double drag = air_density * w.rotational_damping_coefficient * strip.width_m, l = strip.leading_edge_m;
    const double below3 = std::abs(below * below * below), above3 = std::abs(l * l * l);
    p.rotational_damping_Nm_s2 += drag / 8 * (below * below3 + l * above3);
    p.pitching_force_N_s2 += drag / 6 * (below3 - above3);
    p.pitching_force_moment_Nm_s2 += y * drag / 6 * (below3 - above3);
  }
  if (w.strips.empty()) {
    p.rotational_damping_Nm_s2 = derive_planform(s.planform, air_density).rotational_damping_Nm_s2;
  }
  return p;
}

}  // namespace

JointedParameters<double> derive_jointed(const Vehicle& v) {
  const Jointed& j = *v.jointed;
  return {v.torso.mass_kg,
          first_moment(v.torso),
          second_moment(v.torso),
          j.frequency_Hz,
          jointed_side(v.left, j.left, v.air_density_kg_m3, 1),
          jointed_side(v.right, j.right, v.air_density_kg_m3, -1)};
}

std::vector<Strip<double>> derive_strips(const Jointed::Wing& w, double air_density, double side) {
  std::vector<Strip<double>> list;
  for (const Jointed::Strip& s : w.strips) {
    const double pressure = air_density / 2 * s.chord_m * s.width_m;
    const double circulation =
        w.rotational_lift * air_density * s.chord_m * s.chord_m * s.width_m * std::numbers::pi / 2;
    list.push_back({side * s.span_m, pressure, circulation, s.chord_m, s.leading_edge_m});
  }
  return list;
}

SeriesOfForce<double> derive_series(const Jointed::Wing& w) {
  // sin(k a) = sin a U_(k-1)(cos a), cos(k a) = T_k(cos a): Chebyshev's polynomials
  constexpr double kSecond[4][4] = {{1, 0, 0, 0}, {0, 2, 0, 0}, {-1, 0, 4, 0}, {0, -4, 0, 8}};
  constexpr double kFirst[4][5] = {{0, 1, 0, 0, 0}, {-1, 0, 2, 0, 0}, {0, -3, 0, 4, 0}, {1, 0, -8, 0, 8}};
  SeriesOfForce<double> series{};
  if (w.normal_sin.empty()) series.normal[0] = 3.45, series.normal[2] = 0.6;  // wing_aerodynamics.hpp
  for (std::size_t k = 0; k < w.normal_sin.size(); ++k)
    for (std::size_t i = 0; i < 4; ++i) series.normal[i] += w.normal_sin[k] * kSecond[k][i];
  for (std::size_t k = 0; k < w.tangential_cos.size(); ++k)
    for (std::size_t i = 0; i < 5; ++i) series.tangential[i] += w.tangential_cos[k] * kFirst[k][i];
  return series;
}

}  // namespace flappy::model
