#include "flappy/vehicle.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "io/text.hpp"
#include "model/effects/registry.hpp"
#include "model/jointed.hpp"
#include "model/math.hpp"

namespace flappy::model {
namespace {

constexpr double kLongest_m = 1.0;  // largest distance of a part of a vehicle from its frame

class Lister {
 public:
  explicit Lister(std::vector<Parameter>& list) : list_(list) {}

  void add(const std::string& path, double& value, double low, double high) {
    list_.push_back({path, &value, low, high});
  }

  void add(const std::string& path, Triple& t) {
    add(path + ".x", t.x, -kLongest_m, kLongest_m);
    add(path + ".y", t.y, -kLongest_m, kLongest_m);
    add(path + ".z", t.z, -kLongest_m, kLongest_m);
  }
  void add(const std::string& path, RigidBody& b) {
    add(path + ".mass_kg", b.mass_kg, 1e-9, 10);
    add(path + ".com_m", b.com_m);
    InertiaTensor& i = b.inertia_kg_m2;
    add(path + ".inertia_kg_m2.xx", i.xx, 1e-18, 1);
    add(path + ".inertia_kg_m2.yy", i.yy, 1e-18, 1);
    add(path + ".inertia_kg_m2.zz", i.zz, 1e-18, 1);
    add(path + ".inertia_kg_m2.xy", i.xy, -1, 1);
    add(path + ".inertia_kg_m2.yz", i.yz, -1, 1);
    add(path + ".inertia_kg_m2.xz", i.xz, -1, 1);
  }
  void add(const std::string& path, Joint& j) {
    add(path + ".lower_rad", j.lower_rad, -kLargestAngle_rad, 0);
    add(path + ".upper_rad", j.upper_rad, 0, kLargestAngle_rad);
    add(path + ".damping_Nm_s", j.damping_Nm_s, 0, 1);
    add(path + ".friction_Nm", j.friction_Nm, 0, 1);
  }
  void add(const std::string& path, Motor& m) {
    add(path + ".resistance_ohm", m.resistance_ohm, 1e-3, 1e4);
    add(path + ".torque_constant_Nm_A", m.torque_constant_Nm_A, 0, 1);
    add(path + ".gear_ratio", m.gear_ratio, 1e-3, 1e4);
    add(path + ".efficiency", m.efficiency, 1e-3, 1);
    add(path + ".friction_Nm", m.friction_Nm, 0, 1);
    add(path + ".damping_Nm_s", m.damping_Nm_s, 0, 1);
    add(path + ".rotor_inertia_kg_m2", m.rotor_inertia_kg_m2, 0, 1);
    list_.push_back({path + ".rotor_spin_sense", &m.rotor_spin_sense, -1, 1, true});
    add(path + ".voltage_limit_V", m.voltage_limit_V, 0, 1e3);
  }
  void add(const std::string& path, Spring& s) {
    add(path + ".stiffness_positive_Nm_rad", s.stiffness_positive_Nm_rad, 0, 100);
    add(path + ".stiffness_negative_Nm_rad", s.stiffness_negative_Nm_rad, 0, 100);
    add(path + ".rest_angle_rad", s.rest_angle_rad, -kLargestAngle_rad, kLargestAngle_rad);
  }
  void add(const std::string& path, Planform& w) {
    add(path + ".wing_length_m", w.wing_length_m, 1e-4, kLongest_m);
    add(path + ".mean_chord_m", w.mean_chord_m, 1e-5, kLongest_m);
    for (auto [name, value] : {std::pair<const char*, double*>{"r33", &w.r33},
                               {"r22", &w.r22},
                               {"r11", &w.r11},
                               {"r00", &w.r00},
                               {"z_cp2", &w.z_cp2},
                               {"z_cp1", &w.z_cp1},
                               {"z_cp0", &w.z_cp0},
                               {"z_rd", &w.z_rd}})
      add(path + "." + name, *value, 1e-6, 10);
    add(path + ".rotational_damping_coefficient", w.rotational_damping_coefficient, 0, 100);
  }
  void add(ContactPoint& p) {
    const std::string path = "contact." + p.name;
    add(path + ".position_m", p.position_m);
    add(path + ".stiffness_N_m", p.stiffness_N_m, 1e-3, 1e6);
    add(path + ".damping_s_m", p.damping_s_m, 0, 100);
    add(path + ".friction", p.friction, 0, 10);
    list_.push_back({path + ".grasp_m_s", &p.grasp_m_s, 0, 10, true});
  }
  void add(BeatAveraged& b) {
    constexpr double kAny = 1e6;
    for (BeatAveraged::Actuator& a : b.actuators) {
      add("actuator." + a.name + ".gain", a.gain, -kAny, kAny);
      list_.push_back({"actuator." + a.name + ".offset", &a.offset, -kAny, kAny, true});
      list_.push_back({"actuator." + a.name + ".lag_s", &a.lag_s, 0, 2, true});
    }
    for (BeatAveraged::Coefficient& c : b.coefficients) add("coefficients." + c.name, c.value, -kAny, kAny);
  }
  void add_optional(const std::string& path, double& value, double low, double high) {
    list_.push_back({path, &value, low, high, true});
  }
  void add(Jointed& j) {
    add("gait.frequency_Hz", j.frequency_Hz, 0.1, 2000);
    add_optional("gait.muscle_mass_kg", j.muscle_mass_kg, 0, 10);
    for (Jointed::Input& i : j.inputs) add("input." + i.name + ".lag_s", i.lag_s, 1e-5, 1);
  }
  void add(const std::string& path, Side& s, Jointed::Wing& w) {
    add(path + ".shoulder_m", s.shoulder_m);
    const std::size_t edge = list_.size();
    add(path + ".leading_edge", s.leading_edge);
    for (std::size_t k = edge; k < list_.size(); ++k) list_[k].optional = true;  // a file gives none or all of them
    add(path + ".wing", s.wing);
    for (std::size_t k = 0; k < kAngles.size(); ++k) add(path + "." + kAngles[k], w.angles[k]);
    if (w.strips.empty()) add(path + ".planform", s.planform);
  }
  void add(const std::string& path, Jointed::Angle& a) {
    using Mode = Jointed::Mode;
    if (a.mode == Mode::fixed) return add(path + ".angle_rad", a.mean_rad, -kLargestAngle_rad, kLargestAngle_rad);
    const bool free = a.mode == Mode::free;
    const auto put = [&](const char* key, double& value, double low, double high) {
      list_.push_back({path + "." + key, &value, low, high, !free});
    };
    if (!free) add(path + ".mean_rad", a.mean_rad, -kLargestAngle_rad, kLargestAngle_rad);
    put("stiffness_Nm_rad", a.stiffness_Nm_rad, 0, 100);
    put("rest_rad", a.rest_rad, -kLargestAngle_rad, kLargestAngle_rad);
    put("damping_Nm_s", a.damping_Nm_s, 0, 1);
    if (!free) return;
    add_optional(path + ".lower_rad", a.lower_rad, -kLargestAngle_rad, 0);
    add_optional(path + ".upper_rad", a.upper_rad, 0, kLargestAngle_rad);
    add_optional(path + ".stop_stiffness_Nm_rad", a.stop_stiffness_Nm_rad, 0, 1e4);
    add_optional(path + ".stop_damping_Nm_s", a.stop_damping_Nm_s, 0, 10);
  }
  void add(const std::string& path, Side& s) {
    add(path + ".shoulder_m", s.shoulder_m);
    add(path + ".leading_edge", s.leading_edge);
    add(path + ".wing", s.wing);
    add(path + ".stroke", s.stroke);
    add(path + ".rotation", s.rotation);
    add(path + ".motor", s.motor);
    add(path + ".spring", s.spring);
    add(path + ".planform", s.planform);
  }

 private:
  std::vector<Parameter>& list_;
};

/// Share by which rounding in files may raise the largest principal moment above the sum of the other two, which it
/// equals for a flat plate.
constexpr double kRounding = 1e-4;

/// Empty if the inertia is possible: principal moments are positive, and none exceeds the sum of the other two.
std::string impossible(const InertiaTensor& i) {
  Eigen::Matrix3d m;
  m << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
  const Eigen::Vector3d e = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(e[0] > 0)) return io::format("its smallest principal moment is %.4g", e[0]);
  const double excess = (e[2] - e[0] - e[1]) / e[2];
  if (excess <= kRounding) return "";
  return io::format("its largest principal moment exceeds the sum of the other two by %.3g %% of it", 100 * excess);
}

/// Whether a file leaves this body out.
bool absent(const RigidBody& b) {
  const InertiaTensor& i = b.inertia_kg_m2;
  const Triple& c = b.com_m;
  return std::ranges::all_of(std::array{b.mass_kg, c.x, c.y, c.z, i.xx, i.yy, i.zz, i.xy, i.yz, i.xz},
                             [](double x) { return x == 0; });
}

}  // namespace

std::vector<Parameter> parameters(Vehicle& v) {
  std::vector<Parameter> list;
  Lister l(list);
  l.add("air.density_kg_m3", v.air_density_kg_m3, 0, 100);
  const auto add_effects = [&] {
    for (const CatalogueEffect& e : catalogue_of(v))
      if (const auto own = v.effects.find(e.info.id); own != v.effects.end())
        for (const EffectParameter& p : e.parameters)
          if (const auto value = own->second.find(p.name); value != own->second.end())
            l.add("effects." + own->first + "." + p.name, value->second, p.low, p.high);
  };
  const auto add_extent = [&] {
    l.add("extent.below_m", v.extent.below_m, 0, kLongest_m);
    l.add("extent.above_m", v.extent.above_m, 0, kLongest_m);
    l.add("extent.around_m", v.extent.around_m, 0, kLongest_m);
  };
  if (v.beat_averaged) {
    add_extent();
    l.add("torso", v.torso);
    l.add(*v.beat_averaged);
    add_effects();
    return list;
  }
  if (v.jointed) {
    add_extent();
    l.add("torso", v.torso);
    l.add(*v.jointed);
    l.add("left", v.left, v.jointed->left);
    l.add("right", v.right, v.jointed->right);
    add_effects();
    return list;
  }
  l.add("driver.flapping_Hz", v.driver.flapping_Hz, 0.1, 1000);
  l.add("driver.hold_s", v.driver.hold_s, 1e-6, 1);
  l.add("driver.amplitude_limit_V", v.driver.amplitude_limit_V, 0, 1e3);
  l.add("driver.difference_limit_V", v.driver.difference_limit_V, 0, 1e3);
  l.add("driver.bias_limit_V", v.driver.bias_limit_V, 0, 1e3);
  l.add("driver.split_cycle_limit", v.driver.split_cycle_limit, 0, 0.45);
  add_extent();
  l.add("torso", v.torso);
  l.add("left", v.left);
  l.add("right", v.right);
  for (ContactPoint& p : v.contact) l.add(p);
  add_effects();
  return list;
}

std::optional<PhysicalFault> physical_fault(const Vehicle& v) {
  const std::pair<const char*, const RigidBody*> bodies[] = {{"torso", &v.torso},
                                                             {"left.leading_edge", &v.left.leading_edge},
                                                             {"left.wing", &v.left.wing},
                                                             {"right.leading_edge", &v.right.leading_edge},
                                                             {"right.wing", &v.right.wing}};
  for (const auto& [path, body] : bodies)
    if ((body == &v.torso || !v.beat_averaged) && !(v.jointed && absent(*body)))
      if (const std::string why = impossible(body->inertia_kg_m2); !why.empty())
        return PhysicalFault{
            std::string(path) + ".inertia_kg_m2", "no rigid body has this inertia: " + why,
            "positive principal moments, none above the sum of the other two, but for 0.01 % of rounding"};
  return std::nullopt;
}

namespace {

/// A body whose radius of gyration, sqrt(I / m), is longer than `reach_m`, the farthest that its mass can be.
std::optional<PhysicalFault> spread_fault(const std::string& path, const RigidBody& b, double reach_m,
                                          const std::string& reach) {
  const InertiaTensor& i = b.inertia_kg_m2;
  const double largest = std::max({i.xx, i.yy, i.zz}), radius_m = std::sqrt(largest / b.mass_kg);
  if (!(reach_m > 0) || radius_m <= reach_m) return std::nullopt;
  return PhysicalFault{
      path + ".inertia_kg_m2",
      io::format("needs mass %.3g m from the centre of mass, and ", radius_m) + reach +
          io::format(" ends at %.3g m; is it in g mm^2, which are 1e-9 kg m^2?", reach_m),
      io::format("moments of at most %.3g kg m^2, mass times that squared", b.mass_kg * reach_m * reach_m)};
}

double span_m(const Side& side, const Jointed::Wing* strips) {
  double span = side.planform.wing_length_m;
  if (strips != nullptr)
    for (const Jointed::Strip& s : strips->strips) span = std::max(span, s.span_m + s.width_m / 2);
  return span;
}

}  // namespace

std::optional<PhysicalFault> layout_fault(const Vehicle& v) {
  const Extent& e = v.extent;
  if (auto fault = spread_fault("torso", v.torso, std::hypot(e.around_m, std::max(e.below_m, e.above_m)), "extent"))
    return fault;
  if (v.beat_averaged) return std::nullopt;
  const char* const kMirror =
      "y to the left of B: on the right, shoulder_m.y and com_m.y, inertia xy and yz have the other sign";
  const double left_m = v.left.shoulder_m.y, right_m = v.right.shoulder_m.y;
  if (right_m > left_m || (right_m == left_m && left_m != 0))
    return PhysicalFault{left_m < 0 ? "left.shoulder_m.y" : "right.shoulder_m.y",
                         "the right shoulder is not right of the left one", kMirror};
  const std::pair<const char*, const Side*> sides[] = {{"left", &v.left}, {"right", &v.right}};
  for (const auto& [name, side] : sides) {
    const std::string path = name;
    if ((side == &v.left ? 1 : -1) * side->wing.com_m.y < 0)
      return PhysicalFault{path + ".wing.com_m.y", "is on the other side of the hinge than the wing", kMirror};
    const Jointed::Wing* const strips = v.jointed ? &(side == &v.left ? v.jointed->left : v.jointed->right) : nullptr;
    if (auto fault = spread_fault(path + ".wing", side->wing, span_m(*side, strips), "the wing")) return fault;
  }
  if (v.left.leading_edge.com_m.y * v.right.leading_edge.com_m.y > 0)
    return PhysicalFault{"right.leading_edge.com_m.y", "is on the same side of its hinge as on the left", kMirror};
  const std::tuple<const char*, const InertiaTensor*, const InertiaTensor*> tensors[] = {
      {"right.wing", &v.left.wing.inertia_kg_m2, &v.right.wing.inertia_kg_m2},
      {"right.leading_edge", &v.left.leading_edge.inertia_kg_m2, &v.right.leading_edge.inertia_kg_m2}};
  for (const auto& [path, left, right] : tensors)
    if (left->yz != 0 && left->yz == right->yz)
      return PhysicalFault{std::string(path) + ".inertia_kg_m2.yz", "is that of the left, not mirrored", kMirror};
  return std::nullopt;
}

}  // namespace flappy::model
