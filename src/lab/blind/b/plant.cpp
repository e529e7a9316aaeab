#include "lab/blind/b/plant.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flappy::blind::b {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

Wrench times(const Matrix6d& inertia, const Twist& t) {
  Vector6d column;
  column << t.w, t.v;
  const Vector6d f = inertia * column;
  return {f.head<3>(), f.tail<3>()};
}

/// Wrench that air of an inertia needs which moves and speeds up (Kirchhoff).
Wrench air_takes(const Matrix6d& inertia, const Twist& moves, const Twist& speeds_up) {
  return times(inertia, speeds_up) + cross(moves, times(inertia, moves));
}

}  // namespace

struct Plant::SideNow {
  Matrix3d edge, wing;  // frames in B
  double sine, cosine;  // of the rotation angle
  Twist s1, s2;
  Inertia edge_inertia, wing_inertia;
  Eigen::Matrix<double, 6, 3> added_twist;  // columns project the wing's twist on w_y, w_z and v_x at the shoulder
};

Matrix3d rotation_matrix(const State& x) {
  const double w = x[kQuaternion], i = x[kQuaternion + 1], j = x[kQuaternion + 2], k = x[kQuaternion + 3];
  Matrix3d R;
  R << 1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j), 2 * (i * j + w * k), 1 - 2 * (i * i + k * k),
      2 * (j * k - w * i), 2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j);
  return R;
}

Plant::Plant(RobotParameters parameters, const EffectMagnitudes& effect_magnitudes)
    : f_(std::move(parameters)), a_(effect_magnitudes), wing_{WingAir(f_, a_, 0), WingAir(f_, a_, 1)} {
  Link torso = f_.torso;
  torso.com_m += a_[kComOffset] * a_.com_m;
  const double mean = torso.inertia_kg_m2.trace() / 3;
  const Vector3d products = a_[kInertiaProducts] * mean * a_.products;
  torso.inertia_kg_m2(0, 1) += products[0], torso.inertia_kg_m2(1, 0) += products[0];
  torso.inertia_kg_m2(0, 2) += products[1], torso.inertia_kg_m2(2, 0) += products[1];
  torso.inertia_kg_m2(1, 2) += products[2], torso.inertia_kg_m2(2, 1) += products[2];
  torso_ = inertia_at(torso.mass_kg, torso.com_m, torso.inertia_kg_m2, Matrix3d::Identity(), Vector3d::Zero());
  for (std::size_t j = 0; j < 2; ++j) {
    Link& wing = f_.side[j].wing;
    // the same on both wings; products of inertia with y are mirror images
    wing.com_m.z() -= a_[kWingInertia] * a_.wing_com_m;
    const double product = a_[kWingInertia] * a_.wing_product_kg_m2 * (j == 0 ? 1 : -1);
    wing.inertia_kg_m2(1, 2) += product;
    wing.inertia_kg_m2(2, 1) += product;
  }
}

Slow Plant::fresh() const {
  Slow slow;
  for (std::size_t j = 0; j < 2; ++j) {
    slow.resistance_ohm[j] = f_.side[j].motor.resistance_ohm;
    slow.torque_constant_Nm_A[j] = f_.side[j].motor.torque_constant_Nm_A;
  }
  return slow;
}

void Plant::place(const State& x, std::size_t side, SideNow& now) const {
  const Side& s = f_.side[side];
  const double sign = side == 0 ? 1 : -1;
  const double c = std::cos(x[kStroke + side]), n = sign * std::sin(x[kStroke + side]);
  now.cosine = std::cos(x[kRotation + side]);
  now.sine = std::sin(x[kRotation + side]);
  now.edge << c, -n, 0, n, c, 0, 0, 0, 1;
  now.wing.col(0) = now.cosine * now.edge.col(0) - now.sine * now.edge.col(2);
  now.wing.col(1) = now.edge.col(1);
  now.wing.col(2) = now.sine * now.edge.col(0) + now.cosine * now.edge.col(2);
  const Vector3d a1(0, 0, sign), a2 = now.edge.col(1);
  now.s1 = {a1, s.shoulder_m.cross(a1)};
  now.s2 = {a2, s.shoulder_m.cross(a2)};
  now.edge_inertia = inertia_at(s.edge.mass_kg, s.edge.com_m, s.edge.inertia_kg_m2, now.edge, s.shoulder_m);
  now.wing_inertia = inertia_at(s.wing.mass_kg, s.wing.com_m, s.wing.inertia_kg_m2, now.wing, s.shoulder_m);
  if (a_.any(kAddedMass)) {
    now.added_twist.setZero();
    now.added_twist.block<3, 1>(0, 0) = now.wing.col(1);
    now.added_twist.block<3, 1>(0, 1) = now.wing.col(2);
    now.added_twist.block<3, 1>(0, 2) = s.shoulder_m.cross(now.wing.col(0));
    now.added_twist.block<3, 1>(3, 2) = now.wing.col(0);
  }
}

double Plant::near_gain(const Vector3d& shoulder_W, const Vector3d& tip_W, const Surroundings& room) const {
  double gain = 1;
  const double height = 0.5 * (shoulder_W.z() + tip_W.z());
  if (a_.any(kGroundEffect)) gain += a_[kGroundEffect] * ground_share(height - room.ground_z_m);
  if (a_.any(kCeilingEffect)) gain += a_[kCeilingEffect] * ceiling_share(room.ceiling_z_m - height);
  if (a_.any(kWallEffect)) gain -= a_[kWallEffect] * wall_loss(room.wall_y_m - tip_W.y());
  return gain;
}

std::array<double, 2> Plant::added_moments(std::size_t side, const State& x, double stroke_rad_s2,
                                           double rotation_rad_s2) const {
  SideNow now;
  place(x, side, now);
  const Matrix6d air = now.added_twist * wing_[side].added() * now.added_twist.transpose();
  const Twist edge = now.s1 * x[kStrokeRate + side], wing = edge + now.s2 * x[kRotationRate + side];
  const Twist speeds_up =
      now.s1 * stroke_rad_s2 + now.s2 * rotation_rad_s2 + cross(edge, now.s2) * x[kRotationRate + side];
  const Wrench takes = air_takes(air, wing, speeds_up);
  return {-dot(now.s1, takes), -dot(now.s2, takes)};
}

Wrench Plant::on_torso(const State& x, const Matrix3d& R, const Slow& slow, const Surroundings& room) const {
  Wrench sum{Vector3d::Zero(), Vector3d::Zero()};
  const Vector3d position(x[0], x[1], x[2]);
  const Vector3d w(x[kRate], x[kRate + 1], x[kRate + 2]);
  if (a_.any(kBodyDrag) && has_air) {
    const Vector3d centre(0, 0, -3e-3);
    const Vector3d v =
        Vector3d(x[kVelocity], x[kVelocity + 1], x[kVelocity + 2]) + w.cross(centre) - R.transpose() * slow.wind_m_s;
    sum = sum + at_point(centre, a_[kBodyDrag] * body_drag_N(v, f_.density_kg_m3));
  }
  if (a_.any(kWallEffect) && has_air) {
    // The mirror image of the wings' downwash pulls the robot towards the wall, at the stroke plane.
    const double share = wall_pull(room.wall_y_m - position.y() - f_.around_m);
    const Vector3d pull(0, a_[kWallEffect] * f_.mass_kg() * kGravity_m_s2 * share, 0);
    sum = sum + at_point(Vector3d(0, 0, f_.above_m), R.transpose() * pull);
  }
  if (a_.any(kTether)) {
    const Vector3d pull =
        a_[kTether] * tether_N(position.x() - a_.tether_foot_m.x(), position.y() - a_.tether_foot_m.y(),
                               position.z() - room.ground_z_m, room.gravity_m_s2);
    sum = sum + at_point(Vector3d(0, 0, -0.02), R.transpose() * pull);
  }
  return sum;
}

void Plant::rates(const State& x, const std::array<double, 2>& current, const Slow& slow, const Surroundings& room,
                  const Prescribed* prescribed, State& rate, Felt& felt) const {
  rate.fill(0);
  const Matrix3d R = rotation_matrix(x);
  const Vector3d w(x[kRate], x[kRate + 1], x[kRate + 2]), v(x[kVelocity], x[kVelocity + 1], x[kVelocity + 2]);
  const Twist torso{w, v};
  const Vector3d velocity_W = R * v;
  for (std::size_t k = 0; k < 3; ++k) rate[kPosition + k] = velocity_W[static_cast<Eigen::Index>(k)];
  const double* q = &x[kQuaternion];
  rate[kQuaternion] = -0.5 * (q[1] * w.x() + q[2] * w.y() + q[3] * w.z());
  rate[kQuaternion + 1] = 0.5 * (q[0] * w.x() + q[2] * w.z() - q[3] * w.y());
  rate[kQuaternion + 2] = 0.5 * (q[0] * w.y() + q[3] * w.x() - q[1] * w.z());
  rate[kQuaternion + 3] = 0.5 * (q[0] * w.z() + q[1] * w.y() - q[2] * w.x());

  using Coupling = Eigen::Matrix<double, 6, 2>;
  const auto stacked = [](const Wrench& f) {
    Vector6d out;
    out << f.n, f.f;
    return out;
  };
  const Vector3d position(x[0], x[1], x[2]);
  const Vector3d wind_B = slow.wind_m_s.isZero() ? Vector3d::Zero() : Vector3d(R.transpose() * slow.wind_m_s);
  const Vector3d gravity_B = -room.gravity_m_s2 * R.row(2).transpose();
  const bool play = a_.any(kGearBacklash), added = a_.any(kAddedMass) && has_air;

  Inertia whole = torso_;
  Eigen::Matrix<double, 6, 6> whole_added = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6d load = stacked(on_torso(x, R, slow, room) - cross(torso, torso_ * torso));
  std::array<Coupling, 2> coupling;
  std::array<Eigen::Matrix2d, 2> inverse;
  std::array<Eigen::Vector2d, 2> hinge_load;

  for (std::size_t j = 0; j < 2; ++j) {
    const Side& s = f_.side[j];
    SideNow now;
    place(x, j, now);
    const double psi_rate = x[kStrokeRate + j], theta_rate = x[kRotationRate + j];
    const Twist v1 = torso + now.s1 * psi_rate, v2 = v1 + now.s2 * theta_rate;
    const Twist a1 = cross(torso, now.s1) * psi_rate, a2 = a1 + cross(v1, now.s2) * theta_rate;
    const Wrench edge_takes = now.edge_inertia * a1 + cross(v1, now.edge_inertia * v1);
    Wrench wing_takes = now.wing_inertia * a2 + cross(v2, now.wing_inertia * v2);
    const Inertia both = now.edge_inertia + now.wing_inertia;
    Wrench f1 = both * now.s1, f2 = now.wing_inertia * now.s2;

    // Added mass has inertia but no weight. Accelerations are relative to free fall, so gravity is added for it.
    Eigen::Matrix<double, 6, 6> air = Eigen::Matrix<double, 6, 6>::Zero();
    if (added) {
      air = now.added_twist * wing_[j].added() * now.added_twist.transpose();
      wing_takes = wing_takes + air_takes(air, {v2.w, v2.v - wind_B}, {a2.w, a2.v + gravity_B});
      f1 = f1 + times(air, now.s1);
      f2 = f2 + times(air, now.s2);
      whole_added += air;
    }
    Wrench side_load = Wrench{Vector3d::Zero(), Vector3d::Zero()} - edge_takes - wing_takes;
    double stroke_load = -dot(now.s1, edge_takes + wing_takes), rotation_load = -dot(now.s2, wing_takes);

    if (has_air) {
      WingAir::Flow flow;
      const Vector3d shoulder_velocity = v + w.cross(s.shoulder_m) - wind_B;
      flow.shoulder_m_s = now.wing.transpose() * shoulder_velocity;
      flow.rate_rad_s = now.wing.transpose() * v2.w;
      flow.rotation_rate_rad_s = theta_rate;
      flow.sin_rotation = now.sine;
      flow.cos_rotation = now.cosine;
      flow.lag = {x[kLag + 2 * j], x[kLag + 2 * j + 1]};
      if (a_.any(kWakeCapture)) {
        rate[kWake + j] = wake_rate(psi_rate, x[kWake + j]);
        flow.wake_rad_s = kWakeShare * a_[kWakeCapture] * x[kWake + j];
      }
      if (a_.any(kWingFlexibility)) flow.bend_rad = x[kBend + j];
      if (a_.any(kGroundEffect) || a_.any(kCeilingEffect) || a_.any(kWallEffect)) {
        const Vector3d span = (j == 0 ? 1 : -1) * s.wing_length_m * now.edge.col(1);
        flow.gain = near_gain(position + R * s.shoulder_m, position + R * (s.shoulder_m + span), room);
      }
      if (a_.any(kClapAndFling)) {
        const double sum = x[kStroke] + x[kStroke + 1];
        flow.gain += a_[kClapAndFling] *
                     clap_share(std::numbers::pi - std::abs(sum), sum * (x[kStrokeRate] + x[kStrokeRate + 1]));
      }
      if (a_.any(kEdgeBending)) {
        // The bending of the tip follows the load on the wing with a time constant of 1 ms; its rate moves the strips.
        WingAir::Flow stiff = flow;
        const WingAir::Load on = wing_[j].load(stiff);
        const double push = on.force_N.x() * now.cosine + on.force_N.z() * now.sine;  // along x of the leading edge
        rate[kBending + j] = (kEdgeBend_rad * a_[kEdgeBending] * push / 0.08 - x[kBending + j]) / kEdgeFollows_s;
        flow.bending_rate_rad_s = std::clamp(rate[kBending + j], -120.0, 120.0);
        rate[kBending + j] = flow.bending_rate_rad_s;
      }
      const WingAir::Load on = wing_[j].load(flow);
      rate[kLag + 2 * j] = on.lag_rate[0];
      rate[kLag + 2 * j + 1] = on.lag_rate[1];
      if (a_.any(kWingFlexibility)) {
        rate[kBend + j] =
            (a_[kWingFlexibility] * bend_angle(-on.force_N.x() / kHoverNormal_N) - x[kBend + j]) / kBendFollows_s;
      }
      const Vector3d force = now.wing * on.force_N;
      const Wrench air_load{now.wing * on.torque_Nm + s.shoulder_m.cross(force), force};
      side_load = side_load + air_load;
      stroke_load += dot(now.s1, air_load);
      rotation_load += dot(now.s2, air_load);
    }

    const Motor& m = s.motor;
    const double n = m.gear_ratio, sign = j == 0 ? 1 : -1;
    stroke_load += stroke_torque(x, j, current[j], slow, rate);
    rotation_load += hinge_torque(s.rotation, x[kRotation + j], theta_rate, kRotationStop, kStopLoss,
                                  slow.stop_shift_rad[j], a_[kStopCompliance]);

    // Angular momentum of the rotor along the stroke axis; it turns against the wing.
    const double turning = x[rotor_rate() + j];
    const Vector3d rotor(0, 0, -sign * m.rotor_inertia_kg_m2 * n);
    side_load.n -= w.cross(rotor) * turning;
    if (play) side_load.n -= rotor * rate[kRotorRate + j];
    else f1.n += rotor;

    coupling[j].col(0) = stacked(f1);
    coupling[j].col(1) = stacked(f2);
    Eigen::Matrix2d joint;
    joint(0, 0) = dot(now.s1, f1) - (play ? 0 : sign * rotor.z()) + (play ? 0 : n * n * m.rotor_inertia_kg_m2);
    joint(0, 1) = joint(1, 0) = dot(now.s1, f2);
    joint(1, 1) = dot(now.s2, f2);
    const double determinant = joint(0, 0) * joint(1, 1) - joint(0, 1) * joint(1, 0);
    inverse[j] << joint(1, 1), -joint(0, 1), -joint(1, 0), joint(0, 0);
    inverse[j] /= determinant;
    hinge_load[j] = {stroke_load, rotation_load};
    load += stacked(side_load);
    whole = whole + both;
  }

  if (a_.any(kLooseScrew)) {
    // The screw rattles between two end stops; its acceleration relative to the torso reacts on the robot.
    const double screw = x[kScrew], speed = x[kScrewRate];
    double push = -2e-3 * speed;
    const double over = std::abs(screw) - kScrewGap_m;
    if (over > 0) push -= (screw > 0 ? 1 : -1) * 400 * over * std::max(0.0, 1 + 1.2 * (screw > 0 ? speed : -speed));
    const double mass = kScrewMass_kg * a_[kLooseScrew];
    const double torso_up = felt.acceleration.v.z();  // from the previous evaluation, a fraction of a step ago
    rate[kScrew] = speed;
    rate[kScrewRate] = push / kScrewMass_kg - torso_up;
    load -= stacked(at_point(a_.screw_m, Vector3d(0, 0, mass * rate[kScrewRate])));
  }

  Vector6d a;
  Eigen::Matrix<double, 6, 6> M;
  M.topLeftCorner<3, 3>() = whole.j;
  const Vector3d& c = whole.c;
  Matrix3d moment;
  moment << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
  M.topRightCorner<3, 3>() = moment;
  M.bottomLeftCorner<3, 3>() = moment.transpose();
  M.bottomRightCorner<3, 3>() = whole.m * Matrix3d::Identity();
  if (added) M += whole_added;
  if (prescribed) {
    a << prescribed->acceleration.w, prescribed->acceleration.v;
  } else {
    Eigen::Matrix<double, 6, 6> free = M;
    Vector6d right = load;
    for (std::size_t j = 0; j < 2; ++j) {
      const Coupling through = coupling[j] * inverse[j];
      free.noalias() -= through * coupling[j].transpose();
      right.noalias() -= through * hinge_load[j];
    }
    a = free.llt().solve(right);
  }
  felt.acceleration = {a.head<3>(), a.tail<3>()};
  felt.motion = torso;
  Vector6d takes = M * a - load;
  for (std::size_t j = 0; j < 2; ++j) {
    const Eigen::Vector2d hinges = inverse[j] * (hinge_load[j] - coupling[j].transpose() * a);
    rate[kStroke + j] = x[kStrokeRate + j];
    rate[kRotation + j] = x[kRotationRate + j];
    rate[kStrokeRate + j] = hinges[0];
    rate[kRotationRate + j] = hinges[1];
    takes += coupling[j] * hinges;
  }
  felt.support = {takes.head<3>(), takes.tail<3>()};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    rate[kRate + k] = a[i];
    rate[kVelocity + k] = a[i + 3] + gravity_B[i];
  }
}

double Plant::energy_J(const State& x, const Surroundings& room) const {
  const Twist torso{Vector3d(x[kRate], x[kRate + 1], x[kRate + 2]),
                    Vector3d(x[kVelocity], x[kVelocity + 1], x[kVelocity + 2])};
  double energy = 0.5 * dot(torso, torso_ * torso);
  Inertia whole = torso_;
  for (std::size_t j = 0; j < 2; ++j) {
    SideNow now;
    place(x, j, now);
    const Twist v1 = torso + now.s1 * x[kStrokeRate + j], v2 = v1 + now.s2 * x[kRotationRate + j];
    energy += 0.5 * dot(v1, now.edge_inertia * v1) + 0.5 * dot(v2, now.wing_inertia * v2);
    const Motor& m = f_.side[j].motor;
    const double sign = j == 0 ? 1 : -1, relative = m.gear_ratio * x[rotor_rate() + j];
    energy += 0.5 * m.rotor_inertia_kg_m2 * relative * relative - m.rotor_inertia_kg_m2 * relative * sign * torso.w.z();
    energy += spring_energy(j, x);
    whole = whole + now.edge_inertia + now.wing_inertia;
  }
  const Vector3d up = rotation_matrix(x).row(2).transpose();
  return energy + room.gravity_m_s2 * (whole.m * x[2] + up.dot(whole.c));
}

Wrench Plant::momentum_W(const State& x) const {
  const Twist torso{Vector3d(x[kRate], x[kRate + 1], x[kRate + 2]),
                    Vector3d(x[kVelocity], x[kVelocity + 1], x[kVelocity + 2])};
  Wrench sum = torso_ * torso;
  for (std::size_t j = 0; j < 2; ++j) {
    SideNow now;
    place(x, j, now);
    const Twist v1 = torso + now.s1 * x[kStrokeRate + j], v2 = v1 + now.s2 * x[kRotationRate + j];
    sum = sum + now.edge_inertia * v1 + now.wing_inertia * v2;
    const Motor& m = f_.side[j].motor;
    sum.n.z() -= (j == 0 ? 1 : -1) * m.rotor_inertia_kg_m2 * m.gear_ratio * x[rotor_rate() + j];
  }
  const Matrix3d R = rotation_matrix(x);
  const Vector3d f = R * sum.f;
  return {R * sum.n + Vector3d(x[0], x[1], x[2]).cross(f), f};
}

}  // namespace flappy::blind::b
