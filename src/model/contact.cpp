#include "model/contact.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "io/toml_writer.hpp"
#include "model/derive.hpp"

namespace flappy::model {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 3, 6>;

constexpr double kTangential = 0.8;  // k_t/k of [3] at Poisson's ratio 1/3

Eigen::Matrix3d across(const Eigen::Vector3d& r) {
  Eigen::Matrix3d m;
  m << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  return m;
}

Eigen::Vector3d vec(const Triple& t) { return {t.x, t.y, t.z}; }

const RigidBody& body_of(const Vehicle& v, ContactPoint::Body on) {
  switch (on) {
    case ContactPoint::Body::left_leading_edge:
      return v.left.leading_edge;
    case ContactPoint::Body::left_wing:
      return v.left.wing;
    case ContactPoint::Body::right_leading_edge:
      return v.right.leading_edge;
    case ContactPoint::Body::right_wing:
      return v.right.wing;
    case ContactPoint::Body::torso:
      break;
  }
  return v.torso;
}

/// Mass matrix of a body that flies alone, about its centre of mass: velocity, then angular velocity.
Matrix6 mass_of(const RigidBody& b) {
  const InertiaTensor& i = b.inertia_kg_m2;
  Matrix6 m = Matrix6::Zero();
  m.topLeftCorner<3, 3>() = b.mass_kg * Eigen::Matrix3d::Identity();
  m.bottomRightCorner<3, 3>() << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
  return m;
}

Jacobian point_of(const RigidBody& b, const Triple& position_m) {
  Jacobian j;
  j << Eigen::Matrix3d::Identity(), -across(vec(position_m) - vec(b.com_m));
  return j;
}

/// Upper bound of w by Gershgorin's row sums. Plain sums and products: the same bits on every processor.
double largest_inverse_mass(const RigidBody& b, const Triple& position_m) {
  const InertiaTensor& i = b.inertia_kg_m2;
  const auto inertia = inverse(Sym3<double>{i.xx, i.yy, i.zz, i.xy, i.yz, i.xz});
  const Vec3<double> r{position_m.x - b.com_m.x, position_m.y - b.com_m.y, position_m.z - b.com_m.z};
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3<double> push{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
    const Vec3<double> turned = cross(inertia.scale * (inertia.adjugate * cross(r, push)), r);
    const Vec3<double> row = (1 / b.mass_kg) * push + turned;
    largest = std::max(largest, std::abs(row.x) + std::abs(row.y) + std::abs(row.z));
  }
  return largest;
}

}  // namespace

std::vector<ContactConstants<double>> contact_constants(const Vehicle& vehicle) {
  if (vehicle.contact.empty()) return {};
  const Vehicle v = built(vehicle);
  std::vector<ContactConstants<double>> list;
  for (const ContactPoint& p : v.contact) {
    const double w = largest_inverse_mass(body_of(v, p.on), p.position_m), k_t = kTangential * p.stiffness_N_m;
    list.push_back({{p.position_m.x, p.position_m.y, p.position_m.z},
                    p.stiffness_N_m,
                    1.5 * p.damping_s_m,
                    p.friction,
                    k_t,
                    2 * std::sqrt(k_t / w),
                    w,
                    p.grasp_m_s});
  }
  return list;
}

std::optional<PhysicalFault> contact_fault(const Vehicle& vehicle, double step_s, double limit) {
  if (vehicle.contact.empty()) return std::nullopt;
  const Vehicle v = built(vehicle);
  for (const ContactPoint& first : v.contact) {
    const RigidBody& body = body_of(v, first.on);
    Matrix6 stiffness = Matrix6::Zero();
    const ContactPoint* stiffest = &first;
    for (const ContactPoint& p : v.contact) {
      if (p.on != first.on) continue;
      const Jacobian j = point_of(body, p.position_m);
      stiffness += p.stiffness_N_m * j.transpose() * j;
      if (p.stiffness_N_m > stiffest->stiffness_N_m) stiffest = &p;
    }
    const double omega2 =
        Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6>(stiffness, mass_of(body), Eigen::EigenvaluesOnly)
            .eigenvalues()[5];
    const double reached = step_s * step_s * omega2;
    if (reached > limit)
      return PhysicalFault{
          "contact." + stiffest->name + ".stiffness_N_m",
          "the points of this body are too stiff for its mass in steps of " + io::toml_number(step_s) + " s",
          "up to " + io::toml_number(std::floor(1e3 * stiffest->stiffness_N_m * limit / reached) / 1e3) +
              " N/m where all its points are softer by as much, or shorter steps"};
  }
  return std::nullopt;
}

}  // namespace flappy::model
