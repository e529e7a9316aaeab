#include "peer.hpp"

#include <cmath>
#include <numbers>

namespace flappy::reference {
namespace {

double sgn(double x) { return x > 0 ? 1.0 : x < 0 ? -1.0 : 0.0; }

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

Vec3 operator*(double s, const Vec3& v) { return {s * v[0], s * v[1], s * v[2]}; }

double normal_force_coefficient(double a) {
  return 1.8 * std::sin(2 * a) * std::cos(a) + 1.95 * std::sin(a) - 1.5 * std::cos(2 * a) * std::sin(a);
}

/// Centre of pressure behind the rotation axis, fraction of the local chord.
double centre_of_pressure_fraction(double a) {
  return 0.46 - 0.332 * std::cos(a) - 0.037 * std::cos(3 * a) - 0.013 * std::cos(5 * a);
}

struct WingMotion {
  double stroke_rad, rotation_rad, stroke_rate_rad_s, rotation_rate_rad_s;
};

/// Blade elements of one wing; `velocity` is that of the point from which d_0 and d_s are measured, in B.
WingLoad wing_load(const model::Side& side, double density, double sg, const Vec3& velocity, const Vec3& rates,
                   const WingMotion& wing) {
  const model::Planform& planform = side.planform;
  const auto [u, v, w] = velocity;
  const auto [p, q, r] = rates;
  const double c = planform.mean_chord_m;
  const double R_w = planform.wing_length_m;
  const double d_0 = sg * side.shoulder_m.y, d_s = side.shoulder_m.z;
  const double cos_psi = std::cos(wing.stroke_rad), sin_psi = std::sin(wing.stroke_rad);

  const double U_i1 = wing.stroke_rate_rad_s + sg * r;
  const double U_i0 = sg * (r * d_0 * cos_psi - (v - p * d_s) * sin_psi) - (u + q * d_s) * cos_psi;
  const double U_o1 = sg * p * cos_psi + q * sin_psi;
  const double U_o0 = sg * p * d_0 + w;

  const double r_cp = R_w * planform.r33 / planform.r22;
  const double U_i = U_i1 * r_cp + U_i0;
  const double U_o = U_o1 * r_cp + U_o0;
  // The sign of a zero counts, so that flow along the stroke axis (U_i = +-0) has its limit; 0/0 has no
  // force.
  const double inflow = U_i == 0 && U_o == 0 ? 0.0 : std::atan(U_o / U_i);
  const double alpha = wing.rotation_rad + std::copysign(std::numbers::pi / 2, U_i) - inflow;

  const double a2 = U_i1 * U_i1 + U_o1 * U_o1;
  const double a1 = 2 * (U_i1 * U_i0 + U_o1 * U_o0);
  const double a0 = U_i0 * U_i0 + U_o0 * U_o0;
  const double R2 = R_w * R_w, R3 = R2 * R_w;
  const double area = a2 * R3 * planform.r22 + a1 * R2 * planform.r11 + a0 * R_w * planform.r00;
  const double moment = a2 * R3 * planform.z_cp2 + a1 * R2 * planform.z_cp1 + a0 * R_w * planform.z_cp0;
  const double thetadot = wing.rotation_rate_rad_s;

  WingLoad load;
  load.angle_of_attack_rad = alpha;
  load.normal_force_N = 0.5 * density * normal_force_coefficient(alpha) * c * area;
  load.span_m = r_cp;
  // D = -M_aero/F_N; C_N and the dynamic pressure cancel, so it stays finite where C_N passes zero.
  load.depth_m = area == 0 ? 0.0 : c * centre_of_pressure_fraction(alpha) * moment / area;
  load.damping_moment_Nm = -density / 8 * std::abs(thetadot) * thetadot * planform.rotational_damping_coefficient *
                           R_w * c * c * c * c * planform.z_rd;
  return load;
}

/// Brushed motor through its gear, at the joint, N m; the rotor's inertia is the engine's to add.
double motor_torque(const model::Motor& motor, double voltage_V, double rate) {
  const double N = motor.gear_ratio, K = motor.torque_constant_Nm_A;
  const double current = (voltage_V - K * N * rate) / motor.resistance_ohm;
  return N * motor.efficiency * (K * current - motor.damping_Nm_s * N * rate - motor.friction_Nm * sgn(rate));
}

double joint_loss(const model::Joint& joint, bool friction_by_sign, double rate) {
  return -joint.damping_Nm_s * rate - (friction_by_sign ? joint.friction_Nm * sgn(rate) : 0.0);
}

}  // namespace

double reflected_rotor_inertia(const model::Motor& motor) {
  return motor.efficiency * motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kg_m2;
}

double stroke_damping(const model::Side& side) {
  const model::Motor& m = side.motor;
  const double N = m.gear_ratio, K = m.torque_constant_Nm_A;
  return side.stroke.damping_Nm_s + m.efficiency * N * N * (K * K / m.resistance_ohm + m.damping_Nm_s);
}

double spring_stiffness(const model::Spring& spring, double stroke_rad) {
  return stroke_rad > spring.rest_angle_rad ? spring.stiffness_positive_Nm_rad : spring.stiffness_negative_Nm_rad;
}

Loads loads_at(const model::Vehicle& vehicle, const PeerOptions& options, const PeerState& state,
               const PerWing& voltage_V) {
  const Vec3 v_B = to_body(state.q_WB, state.v_WB_W_m_s);
  const Vec3& w_B = state.w_WB_B_rad_s;
  const model::Triple& com = vehicle.torso.com_m;
  const bool exact = options.shoulder == ShoulderVelocity::exact;
  const bool friction_by_sign = options.dry_friction == DryFriction::sign;
  Loads loads;
  for (std::size_t i : {0u, 1u}) {
    const model::Side& side = side_of(vehicle, i);
    const WingMotion wing{state.stroke_rad[i], state.rotation_rad[i], state.stroke_rate_rad_s[i],
                          state.rotation_rate_rad_s[i]};
    const Vec3 reference = exact ? Vec3{side.shoulder_m.x, 0, 0} : Vec3{com.x, com.y, com.z};
    loads.wing[i] = wing_load(side, vehicle.air_density_kg_m3, side_sign(i), v_B + cross(w_B, reference), w_B, wing);
    loads.spring_Nm[i] =
        -spring_stiffness(side.spring, wing.stroke_rad) * (wing.stroke_rad - side.spring.rest_angle_rad);
    loads.stroke_Nm[i] = motor_torque(side.motor, voltage_V[i], wing.stroke_rate_rad_s) +
                         joint_loss(side.stroke, friction_by_sign, wing.stroke_rate_rad_s);
    loads.rotation_Nm[i] = joint_loss(side.rotation, friction_by_sign, wing.rotation_rate_rad_s);
  }
  return loads;
}

Wrench aerodynamic_wrench(const model::Vehicle& vehicle, const PeerState& state, const Loads& loads) {
  Wrench sum;
  for (std::size_t i : {0u, 1u}) {
    const model::Triple& shoulder = side_of(vehicle, i).shoulder_m;
    const WingLoad& load = loads.wing[i];
    const double psi = side_sign(i) * state.stroke_rad[i], theta = state.rotation_rad[i];
    // Columns of R_B_wing = Rz(psi) Ry(theta).
    const Vec3 x{std::cos(psi) * std::cos(theta), std::sin(psi) * std::cos(theta), -std::sin(theta)};
    const Vec3 y{-std::sin(psi), std::cos(psi), 0};
    const Vec3 z{std::cos(psi) * std::sin(theta), std::sin(psi) * std::sin(theta), std::cos(theta)};
    const Vec3 force = load.normal_force_N * x;
    const Vec3 point = Vec3{shoulder.x, shoulder.y, shoulder.z} + side_sign(i) * load.span_m * y + -load.depth_m * z;
    sum.force_N = sum.force_N + force;
    sum.moment_Nm = sum.moment_Nm + cross(point, force) + load.damping_moment_Nm * y;
  }
  return sum;
}

Vec3 to_world(const Quat& q_WB, const Vec3& v_B) {
  const Vec3 axis{q_WB[1], q_WB[2], q_WB[3]};
  const Vec3 twice = 2.0 * cross(axis, v_B);
  return v_B + q_WB[0] * twice + cross(axis, twice);
}

Vec3 to_body(const Quat& q_WB, const Vec3& v_W) { return to_world({q_WB[0], -q_WB[1], -q_WB[2], -q_WB[3]}, v_W); }

}  // namespace flappy::reference
