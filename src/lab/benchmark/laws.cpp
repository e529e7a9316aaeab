#include "lab/benchmark/laws.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "flappy/vehicle_file.hpp"
#include "io/installation.hpp"
#include "io/text.hpp"
#include "lab/benchmark/families.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

using Points = std::vector<std::vector<double>>;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d three(const std::vector<double>& x, std::size_t from = 0) { return {x[from], x[from + 1], x[from + 2]}; }

/// Fits a linear law to displacements, by least squares over the grid, and returns root mean squares of its parts: what it turns, what it
/// skews, what it stretches, its constant, and what is not linear.
Points parts_of_linear(const Points& at, const Points& outcomes) {
  const auto n = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd x(n, 4), y(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    x.row(i) << three(at[static_cast<std::size_t>(i)]).transpose(), 1;
    y.row(i) = three(outcomes[static_cast<std::size_t>(i)]).transpose();
  }
  const Eigen::MatrixXd fit = x.colPivHouseholderQr().solve(y);
  const Matrix3d m = fit.topRows(3).transpose();
  const double reach = std::sqrt(x.leftCols(3).squaredNorm() / static_cast<double>(n));
  const Matrix3d turns = (m - m.transpose()) / 2;
  Matrix3d skews = (m + m.transpose()) / 2;
  const Vector3d stretches = skews.diagonal();
  skews.diagonal().setZero();
  return {{reach * turns.norm()},
          {reach * skews.norm()},
          {reach * stretches.norm()},
          {fit.row(3).norm()},
          {(y - x * fit).norm() / std::sqrt(static_cast<double>(n))}};
}

/// Splits the changes of place and of attitude, in the axes of the body, into their means and what varies with the attitude; returns the
/// norms.
Points parts_of_marker(const Points& at, const Points& outcomes) {
  Eigen::MatrixXd seen(6, static_cast<Eigen::Index>(at.size()));
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Matrix3d attitude =
        (Eigen::AngleAxisd(at[i][2], Vector3d::UnitZ()) * Eigen::AngleAxisd(at[i][1], Vector3d::UnitY()) *
         Eigen::AngleAxisd(at[i][0], Vector3d::UnitX()))
            .toRotationMatrix();
    seen.col(static_cast<Eigen::Index>(i)) << attitude.transpose() * three(outcomes[i]), three(outcomes[i], 3);
  }
  const Eigen::VectorXd mean = seen.rowwise().mean();
  const Eigen::MatrixXd varies = seen.colwise() - mean;
  const double share = 1 / std::sqrt(static_cast<double>(at.size()));
  constexpr double kReach_m = 0.03;  // of markers from the body's origin: by it an angle becomes a length
  return {{mean.head(3).norm()},
          {share * varies.topRows(3).norm()},
          {kReach_m * mean.tail(3).norm()},
          {kReach_m * share * varies.bottomRows(3).norm()}};
}

/// Draws in the order of their size, and so the distances from one to the next.
Points in_order(const Points&, const Points& outcomes) {
  std::vector<double> delays, steps;
  for (const auto& o : outcomes) delays.push_back(o[0]);
  for (std::size_t i = 1; i < delays.size(); ++i) steps.push_back(std::abs(delays[i] - delays[i - 1]));
  std::ranges::sort(delays), std::ranges::sort(steps);
  Points sorted;
  for (const std::vector<double>* list : {&delays, &steps})
    for (const double x : *list) sorted.push_back({x});
  return sorted;
}

/// What the catalogue's laws need of the shipped vehicle.
struct Nominal {
  model::Vehicle vehicle = model::read_vehicle(io::config_path("vehicles/hummingbird_nominal.toml"));
  const model::Planform& planform = vehicle.left.planform;
  double weight_N = 9.81 * (vehicle.torso.mass_kg + vehicle.left.leading_edge.mass_kg + vehicle.left.wing.mass_kg +
                            vehicle.right.leading_edge.mass_kg + vehicle.right.wing.mass_kg);

  /// c at r, linear as model/effects/wing_damage.hpp has it.
  double chord_m(double r_m) const {
    const model::Planform& p = planform;
    return p.mean_chord_m * (p.r00 + 12 * (p.r11 - p.r00 / 2) * (r_m / p.wing_length_m - 0.5));
  }
  /// Integral of r^n c^m over the span.
  double integral(int n, int m) const {
    constexpr int kCells = 200;
    const double dr = planform.wing_length_m / kCells;
    double sum = 0;
    for (int i = 0; i < kCells; ++i) {
      const double r = (i + 0.5) * dr;
      sum += std::pow(r, n) * std::pow(chord_m(r), m) * dr;
    }
    return sum;
  }
};

const Nominal& nominal() {
  static const Nominal one;
  return one;
}

constexpr double kBeat_Hz = 34, kPi = std::numbers::pi;
using Law = std::function<std::vector<double>(std::span<const double> at, const std::vector<double>& q)>;

double sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

/// The equations at the head of each file of model/effects, with `q` its parameters.
const std::map<std::string, Law>& catalogue_laws() {
  using At = std::span<const double>;
  using Q = std::vector<double>;
  static const std::map<std::string, Law> laws = {
      {"ground_effect", [](At at, const Q& q) { return Q{q[0] * std::exp(-at[0] / q[1])}; }},
      {"ceiling_effect", [](At at, const Q& q) { return Q{q[0] * std::exp(-at[0] / q[1])}; }},
      {"wall_effect",
       [](At at, const Q& q) {
         const double near = std::exp(-at[0] / q[2]);
         // the roll moment as lift that the wing at the wall loses, taken at two thirds of its span
         const double arm_m = 2.0 / 3 * nominal().planform.wing_length_m;
         return Q{-q[0] * near, q[1] / arm_m * near};
       }},
      {"body_drag",
       [](At at, const Q& q) {
         const double speed = std::hypot(at[0], at[1], at[2]);
         const double k = -0.5 * nominal().vehicle.air_density_kg_m3 * q[0] * speed;
         return Q{k * at[0], k * at[1], k * at[2]};
       }},
      {"added_mass",
       [](At at, const Q& q) {
         const double m = q[0] * nominal().vehicle.air_density_kg_m3 * kPi / 4;
         const double span = std::cos(at[0]) * at[3] - std::sin(at[0]) * at[2] * at[1];  // rate of psi' cos theta
         const double cross = m / 2 * nominal().integral(1, 3), along = m * nominal().integral(2, 2),
                      chord = m * (1.0 / 4 + 1.0 / 32) * nominal().integral(0, 4);
         return Q{-std::cos(at[0]) * (cross * at[4] + along * span), -(chord * at[4] + cross * span)};
       }},
      {"rotational_lift",
       [](At at, const Q& q) {
         return Q{q[0] * nominal().vehicle.air_density_kg_m3 * 0.75 * kPi * at[2] * std::abs(at[1]) *
                  nominal().integral(1, 2)};
       }},
      {"wake_capture",
       [](At at, const Q& q) {
         const double half_s = 0.5 / kBeat_Hz, rate = std::sin(kPi * at[0] / half_s);
         const double wake = q[0] * std::exp(-at[0] / (q[1] * half_s));
         return Q{(rate + wake) * (rate + wake) - rate * rate};
       }},
      {"clap_and_fling",
       [](At at, const Q& q) {
         const auto smooth = [](double x) { return x * x * (3 - 2 * x); };
         const model::Planform& p = nominal().planform;
         const double deflected = (kPi - at[0]) / 2;
         const double near = smooth(std::clamp((deflected - q[1]) * 2 * p.wing_length_m / p.mean_chord_m, 0.0, 1.0));
         const double left = std::exp(-at[0] / 2 * p.wing_length_m / (2 * p.mean_chord_m));
         return Q{q[0] * std::max(near, left)};
       }},
      {"wing_flexibility", [](At at, const Q& q) { return Q{-q[0] * nominal().weight_N / 2 * at[1] * at[0]}; }},
      {"wing_damage",
       [](At at, const Q& q) {
         const double length = nominal().planform.wing_length_m, area = nominal().integral(0, 1);
         double cut = length, lost = 0;
         for (constexpr double kStep_m = 1e-5; lost < q[0] * area; cut -= kStep_m)
           lost += nominal().chord_m(cut) * kStep_m;
         return Q{at[0] * length > cut ? 1.0 : 0.0};
       }},
      {"wind",
       [](At, const Q&) {
         return Q{1, 0};
       }},  // no profile; its gusts are three lines, between the grid's points
      {"spring_hardening",
       [](At at, const Q& q) {
         return Q{-nominal().vehicle.left.spring.stiffness_positive_Nm_rad * q[0] * std::pow(at[0], 3)};
       }},
      {"gear_backlash",
       [](At at, const Q& q) {
         const model::Motor& m = nominal().vehicle.left.motor;
         const double rotor = m.efficiency * m.gear_ratio * m.gear_ratio * m.rotor_inertia_kg_m2;
         const double k =
             m.efficiency * m.gear_ratio * m.torque_constant_Nm_A / m.resistance_ohm * m.voltage_limit_V / 1e-3;
         const double d = 2 * 0.1 * std::sqrt(k * rotor), beyond = at[0] - std::clamp(at[0], -q[0] / 2, q[0] / 2);
         return Q{beyond == 0 ? 0 : k * beyond + d * at[1]};
       }},
      {"coulomb_friction", [](At at, const Q& q) { return Q{q[0] * sign(at[0]) * std::exp(-std::abs(at[0]) / q[1])}; }},
      {"winding_heating",
       [](At at, const Q& q) {
         return Q{0.00393 * q[0] * at[1] * (1 - std::exp(-at[0] / q[1])), 0};
       }},
      {"battery_sag", [](At at, const Q& q) { return Q{at[1] * (q[0] + q[1] * at[0])}; }},
      {"driver_dead_zone", [](At at, const Q& q) { return Q{-std::clamp(at[0], -q[0], q[0])}; }},
      {"driver_bandwidth", [](At at, const Q& q) { return Q{-10 * std::exp(-at[0] / q[0])}; }},
      {"command_delay", [](At, const Q& q) { return Q{q[0]}; }},
      {"stop_compliance",
       [](At at, const Q& q) {
         const model::RigidBody& w = nominal().vehicle.left.wing;
         const double inertia = w.inertia_kg_m2.yy + w.mass_kg * (w.com_m.x * w.com_m.x + w.com_m.z * w.com_m.z);
         const double k = 1 / q[0], push = k * at[0] + 2 * q[1] * std::sqrt(k * inertia) * at[1];
         return Q{at[0] > 0 && push > 0 ? push : 0};
       }},
      {"gyro_bias",
       [](At at, const Q& q) {
         return Q{q[0] * (1 - std::exp(-at[0] / q[3])), 0};
       }},
      {"accelerometer_misalignment",
       [](At at, const Q& q) {
         const Vector3d change = Vector3d(q[0], q[1], q[2]).cross(Vector3d(at[0], at[1], at[2]));
         return Q{change[0], change[1], change[2]};
       }},
      {"vibration_rectification", [](At at, const Q& q) { return Q{q[0] * at[0] * at[0] / 2}; }},
      {"mocap_tilt",
       [](At at, const Q& q) {
         const Vector3d change = Vector3d(q[0], q[1], 0).cross(Vector3d(at[0], at[1], at[2]));
         return Q{change[0], change[1], change[2]};
       }},
      {"marker_offset",
       [](At at, const Q& q) {
         const Vector3d change = Eigen::AngleAxisd(at[2], Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(at[1], Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(at[0], Vector3d::UnitX()) * Vector3d(q[0], q[1], q[2]);
         return Q{change[0], change[1], change[2], 0, 0, 0};
       }},
      {"mocap_delay", [](At, const Q& q) { return Q{q[0]}; }},
      {"tether",
       [](At at, const Q& q) {
         return Q{-q[1] * at[0], -q[1] * at[1], -9.81 * q[0] * at[2]};
       }},
  };
  return laws;
}

std::vector<double> typical_of(const std::string& effect) {
  std::vector<double> q;
  for (const model::EffectParameter& p : model::effect_within_beat(effect).parameters) q.push_back(p.typical);
  return q;
}

/// One side of a comparison.
struct Party {
  std::string name;
  const blind::FamilyEffect* effect = nullptr;  ///< null: the catalogue
  std::vector<double> numbers;
  std::function<std::vector<double>(std::span<const double>)> law;
};

Points asked(const LawQuestion& question, const Party& party) {
  const Points at = grid_of(question);
  Points outcomes;
  bool acts = false;
  for (const std::vector<double>& point : at) {
    outcomes.push_back(party.law(point));
    if (outcomes.back().size() != question.outcomes.size()) return {};
    for (const double x : outcomes.back()) {
      if (!std::isfinite(x)) return {};
      acts = acts || x != 0;
    }
  }
  if (!acts) return {};
  return question.invariants ? question.invariants(at, outcomes) : outcomes;
}

std::optional<double> equal_number(const std::vector<double>& a, const std::vector<double>& b) {
  for (const double x : a)
    for (const double y : b)
      if (x != 0 && std::abs(std::abs(x) - std::abs(y)) <= kEqualNumbers * std::abs(x)) return std::abs(x);
  return std::nullopt;
}

std::vector<Party> parties(const std::vector<const blind::Family*>& families, const std::string& id) {
  std::vector<Party> all;
  for (const blind::Family* family : families)
    for (const blind::FamilyEffect& e : family->effects())
      if (e.id == id)
        all.push_back(
            {family->name(), &e, e.numbers, [family, id](std::span<const double> at) { return family->law(id, at); }});
  return all;
}

std::vector<std::string> ids_of(const std::vector<const blind::Family*>& families) {
  std::vector<std::string> ids;
  for (const blind::Family* family : families)
    for (const blind::FamilyEffect& e : family->effects())
      if (!std::ranges::count(ids, e.id)) ids.push_back(e.id);
  return ids;
}

}  // namespace

const std::vector<LawQuestion>& law_questions() {
  static const std::vector<LawQuestion> all = {
      {"ground_effect", {{"height_m", 0.02, 0.3, 29}}, {"lift_share"}},
      {"ceiling_effect", {{"clearance_m", 0.02, 0.3, 29}}, {"lift_share"}},
      {"wall_effect", {{"distance_m", 0.09, 0.4, 32}}, {"pull_over_weight", "lift_share_lost"}},
      {"body_drag",
       {{"vx_m_s", -1.5, 1.5, 7}, {"vy_m_s", -1.5, 1.5, 7}, {"vz_m_s", -1.5, 1.5, 7}},
       {"fx_N", "fy_N", "fz_N"}},
      {"added_mass",
       {{"rotation_rad", -1, 1, 5},
        {"stroke_rad_s", -250, 250, 5},
        {"rotation_rad_s", -150, 150, 5},
        {"stroke_rad_s2", -5e4, 5e4, 5},
        {"rotation_rad_s2", -5e4, 5e4, 5}},
       {"stroke_moment_Nm", "rotation_moment_Nm"}},
      {"rotational_lift",
       {{"rotation_rad", -1, 1, 7}, {"stroke_rad_s", -250, 250, 7}, {"rotation_rad_s", -150, 150, 7}},
       {"normal_force_N"},
       nullptr,
       // the left wing's leading edge leads
       [](const std::vector<double>& at) { return at[0] * at[1] < 0; }},
      {"wake_capture", {{"since_reversal_s", 0, 0.012, 25}, {"peak_rad_s", 150, 300, 4}}, {"force_share"}},
      {"clap_and_fling", {{"gap_rad", 0.02, 1, 50}}, {"lift_share"}},
      {"wing_flexibility", {{"station", 0.1, 1, 19}, {"load_share", -2, 2, 9}}, {"twist_rad"}},
      {"wing_damage", {{"station", 0.3, 1, 141}}, {"chord_share_lost"}},
      {"wind", {{"height_m", 0.1, 1.5, 8}, {"frequency_Hz", 0.1, 15, 50}}, {"speed_share", "gust_density_s"}},
      {"spring_hardening", {{"stroke_rad", -1.3, 1.3, 53}}, {"torque_Nm"}},
      {"gear_backlash", {{"ahead_rad", -0.04, 0.04, 41}, {"rate_rad_s", -20, 20, 9}}, {"torque_Nm"}},
      {"coulomb_friction", {{"stroke_rad_s", -250, 250, 101}}, {"torque_Nm"}},
      {"winding_heating",
       {{"time_s", 1, 30, 30}, {"loss_W", 0.2, 2, 10}},
       {"resistance_share", "torque_constant_share"}},
      {"battery_sag", {{"time_s", 0.1, 30, 30}, {"current_A", 0.2, 2, 10}}, {"lost_V"}},
      {"driver_dead_zone", {{"command_V", -18, 18, 73}, {"current_A", -1, 1, 9}}, {"lost_V"}},
      {"driver_bandwidth", {{"time_s", 0, 6e-3, 61}}, {"missing_V"}},
      {"command_delay", {{"update", 0, 40, 41}}, {"delay_s"}, in_order},
      {"stop_compliance", {{"beyond_rad", 0, 0.3, 16}, {"rate_rad_s", -150, 150, 13}}, {"torque_Nm"}},
      {"gyro_bias", {{"time_s", 0, 30, 61}}, {"bias_rad_s", "random_rad_s"}},
      {"accelerometer_misalignment",
       {{"fx_m_s2", -20, 20, 4}, {"fy_m_s2", -20, 20, 4}, {"fz_m_s2", -20, 20, 4}},
       {"x_m_s2", "y_m_s2", "z_m_s2"},
       parts_of_linear},
      {"vibration_rectification", {{"amplitude_m_s2", 0, 60, 13}, {"frequency_Hz", 20, 500, 9}}, {"bias_m_s2"}},
      {"mocap_tilt",
       {{"x_m", -0.7, 0.7, 5}, {"y_m", -0.7, 0.7, 5}, {"z_m", 0.1, 1.2, 5}},
       {"x_m", "y_m", "z_m"},
       parts_of_linear},
      {"marker_offset",
       {{"roll_rad", -0.6, 0.6, 5}, {"pitch_rad", -0.6, 0.6, 5}, {"yaw_rad", -3, 3, 5}},
       {"x_m", "y_m", "z_m", "x_rad", "y_rad", "z_rad"},
       parts_of_marker},
      {"mocap_delay", {{"time_s", 0, 10, 101}}, {"delay_s"}},
      {"tether", {{"x_m", 0, 0.6, 7}, {"y_m", 0, 0.6, 7}, {"height_m", 0.1, 1.2, 12}}, {"fx_N", "fy_N", "fz_N"}},
  };
  return all;
}

std::vector<std::vector<double>> grid_of(const LawQuestion& question) {
  Points all = {{}};
  for (const LawArgument& a : question.arguments) {
    Points longer;
    for (const std::vector<double>& begun : all)
      for (std::size_t k = 0; k < a.points; ++k) {
        longer.push_back(begun);
        longer.back().push_back(a.low + (a.high - a.low) * static_cast<double>(k) / static_cast<double>(a.points - 1));
      }
    all = std::move(longer);
  }
  if (question.occurs) std::erase_if(all, [&](const std::vector<double>& at) { return !question.occurs(at); });
  return all;
}

std::vector<double> catalogue_law(const std::string& effect, std::span<const double> at) {
  const auto law = catalogue_laws().find(effect);
  return law == catalogue_laws().end() ? std::vector<double>{} : law->second(at, typical_of(effect));
}

double law_distance(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b) {
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t k = 0; k < a.front().size(); ++k) {
    double of_a = 0, of_b = 0, of_both = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      of_a += a[i][k] * a[i][k], of_b += b[i][k] * b[i][k], of_both += a[i][k] * b[i][k];
    // an outcome that one law does not have counts by the other's size alone
    const double unit = of_a > 0 && of_b > 0 ? std::sqrt(of_a * of_b) : std::max(of_a, of_b);
    if (!(unit > 0)) continue;
    aa += of_a / unit, bb += of_b / unit, ab += of_both / unit;
  }
  return aa > 0 && bb > 0 ? std::sqrt(std::max(0.0, 1 - ab * ab / (aa * bb))) : 1;
}

std::vector<LawPair> compare_laws(const std::vector<const blind::Family*>& families) {
  std::vector<LawPair> pairs;
  for (const std::string& id : ids_of(families)) {
    std::vector<Party> all = parties(families, id);
    if (model::is_effect(id))
      all.push_back(
          {"catalogue", nullptr, typical_of(id), [id](std::span<const double> at) { return catalogue_law(id, at); }});
    const auto question =
        std::ranges::find(law_questions(), id, [](const LawQuestion& q) { return std::string(q.effect); });
    std::vector<Points> of(all.size());
    if (question != law_questions().end())
      std::ranges::transform(all, of.begin(), [&](const Party& p) { return asked(*question, p); });
    const auto missing = [&](std::size_t i) -> std::string {
      const blind::FamilyEffect* e = all[i].effect;
      if (!e) return "";
      if (e->law.empty() || (question != law_questions().end() && of[i].empty())) return "law";
      return e->source.empty() ? "source" : e->numbers.empty() ? "numbers" : "";
    };
    if (all.size() == 1) pairs.push_back({id, all[0].name, "", {}, {}, missing(0)});
    for (std::size_t i = 0; i < all.size(); ++i)
      for (std::size_t k = i + 1; k < all.size(); ++k) {
        LawPair pair{id, all[i].name, all[k].name, {}, equal_number(all[i].numbers, all[k].numbers), missing(i)};
        if (pair.missing.empty()) pair.missing = missing(k);
        if (!of[i].empty() && !of[k].empty()) pair.distance = law_distance(of[i], of[k]);
        pairs.push_back(std::move(pair));
      }
  }
  return pairs;
}

std::string laws_page(const std::vector<const blind::Family*>& families) {
  std::string page =
      "# Laws of the blind robots' effects\n\n"
      "This page has the law, the source and the strength of each effect of the [blind "
      "robots](diagnosis.md#11-how-blind-benchmarks-judge-it), by\n"
      "family. `flappy-blind laws --page FILE` writes it, and checks that no two families, and no family and the "
      "catalogue, share a law or a\n"
      "number: on a grid, after the best scale factor, two laws of one effect of the catalogue differ by at least 3 % "
      "of their change. "
      "Angles are in rad, all else\n"
      "in SI units.\n";
  for (const std::string& id : ids_of(families)) {
    page += "\n## " + id + "\n\n| family | magnitude 1 | law | source |\n|---|---|---|---|\n";
    for (const Party& p : parties(families, id))
      page += "| " + p.name + " | " + p.effect->typical + " | " + p.effect->law + " | " + p.effect->source + " |\n";
  }
  return page;
}

}  // namespace flappy::benchmark
