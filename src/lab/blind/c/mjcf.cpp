#include "lab/blind/c/mjcf.hpp"

#include <algorithm>
#include <cstdio>

namespace flappy::blind::c {
namespace {

constexpr double kViscosity_Pa_s = 1.82e-5;  // air at 20 degC
constexpr double kThickness_m = 0.2e-3;      // half thickness of the ellipsoids; it only affects their edge-on area
// Constraints have a time constant, so a stop stiffens with the inertia that hits it. The nominal robot's rotation stop
// yields by about 2 deg in mid-stroke.
constexpr double kStopTime_s = 0.5e-3, kStopDamping = 0.7, kStopImpedance = 0.8;

std::string numbers(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%.17g", value);
    text += (text.empty() ? "" : " ") + std::string(digits);
  }
  return text;
}

std::string numbers(const Eigen::Vector3d& v) { return numbers({v.x(), v.y(), v.z()}); }

std::string inertial(const RigidBody& body) {
  // with own principal axes: MuJoCo's would neglect products below 1e-12 kg m^2
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(body.inertia_kg_m2);
  Eigen::Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  const Eigen::Quaterniond q(axes);
  return "<inertial pos=\"" + numbers(body.com_m) + "\" mass=\"" + numbers({body.mass_kg}) + "\" quat=\"" +
         numbers({q.w(), q.x(), q.y(), q.z()}) + "\" diaginertia=\"" + numbers(principal.eigenvalues()) + "\"/>\n";
}

/// No mass, and no air if coefficients are zero. Keeps MuJoCo from using the body's inertia box.
std::string ellipsoid(const std::string& name, const Eigen::Vector3d& at, const Eigen::Vector3d& axes,
                      const FluidCoefficients& fluid) {
  return "<geom name=\"" + name + "\" type=\"ellipsoid\" mass=\"0\" pos=\"" + numbers(at) + "\" size=\"" +
         numbers(axes) + "\" fluidshape=\"ellipsoid\" fluidcoef=\"" +
         numbers({fluid[0], fluid[1], fluid[2], fluid[3], fluid[4]}) + "\"/>\n";
}

std::string hinge(const std::string& name, const Eigen::Vector3d& axis, const std::string& more) {
  return "<joint name=\"" + name + "\" type=\"hinge\" axis=\"" + numbers(axis) + "\" " + more + "/>\n";
}

std::string stops(const Hinge& range, double softness) {
  // negative values mean stiffness and damping; a softer stop keeps its damping ratio
  const double stiffness =
      1 / (kStopTime_s * kStopTime_s * kStopDamping * kStopDamping) / (1 + kStopSoftness * softness);
  const double damping = 2 * kStopDamping * std::sqrt(stiffness);
  return "limited=\"true\" range=\"" + numbers({range.lower_rad, range.upper_rad}) + "\" solreflimit=\"" +
         numbers({-stiffness, -damping}) + "\" solimplimit=\"" +
         numbers({kStopImpedance / (1 + kStopFirst * softness), kStopImpedance, 1e-3 + kStopRise_rad * softness}) +
         "\" ";
}

std::string wing_of(const Side& side, std::size_t number, const Build& build) {
  const std::string name = number == 0 ? "left" : "right";
  const double out = number == 0 ? 1 : -1, area = side.planform.length_m * side.planform.chord_m;
  const double half_chord = 2 * side.planform.chord_m / M_PI;
  std::array<Strip, Mechanism::kStrips> strips = strips_of(side.planform);
  RigidBody body = side.wing;
  if (build.damage > 0 && number == build.damaged) {
    // mass is lost in proportion
    Strip& tip = strips.back();
    const double lost = build.damage * tip.area;
    tip = damaged_tip(tip, build.damage);
    body.mass_kg *= 1 - lost;
    body.com_m.y() *= 1 - lost;
    body.inertia_kg_m2 *= 1 - 2 * lost;
  }
  std::string text = inertial(body);
  for (std::size_t i = 0; i < strips.size(); ++i) {
    const Eigen::Vector3d axes(kThickness_m, half_length(strips[i]) * side.planform.length_m, half_chord);
    const Eigen::Vector3d at(0, out * strips[i].radius * side.planform.length_m, -0.55 * side.planform.chord_m);
    FluidCoefficients fluid = side.fluid;
    // Magnus: C rho V w x v, to be rho kRotation U thetadot c^2 per span
    const double volume = 4.0 / 3 * M_PI * axes.prod();
    fluid[4] += build.rotational_lift * kRotation * side.planform.chord_m * strips[i].area * area / volume;
    text += ellipsoid(name + "_strip_" + std::to_string(i), at, axes, fluid);
  }
  return text;
}

std::string side_of(const Side& side, std::size_t number, const Build& build) {
  const std::string name = number == 0 ? "left" : "right";
  const double out = number == 0 ? 1 : -1;
  const Motor& motor = side.motor;
  const double gear = motor.efficiency * motor.gear_ratio;
  const std::string rotor =
      "armature=\"" + numbers({gear * motor.gear_ratio * motor.rotor_inertia_kg_m2}) + "\" damping=\"" +
      numbers({gear * motor.gear_ratio * motor.damping_Nm_s + side.stroke.damping_Nm_s}) + "\" frictionloss=\"" +
      numbers({gear * motor.friction_Nm + side.stroke.friction_Nm}) + "\" ";
  const Eigen::Vector3d up(0, 0, out);
  const bool one = build.backlash_rad == 0;
  std::string text;
  if (!one)  // a body of negligible mass: its inertia is the armature
    text += "<body name=\"" + name + "_rotor\" pos=\"" + numbers(side.shoulder_m) +
            "\">\n<inertial pos=\"0 0 0\" mass=\"1e-9\" diaginertia=\"1e-13 1e-13 1e-13\"/>\n" +
            hinge(name + "_rotor", up, rotor) + ellipsoid(name + "_rotor", {0, 0, 0}, {1e-6, 1e-6, 1e-6}, {}) +
            "</body>\n";
  text += "<body name=\"" + name + "_edge\" pos=\"" + numbers(side.shoulder_m) + "\">\n" + inertial(side.leading_edge) +
          hinge(name + "_stroke", up, stops(side.stroke, 0) + (one ? rotor : std::string()));
  if (build.spar_stiffness_Nm_rad > 0)
    text += hinge(name + "_spar", {out, 0, 0},
                  "stiffness=\"" + numbers({build.spar_stiffness_Nm_rad}) + "\" damping=\"" +
                      numbers({build.spar_stiffness_Nm_rad * 6e-4}) + "\" ");
  text += ellipsoid(name + "_edge", {0, 0, 0}, {1e-6, 1e-6, 1e-6}, {}) + "<body name=\"" + name + "_wing\">\n" +
          hinge(name + "_rotation", {0, 1, 0},
                stops(side.rotation, build.stop_softness) + "damping=\"" + numbers({side.rotation.damping_Nm_s}) +
                    "\" frictionloss=\"" + numbers({side.rotation.friction_Nm}) + "\" ") +
          wing_of(side, number, build) + "</body>\n</body>\n";
  return text;
}

}  // namespace

std::array<Strip, Mechanism::kStrips> strips_of(const Planform& p) {
  // the nodes are the roots of the polynomial x^2 + b x + c that the moments make orthogonal to 1 and x
  const double determinant = p.r11 * p.r11 - p.r00 * p.r22;
  const double b = (p.r00 * p.r33 - p.r11 * p.r22) / determinant, c = (p.r22 * p.r22 - p.r11 * p.r33) / determinant;
  const double half = std::sqrt(b * b / 4 - c), inner = -b / 2 - half, outer = -b / 2 + half;
  const double outer_area = (p.r11 - inner * p.r00) / (outer - inner);
  return {Strip{inner, p.r00 - outer_area}, Strip{outer, outer_area}};
}

double half_length(const Strip& strip) { return strip.area / 2; }  // its half chord is 2/pi mean chords

Strip damaged_tip(const Strip& tip, double share) {
  return {tip.radius - share * half_length(tip), tip.area * (1 - share)};
}

double chord_at(const std::array<Strip, Mechanism::kStrips>& strips, double radius) {
  double chord = 0;
  for (const Strip& strip : strips) {
    const double off = (radius - strip.radius) / half_length(strip);
    if (std::abs(off) < 1) chord += 4 / M_PI * std::sqrt(1 - off * off);
  }
  return chord;
}

std::string mjcf_text(const RobotParameters& parameters, const Build& build, double step_s) {
  std::string text =
      "<mujoco model=\"flapper\">\n<compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n<option timestep=\"" +
      numbers({step_s}) + "\" gravity=\"0 0 " + numbers({-Mechanism::kGravity_m_s2}) + "\" density=\"" +
      numbers({parameters.density_kg_m3 * parameters.air}) + "\" viscosity=\"" + numbers({kViscosity_Pa_s}) +
      "\" integrator=\"Euler\" solver=\"Newton\" tolerance=\"1e-12\" iterations=\"30\">\n<flag "
      "contact=\"disable\"/>\n</option>\n"
      "<worldbody>\n<body name=\"torso\">\n<freejoint name=\"torso\"/>\n";
  RigidBody torso = parameters.torso;
  const Eigen::Vector3d foot(0, 0, -0.02);
  if (build.leg_mass_kg > 0) {  // torso and leg together keep mass and centre of mass
    torso.com_m = (torso.mass_kg * torso.com_m - build.leg_mass_kg * foot) / (torso.mass_kg - build.leg_mass_kg);
    torso.mass_kg -= build.leg_mass_kg;
  }
  text += inertial(torso);
  const Eigen::Vector3d axes(0.013, 0.013, 0.022);
  const double front = M_PI * axes.y() * axes.z();
  const double blunt = build.body_drag_m2 / (2 * front);  // MuJoCo's drag law has no factor 1/2
  text += ellipsoid("torso", {0, 0, 0}, axes,
                    {blunt, kBodySlender * blunt, build.body_drag_m2 > 0 ? kBodyAngular : 0, 0, 0});
  for (std::size_t side = 0; side < 2; ++side) text += side_of(parameters.sides[side], side, build);
  if (build.leg_mass_kg > 0) {
    const double length = 0.012, inertia = build.leg_mass_kg * length * length, rate = 2 * M_PI * 20;
    const std::string flexure =
        "stiffness=\"" + numbers({inertia * rate * rate}) + "\" damping=\"" + numbers({0.1 * inertia * rate}) + "\" ";
    text += "<body name=\"leg\" pos=\"0 0 -0.008\">\n<inertial pos=\"" + numbers({0, 0, -length}) + "\" mass=\"" +
            numbers({build.leg_mass_kg}) + "\" diaginertia=\"1e-9 1e-9 1e-9\"/>\n" +
            hinge("leg_x", {1, 0, 0}, flexure) + hinge("leg_y", {0, 1, 0}, flexure) +
            ellipsoid("leg", {0, 0, 0}, {1e-6, 1e-6, 1e-6}, {}) + "</body>\n";
  }
  text += "</body>\n</worldbody>\n";
  if (build.backlash_rad > 0) {
    text += "<tendon>\n";
    for (const std::string name : {"left", "right"})
      text += "<fixed limited=\"true\" range=\"" + numbers({-build.backlash_rad / 2, build.backlash_rad / 2}) +
              "\" solreflimit=\"" + numbers({std::max(kTeethTime_s, 2 * step_s), kTeethDamping}) +
              "\" solimplimit=\"0.95 0.99 0.001\"><joint joint=\"" + name + "_rotor\" coef=\"1\"/><joint joint=\"" +
              name + "_stroke\" coef=\"-1\"/></fixed>\n";
    text += "</tendon>\n";
  }
  return text + "</mujoco>\n";
}

}  // namespace flappy::blind::c
