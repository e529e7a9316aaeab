#include "mujoco_peer.hpp"

#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cstring>
#include <iomanip>
#include <sstream>
#include <stdexcept>

namespace flappy::reference {
namespace {

// In MuJoCo's arrays: bodies are world, torso, then leading edge and wing of each side; hinges likewise.
constexpr int wing_body(std::size_t i) { return i == 0 ? 3 : 5; }
constexpr std::size_t stroke_joint(std::size_t i) { return 2 * i; }
constexpr std::size_t rotation_joint(std::size_t i) { return 2 * i + 1; }

/// In principal axes, because MuJoCo's own diagonalisation is only good to 1e-5, or to 1e-12 kg m^2.
std::string inertial(const model::RigidBody& body) {
  const auto& I = body.inertia_kg_m2;
  Eigen::Matrix3d inertia;
  inertia << I.xx, I.xy, I.xz,  //
      I.xy, I.yy, I.yz,         //
      I.xz, I.yz, I.zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(inertia);
  const Eigen::Vector3d moments = principal.eigenvalues();
  Eigen::Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  const Eigen::Quaterniond q(axes);
  std::ostringstream xml;
  xml << std::setprecision(17) << "<inertial mass='" << body.mass_kg << "' pos='" << body.com_m.x << ' ' << body.com_m.y
      << ' ' << body.com_m.z << "' diaginertia='" << moments[0] << ' ' << moments[1] << ' ' << moments[2] << "' quat='"
      << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << "'/>";
  return xml.str();
}

std::string hinge(const char* axis, const model::Joint& joint, double armature, double damping, bool friction) {
  std::ostringstream xml;
  xml << std::setprecision(17) << "<joint axis='" << axis << "' limited='true' range='" << joint.lower_rad << ' '
      << joint.upper_rad << "' armature='" << armature << "' damping='" << damping << "' frictionloss='"
      << (friction ? joint.friction_Nm : 0) << "'/>";
  return xml.str();
}

std::string wing(const model::Side& side, const char* stroke_axis, bool damping, bool friction) {
  const auto& [x, y, z] = side.shoulder_m;
  std::ostringstream xml;
  xml << std::setprecision(17) << "<body pos='" << x << ' ' << y << ' ' << z << "'>" << inertial(side.leading_edge)
      << hinge(stroke_axis, side.stroke, reflected_rotor_inertia(side.motor), damping ? stroke_damping(side) : 0,
               friction)
      << "<body>" << inertial(side.wing)
      << hinge("0 1 0", side.rotation, 0, damping ? side.rotation.damping_Nm_s : 0, friction) << "</body></body>";
  return xml.str();
}

thread_local MujocoPeer* stepping = nullptr;  // MuJoCo's callback is global

}  // namespace

std::string mujoco_xml(const model::Vehicle& vehicle, const PeerOptions& options, const MujocoSettings& settings) {
  const bool friction = options.dry_friction == DryFriction::constraint;
  std::ostringstream xml;
  xml << std::setprecision(17) << "<mujoco><compiler angle='radian'/><option timestep='" << options.step_s
      << "' gravity='0 0 " << -options.gravity_m_s2 << "' integrator='" << settings.integrator << "' solver='"
      << settings.solver << "'><flag contact='disable'/></option>"
      << "<default><joint solimplimit='0.9 " << settings.stop_impedance << " 0.001' solreflimit='"
      << settings.stop_time_s << ' ' << settings.stop_damping_ratio << "' solreffriction='" << settings.stop_time_s
      << " 1'/></default>"
      << "<worldbody><body>" << (options.torso_welded ? "" : "<freejoint/>") << inertial(vehicle.torso)
      << wing(vehicle.left, "0 0 1", settings.joint_damping, friction)
      << wing(vehicle.right, "0 0 -1", settings.joint_damping, friction) << "</body></worldbody></mujoco>";
  return xml.str();
}

std::string mujoco_version() {
  if (mj_version() != mjVERSION_HEADER)
    throw std::runtime_error(std::string("MuJoCo: the library is ") + mj_versionString() +
                             ", the headers are of another");
  return mj_versionString();
}

bool mujoco_has_implicitfast() { return mjVERSION_HEADER >= 235; }

mjModel* mujoco_model(const std::string& xml) {
  mujoco_version();
  const auto files = std::make_unique<mjVFS>();  // two megabytes in 2.2, too big for the stack
  mj_defaultVFS(files.get());
#if mjVERSION_HEADER < 300
  mj_makeEmptyFileVFS(files.get(), "vehicle.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
#else
  mj_addBufferVFS(files.get(), "vehicle.xml", xml.data(), static_cast<int>(xml.size()));
#endif
  char error[1000] = "";
  mjModel* model = mj_loadXML("vehicle.xml", files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("MuJoCo: ") + error);
  return model;
}

MujocoPeer::MujocoPeer(const model::Vehicle& vehicle, const PeerOptions& options, const MujocoSettings& settings)
    : vehicle_(vehicle),
      options_(options),
      joint_damping_(settings.joint_damping),
      model_(mujoco_model(mujoco_xml(vehicle, options, settings)), mj_deleteModel),
      data_(mj_makeData(model_.get()), mj_deleteData) {
  mjcb_control = load_stage;
  mju_user_warning = [](const char*) {};  // else MuJoCo writes them to a file in the working folder
}

void MujocoPeer::step(double left_V, double right_V) {
  voltage_V_ = {left_V, right_V};
  first_stage_ = true;
  stepping = this;
  mj_step(model_.get(), data_.get());
  stepping = nullptr;
}

void MujocoPeer::load_stage(const mjModel* model, mjData* data) {
  if (stepping == nullptr) return;
  MujocoPeer& peer = *stepping;
  const PeerState state = peer.state();
  const Loads loads = loads_at(peer.vehicle_, peer.options_, state, peer.voltage_V_);
  if (peer.first_stage_) peer.start_ = state, peer.loads_ = loads;
  peer.first_stage_ = false;

  double* torque = data->qfrc_applied;
  double* joint_torque = torque + (peer.options_.torso_welded ? 0 : 6);
  mju_zero(torque, static_cast<int>(model->nv));
  for (std::size_t i : {0u, 1u}) {
    const WingLoad& load = loads.wing[i];
    const double* R = data->xmat + 9 * wing_body(i);
    const double* shoulder = data->xpos + 3 * wing_body(i);
    double force[3], moment[3], point[3];
    for (int k : {0, 1, 2}) {
      const double x = R[3 * k], y = R[3 * k + 1], z = R[3 * k + 2];
      force[k] = load.normal_force_N * x;
      moment[k] = load.damping_moment_Nm * y;
      point[k] = shoulder[k] + side_sign(i) * load.span_m * y - load.depth_m * z;
    }
    mj_applyFT(model, data, force, moment, point, wing_body(i), torque);
    joint_torque[stroke_joint(i)] += loads.stroke_Nm[i] + loads.spring_Nm[i];
    joint_torque[rotation_joint(i)] += loads.rotation_Nm[i];
    if (!peer.joint_damping_) continue;
    const model::Side& side = side_of(peer.vehicle_, i);  // what the joint's damping adds is no load
    joint_torque[stroke_joint(i)] += stroke_damping(side) * state.stroke_rate_rad_s[i];
    joint_torque[rotation_joint(i)] += side.rotation.damping_Nm_s * state.rotation_rate_rad_s[i];
  }
}

PeerState MujocoPeer::state() const {
  PeerState state;
  const double *q = data_->qpos, *v = data_->qvel;
  if (!options_.torso_welded) {
    // MuJoCo's free joint: origin and its velocity in W, quaternion body to world, angular velocity in B.
    state.p_WB_W_m = {q[0], q[1], q[2]};
    state.q_WB = {q[3], q[4], q[5], q[6]};
    state.v_WB_W_m_s = {v[0], v[1], v[2]};
    state.w_WB_B_rad_s = {v[3], v[4], v[5]};
    q += 7, v += 6;
  }
  for (std::size_t i : {0u, 1u}) {
    state.stroke_rad[i] = q[stroke_joint(i)];
    state.rotation_rad[i] = q[rotation_joint(i)];
    state.stroke_rate_rad_s[i] = v[stroke_joint(i)];
    state.rotation_rate_rad_s[i] = v[rotation_joint(i)];
  }
  return state;
}

void MujocoPeer::set_state(const PeerState& state) {
  double *q = data_->qpos, *v = data_->qvel;
  if (!options_.torso_welded) {
    mju_copy3(q, state.p_WB_W_m.data());
    mju_copy4(q + 3, state.q_WB.data());
    mju_copy3(v, state.v_WB_W_m_s.data());
    mju_copy3(v + 3, state.w_WB_B_rad_s.data());
    q += 7, v += 6;
  }
  for (std::size_t i : {0u, 1u}) {
    q[stroke_joint(i)] = state.stroke_rad[i];
    q[rotation_joint(i)] = state.rotation_rad[i];
    v[stroke_joint(i)] = state.stroke_rate_rad_s[i];
    v[rotation_joint(i)] = state.rotation_rate_rad_s[i];
  }
  mju_zero(data_->qacc_warmstart, static_cast<int>(model_->nv));
}

bool MujocoPeer::diverged() const {
  const auto met = [&](mjtWarning what) { return data_->warning[what].number > 0; };
  return met(mjWARN_BADQPOS) || met(mjWARN_BADQVEL) || met(mjWARN_BADQACC);
}

double MujocoPeer::time_s() const { return data_->time; }

}  // namespace flappy::reference
