#include "view/shape.hpp"

#include <algorithm>
#include <cmath>

#include "model/chord.hpp"

namespace flappy::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kStations = 16;
constexpr double kRoot = 0.05,
                 kTip = 0.94;  // shares of the span at which the membrane begins, and from which the tip is rounded
constexpr double kProfileWing_m = 0.07;  // wing length for which kProfile_m is drawn
constexpr double kProfile_m[][2] = {{-0.04, 0},      {-0.03, 0.004},  {-0.016, 0.009}, {0, 0.0105},     {0.012, 0.0085},
                                    {0.022, 0.0045}, {0.026, 0.0062}, {0.031, 0.0068}, {0.036, 0.0048}, {0.0375, 0}};

/// Rounds to a micrometre, to keep pages small.
double rounded(double x_m) { return std::round(x_m * 1e6) / 1e6; }

/// `strips`: those of an articulated wing; empty: use the planform.
Json wing_of(const model::Side& s, const std::vector<model::Jointed::Strip>& strips) {
  Json outline = Json::array();
  for (const model::Jointed::Strip& strip : strips) outline.push_back({rounded(strip.span_m), rounded(strip.chord_m)});
  for (int k = 0; k <= kStations && strips.empty(); ++k) {
    const double share = kRoot + (1 - kRoot) * k / kStations, beyond = std::max(0.0, (share - kTip) / (1 - kTip));
    const double chord_m = chord_at(s.planform, share) * s.planform.mean_chord_m * std::sqrt(1 - beyond * beyond);
    outline.push_back({rounded(share * s.planform.wing_length_m), rounded(chord_m)});
  }
  return {{"shoulder_m", {s.shoulder_m.x, s.shoulder_m.y, s.shoulder_m.z}}, {"outline_m", outline}};
}

Json ellipsoid_of(const model::RigidBody& torso) {
  const model::InertiaTensor& i = torso.inertia_kg_m2;
  const auto semi_axis = [&](double one, double other, double own) {
    return std::sqrt(std::max(0.0, 2.5 * (one + other - own) / torso.mass_kg));
  };
  return {semi_axis(i.yy, i.zz, i.xx), semi_axis(i.xx, i.zz, i.yy), semi_axis(i.xx, i.yy, i.zz)};
}

}  // namespace

double chord_at(const model::Planform& p, double share) {
  return std::max(0.0, model::QuadraticChord(p).at(2 * share - 1));
}

Json shape_of(const model::Vehicle& v) {
  if (v.beat_averaged) return {{"name", v.name}, {"mass_kg", v.torso.mass_kg}, {"body_m", ellipsoid_of(v.torso)}};
  double mass_kg = v.torso.mass_kg;
  for (const model::Side* s : {&v.left, &v.right}) mass_kg += s->leading_edge.mass_kg + s->wing.mass_kg;
  const std::vector<model::Jointed::Strip> none, &left = v.jointed ? v.jointed->left.strips : none,
                                                 &right = v.jointed ? v.jointed->right.strips : none;
  const double wing_m = left.empty() ? v.left.planform.wing_length_m : left.back().span_m + left.back().width_m / 2;
  Json profile = Json::array();
  for (const auto& [height_m, radius_m] : kProfile_m) {
    const double size = wing_m / kProfileWing_m;
    profile.push_back({rounded(height_m * size), rounded(radius_m * size)});
  }
  return {{"name", v.name},
          {"mass_kg", mass_kg},
          {"profile_m", profile},
          {"left", wing_of(v.left, left)},
          {"right", wing_of(v.right, right)}};
}

}  // namespace flappy::view
