#include "lab/blind/a/a_robot.hpp"

#include <Eigen/Cholesky>

namespace flappy::blind {
namespace {

Vector3d vector(const model::Triple& t) { return {t.x, t.y, t.z}; }

/// Inertia of a unit point mass about a point `d` away.
Matrix3d point_inertia(const Vector3d& d) { return d.squaredNorm() * Matrix3d::Identity() - d * d.transpose(); }

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Natural frequency of a wing on its stop. An impact presses the stop in by 0.01 rad; stop_compliance softens it.
constexpr double kStopFrequency_rad_s = 1.1e4;

}  // namespace

Robot::Robot(const model::Vehicle& v, const Room& room, const Magnitudes& magnitudes, std::uint64_t seed,
             std::uint64_t flight, double step_s, bool swapped_wings)
    : room_(room),
      magnitudes_(magnitudes),
      step_s_(step_s),
      density_kg_m3_(v.air_density_kg_m3),
      slow_steps_(std::max(1, static_cast<int>(std::lround(1e-3 / step_s)))),
      gust_random_(seed, Purpose::gusts, flight),
      delay_random_(seed, Purpose::delays, flight),
      brush_random_(seed, Purpose::brushes, flight) {
  const auto body = [](const model::RigidBody& b) {
    Body to{b.mass_kg, vector(b.com_m), Matrix3d::Zero()};
    const auto& i = b.inertia_kg_m2;
    to.inertia_kg_m2 << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
    return to;
  };
  torso_ = body(v.torso);
  if (const double magnitude = magnitudes[Effect::com_offset]; magnitude > 0) {
    // the battery lies beside its place
    Random random(seed, Purpose::com_offset);
    const Vector3d moved = magnitude * laws::kBatteryMoved_m * random.level();
    const Vector3d shift = laws::kBattery_kg / torso_.mass_kg * moved;
    torso_.inertia_kg_m2 += laws::kBattery_kg * point_inertia(moved) - torso_.mass_kg * point_inertia(shift);
    torso_.com_m += shift;
  }
  if (const double magnitude = magnitudes[Effect::inertia_products]; magnitude > 0) {
    Random random(seed, Purpose::inertia_products);
    Matrix3d& i = torso_.inertia_kg_m2;
    for (int a = 0; a < 3; ++a)
      for (int b = a + 1; b < 3; ++b) {
        const double product = laws::kProducts[a + b - 1] * magnitude * random.sign() * std::sqrt(i(a, a) * i(b, b));
        i(a, b) += product, i(b, a) += product;
      }
  }
  const bool left_damaged = (Random(seed, Purpose::damaged_side).uniform() < 0.5) != swapped_wings;
  for (const std::size_t s : {0u, 1u}) {
    const model::Side& from = s == 0 ? v.left : v.right;
    side_[s].leading_edge = body(from.leading_edge);
    side_[s].wing = body(from.wing);
    build_side(from, s, left_damaged == (s == 0));
  }
  mass_kg_ = torso_.mass_kg;
  for (const Side& s : side_) mass_kg_ += s.leading_edge.mass_kg + s.wing.mass_kg;

  Random random(seed, Purpose::directions);
  wind_direction_ = random.level();
  magnet_ = random.level();
  front_ = random.level();
  shedding_axis_ = random.level();
  shedding_Hz_ = random.between(laws::kSheddingLow_Hz, laws::kSheddingHigh_Hz);
  field_ = (random.level() + Vector3d(0, 0, -laws::kDip)).normalized();
}

void Robot::build_side(const model::Side& from, std::size_t s, bool damaged) {
  Side& to = side_[s];
  to.sign = s == 0 ? 1 : -1;
  to.shoulder_m = vector(from.shoulder_m);
  to.motor = from.motor;
  to.spring = from.spring;
  to.planform = from.planform;
  to.stroke = from.stroke;
  to.rotation = from.rotation;
  to.strips = cut_into_strips(from.planform);
  if (damaged) damage(to);
  if (const double magnitude = magnitudes_[Effect::wing_inertia]; magnitude > 0) {
    Matrix3d& i = to.wing.inertia_kg_m2;
    i(0, 0) *= 1 + laws::kWingMoments * magnitude;
    i(2, 2) *= 1 + laws::kWingMoments * magnitude;
    const double product = laws::kWingProduct * magnitude * to.sign * std::sqrt(i(1, 1) * i(2, 2));
    i(1, 2) += product, i(2, 1) += product;
    to.wing.com_m.z() *= 1 + laws::kWingCentre * magnitude;
  }
  to.twist = laws::twist_shape(to.strips);
  const auto about = [](const Body& b, int axis) {
    return b.inertia_kg_m2(axis, axis) + b.mass_kg * (b.com_m.squaredNorm() - b.com_m(axis) * b.com_m(axis));
  };
  const auto stop = [](const model::Joint& joint, double inertia, double softness) {
    const double stiffness = inertia * kStopFrequency_rad_s * kStopFrequency_rad_s;
    return Stop{joint.lower_rad, joint.upper_rad, softness, {stiffness, 2 * std::sqrt(stiffness * inertia)}};
  };
  to.rotation_stop = stop(to.rotation, about(to.wing, 1), magnitudes_[Effect::stop_compliance]);
  to.stroke_stop = stop(to.stroke, about(to.wing, 2) + about(to.leading_edge, 2), 0);
}

Stop Robot::rotation_stop(std::size_t side) const { return side_[side].rotation_stop; }

/// The trailing edge wears; its membrane's mass goes with it.
void Robot::damage(Side& s) {
  const double magnitude = magnitudes_[Effect::wing_damage];
  if (!(magnitude > 0)) return;
  double area_m2 = 0, lost_m2 = 0;
  Vector3d at = Vector3d::Zero();
  for (std::size_t i = 0; i < kStrips; ++i) {
    double& c = s.strips.chord_m[i];
    const double lost = c * laws::wear(magnitude, s.strips.r_m[i] / s.planform.wing_length_m);
    area_m2 += c, lost_m2 += lost;
    at += lost * Vector3d(0, s.sign * s.strips.r_m[i], -(c - lost / 2));
    c -= lost;
  }
  at /= lost_m2;
  const double lost_kg = s.wing.mass_kg * laws::kMembrane * lost_m2 / area_m2, rest_kg = s.wing.mass_kg - lost_kg;
  const Vector3d com = (s.wing.mass_kg * s.wing.com_m - lost_kg * at) / rest_kg;
  s.wing.inertia_kg_m2 -= lost_kg * point_inertia(at - s.wing.com_m) + rest_kg * point_inertia(com - s.wing.com_m);
  s.wing.mass_kg = rest_kg;
  s.wing.com_m = com;
}

void Robot::pose_sides() {
  R_ = x_.torso.attitude.toRotationMatrix();
  const Vector3d& w = x_.torso.rate_rad_s;
  for (const std::size_t k : {0u, 1u}) {
    const Wing& q = x_.side[k].wing;
    const double sg = side_[k].sign;
    const SinCos stroke = sin_cos(sg * q.stroke_rad), rotation = sin_cos(q.rotation_rad);
    Pose& p = pose_[k];
    p.edge << stroke.cos, -stroke.sin, 0, stroke.sin, stroke.cos, 0, 0, 0, 1;
    p.wing.col(1) = p.edge.col(1);
    p.wing.col(0) = rotation.cos * p.edge.col(0) - rotation.sin * p.edge.col(2);
    p.wing.col(2) = rotation.sin * p.edge.col(0) + rotation.cos * p.edge.col(2);
    p.stroke_axis = Vector3d(0, 0, sg);
    p.rotation_axis = p.edge.col(1);
    const Vector3d stroking = q.stroke_rad_s * p.stroke_axis, rotating = q.rotation_rad_s * p.rotation_axis;
    p.edge_rate = w + stroking;
    p.wing_rate = p.edge_rate + rotating;
    p.edge_turning = w.cross(stroking);
    p.wing_turning = p.edge_turning + p.edge_rate.cross(rotating);
  }
}

/// Joints are the unknowns first, first + 1, ... `acceleration`: of the centre of mass at x = 0, in B.
template <int joints>
void Robot::add_body(double m, const Matrix3d& I, const Vector3d& c, const Vector3d& rate, const Vector3d& turning,
                     const Vector3d& acceleration, const std::array<Column, 2>& column, int first) {
  mass_matrix_.block<3, 3>(0, 0) += I + m * point_inertia(c);
  mass_matrix_.block<3, 3>(3, 0) -= m * cross_matrix(c);
  const Vector3d weight = -room_.gravity_m_s2 * R_.row(2).transpose();
  const Vector3d force = m * (acceleration - weight), moment = I * turning + rate.cross(I * rate);
  rhs_.segment<3>(0) -= moment + c.cross(force);
  rhs_.segment<3>(3) -= force;
  for (int k = 0; k < joints; ++k) {
    const Column& a = column[static_cast<std::size_t>(k)];
    const Vector3d spin = I * a.turn, shift = m * a.shift;
    mass_matrix_.block<1, 3>(first + k, 0) += (spin + c.cross(shift)).transpose();
    mass_matrix_.block<1, 3>(first + k, 3) += shift.transpose();
    for (int l = 0; l <= k; ++l) {
      const Column& b = column[static_cast<std::size_t>(l)];
      mass_matrix_(first + k, first + l) += b.turn.dot(spin) + b.shift.dot(shift);
    }
    rhs_(first + k) -= a.turn.dot(moment) + a.shift.dot(force);
  }
}

void Robot::assemble() {
  mass_matrix_.setZero();
  rhs_.setZero();
  const Vector3d& w = x_.torso.rate_rad_s;
  for (int k = 3; k < 6; ++k) mass_matrix_(k, k) = mass_kg_;
  add_body<0>(torso_.mass_kg, torso_.inertia_kg_m2, torso_.com_m, w, Vector3d::Zero(), w.cross(w.cross(torso_.com_m)),
              {}, 6);
  for (const std::size_t k : {0u, 1u}) {
    const Side& s = side_[k];
    const Pose& p = pose_[k];
    const int first = 6 + 2 * static_cast<int>(k);
    const Vector3d shoulder = w.cross(w.cross(s.shoulder_m));
    const auto swung = [&](const Vector3d& r, const Vector3d& rate, const Vector3d& turning) {
      return Vector3d(shoulder + turning.cross(r) + rate.cross(rate.cross(r)));
    };
    const Vector3d to_edge = p.edge * s.leading_edge.com_m, to_wing = p.wing * s.wing.com_m;
    add_body<1>(s.leading_edge.mass_kg, p.edge * s.leading_edge.inertia_kg_m2 * p.edge.transpose(),
                s.shoulder_m + to_edge, p.edge_rate, p.edge_turning, swung(to_edge, p.edge_rate, p.edge_turning),
                {Column{p.stroke_axis, p.stroke_axis.cross(to_edge)}, Column{}}, first);
    add_body<2>(
        s.wing.mass_kg, p.wing * s.wing.inertia_kg_m2 * p.wing.transpose(), s.shoulder_m + to_wing, p.wing_rate,
        p.wing_turning, swung(to_wing, p.wing_rate, p.wing_turning),
        {Column{p.stroke_axis, p.stroke_axis.cross(to_wing)}, Column{p.rotation_axis, p.rotation_axis.cross(to_wing)}},
        first);
  }
}

/// A spring-damper that only pushes, implicit: (M + h D + h^2 K) x = Q - K (d + h rate) - D rate.
void Robot::add_stop(int joint, const Stop& stop, double angle, double rate) {
  const double beyond = angle > stop.upper_rad   ? angle - stop.upper_rad
                        : angle < stop.lower_rad ? angle - stop.lower_rad
                                                 : 0;
  if (beyond == 0) return;
  const laws::StopForce f = laws::stop(stop.softness, beyond, stop.hard);
  const double torque = f.stiffness_Nm_rad * (beyond + step_s_ * rate) + f.damping_Nm_s * rate;
  if (torque * beyond <= 0) return;
  rhs_(joint) -= torque;
  mass_matrix_(joint, joint) += step_s_ * (f.damping_Nm_s + step_s_ * f.stiffness_Nm_rad);
}

void Robot::add_joints() {
  for (const std::size_t k : {0u, 1u}) {
    const Side& s = side_[k];
    const Wing& q = x_.side[k].wing;
    const int stroke = 6 + 2 * static_cast<int>(k), rotation = stroke + 1;
    // dry friction, smoothed over 0.5 rad/s (stroke) and 1 rad/s (rotation)
    rhs_(stroke) += motor_torque(k) - s.stroke.damping_Nm_s * q.stroke_rad_s -
                    s.stroke.friction_Nm * hyperbolic_tangent(q.stroke_rad_s / 0.5);
    rhs_(rotation) -=
        s.rotation.damping_Nm_s * q.rotation_rad_s + s.rotation.friction_Nm * hyperbolic_tangent(q.rotation_rad_s);
    const double stretch = q.stroke_rad - s.spring.rest_angle_rad;
    const double stiffness = stretch > 0 ? s.spring.stiffness_positive_Nm_rad : s.spring.stiffness_negative_Nm_rad;
    rhs_(stroke) -= stiffness * stretch;
    if (const double magnitude = magnitudes_[Effect::spring_hardening]; magnitude > 0)
      rhs_(stroke) -= magnitude * laws::leaf_added(stiffness, stretch);
    add_stop(stroke, s.stroke_stop, q.stroke_rad, q.stroke_rad_s);
    add_stop(rotation, s.rotation_stop, q.rotation_rad, q.rotation_rad_s);
  }
}

void Robot::add_force(const Vector3d& point, const Vector3d& force) {
  rhs_.segment<3>(0) += point.cross(force);
  rhs_.segment<3>(3) += force;
}

void Robot::step(double left_V, double right_V) {
  if (until_slow_-- == 0) {
    const double dt_s = slow_steps_ * step_s_;
    update_surroundings(dt_s);
    update_drive(dt_s);
    until_slow_ = slow_steps_ - 1;
  }
  drive(left_V, right_V);
  pose_sides();
  assemble();
  add_joints();
  blow();
  push();
  integrate();
}

void Robot::integrate() {
  const double h = step_s_;
  Torso& t = x_.torso;
  Vector10 x;
  if (held_) {
    x.head<6>().setZero();
    x.tail<4>() = mass_matrix_.bottomRightCorner<4, 4>().llt().solve(rhs_.tail<4>());
    x_.acceleration_m_s2.setZero();
    x_.turning_rad_s2.setZero();
  } else {
    x = mass_matrix_.llt().solve(rhs_);
    x_.turning_rad_s2 = x.head<3>();
    x_.acceleration_m_s2 = x.segment<3>(3);
    t.rate_rad_s += h * x.head<3>();
    t.velocity_m_s += h * (R_ * x.segment<3>(3));
    t.position_m += h * t.velocity_m_s;
    t.attitude = (t.attitude * turned_by(h * t.rate_rad_s)).normalized();
  }
  for (const std::size_t k : {0u, 1u}) {
    Wing& q = x_.side[k].wing;
    const int first = 6 + 2 * static_cast<int>(k);
    q.stroke_rad_s += h * x(first);
    q.rotation_rad_s += h * x(first + 1);
    q.stroke_rad += h * q.stroke_rad_s;
    q.rotation_rad += h * q.rotation_rad_s;
  }
  x_.t_s += h;
}

Vector3d Robot::specific_force(const Vector3d& p) const {
  const Vector3d& w = x_.torso.rate_rad_s;
  return x_.acceleration_m_s2 + x_.turning_rad_s2.cross(p) + w.cross(w.cross(p)) +
         room_.gravity_m_s2 * R_.row(2).transpose();
}

Robot::Momentum Robot::momentum() const {
  Robot now = *this;
  now.pose_sides();
  const Vector3d &w = x_.torso.rate_rad_s, v0 = now.R_.transpose() * x_.torso.velocity_m_s;
  Momentum sum{Vector3d::Zero(), Vector3d::Zero(), 0};
  const auto add = [&](const Body& b, const Matrix3d& frame, const Vector3d& com, const Vector3d& rate,
                       const Vector3d& velocity) {
    const Vector3d p = b.mass_kg * velocity, spin = frame * (b.inertia_kg_m2 * (frame.transpose() * rate));
    sum.linear_kg_m_s += now.R_ * p;
    sum.angular_kg_m2_s += now.R_ * spin + (x_.torso.position_m + now.R_ * com).cross(now.R_ * p);
    sum.energy_J += (p.dot(velocity) + spin.dot(rate)) / 2;
  };
  add(torso_, Matrix3d::Identity(), torso_.com_m, w, v0 + w.cross(torso_.com_m));
  for (const std::size_t k : {0u, 1u}) {
    const Side& s = side_[k];
    const Pose& p = now.pose_[k];
    const Wing& q = x_.side[k].wing;
    const Vector3d shoulder = v0 + w.cross(s.shoulder_m), to_edge = p.edge * s.leading_edge.com_m,
                   to_wing = p.wing * s.wing.com_m;
    add(s.leading_edge, p.edge, s.shoulder_m + to_edge, p.edge_rate, shoulder + p.edge_rate.cross(to_edge));
    add(s.wing, p.wing, s.shoulder_m + to_wing, p.wing_rate, shoulder + p.wing_rate.cross(to_wing));
    const double stretch = q.stroke_rad - s.spring.rest_angle_rad;
    const double stiffness = stretch > 0 ? s.spring.stiffness_positive_Nm_rad : s.spring.stiffness_negative_Nm_rad;
    const double rotor = s.motor.efficiency * s.motor.gear_ratio * s.motor.gear_ratio * s.motor.rotor_inertia_kg_m2;
    sum.energy_J += (stiffness * stretch * stretch + rotor * q.stroke_rad_s * q.stroke_rad_s) / 2;
  }
  return sum;
}

}  // namespace flappy::blind
