// Calls what the flights call. Of the laws that MuJoCo states, the engine is asked with the effect and without, for the shipped
// vehicle with its torso at rest in still air; what both share falls out.
#include "lab/blind/c/c_law.hpp"

#include <map>

#include "io/files.hpp"
#include "io/installation.hpp"
#include "lab/blind/c/c_laws.hpp"
#include "lab/blind/c/c_sensors.hpp"

namespace flappy::blind::c {
namespace {

constexpr std::uint64_t kSeed = 1;  // of random directions
// Of the nominal robot in hover: stroke amplitude, and mean of the air's moment about a rotation hinge without its sign.
constexpr double kHoverStroke_rad = 1.15, kHoverMoment_Nm = 1.17e-3;

using At = std::span<const double>;
using Values = std::vector<double>;

const RobotParameters& nominal() {
  static const RobotParameters parameters = read_parameters(io::config_path("vehicles/hummingbird_nominal.toml"));
  return parameters;
}

Magnitudes only(const std::string& effect) { return Magnitudes({{effect, 1}}); }

Values three(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Coordinates of the left wing: six of the torso, then the rotor's if it is apart, the stroke's and the rotation's.
struct Left {
  explicit Left(const Build& build) : mechanism(nominal(), build), rotor(build.backlash_rad > 0) {}
  mjModel& model() { return mechanism.model(); }
  mjData& data() { return const_cast<mjData&>(mechanism.data()); }
  int stroke() const { return rotor ? 7 : 6; }

  /// Puts the left wing into this state, all else at rest.
  void put(double rotation, double stroke_rate, double rotation_rate) {
    mjData& d = data();
    mju_zero(d.qvel, static_cast<int>(model().nv));
    d.qpos[7 + stroke() - 6 + 1] = rotation;
    d.qvel[stroke()] = stroke_rate;
    d.qvel[stroke() + 1] = rotation_rate;
    settle();
  }
  /// All forces and accelerations of this state.
  void settle() {
    mju_zero(data().qacc_warmstart, static_cast<int>(model().nv));  // the solver is not to know what was asked before
    mj_forward(&model(), &data());
  }
  /// Along the wing's normal; all passive forces of the torso's coordinates are the air's on this wing.
  double normal_N() {
    const mjData& d = data();
    const int wing = mj_name2id(&model(), mjOBJ_BODY, "left_wing");
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d.xmat + 9 * wing);
    return Eigen::Vector3d(d.qfrc_passive).dot(R.col(0));
  }

  Mechanism mechanism;
  bool rotor;
};

Left& left(const std::string& what, const Build& build) {
  thread_local std::map<std::string, std::unique_ptr<Left>> kept;
  std::unique_ptr<Left>& one = kept[what];
  if (!one) one = std::make_unique<Left>(build);
  return *one;
}

Left& plain() { return left("", {}); }

Values wall(At at) {
  Motion torso;
  torso.position_W.y() = Room::kWall_m - at[0];
  double pull = 0, loss = 0;
  constexpr int kPhases = 48;
  for (int i = 0; i < kPhases; ++i)
    for (std::size_t side = 0; side < 2; ++side) {
      const double stroke = kHoverStroke_rad * std::cos(2 * M_PI * (i + 0.5) / kPhases);
      const Eigen::Vector3d tip = reach_W(nominal(), torso, side, stroke, nominal().sides[side].planform.length_m);
      const double near = laws::wall_nearness(Room::kWall_m - tip.y()) / kPhases;
      pull += laws::kWallPull * near;
      if (side == 0) loss += laws::kWallLoss * near;
    }
  return {pull, loss};
}

Values drag(At at) {
  Build build;
  build.body_drag_m2 = kBodyDrag_m2;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (Left* one : {&left("drag", build), &plain()}) {
    one->put(0, 0, 0);
    for (int i = 0; i < 3; ++i) one->data().qvel[i] = at[static_cast<std::size_t>(i)];
    one->settle();
    force = Eigen::Vector3d(one->data().qfrc_passive) - force;
  }
  return three(-force);
}

Values virtual_mass(At at) {
  Build build;
  build.added_mass = 1;
  Left& wing = left("mass", build);
  wing.put(at[0], at[1], at[2]);
  Eigen::VectorXd accelerations = Eigen::VectorXd::Zero(wing.model().nv);
  accelerations[wing.stroke()] = at[3];
  accelerations[wing.stroke() + 1] = at[4];
  const Eigen::VectorXd load = wing.mechanism.virtual_mass_load(accelerations);
  return {load[wing.stroke()], load[wing.stroke() + 1]};
}

Values rotation(At at) {
  Build build;
  build.rotational_lift = 1;
  Left& wing = left("rotation", build);
  wing.put(at[0], at[1], at[2]);
  plain().put(at[0], at[1], at[2]);
  return {wing.normal_N() - plain().normal_N()};
}

Values wake(At at) {
  const double rate = 2 * M_PI * nominal().flapping_Hz, phase = rate * at[0], peak = at[1];
  const Planform& planform = nominal().sides[0].planform;
  const double travelled_m = laws::kTravelRadius * planform.length_m * peak / rate * (1 - std::cos(phase));
  const auto force = [&](double stroke_rate) {
    plain().put(M_PI / 4, stroke_rate, 0);
    return plain().normal_N();
  };
  return {laws::wake_share(travelled_m / planform.chord_m) * force(peak * std::sin(phase)) / force(peak)};
}

Values fling(At at) {
  const Planform& planform = nominal().sides[0].planform;
  const double chords = at[0] / 2 * laws::kTravelRadius * planform.length_m / planform.chord_m;
  return {laws::fling_share(0, at[0], chords)};
}

Values flexibility(At at) {
  const Strip outer = strips_of(nominal().sides[0].planform).back();
  return {at[0] < outer.radius - half_length(outer) ? 0 : laws::flex_rad(at[1] * kHoverMoment_Nm, 1)};
}

Values damage(At at) {
  std::array<Strip, Mechanism::kStrips> strips = strips_of(nominal().sides[0].planform);
  const double whole = chord_at(strips, at[0]);
  strips.back() = damaged_tip(strips.back(), kDamage);
  const double left = chord_at(strips, at[0]);
  return {left > 0 ? 1 - left / whole : 1};
}

Values backlash(At at) {
  Build build;
  build.backlash_rad = kBacklash_rad;
  Left& wing = left("play", build);
  wing.data().qpos[7] = at[0];
  wing.put(0, 0, 0);
  wing.data().qvel[6] = at[1];
  wing.settle();
  return {wing.data().qfrc_constraint[wing.stroke()]};
}

Values stop(At at) {
  Build build;
  build.stop_softness = 1;
  Left& wing = left("stop", build);
  wing.model().dof_frictionloss[wing.stroke() + 1] = 0;
  wing.put(nominal().sides[0].rotation.upper_rad + at[0], 0, at[1]);
  return {-wing.data().qfrc_constraint[wing.stroke() + 1]};
}

Values battery(At at) {
  const double load_A = at[1] * -std::expm1(-at[0] / laws::kBuffer_s);
  return {laws::sag_V(at[1] * at[0] - laws::kBuffer_s * load_A, load_A)};
}

Values heating(At at) { return {kCopper_1_K * laws::warmed_K(0, at[1], laws::kWash_m_s, at[0]), 0}; }

Values bridge(At at) { return {-laws::bridge_loss_V(at[0], at[1], Drive::kBattery_V)}; }

Values rectification(At at) {
  const double ratio = laws::kRectifiedFrom_Hz / at[1], swing = at[0] / std::sqrt(1 + ratio * ratio);
  constexpr int kPhases = 96;
  double mean = 0;
  for (int i = 0; i < kPhases; ++i)
    mean += laws::rectified_m_s2(swing * std::sin(2 * M_PI * (i + 0.5) / kPhases)) / kPhases;
  return {mean};
}

Values bend(At at) {
  return three(laws::bent_by({at[0], at[1], at[2]}, sensor_faults(only("mocap_tilt"), kSeed).bend, 1));
}

Values markers(At at) {
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(at[2], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(at[1], Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(at[0], Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  const Eigen::Vector3d force_B = R.transpose() * Eigen::Vector3d(0, 0, Mechanism::kGravity_m_s2);
  Values change = three(R * laws::stalk_rest_m(force_B, sensor_faults(only("marker_offset"), kSeed).stalk, 1));
  change.resize(6);
  return change;
}

struct Law {
  std::size_t arguments;
  Values (*of)(At);
};

const std::map<std::string, Law>& all() {
  static const std::map<std::string, Law> laws = {
      {"ground_effect", {1, [](At at) { return Values{laws::ground_share(at[0])}; }}},
      {"ceiling_effect", {1, [](At at) { return Values{laws::ceiling_share(at[0])}; }}},
      {"wall_effect", {1, wall}},
      {"body_drag", {3, drag}},
      {"added_mass", {5, virtual_mass}},
      {"rotational_lift", {3, rotation}},
      {"wake_capture", {2, wake}},
      {"clap_and_fling", {1, fling}},
      {"wing_flexibility", {2, flexibility}},
      {"wing_damage", {1, damage}},
      {"wind",
       {2,
        [](At at) {
          return Values{1, laws::gust_spectrum(at[1])};
        }}},
      {"spring_hardening", {1, [](At at) { return Values{second_spring_Nm(nominal().sides[0].spring, at[0])}; }}},
      {"gear_backlash", {2, backlash}},
      {"coulomb_friction",
       {1,
        [](At at) {
          const double more = dry_friction_Nm(nominal().sides[0]) * laws::tustin_share(at[0]);
          return Values{at[0] > 0 ? -more : at[0] < 0 ? more : 0};
        }}},
      {"winding_heating", {2, heating}},
      {"battery_sag", {2, battery}},
      {"driver_dead_zone", {2, bridge}},
      {"driver_bandwidth", {1, [](At at) { return Values{laws::slewed_V(0, 10, at[0], 1) - 10}; }}},
      {"command_delay",
       {1, [](At at) { return Values{laws::task_delay_s(at[0] * nominal().hold_s, task_phase(kSeed), 1)}; }}},
      {"stop_compliance", {2, stop}},
      {"gyro_bias",
       {1,
        [](At at) {
          return Values{laws::gyro_warmth_rad_s(at[0]), laws::kGyroWalk_rad_s * std::sqrt(std::max(0.0, at[0]))};
        }}},
      {"accelerometer_misalignment",
       {3,
        [](At at) {
          const Eigen::Vector3d force(at[0], at[1], at[2]);
          return three(sensor_faults(only("accelerometer_misalignment"), kSeed).axes * force - force);
        }}},
      {"vibration_rectification", {2, rectification}},
      {"mocap_tilt", {3, bend}},
      {"marker_offset", {3, markers}},
      {"mocap_delay",
       {1,
        [](At at) {
          return Values{laws::buffer_delay_s(at[0], sensor_faults(only("mocap_delay"), kSeed).buffer_phase, 1)};
        }}},
      {"tether",
       {3,
        [](At at) {
          return three(laws::tether_N({at[0], at[1], at[2]}, Mechanism::kGravity_m_s2));
        }}},
  };
  return laws;
}

}  // namespace

std::vector<double> law_of(const std::string& effect, std::span<const double> at) {
  only(effect);  // throws for an unknown effect
  const auto found = all().find(effect);
  if (found == all().end()) return {};
  if (at.size() != found->second.arguments)
    throw io::InputError("law of " + effect + ": " + std::to_string(at.size()) +
                         " arguments; accepted: " + std::to_string(found->second.arguments));
  return found->second.of(at);
}

}  // namespace flappy::blind::c
