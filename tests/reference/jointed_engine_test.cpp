// Vehicles with four angles a wing against MuJoCo, which knows nothing of driven angles: its mass matrix and its bias, of a torso with two wings on three
// hinges and one, are solved for what is free, and give torques of what is driven.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <iomanip>
#include <memory>
#include <sstream>

#include "model/derive_jointed.hpp"
#include "model/jointed_kane.hpp"
#include "mujoco_peer.hpp"

namespace flappy::reference {
namespace {

using model::Jointed, model::Moving, model::Vec3, model::Vehicle;
using test::Vector3d;

std::string inertial(const model::RigidBody& b) {
  const auto& i = b.inertia_kg_m2;
  Eigen::Matrix3d I;
  I << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(I);
  Eigen::Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  const Eigen::Quaterniond q(axes);
  std::ostringstream xml;
  xml << std::setprecision(17) << "<inertial mass='" << b.mass_kg << "' pos='" << b.com_m.x << ' ' << b.com_m.y << ' '
      << b.com_m.z << "' diaginertia='" << principal.eigenvalues().transpose() << "' quat='" << q.w() << ' ' << q.x()
      << ' ' << q.y() << ' ' << q.z() << "'/>";
  return xml.str();
}

std::string wing(const model::Side& s, int side) {
  std::ostringstream xml;
  xml << std::setprecision(17) << "<body pos='" << s.shoulder_m.x << ' ' << s.shoulder_m.y << ' ' << s.shoulder_m.z
      << "'>" << inertial(s.leading_edge) << "<joint axis='0 -1 0'/><joint axis='0 0 " << side << "'/><joint axis='"
      << side << " 0 0'/><body>" << inertial(s.wing) << "<joint axis='0 1 0'/></body></body>";
  return xml.str();
}

mjModel* load(const Vehicle& v, const Vector3d& gravity) {
  std::ostringstream xml;
  xml << std::setprecision(17) << "<mujoco><compiler angle='radian' balanceinertia='false'/><option gravity='"
      << gravity.transpose() << "'/><worldbody><body><freejoint/>" << inertial(v.torso) << wing(v.left, 1)
      << wing(v.right, -1) << "</body></worldbody></mujoco>";
  return mujoco_model(xml.str());
}

TEST(Jointed, AcceleratesAsMujocoSays) {
  constexpr int kAll = 14;
  constexpr double kTolerance = 1e-6;  // MuJoCo's quaternions and principal axes are good to about 1e-10 of the inertia
  test::Random random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Vehicle v = test::random_jointed(random);
    const test::JointedState x = test::random_state(random, v);
    const std::unique_ptr<mjModel, void (*)(mjModel*)> m(load(v, x.gravity_B), mj_deleteModel);
    const std::unique_ptr<mjData, void (*)(mjData*)> d(mj_makeData(m.get()), mj_deleteData);
    ASSERT_EQ(m->nv, kAll);
    for (int k = 0; k < 3; ++k) d->qvel[k] = x.velocity_B[k], d->qvel[3 + k] = x.body_rate[k];
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t j = 0; j < 4; ++j) {
        d->qpos[7 + 4 * side + j] = x.joints[side][j].angle;
        d->qvel[6 + 4 * side + j] = x.joints[side][j].rate;
      }
    mj_forward(m.get(), d.get());
    Eigen::Matrix<double, kAll, kAll, Eigen::RowMajor> M;
    for (int k = 0; k < kAll; ++k) {  // by columns, as each version keeps M in another form
      const Eigen::Matrix<double, kAll, 1> unit = Eigen::Matrix<double, kAll, 1>::Unit(k);
      Eigen::Matrix<double, kAll, 1> column;
      mj_mulM(m.get(), d.get(), column.data(), unit.data());
      M.col(k) = column;
    }
    Eigen::Matrix<double, kAll, 1> f = -Eigen::Map<Eigen::Matrix<double, kAll, 1>>(d->qfrc_bias), u, applied;
    applied.setZero();
    u.setZero();
    for (int side = 0; side < 2; ++side) {
      const int body = side == 0 ? 3 : 5;
      mj_applyFT(m.get(), d.get(), x.force[static_cast<std::size_t>(side)].data(),
                 x.moment[static_cast<std::size_t>(side)].data(), d->xpos + 3 * body, body, applied.data());
    }
    f += applied;
    std::vector<Eigen::Index> unknown = {0, 1, 2, 3, 4, 5};
    auto right = f;
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t j = 0; j < 4; ++j) {
        const auto i = static_cast<Eigen::Index>(6 + 4 * side + j);
        if ((side == 0 ? v.jointed->left : v.jointed->right).angles[j].mode == Jointed::Mode::free) {
          unknown.push_back(i);
          right[i] += x.joints[side][j].torque;
        } else {
          u[i] = x.joints[side][j].acceleration;
        }
      }
    right -= M * u;
    const Eigen::MatrixXd A = M(unknown, unknown);
    const Eigen::VectorXd solution = A.ldlt().solve(Eigen::VectorXd(right(unknown)));
    for (std::size_t i = 0; i < unknown.size(); ++i) u[unknown[i]] = solution[static_cast<Eigen::Index>(i)];
    const Eigen::Matrix<double, kAll, 1> torque = M * u - f;

    // ours
    const auto vec = [](const Vector3d& a) { return Vec3<double>{a.x(), a.y(), a.z()}; };
    const model::JointedParameters<double> p = model::derive_jointed(v);
    model::Sides<Moving<double>[model::kJoints]> q;
    model::FreeJoints free[2];
    int size = model::kBodyUnknowns;
    model::Sides<model::JointedLoad<double>> load_of{};
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t j = 0; j < 4; ++j) {
        const test::JointedState::Joint& joint = x.joints[side][j];
        const bool is_free = (side == 0 ? v.jointed->left : v.jointed->right).angles[j].mode == Jointed::Mode::free;
        (side == 0 ? q.left : q.right)[j] = {joint.angle, joint.rate, is_free ? 0 : joint.acceleration};
        if (is_free) free[side].unknown[j] = size++;
        (side == 0 ? load_of.left : load_of.right).pulls[j] = {is_free ? joint.torque : 0, 0};
      }
    const model::Sides<model::JointedPose<double>> pose{model::place_side<+1>(p.left, q.left, vec(x.body_rate)),
                                                        model::place_side<-1>(p.right, q.right, vec(x.body_rate))};
    load_of.left.force_N = pose.left.to_E(vec(x.force[0])), load_of.left.moment_Nm = pose.left.to_E(vec(x.moment[0]));
    load_of.right.force_N = pose.right.to_E(vec(x.force[1]));
    load_of.right.moment_Nm = pose.right.to_E(vec(x.moment[1]));
    const auto ours =
        model::accelerate(p, pose, q, load_of, vec(x.body_rate), vec(x.gravity_B), free, size, false, false);

    const auto& a = ours.acceleration_m_s2;
    const auto& w = ours.angular_acceleration_rad_s2;
    EXPECT_LT((Vector3d(a.x, a.y, a.z) - u.segment<3>(0)).norm(), kTolerance * u.segment<3>(0).norm());
    EXPECT_LT((Vector3d(w.x, w.y, w.z) - u.segment<3>(3)).norm(), kTolerance * u.segment<3>(3).norm());
    const double joint = u.tail<8>().cwiseAbs().maxCoeff(), most = torque.tail<8>().cwiseAbs().maxCoeff();
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t j = 0; j < 4; ++j) {
        const auto i = static_cast<Eigen::Index>(6 + 4 * side + j);
        EXPECT_NEAR((side == 0 ? ours.joint_rad_s2.left : ours.joint_rad_s2.right)[j], u[i], kTolerance * joint);
        EXPECT_NEAR((side == 0 ? ours.torque_Nm.left : ours.torque_Nm.right)[j], torque[i], kTolerance * most);
      }
  }
}

}  // namespace
}  // namespace flappy::reference
