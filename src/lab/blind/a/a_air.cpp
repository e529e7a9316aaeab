// Air on the wings, strip by strip, in the frame of the leading edge (x forward, y left, z up; span along +-y).
//   u = psidot r + ... backward, w upward: the strip's velocity in the air    U^2 = u^2 + w^2
//   alpha = theta + sgn(u) pi/2 - atan(w/u), 0 to pi
// Force along the wing's x (wing_section()):
//   F = 1/2 rho c U^2 dr f C_La sin(alpha)    C_La = C_l / (E + k C_l / (pi AR))
// Nabawy and Crowther, J. R. Soc. Interface 11, 2014 (part I: the induced power factor k; part II: the model), give the
// hovering wing a lift of C_La sin(alpha) cos(alpha) and a drag of lift times tan(alpha): the leading-edge vortex turns the
// suction into the normal, as Polhamus has it. C_l is the slope of the section, E the semi-perimeter over the span (the
// edge correction of Jones). Their numbers for this planform are not published; ours are choices within the theory.
// f, kLift, is fitted: the nominal robot hovers at its declared voltage.
// Skin friction, along the flow: both faces of a laminar plate, 2 x 1.328 / sqrt(Re) (Blasius) at Re = 8000.
// Centre of pressure at (0.82 alpha / pi + 0.05) c behind the leading edge (fit to the measurements of Dickson, Straw,
// Poelma and Dickinson, AIAA 2006-34, as we remember it; 0.46 c for a plate across the flow).
// Rotation, about y: drag of the plate's chordwise stations x that move across the air at v - thetadot x, less the part
// that translation has already,
//   M = 1/2 rho C dr integral of x ((v - thetadot x) |v - thetadot x| - v |v|) dx
// It opposes the rotation whatever v is. C: drag of a plate broadside, some 1.2 at this aspect ratio (Hoerner, Fluid-
// Dynamic Drag), in proportion to the vehicle's rotational damping coefficient. The moment alone counts; the force that
// rotation causes is the effect rotational_lift.
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {
namespace {

/// Slope of thin sections at low Reynolds numbers: 0.09 per degree.
constexpr double kSection_1_rad = 5.16;
/// Of the trapezoid of 27 and 15 mm by 70 mm.
constexpr double kAspect = 3.3, kEdge = 1.31, kInduced = 1.26;
constexpr double kLiftSlope = kSection_1_rad / (kEdge + kInduced * kSection_1_rad / (kPi * kAspect));
constexpr double kLift = 1.33;
constexpr double kFriction = 0.0297;
/// Drag of the plate broadside over the vehicle's rotational damping coefficient: 1.17 / 5.
constexpr double kBroadside = 0.234;

/// Gauss-Legendre points of third order, over the chord.
constexpr double kStation[] = {0.1127016653792583, 0.5, 0.8872983346207417}, kWeight[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

}  // namespace

WingSection wing_section(double sin_alpha, double cos_alpha) {
  return {kLift * kLiftSlope * sin_alpha, kFriction, 0.82 / kPi * angle_of(std::abs(sin_alpha), cos_alpha) + 0.05};
}

double rotation_drag(double chord_m, double across_m_s, double rotation_rad_s) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double x = kStation[k] * chord_m, v = across_m_s - rotation_rad_s * x;
    sum += kWeight[k] * x * (v * std::abs(v) - across_m_s * std::abs(across_m_s));
  }
  return kBroadside * chord_m * sum;
}

void Robot::blow() {
  const double rho = density_kg_m3_ * x_.density_gain;
  air_ = {};
  const Vector3d &w = x_.torso.rate_rad_s, through_air = R_.transpose() * (x_.torso.velocity_m_s - x_.wind_m_s);

  if (const double magnitude = magnitudes_[Effect::clap_and_fling]; magnitude > 0) {
    // wings that come close, behind or in front, separate with extra circulation
    const double gap = kPi - std::abs(x_.side[0].wing.stroke_rad + x_.side[1].wing.stroke_rad);
    const bool parting = gap > x_.gap_rad;
    if (!parting) x_.closest_gap_rad = gap;
    x_.gap_rad = gap;
    x_.fling = parting ? magnitude * laws::clap_and_fling(std::max(gap, 0.0), std::max(x_.closest_gap_rad, 0.0)) : 0;
  }

  for (const std::size_t k : {0u, 1u}) {
    const Side& s = side_[k];
    RobotSideState& state = x_.side[k];
    const Wing& q = state.wing;
    const Pose& p = pose_[k];
    const Vector3d shoulder = p.edge.transpose() * (through_air + w.cross(s.shoulder_m));
    const Vector3d rate = p.edge.transpose() * p.edge_rate;
    const double stroking = s.sign * rate.z(), lifting = s.sign * rate.x();
    const SinCos rotation = sin_cos(q.rotation_rad);

    double memory = 0;
    if (const double magnitude = magnitudes_[Effect::wake_capture]; magnitude > 0) {
      laws::wake_step(state.wake, q.stroke_rad_s, step_s_);
      memory = magnitude * laws::wake_met(state.wake, q.stroke_rad_s);
    }
    const double kramer = magnitudes_[Effect::rotational_lift];
    const double pressure = 0.5 * rho * s.strips.width_m,
                 damping = pressure * s.planform.rotational_damping_coefficient;
    // The gain acts on lift alone, as it stands for a lower induced velocity.
    const double lift_gain = state.air_gain * (1 + x_.fling) * motion_gain_;

    double force_x = 0, force_z = 0, moment_x = 0, moment_y = 0, moment_z = 0, load = 0;
    for (std::size_t i = 0; i < kStrips; ++i) {
      const double r = s.strips.r_m[i], c = s.strips.chord_m[i];
      const double u = (stroking + memory) * r - shoulder.x(), up = lifting * r + shoulder.z();
      const double speed2 = u * u + up * up + 1e-12, speed = std::sqrt(speed2), per_speed = 1 / speed;
      const double bent = state.twist_rad * s.twist[i];  // small angle: a second-order expansion is enough
      const double sin_t = rotation.sin + bent * (rotation.cos - 0.5 * bent * rotation.sin);
      const double cos_t = rotation.cos - bent * (rotation.sin + 0.5 * bent * rotation.cos);
      const double way = std::copysign(1.0, u);
      const double cos_f = std::abs(u) * per_speed, sin_f = way * up * per_speed;
      // alpha = (theta - f) + way pi/2
      const double sa = way * (cos_t * cos_f + sin_t * sin_f), ca = -way * (sin_t * cos_f - cos_t * sin_f);
      const WingSection section = wing_section(sa, ca);
      const double head = pressure * c * speed2;
      double f = head * section.normal;
      double turning = f * section.centre * c;
      load += f;
      if (kramer > 0) {
        // On either stroke thetadot > 0 moves the flow at 3/4 chord to a larger C_N (Sane and Dickinson 2002): pitching up
        // adds force. At half chord.
        const double extra = kramer * laws::rotational_lift(rho, c, s.strips.width_m, speed, q.rotation_rad_s);
        f += extra;
        turning += extra * 0.5 * c;
      }
      const double friction = head * section.friction * per_speed;
      const double along_x = f * cos_t + friction * u, along_z = -f * sin_t - friction * up;
      force_x += along_x;
      force_z += along_z;
      moment_x += r * along_z;
      moment_y += damping * rotation_drag(c, -u * cos_t - up * sin_t, q.rotation_rad_s) - turning;
      moment_z -= r * along_x;
    }
    force_z *= lift_gain;
    moment_x *= lift_gain;
    if (const double magnitude = magnitudes_[Effect::wing_flexibility]; magnitude > 0)
      state.twist_rad +=
          step_s_ / laws::kTwistLag_s * (laws::tip_twist(magnitude, load / laws::kHoverNormal_N) - state.twist_rad);
    const Vector3d force = p.edge * Vector3d(force_x, 0, force_z);
    const Vector3d moment = p.edge * Vector3d(s.sign * moment_x, moment_y, s.sign * moment_z);
    air_.force_N += force;
    air_.moment_Nm += moment + s.shoulder_m.cross(force);
    const int stroke = 6 + 2 * static_cast<int>(k);
    rhs_(stroke) += p.stroke_axis.dot(moment);
    rhs_(stroke + 1) += p.rotation_axis.dot(moment);
    if (magnitudes_.has(Effect::added_mass)) add_added_mass(k);
  }
  rhs_.segment<3>(0) += air_.moment_Nm;
  rhs_.segment<3>(3) += air_.force_N;
}

/// A strip's mass sits at half chord and resists the rate of n.v. The part of n.a that is linear in the unknowns is row . x;
/// v.(rate x n) and the rest are known. Its inertia resists the rate of the wing's turning about its span.
template <class Use>
void Robot::for_added_masses(std::size_t k, const Use& use) const {
  const Side& s = side_[k];
  const Pose& p = pose_[k];
  const Vector3d& w = x_.torso.rate_rad_s;
  const Vector3d n = p.wing.col(0), turning_n = p.wing_rate.cross(n);
  const Vector3d shoulder_v = R_.transpose() * x_.torso.velocity_m_s + w.cross(s.shoulder_m);
  const Vector3d shoulder_a = w.cross(w.cross(s.shoulder_m));
  using Row = Eigen::Matrix<double, 8, 1>;
  Row row;
  double inertia = 0;
  for (std::size_t i = 0; i < kStrips; ++i) {
    const double c = s.strips.chord_m[i];
    const laws::AddedMass added = laws::added_mass(density_kg_m3_ * x_.density_gain, c, s.strips.width_m,
                                                   s.strips.r_m[i] / s.planform.wing_length_m);
    inertia += added.inertia_kg_m2;
    const Vector3d r = s.sign * s.strips.r_m[i] * p.wing.col(1) - 0.5 * c * p.wing.col(2);
    row << (s.shoulder_m + r).cross(n), n, n.dot(p.stroke_axis.cross(r)), n.dot(p.rotation_axis.cross(r));
    const double known = n.dot(shoulder_a + p.wing_turning.cross(r) + p.wing_rate.cross(p.wing_rate.cross(r))) +
                         turning_n.dot(shoulder_v + p.wing_rate.cross(r));
    use(added.mass_kg, row, known);
  }
  const Vector3d span = p.wing.col(1);
  row << span, Vector3d::Zero(), span.dot(p.stroke_axis), span.dot(p.rotation_axis);
  use(inertia, row, span.dot(p.wing_turning));
}

void Robot::add_added_mass(std::size_t k) {
  const int stroke = 6 + 2 * static_cast<int>(k);
  for_added_masses(k, [&](double mass, const Eigen::Matrix<double, 8, 1>& row, double known) {
    mass *= magnitudes_[Effect::added_mass];
    for (int a = 0; a < 8; ++a) {
      const int ra = a < 6 ? a : stroke + a - 6;
      rhs_(ra) -= mass * row(a) * known;
      for (int b = 0; b <= a; ++b) mass_matrix_(ra, b < 6 ? b : stroke + b - 6) += mass * row(a) * row(b);
    }
  });
}

std::array<double, 2> Robot::added_mass_moments(std::size_t k, double stroke_rad_s2, double rotation_rad_s2) {
  pose_sides();
  std::array<double, 2> moments{};
  for_added_masses(k, [&](double mass, const Eigen::Matrix<double, 8, 1>& row, double known) {
    const double force = -mass * (known + row(6) * stroke_rad_s2 + row(7) * rotation_rad_s2);
    moments[0] += force * row(6), moments[1] += force * row(7);
  });
  return moments;
}

}  // namespace flappy::blind
