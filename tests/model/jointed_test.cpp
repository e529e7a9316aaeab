// Vehicles with four angles a wing: their equations of motion against Kane's method written independently, with Eigen and for any chain of bodies, and
// against what their inverse dynamics gives; their gait and its filter against differences; their air against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "model/derive_jointed.hpp"
#include "model/jointed_kane.hpp"

namespace flappy {
namespace {

using model::Jointed, model::Moving, model::Vec3, model::Vehicle;
using test::Random, test::Vector3d;

Vec3<double> to_vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

struct Case {
  Vehicle vehicle;
  test::JointedState state;
  model::JointedParameters<double> parameters;
  model::Sides<Moving<double>[model::kJoints]> q;
  model::Sides<model::JointedPose<double>> pose;
  model::Sides<model::JointedLoad<double>> load{};
  model::FreeJoints free[2];
  int size = model::kBodyUnknowns;
};

Case random_case(Random& random, bool carries_air) {
  Case c;
  c.vehicle = test::random_jointed(random);
  c.parameters = model::derive_jointed(c.vehicle);
  c.state = test::random_state(random, c.vehicle);
  if (carries_air) {
    c.parameters.left.added = {3e-4, 2e-9, 4e-8, -3e-7, 2e-9, -2e-6};
    c.parameters.right.added = {4e-4, 3e-9, 5e-8, -4e-7, -2e-9, 3e-6};
  }
  for (std::size_t side = 0; side < 2; ++side) {
    auto& q = side == 0 ? c.q.left : c.q.right;
    auto& free = c.free[side];
    auto& load = side == 0 ? c.load.left : c.load.right;
    const Jointed::Wing& w = side == 0 ? c.vehicle.jointed->left : c.vehicle.jointed->right;
    for (std::size_t j = 0; j < 4; ++j) {
      const test::JointedState::Joint& x = c.state.joints[side][j];
      const bool is_free = w.angles[j].mode == Jointed::Mode::free;
      q[j] = {x.angle, x.rate, is_free ? 0 : x.acceleration};
      if (is_free) free.unknown[j] = c.size++;
      load.pulls[j] = {is_free ? x.torque : 0, 0};
    }
  }
  const Vec3<double> w = to_vec(c.state.body_rate);
  c.pose = {model::place_side<+1>(c.parameters.left, c.q.left, w),
            model::place_side<-1>(c.parameters.right, c.q.right, w)};
  for (std::size_t side = 0; side < 2; ++side) {  // what the air does, and how fast the shoulder is in it
    const auto& g = side == 0 ? c.pose.left : c.pose.right;
    auto& load = side == 0 ? c.load.left : c.load.right;
    load.force_N = g.to_E(to_vec(c.state.force[side]));
    load.moment_Nm = g.to_E(to_vec(c.state.moment[side]));
    const model::Triple& s = (side == 0 ? c.vehicle.left : c.vehicle.right).shoulder_m;
    load.air_speed_m_s = g.to_E(to_vec(c.state.velocity_B) + cross(w, Vec3<double>{s.x, s.y, s.z}));
  }
  return c;
}

model::JointedMotion<double> solved(const Case& c, bool carries_air, bool held = false) {
  return model::accelerate(c.parameters, c.pose, c.q, c.load, to_vec(c.state.body_rate), to_vec(c.state.gravity_B),
                           c.free, c.size, carries_air, held);
}

// Both are exact; their linear systems are solved to about 1e-16 times condition numbers of 1e6.
constexpr double kTolerance = 1e-8;

TEST(Jointed, AcceleratesAsKaneSays) {
  Random random;
  for (int trial = 0; trial < 300; ++trial) {
    for (const bool carries_air : {false, true}) {
      Case c = random_case(random, carries_air);
      const auto m = solved(c, carries_air);
      std::array<Eigen::Matrix3d, 2> added;
      for (std::size_t side = 0; side < 2; ++side) {
        const auto& k = (side == 0 ? c.parameters.left : c.parameters.right).added;
        added[side] << k.xx, k.xy, k.xz, k.xy, k.yy, k.yz, k.xz, k.yz, k.zz;
      }
      const test::JointedAnswer kane = test::jointed_kane(c.vehicle, c.state, added);
      const Vector3d ours(m.acceleration_m_s2.x, m.acceleration_m_s2.y, m.acceleration_m_s2.z),
          turn(m.angular_acceleration_rad_s2.x, m.angular_acceleration_rad_s2.y, m.angular_acceleration_rad_s2.z);
      EXPECT_LT((ours - kane.acceleration).norm(), kTolerance * kane.acceleration.norm());
      EXPECT_LT((turn - kane.angular_acceleration).norm(), kTolerance * kane.angular_acceleration.norm());
      double joint = 0, torque = 0;
      for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t j = 0; j < 4; ++j) {
          joint = std::max(joint, std::abs(kane.joint[side][j]));
          torque = std::max(torque, std::abs(kane.torque[side][j]));
        }
      for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t j = 0; j < 4; ++j) {
          EXPECT_NEAR((side == 0 ? m.joint_rad_s2.left : m.joint_rad_s2.right)[j], kane.joint[side][j],
                      kTolerance * joint);
          EXPECT_NEAR((side == 0 ? m.torque_Nm.left : m.torque_Nm.right)[j], kane.torque[side][j], kTolerance * torque);
        }
    }
  }
}

TEST(Jointed, HeldTorsoLeavesTheFreeAnglesOfKane) {
  Random random;
  for (int trial = 0; trial < 100; ++trial) {
    Case c = random_case(random, false);
    const auto m = solved(c, false, true);
    const test::JointedAnswer kane =
        test::jointed_kane(c.vehicle, c.state, {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}, true);
    EXPECT_EQ(m.acceleration_m_s2.x, 0);
    EXPECT_EQ(m.angular_acceleration_rad_s2.z, 0);
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t j = 0; j < 4; ++j)
        EXPECT_NEAR((side == 0 ? m.joint_rad_s2.left : m.joint_rad_s2.right)[j], kane.joint[side][j],
                    kTolerance * (1e5 + std::abs(kane.joint[side][j])));
  }
}

}  // namespace
}  // namespace flappy
