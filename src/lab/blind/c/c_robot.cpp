#include "lab/blind/c/c_robot.hpp"

#include "lab/blind/c/c_laws.hpp"
#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

/// Adds a point mass, or takes it away if negative.
void add_mass(RigidBody& body, double mass_kg, const Eigen::Vector3d& at_m) {
  const double whole_kg = body.mass_kg + mass_kg;
  const Eigen::Vector3d d = at_m - body.com_m;
  body.inertia_kg_m2 +=
      body.mass_kg * mass_kg / whole_kg * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  body.com_m += mass_kg / whole_kg * d;
  body.mass_kg = whole_kg;
}

RobotParameters changed(RobotParameters f, const SessionChange& day) {
  const double battery_kg = 0.3 * f.torso.mass_kg;
  const Eigen::Vector3d tray_m(0, 0, -0.01);
  add_mass(f.torso, -battery_kg, tray_m);
  add_mass(f.torso, battery_kg + day.tape_kg, tray_m + day.battery_m);
  f.air = day.air;
  f.supply = day.supply;
  for (std::size_t side = 0; side < 2; ++side) {
    Side& of = f.sides[side];
    of.motor.resistance_ohm *= day.winding[side];
    of.motor.friction_Nm *= day.friction[side];
    of.stroke.friction_Nm *= day.friction[side];
    of.motor.damping_Nm_s *= day.damping[side];
    of.stroke.damping_Nm_s *= day.damping[side];
    of.spring.rest_rad += day.rest_rad[side];
  }
  return f;
}

/// Effects that only change parameters.
RobotParameters faulty(RobotParameters f, const Magnitudes& magnitudes, std::uint64_t seed) {
  Random random(seed, "faults");
  const double heading = random.uniform(0, 2 * M_PI), sign = random.sign(), other = random.sign(), wing = random.sign(),
               lift = random.sign();
  f.torso.com_m += magnitudes[Effect::kComOffset] * f.mass_kg() / f.torso.mass_kg *
                   Eigen::Vector3d(kComLevel_m * std::cos(heading), kComLevel_m * std::sin(heading), lift * kComUp_m);
  // a body at one side and below turns Ixz and Iyz; each is a share of the mean of its two moments
  for (const auto& [axis, share] : {std::pair{0, sign * kProductXz}, std::pair{1, other * kProductYz}}) {
    Eigen::Matrix3d& inertia = f.torso.inertia_kg_m2;
    inertia(axis, 2) += magnitudes[Effect::kInertiaProducts] * share * std::sqrt(inertia(axis, axis) * inertia(2, 2));
    inertia(2, axis) = inertia(axis, 2);
  }
  f.torso.inertia_kg_m2 = made_physical(f.torso.inertia_kg_m2);
  const double magnitude = magnitudes[Effect::kWingInertia];
  for (std::size_t i = 0; i < 2; ++i) {
    Side& side = f.sides[i];
    side.wing.com_m.z() -= magnitude * wing * kWingCom_m;  // the same way from the leading edge on both sides
    const double product = magnitude * wing * (i == 0 ? kWingProduct_kg_m2 : -kWingProduct_kg_m2);
    side.wing.inertia_kg_m2(1, 2) += product;
    side.wing.inertia_kg_m2(2, 1) += product;
    // a film is all but flat, so other products of a drawn one may now ask for more than any body has
    if (product != 0) side.wing.inertia_kg_m2 = made_physical(side.wing.inertia_kg_m2);
    side.rotation.friction_Nm += 6e-5 * magnitudes[Effect::kHingeStiction];
  }
  return f;
}

/// Wings, leading edges and rotation hinges; what moves them stays on its side.
void swap_wings(RobotParameters& f) {
  auto& [left, right] = f.sides;
  std::swap(left.leading_edge, right.leading_edge);
  std::swap(left.wing, right.wing);
  std::swap(left.rotation, right.rotation);
  std::swap(left.planform, right.planform);
  std::swap(left.fluid, right.fluid);
  for (Side& side : f.sides)
    for (RigidBody* body : {&side.leading_edge, &side.wing}) {  // seen in a mirror in the plane y = 0
      body->com_m.y() *= -1;
      body->inertia_kg_m2.row(1) *= -1;
      body->inertia_kg_m2.col(1) *= -1;
    }
}

Build build_of(const Magnitudes& magnitudes, std::uint64_t seed, bool swapped_wings) {
  Random random(seed, "build");
  Build build;
  build.damage = kDamage * magnitudes[Effect::kWingDamage];
  build.damaged = random.below(2);
  if (swapped_wings) build.damaged = 1 - build.damaged;
  build.backlash_rad = kBacklash_rad * magnitudes[Effect::kGearBacklash];
  const double half_weight_Nm = 0.0611 * 0.0507;  // half the weight of 12.4 g at the planform's centre of pressure
  if (magnitudes[Effect::kSparBending] > 0)
    build.spar_stiffness_Nm_rad = half_weight_Nm / (0.5 * kDegree * magnitudes[Effect::kSparBending]);
  build.leg_mass_kg = 0.4e-3 * magnitudes[Effect::kLegFlexure];
  build.body_drag_m2 = kBodyDrag_m2 * magnitudes[Effect::kBodyDrag];
  build.rotational_lift = magnitudes[Effect::kRotationalLift];
  build.added_mass = magnitudes[Effect::kAddedMass];
  build.stop_softness = magnitudes[Effect::kStopCompliance];
  return build;
}

}  // namespace

Robot::Robot(const Assignment& a, std::size_t flight)
    : magnitudes_(a.present_effects()), parameters_(read_parameters(a.vehicle_file)) {
  if (a.own_parameters) parameters_ = drawn_parameters(parameters_, a.seed);
  if (a.session > 0) parameters_ = changed(std::move(parameters_), session_change(a));
  parameters_ = faulty(std::move(parameters_), magnitudes_, a.seed);
  if (a.changes.swapped_wings) swap_wings(parameters_);
  if (a.changes.added_mass_kg > 0)
    add_mass(parameters_.torso, a.changes.added_mass_kg, Eigen::Vector3d::Map(a.changes.added_at_m.data()));
  steps_ = static_cast<std::size_t>(std::max(1.0, std::ceil(parameters_.hold_s / Mechanism::kStep_s - 1e-6)));
  step_s_ = parameters_.hold_s / static_cast<double>(steps_);
  mechanism_ =
      std::make_unique<Mechanism>(parameters_, build_of(magnitudes_, a.seed, a.changes.swapped_wings), step_s_);
  drive_ = std::make_unique<Drive>(parameters_, magnitudes_, a.seed, stream_of(a, flight));
  air_ = std::make_unique<Air>(parameters_, magnitudes_, a.seed, stream_of(a, flight));
  for (std::size_t side = 0; side < 2; ++side) friction_Nm_[side] = dry_friction_Nm(parameters_.sides[side]);
}

void Robot::tick(const std::array<double, 2>& voltages, const std::function<void()>& after) {
  tick_held(voltages, nullptr, after);
}

void Robot::tick_held(const std::array<double, 2>& voltages, const Motion* held, const std::function<void()>& after) {
  drive_->command(static_cast<double>(done_) * step_s_, voltages);
  for (std::size_t i = 0; i < steps_; ++i) {
    step(held == nullptr ? nullptr : held + i);
    after();
    if (held != nullptr) mechanism_->move_torso(held[i + 1]);
  }
}

void Robot::step(const Motion* held) {
  Mechanism& m = *mechanism_;
  if (!m.is_finite()) return;  // otherwise MuJoCo writes warnings to a log file
  const double now_s = static_cast<double>(done_) * step_s_;
  const Wrench wrench = air_->act(m, step_s_);
  drive_->fan(m.motion().velocity_W.norm());
  const std::array<double, 2> motor =
      drive_->torques(now_s, step_s_, {m.drive_angle(0), m.drive_angle(1)}, {m.drive_rate(0), m.drive_rate(1)});
  const double creep = 2 * kDegree * magnitudes_[Effect::kSpringCreep] * (1 - std::exp(-now_s / 6));
  const double harder = magnitudes_[Effect::kSpringHardening], stiction = magnitudes_[Effect::kCoulombFriction];
  std::array<double, 2> spring{};
  for (std::size_t side = 0; side < 2; ++side) {
    const Spring& of = parameters_.sides[side].spring;
    const double angle = m.stroke(side) - of.rest_rad - creep;
    spring[side] = -stiffness_Nm_rad(of, angle) * angle + harder * second_spring_Nm(of, angle);
    if (stiction > 0)
      m.set_friction(side, friction_Nm_[side] * (1 + stiction * laws::tustin_share(m.drive_rate(side))));
  }
  m.step(motor, spring, wrench, held);
  ++done_;
}

double dry_friction_Nm(const Side& side) {
  return side.motor.efficiency * side.motor.gear_ratio * side.motor.friction_Nm + side.stroke.friction_Nm;
}

double stiffness_Nm_rad(const Spring& spring, double angle_rad) {
  return angle_rad > 0 ? spring.positive_Nm_rad : spring.negative_Nm_rad;
}

double second_spring_Nm(const Spring& spring, double angle_rad) {
  return -stiffness_Nm_rad(spring, angle_rad) * laws::second_spring_rad(angle_rad);
}

Eigen::Vector3d specific_force_B(const Motion& motion, const Eigen::Vector3d& place_B) {
  const Eigen::Vector3d gravity(0, 0, -Mechanism::kGravity_m_s2);
  return motion.R_WB.transpose() * (motion.acceleration_W - gravity) + motion.turning_B.cross(place_B) +
         motion.rate_B.cross(motion.rate_B.cross(place_B));
}

}  // namespace flappy::blind::c
