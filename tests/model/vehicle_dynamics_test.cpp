// The rearranged equations of the step against Kane's method written independently (kane.hpp).
#include "model/vehicle_dynamics.hpp"

#include <gtest/gtest.h>

#include <random>

#include "model/derive.hpp"
#include "model/kane.hpp"
#include "vehicles.hpp"

namespace flappy::vehicle_dynamics_test {
namespace {

using model::Vec3;
using test::Vector3d;

class Random {
 public:
  double operator()(double scale) { return scale * std::uniform_real_distribution<double>(-1, 1)(engine_); }
  Vector3d vector(double scale) { return {(*this)(scale), (*this)(scale), (*this)(scale)}; }

 private:
  std::mt19937_64 engine_{7};
};

/// A vehicle with nothing symmetric and nothing zero.
model::Vehicle scrambled(Random& random) {
  model::Vehicle v = test::nominal();
  for (const model::Parameter& p : model::parameters(v)) {
    const bool product = p.path.ends_with(".xy") || p.path.ends_with(".yz") || p.path.ends_with(".xz");
    const bool com = p.path.find("com_m") != std::string::npos || p.path.find("shoulder_m") != std::string::npos;
    if (product) *p.value += random(0.1e-9);
    else if (com) *p.value += random(2e-3);
    else *p.value *= 1 + random(0.2);
  }
  return v;
}

Vec3<double> to_vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

struct Case {
  model::Vehicle vehicle;
  test::KaneState kane;
  test::KaneLoads loads;
  model::State<double> state{};
  model::Parameters<double> parameters;
  model::Sides<model::SideLoad<double>> load;
  model::BodyLoad<double> body;
};

Case random_case(Random& random) {
  Case c;
  c.vehicle = scrambled(random);
  for (model::Side* s : {&c.vehicle.left, &c.vehicle.right}) {
    s->motor.friction_Nm = 0;
    s->stroke = {-1.75, 1.75, 0, 0};
    s->rotation = {-1.75, 1.75, 0, 0};
  }
  c.vehicle.left.motor.rotor_spin_sense = 1;
  c.vehicle.right.motor.rotor_spin_sense = -0.6;
  for (model::Side* s : {&c.vehicle.left, &c.vehicle.right}) {  // no implicit damping: it would be part of the step
    s->planform.rotational_damping_coefficient = 0;
    s->motor.torque_constant_Nm_A = 0;
    s->motor.damping_Nm_s = 0;
  }
  c.parameters = model::derive(c.vehicle, 1e-6);
  test::KaneState& k = c.kane;
  k.velocity_B = random.vector(3);
  k.body_rate = random.vector(40);
  for (std::size_t i = 0; i < 2; ++i) {
    k.beta[i] = random(1.2), k.theta[i] = random(0.8);
    k.beta_rate[i] = random(300), k.theta_rate[i] = random(400);
  }
  c.state.body_rate_rad_s = to_vec(k.body_rate);
  c.state.left = {k.beta[0], k.theta[0], k.beta_rate[0], k.theta_rate[0]};
  c.state.right = {-k.beta[1], k.theta[1], -k.beta_rate[1], k.theta_rate[1]};
  test::KaneLoads& l = c.loads;
  l.gravity_B = random.vector(9.81);
  l.torso_force = random.vector(0.1);
  l.torso_moment = random.vector(1e-3);
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::Matrix3d to_B = Eigen::AngleAxisd(k.beta[i], Vector3d::UnitZ()).toRotationMatrix();
    const Vector3d force_L(random(0.2), 0, random(0.2)), moment_L = random.vector(1e-2);
    l.force[i] = to_B * force_L;
    l.moment[i] = to_B * moment_L;
    l.stroke_torque[i] = random(1e-2);
    l.rotation_torque[i] = random(1e-3);
    model::SideLoad<double>& load = i == 0 ? c.load.left : c.load.right;
    load = {force_L.x(), force_L.z(), to_vec(moment_L), moment_L.z() + l.stroke_torque[i],
            moment_L.y() + l.rotation_torque[i]};
  }
  return c;
}

struct Solution {
  model::Motion<double> motion;
  Vec3<double> force;
};

model::Sides<model::WingPose<double>> pose_of(const Case& c) {
  return {model::place_wing<+1>(c.parameters.left, c.state.left, c.state.body_rate_rad_s),
          model::place_wing<-1>(c.parameters.right, c.state.right, c.state.body_rate_rad_s)};
}

Solution solve(Case& c, const test::KaneSystem& k, double step) {
  const auto pose = pose_of(c);
  const model::Sides<model::WingInertia<double>> wing{model::wing_inertia(c.parameters.left, pose.left),
                                                      model::wing_inertia(c.parameters.right, pose.right)};
  const auto whole = model::whole_vehicle(c.parameters, pose);
  c.body = {to_vec(c.loads.torso_force), to_vec(c.loads.torso_moment - k.com.cross(c.loads.torso_force))};
  const auto inertia = model::body_inertia(c.parameters, c.state, pose, wing, whole);
  const auto drive = model::drive_body(c.parameters, c.state, pose, wing, whole, inertia, c.load, c.body,
                                       to_vec(-c.loads.gravity_B), 1.0);
  const auto hinges = model::eliminate_body(c.parameters, pose, wing, whole, inertia, drive, c.load);
  return {model::move(c.parameters, c.state, inertia, drive, hinges, step, 1 / step), drive.force};
}

// A step this short leaves 1e-10 of relative rounding in (new rate - rate) / step.
constexpr double kStep = 1e-6;
constexpr double kTolerance = 1e-8;

double acceleration(double turn, double old_rate) { return (turn / kStep - old_rate) / kStep; }

TEST(VehicleDynamics, AcceleratesAsKaneSays) {
  Random random;
  for (int trial = 0; trial < 200; ++trial) {
    Case c = random_case(random);
    const test::KaneSystem k = test::kane(c.vehicle, c.kane, c.loads);
    const test::Speeds a = k.mass.llt().solve(k.right_side);
    const auto [m, applied] = solve(c, k, kStep);
    const auto near = [&](double ours, double theirs, double scale) { EXPECT_NEAR(ours, theirs, kTolerance * scale); };
    const double body = a.segment<3>(3).norm(), hinge = a.tail<4>().norm();
    near(m.body_acceleration.x, a[3], body);
    near(m.body_acceleration.y, a[4], body);
    near(m.body_acceleration.z, a[5], body);
    near(acceleration(m.stroke_left, c.kane.beta_rate[0]), a[6], hinge);
    near(acceleration(m.stroke_right, c.kane.beta_rate[1]), a[7], hinge);
    near(acceleration(m.rotation_left, c.kane.theta_rate[0]), a[8], hinge);
    near(acceleration(m.rotation_right, c.kane.theta_rate[1]), a[9], hinge);
    const Vector3d force = c.loads.force[0] + c.loads.force[1] + c.loads.torso_force;
    near(applied.x, force.x(), force.norm());
    near(applied.z, force.z(), force.norm());
  }
}

TEST(VehicleDynamics, WeldedTorsoLeavesTheHingesOfKane) {
  Random random;
  for (int trial = 0; trial < 50; ++trial) {
    Case c = random_case(random);
    c.kane.velocity_B.setZero();
    c.kane.body_rate.setZero();
    c.state.body_rate_rad_s = {0, 0, 0};
    c.state.support = static_cast<double>(model::Support::welded);
    const test::KaneSystem k = test::kane(c.vehicle, c.kane, c.loads);
    const Eigen::Vector4d a = k.mass.bottomRightCorner<4, 4>().llt().solve(k.right_side.tail<4>());
    const auto [m, applied] = solve(c, k, kStep);
    EXPECT_EQ(m.body_acceleration.x, 0);
    EXPECT_NEAR(acceleration(m.stroke_left, c.kane.beta_rate[0]), a[0], kTolerance * a.norm());
    EXPECT_NEAR(acceleration(m.stroke_right, c.kane.beta_rate[1]), a[1], kTolerance * a.norm());
    EXPECT_NEAR(acceleration(m.rotation_left, c.kane.theta_rate[0]), a[2], kTolerance * a.norm());
    EXPECT_NEAR(acceleration(m.rotation_right, c.kane.theta_rate[1]), a[3], kTolerance * a.norm());
  }
}

TEST(VehicleDynamics, CentreOfMassAndItsVelocity) {
  Random random;
  for (int trial = 0; trial < 50; ++trial) {
    Case c = random_case(random);
    const test::KaneSystem k = test::kane(c.vehicle, c.kane, c.loads);
    const auto whole = model::whole_vehicle(c.parameters, pose_of(c));
    const Vector3d rate = k.momentum / k.total_mass - c.kane.velocity_B - c.kane.body_rate.cross(k.com);
    EXPECT_NEAR(whole.com.x, k.com.x(), 1e-15);
    EXPECT_NEAR(whole.com.y, k.com.y(), 1e-15);
    EXPECT_NEAR(whole.com.z, k.com.z(), 1e-15);
    EXPECT_NEAR(whole.com_rate.x, rate.x(), 1e-12 * rate.norm() + 1e-13);
    EXPECT_NEAR(whole.com_rate.y, rate.y(), 1e-12 * rate.norm() + 1e-13);
    EXPECT_NEAR(whole.com_rate.z, rate.z(), 1e-12 * rate.norm() + 1e-13);
  }
}

}  // namespace
}  // namespace flappy::vehicle_dynamics_test
