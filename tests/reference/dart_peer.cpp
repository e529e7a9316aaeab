#include "dart_peer.hpp"

#include <dart/config.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#include <string>
#include <tuple>

namespace flappy::reference {
namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::FreeJoint;
using dart::dynamics::RevoluteJoint;
using dart::dynamics::WeldJoint;
using Eigen::Vector3d;

Vector3d vector(const model::Triple& v) { return {v.x, v.y, v.z}; }

BodyNode::Properties body_properties(const std::string& name, const model::RigidBody& body) {
  const auto& [xx, yy, zz, xy, yz, xz] = body.inertia_kg_m2;
  Eigen::Matrix3d inertia;
  inertia << xx, xy, xz,  //
      xy, yy, yz,         //
      xz, yz, zz;
  return BodyNode::AspectProperties(name, dart::dynamics::Inertia(body.mass_kg, vector(body.com_m), inertia));
}

/// Adds `body` to `parent` on a hinge at `origin_m` in the parent's frame.
RevoluteJoint* add_hinged(BodyNode* parent, const std::string& name, const model::RigidBody& body,
                          const Vector3d& origin_m, const Vector3d& axis, const model::Joint& joint,
                          DryFriction dry_friction) {
  RevoluteJoint::Properties properties;
  properties.mName = name + " joint";
  properties.mAxis = axis;
  properties.mT_ParentBodyToJoint.translation() = origin_m;
  auto* hinge = parent->createChildJointAndBodyNodePair<RevoluteJoint>(properties, body_properties(name, body)).first;
  hinge->setPositionLowerLimit(0, joint.lower_rad);
  hinge->setPositionUpperLimit(0, joint.upper_rad);
  hinge->setLimitEnforcement(true);
  if (dry_friction == DryFriction::constraint) hinge->setCoulombFriction(0, joint.friction_Nm);
  return hinge;
}

}  // namespace

std::string dart_version() { return DART_VERSION; }

struct DartPeer::Engine {
  dart::simulation::WorldPtr world = dart::simulation::World::create();
  dart::dynamics::SkeletonPtr skeleton = dart::dynamics::Skeleton::create();
  BodyNode* torso = nullptr;
  FreeJoint* free = nullptr;  ///< none if welded
  std::array<RevoluteJoint*, 2> stroke{}, rotation{};
};

DartPeer::DartPeer(const model::Vehicle& vehicle, const PeerOptions& options, const DartSettings& settings)
    : vehicle_(vehicle), options_(options), settings_(settings), engine_(std::make_unique<Engine>()) {
  Engine& engine = *engine_;
  const BodyNode::Properties torso = body_properties("torso", vehicle.torso);
  if (options.torso_welded) {
    engine.torso = engine.skeleton->createJointAndBodyNodePair<WeldJoint>(nullptr, {}, torso).second;
  } else {
    std::tie(engine.free, engine.torso) = engine.skeleton->createJointAndBodyNodePair<FreeJoint>(nullptr, {}, torso);
  }
  for (std::size_t i : {0u, 1u}) {
    const model::Side& side = side_of(vehicle, i);
    const std::string name = i == 0 ? "left " : "right ";
    model::RigidBody edge = side.leading_edge;
    if (!settings.rotor_lags) edge.inertia_kg_m2.zz += reflected_rotor_inertia(side.motor);
    engine.stroke[i] = add_hinged(engine.torso, name + "leading edge", edge, vector(side.shoulder_m),
                                  side_sign(i) * Vector3d::UnitZ(), side.stroke, options.dry_friction);
    engine.stroke[i]->setRestPosition(0, side.spring.rest_angle_rad);
    engine.rotation[i] = add_hinged(engine.stroke[i]->getChildBodyNode(), name + "wing", side.wing, Vector3d::Zero(),
                                    Vector3d::UnitY(), side.rotation, options.dry_friction);
    if (!settings.joint_damping) continue;
    engine.stroke[i]->setDampingCoefficient(0, stroke_damping(side));
    engine.rotation[i]->setDampingCoefficient(0, side.rotation.damping_Nm_s);
  }
  engine.world->setTimeStep(options.step_s);
  engine.world->setGravity({0, 0, -options.gravity_m_s2});
  engine.world->addSkeleton(engine.skeleton);
}

DartPeer::~DartPeer() = default;

void DartPeer::step(double left_V, double right_V) {
  start_ = state();
  loads_ = loads_at(vehicle_, options_, start_, {left_V, right_V});
  for (std::size_t i : {0u, 1u}) {
    const model::Side& side = side_of(vehicle_, i);
    RevoluteJoint *stroke = engine_->stroke[i], *rotation = engine_->rotation[i];
    double spring_Nm = loads_.spring_Nm[i];
    if (settings_.implicit_spring) {
      stroke->setSpringStiffness(0, spring_stiffness(side.spring, start_.stroke_rad[i]));
      spring_Nm = 0;
    }
    double stroke_Nm = loads_.stroke_Nm[i] + spring_Nm, rotation_Nm = loads_.rotation_Nm[i];
    if (settings_.joint_damping) {  // what the joint's damping adds is no load
      stroke_Nm += stroke_damping(side) * start_.stroke_rate_rad_s[i];
      rotation_Nm += side.rotation.damping_Nm_s * start_.rotation_rate_rad_s[i];
    }
    if (settings_.rotor_lags) stroke_Nm -= reflected_rotor_inertia(side.motor) * stroke->getAcceleration(0);
    stroke->setForce(0, stroke_Nm);
    rotation->setForce(0, rotation_Nm);

    const WingLoad& load = loads_.wing[i];
    BodyNode* wing = rotation->getChildBodyNode();
    wing->addExtForce({load.normal_force_N, 0, 0}, {0, side_sign(i) * load.span_m, -load.depth_m}, true, true);
    wing->addExtTorque({0, load.damping_moment_Nm, 0}, true);
  }
  if (!settings_.rotor_lags && !options_.torso_welded) relieve_torso();
  engine_->world->step();
}

// The leading edge carries J about the stroke axis, +-z of the torso, so its hinge resists with J (psi'' +- w_z'), and the
// torso with d/dt of J (w_z +- psi') z. A rotor behind a gear resists with J psi'' at the hinge alone: the rest is taken back.
void DartPeer::relieve_torso() {
  const Vector3d w = engine_->torso->getAngularVelocity(dart::dynamics::Frame::World(), engine_->torso);
  const double turning = engine_->torso->getAngularAcceleration(dart::dynamics::Frame::World(), engine_->torso).z();
  for (std::size_t i : {0u, 1u}) {
    RevoluteJoint* stroke = engine_->stroke[i];
    const double J = reflected_rotor_inertia(side_of(vehicle_, i).motor), sign = side_sign(i);
    const Vector3d z = Vector3d::UnitZ();
    const Vector3d spin = J * (w.z() + sign * stroke->getVelocity(0)) * z;
    stroke->setForce(0, stroke->getForce(0) + sign * J * turning);
    engine_->torso->addExtTorque(J * (turning + sign * stroke->getAcceleration(0)) * z + w.cross(spin), true);
  }
}

PeerState DartPeer::state() const {
  PeerState state;
  if (!options_.torso_welded) {
    const Eigen::Isometry3d& pose = engine_->torso->getTransform();
    const Eigen::Quaterniond q(pose.linear());
    const Eigen::Vector6d& twist_B = engine_->torso->getSpatialVelocity();  // angular, then linear at the origin
    state.q_WB = {q.w(), q.x(), q.y(), q.z()};
    Vector3d::Map(state.p_WB_W_m.data()) = pose.translation();
    Vector3d::Map(state.v_WB_W_m_s.data()) = pose.linear() * twist_B.tail<3>();
    Vector3d::Map(state.w_WB_B_rad_s.data()) = twist_B.head<3>();
  }
  for (std::size_t i : {0u, 1u}) {
    state.stroke_rad[i] = engine_->stroke[i]->getPosition(0);
    state.rotation_rad[i] = engine_->rotation[i]->getPosition(0);
    state.stroke_rate_rad_s[i] = engine_->stroke[i]->getVelocity(0);
    state.rotation_rate_rad_s[i] = engine_->rotation[i]->getVelocity(0);
  }
  return state;
}

void DartPeer::set_state(const PeerState& state) {
  if (!options_.torso_welded) {
    const auto& [w, x, y, z] = state.q_WB;
    Eigen::Isometry3d pose(Eigen::Quaterniond(w, x, y, z).normalized());
    pose.translation() = Vector3d::Map(state.p_WB_W_m.data());
    Eigen::Vector6d twist_B;
    twist_B << Vector3d::Map(state.w_WB_B_rad_s.data()),
        pose.linear().transpose() * Vector3d::Map(state.v_WB_W_m_s.data());
    engine_->free->setRelativeTransform(pose);
    engine_->free->setRelativeSpatialVelocity(twist_B);
  }
  for (std::size_t i : {0u, 1u}) {
    engine_->stroke[i]->setPosition(0, state.stroke_rad[i]);
    engine_->rotation[i]->setPosition(0, state.rotation_rad[i]);
    engine_->stroke[i]->setVelocity(0, state.stroke_rate_rad_s[i]);
    engine_->rotation[i]->setVelocity(0, state.rotation_rate_rad_s[i]);
  }
  engine_->skeleton->resetAccelerations();
}

double DartPeer::time_s() const { return engine_->world->getTime(); }

const Loads& DartPeer::loads() const { return loads_; }

Wrench DartPeer::wrench() const { return aerodynamic_wrench(vehicle_, start_, loads_); }

}  // namespace flappy::reference
