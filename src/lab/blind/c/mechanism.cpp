#include "lab/blind/c/mechanism.hpp"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "lab/blind/c/c_laws.hpp"
#include "lab/blind/c/mjcf.hpp"

namespace flappy::blind::c {
namespace {

mjModel* compiled(const std::string& text) {
  static std::mutex one_at_a_time;  // MuJoCo's parser keeps global state
  const std::lock_guard<std::mutex> lock(one_at_a_time);
  if (mj_version() != mjVERSION_HEADER)
    throw std::runtime_error(std::string("family C: MuJoCo's library is ") + mj_versionString() +
                             ", its headers are of another version");
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const char* name = "flapper.xml";
#if mjVERSION_HEADER < 300
  if (mj_makeEmptyFileVFS(files.get(), name, static_cast<int>(text.size())) != 0)
    throw std::runtime_error("family C: no room for a model");
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), name)], text.data(), text.size());
#else
  if (mj_addBufferVFS(files.get(), name, text.data(), static_cast<int>(text.size())) != 0)
    throw std::runtime_error("family C: no room for a model");
#endif
  char error[1000] = "";
  mjModel* model = mj_loadXML(name, files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("family C: ") + error);
  return model;
}

Eigen::Map<Eigen::Vector3d> vector_at(mjtNum* at) { return Eigen::Map<Eigen::Vector3d>(at); }
Eigen::Map<const Eigen::Vector3d> vector_of(const mjtNum* at) { return Eigen::Map<const Eigen::Vector3d>(at); }

// Thousands of times the torso's own, so what it still gives way is as small a share. Far larger ones would hide the
// support's force from the solver's tolerance.
constexpr double kClampMass_kg = 1e3, kClampInertia_kg_m2 = 1;

/// J' q' of an ellipsoid's centre, m/s^2, and of its rate, rad/s^2, in W: its accelerations where all q'' are zero.
std::pair<Eigen::Vector3d, Eigen::Vector3d> drift_of(const mjModel& m, const mjData& d, std::ptrdiff_t geom) {
  std::vector<int> chain;  // bodies from the torso's child on
  for (int body = m.geom_bodyid[geom]; m.body_parentid[body] != 0; body = m.body_parentid[body]) chain.push_back(body);
  const int torso = m.body_rootid[m.geom_bodyid[geom]];
  Eigen::Vector3d at = vector_of(d.xpos + 3 * torso), a = Eigen::Vector3d::Zero(), turn = a;
  Eigen::Vector3d w = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d.xmat + 9 * torso) *
                      vector_of(d.qvel + m.jnt_dofadr[m.body_jntadr[torso]] + 3);
  const auto go_to = [&](const Eigen::Vector3d& next) {
    const Eigen::Vector3d by = next - at;
    a += turn.cross(by) + w.cross(w.cross(by));
    at = next;
  };
  for (auto body = chain.rbegin(); body != chain.rend(); ++body)
    for (int joint = m.body_jntadr[*body]; joint < m.body_jntadr[*body] + m.body_jntnum[*body]; ++joint) {
      go_to(vector_of(d.xanchor + 3 * joint));
      const Eigen::Vector3d rate = d.qvel[m.jnt_dofadr[joint]] * vector_of(d.xaxis + 3 * joint);
      turn += w.cross(rate);
      w += rate;
    }
  go_to(vector_of(d.geom_xpos + 3 * geom));
  return {a, turn};
}

}  // namespace

Mechanism::Mechanism(const RobotParameters& parameters, const Build& build, double step_s)
    : model_(compiled(mjcf_text(parameters, build, step_s)), mj_deleteModel),
      data_(mj_makeData(model_.get()), mj_deleteData),
      added_mass_(build.added_mass > 0) {
  mjModel& m = *model_;
  const std::array<std::string, 2> names = {"left", "right"};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto joint = [&](const std::string& what) {
      return mj_name2id(&m, mjOBJ_JOINT, (names[side] + what).c_str());
    };
    const int stroke = joint("_stroke"), rotation = joint("_rotation"), rotor = joint("_rotor"),
              drive = rotor < 0 ? stroke : rotor;
    stroke_q_[side] = m.jnt_qposadr[stroke];
    stroke_v_[side] = m.jnt_dofadr[stroke];
    rotation_q_[side] = m.jnt_qposadr[rotation];
    rotation_v_[side] = m.jnt_dofadr[rotation];
    drive_q_[side] = m.jnt_qposadr[drive];
    drive_v_[side] = m.jnt_dofadr[drive];
    for (std::size_t i = 0; i < kStrips; ++i)
      strips_[side][i] = mj_name2id(&m, mjOBJ_GEOM, (names[side] + "_strip_" + std::to_string(i)).c_str());
    std::memcpy(strip_quat_[side].data(), m.geom_quat + 4 * strips_[side].back(), sizeof strip_quat_[side]);
  }
  // Only the wings have virtual mass, and only with its effect; the engine's products are taken from all.
  for (std::size_t side = 0; side < 2; ++side) {
    growth_m_s_[side] = laws::kGrowthPeriods * parameters.sides[side].planform.chord_m * parameters.flapping_Hz;
    for (std::size_t i = 0; i < kStrips; ++i) {
      const mjtNum* fluid = m.geom_fluid + mjNFLUID * strips_[side][i];
      virtual_m3_[side][i] = build.added_mass * fluid[6];
      virtual_m5_[side][i] = build.added_mass * vector_of(fluid + 9);
    }
  }
  for (std::ptrdiff_t geom = 0; geom < m.ngeom; ++geom)
    std::fill_n(m.geom_fluid + mjNFLUID * geom + 6, mjNFLUID - 6, mjtNum(0));
  mj_forward(&m, data_.get());
}

Motion Mechanism::motion() const {
  const mjData& d = *data_;
  Motion now;
  now.position_W = vector_of(d.qpos);
  now.q_WB = Eigen::Quaterniond(d.qpos[3], d.qpos[4], d.qpos[5], d.qpos[6]).normalized();
  now.R_WB = now.q_WB.toRotationMatrix();
  now.velocity_W = vector_of(d.qvel);
  now.rate_B = vector_of(d.qvel + 3);
  now.acceleration_W = vector_of(d.qacc);
  now.turning_B = vector_of(d.qacc + 3);
  return now;
}

Eigen::Vector3d Mechanism::strip_position(std::size_t side, std::size_t strip) const {
  return vector_of(data_->geom_xpos + 3 * strips_[side][strip]);
}

bool Mechanism::is_finite() const {
  for (int i = 0; i < model_->nv; ++i)
    if (!(std::abs(data_->qvel[i]) < 1e5)) return false;
  for (int i = 0; i < model_->nq; ++i)
    if (!(std::abs(data_->qpos[i]) < 1e4)) return false;
  return true;
}

void Mechanism::place(const Eigen::Vector3d& position_W, const Eigen::Quaterniond& q_WB) {
  vector_at(data_->qpos) = position_W;
  const double q[4] = {q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()};
  std::memcpy(data_->qpos + 3, q, sizeof q);
}

void Mechanism::move_torso(const Motion& motion) {
  place(motion.position_W, motion.q_WB);
  vector_at(data_->qvel) = motion.velocity_W;
  vector_at(data_->qvel + 3) = motion.rate_B;
}

void Mechanism::set_wind(const Eigen::Vector3d& wind_W) { vector_at(model_->opt.wind) = wind_W; }

void Mechanism::scale_air(std::size_t side, std::size_t strip, double factor) {
  model_->geom_fluid[mjNFLUID * strips_[side][strip]] = factor;
}

void Mechanism::twist(std::size_t side, double angle_rad) {
  const double by[4] = {std::cos(angle_rad / 2), 0, std::sin(angle_rad / 2), 0};
  mju_mulQuat(model_->geom_quat + 4 * strips_[side].back(), by, strip_quat_[side].data());
}

void Mechanism::set_friction(std::size_t side, double torque_Nm) {
  model_->dof_frictionloss[drive_v_[side]] = torque_Nm;
}

void Mechanism::step(const std::array<double, 2>& motor_Nm, const std::array<double, 2>& spring_Nm,
                     const Wrench& wrench, const Motion* held) {
  mjModel* m = model_.get();
  mjData* d = data_.get();
  mj_step1(m, d);
  mju_zero(d->qfrc_applied, static_cast<int>(m->nv));
  if (added_mass_) {
    add_virtual_mass();
    Eigen::Map<Eigen::VectorXd>(d->qfrc_applied, m->nv) -= virtual_mass_bias();
    Eigen::Map<Eigen::VectorXd>(d->qfrc_passive, m->nv) += virtual_mass_products();
  }
  for (std::size_t side = 0; side < 2; ++side) {
    d->qfrc_applied[drive_v_[side]] += motor_Nm[side];
    d->qfrc_applied[stroke_v_[side]] += spring_Nm[side];
  }
  // forces at the torso's origin in W, but torques in B
  vector_at(d->qfrc_applied) += wrench.force_W;
  Eigen::Matrix3d R_WB;
  mju_quat2Mat(R_WB.data(), d->qpos + 3);  // MuJoCo writes row by row, Eigen reads columns: this is the transpose
  vector_at(d->qfrc_applied + 3) += R_WB * wrench.torque_W;
  mj_step2(m, d);
  if (held != nullptr) hold_torso(*held);
  if (!clamped_) return;
  // the step's change of velocity, not qacc: the integrator takes damping implicitly
  support_.force_W = kClampMass_kg / m->opt.timestep * vector_of(d->qvel);
  support_.torque_W = clamp_.R_WB * (kClampInertia_kg_m2 / m->opt.timestep * vector_of(d->qvel + 3));
  move_torso(clamp_);
}

void Mechanism::clamp() {
  clamped_ = true;
  const Motion now = motion();
  clamp_.position_W = now.position_W;
  clamp_.q_WB = now.q_WB;
  clamp_.R_WB = now.R_WB;
  move_torso(clamp_);
  // after the compilation, which derived the stops' softness from a torso that is free
  for (int i = 0; i < 6; ++i) model_->dof_armature[i] = i < 3 ? kClampMass_kg : kClampInertia_kg_m2;
}

// The air that an ellipsoid carries has the momentum p along its normal, a function of its speed v along it, and h = I_A w,
// in its axes, without the wind. As in Kirchhoff's equations [Lamb, Hydrodynamics, 6th ed. 1932, chapter VI] the force on it
// is
//   F = -(dp/dt + S w x p),  T = -(I_A dw/dt + w x h + S v x p)
// with the share S of the products of p that suction leaves. What the rest turns of p is left to the wake. The products do no
// work: v.(w x p) + w.(v x p) = 0, so the power is that of v dp/dt and w dh/dt. In coordinates q, with dv/dt in the axes of
// the ellipsoid R^T (J q'' + J' q') - w x v, the rest is M_A q'' + b, M_A = J^T (dp/dv, I_A) J. Wind is taken as steady.
struct Mechanism::Carried {
  std::ptrdiff_t geom;
  Eigen::Matrix3d R;                                              ///< from its axes to W
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 32> v_of, w_of;  ///< in its axes, per rate of each coordinate
  Eigen::Vector3d v, w, p, h, mass, moment;                       ///< mass: dp/dv
  double energy_J;
};

Mechanism::Carried Mechanism::carried(std::size_t side, std::size_t strip) const {
  const mjModel& m = *model_;
  const mjData& d = *data_;
  Carried c;
  c.geom = strips_[side][strip];
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, 32> along(3, m.nv), about(3, m.nv);
  mj_jac(&m, &d, along.data(), about.data(), d.geom_xpos + 3 * c.geom, m.geom_bodyid[c.geom]);
  c.R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d.geom_xmat + 9 * c.geom);
  c.v_of = c.R.transpose() * along;
  c.w_of = c.R.transpose() * about;
  const Eigen::Map<const Eigen::VectorXd> rates(d.qvel, m.nv);
  c.v = c.v_of * rates - c.R.transpose() * vector_of(m.opt.wind);
  c.w = c.w_of * rates;
  const double density = m.opt.density * m.geom_fluid[mjNFLUID * c.geom];  // air's factor too
  const double mass_kg = density * virtual_m3_[side][strip];
  const laws::CarriedAir air = laws::carried_air(c.v.x(), growth_m_s_[side]);
  c.mass = {mass_kg * air.mass, 0, 0};
  c.p = {mass_kg * air.momentum_m_s, 0, 0};
  c.moment = density * virtual_m5_[side][strip];
  c.h = c.moment.cwiseProduct(c.w);
  c.energy_J = mass_kg * air.energy_m2_s2 + c.w.dot(c.h) / 2;
  return c;
}

std::array<Mechanism::Carried, 2 * Mechanism::kStrips> Mechanism::all_carried() const {
  return {carried(0, 0), carried(0, 1), carried(1, 0), carried(1, 1)};
}

void Mechanism::add_virtual_mass() {
  mjModel* m = model_.get();
  mjData* d = data_.get();
  const int nv = static_cast<int>(m->nv);
  for (const Carried& c : all_carried()) {
    const auto add = [&](int i, int j, mjtNum& to) {
      to += c.v_of.col(i).dot(c.mass.cwiseProduct(c.v_of.col(j))) +
            c.w_of.col(i).dot(c.moment.cwiseProduct(c.w_of.col(j)));
    };
    for (int i = 0; i < nv; ++i)
#if mjVERSION_HEADER < 300  // a row of M from its diagonal on, by parents
      for (int j = i, at = m->dof_Madr[i]; j >= 0; j = m->dof_parentid[j]) add(i, j, d->qM[at++]);
#else  // its columns as listed
      for (int at = m->M_rowadr[i]; at < m->M_rowadr[i] + m->M_rownnz[i]; ++at) add(i, m->M_colind[at], d->M[at]);
#endif
  }
  mj_factorM(m, d);
}

Eigen::VectorXd Mechanism::virtual_mass_bias() const {
  Eigen::VectorXd bias = Eigen::VectorXd::Zero(model_->nv);
  for (const Carried& c : all_carried()) {
    const auto [along_W, about_W] = drift_of(*model_, *data_, c.geom);
    bias += c.v_of.transpose() * c.mass.cwiseProduct(c.R.transpose() * along_W - c.w.cross(c.v)) +
            c.w_of.transpose() * c.moment.cwiseProduct(c.R.transpose() * about_W);
  }
  return bias;
}

Eigen::VectorXd Mechanism::virtual_mass_products() const {
  Eigen::VectorXd force = Eigen::VectorXd::Zero(model_->nv);
  for (const Carried& c : all_carried())
    force -= laws::kSuction * c.v_of.transpose() * c.w.cross(c.p) +
             c.w_of.transpose() * (c.w.cross(c.h) + laws::kSuction * c.v.cross(c.p));
  return force;
}

Eigen::VectorXd Mechanism::virtual_mass_load(const Eigen::VectorXd& accelerations) const {
  Eigen::VectorXd load = virtual_mass_products() - virtual_mass_bias();
  for (const Carried& c : all_carried())
    load -= c.v_of.transpose() * c.mass.cwiseProduct(c.v_of * accelerations) +
            c.w_of.transpose() * c.moment.cwiseProduct(c.w_of * accelerations);
  return load;
}

double Mechanism::virtual_mass_energy() const {
  double energy_J = 0;
  for (const Carried& c : all_carried()) energy_J += c.energy_J;
  return energy_J;
}

// For a prescribed torso t, all other coordinates w change by M_ww da_w = -M_wt da_t.
void Mechanism::hold_torso(const Motion& held) {
  mjModel* m = model_.get();
  mjData* d = data_.get();
  const int nv = static_cast<int>(m->nv), rest = nv - 6;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 32, 32> M(nv, nv);
  for (int k = 0; k < nv; ++k) {  // by columns, as each version keeps M in another form
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 32, 1> unit = Eigen::VectorXd::Unit(nv, k);
    mj_mulM(m, d, M.col(k).data(), unit.data());
  }
  Eigen::Matrix<double, 6, 1> change;
  change.head<3>() = held.acceleration_W - vector_of(d->qacc);
  change.tail<3>() = held.turning_B - vector_of(d->qacc + 3);
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 32, 1> other =
      M.bottomRightCorner(rest, rest).ldlt().solve(-M.bottomLeftCorner(rest, 6) * change);
  for (int i = 0; i < rest; ++i) {
    d->qvel[6 + i] += m->opt.timestep * other[i];
    d->qpos[7 + i] += m->opt.timestep * m->opt.timestep * other[i];  // valid as every joint after the first is a hinge
  }
}

}  // namespace flappy::blind::c
