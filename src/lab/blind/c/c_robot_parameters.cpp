#include "lab/blind/c/c_robot_parameters.hpp"

#include "io/config.hpp"
#include "lab/blind/c/c_random.hpp"

namespace flappy::blind::c {
namespace {

// Blunt, slender and angular drag, Kutta and Magnus lift of a fruit fly with one ellipsoid a wing that carry its weight
// (Vaxenburg et al., Whole-body physics simulation of fruit fly locomotion, Nature 643, 2025; its fly).
constexpr FluidCoefficients kFly = {1.0, 0.5, 1.5, 1.7, 1.0};
// The only tuned factor. It scales lift so that the nominal robot carries its weight at about 10 V.
constexpr double kLift = 1.18;

Eigen::Vector3d read_vector(const io::Table& at, const char* key) {
  const io::Table v = at.table(key);
  return {v.number("x"), v.number("y"), v.number("z")};
}

RigidBody read_body(const io::Table& at, const char* key) {
  const io::Table body = at.table(key), inertia = body.table("inertia_kg_m2");
  RigidBody read;
  read.mass_kg = body.number("mass_kg", io::positive(1));
  read.com_m = read_vector(body, "com_m");
  const double xx = inertia.number("xx", io::positive()), yy = inertia.number("yy", io::positive()),
               zz = inertia.number("zz", io::positive()), xy = inertia.number("xy"), yz = inertia.number("yz"),
               xz = inertia.number("xz");
  read.inertia_kg_m2 << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  if (!is_physical(read.inertia_kg_m2))
    body.fail("inertia_kg_m2", "no body has this inertia",
              "principal moments none of which is above the sum of the others");
  return read;
}

Hinge read_hinge(const io::Table& at, const char* key) {
  const io::Table hinge = at.table(key);
  return {hinge.number("lower_rad", {-3, 0}), hinge.number("upper_rad", {0, 3}),
          hinge.number("damping_Nm_s", io::non_negative()), hinge.number("friction_Nm", io::non_negative())};
}

Side read_side(const io::Table& root, const char* key) {
  const io::Table at = root.table(key), motor = at.table("motor"), spring = at.table("spring"),
                  plan = at.table("planform");
  Side side;
  side.leading_edge = read_body(at, "leading_edge");
  side.wing = read_body(at, "wing");
  side.shoulder_m = read_vector(at, "shoulder_m");
  side.stroke = read_hinge(at, "stroke");
  side.rotation = read_hinge(at, "rotation");
  side.motor = {
      motor.number("resistance_ohm", io::positive()),      motor.number("torque_constant_Nm_A", io::positive()),
      motor.number("gear_ratio", io::positive()),          motor.number("efficiency", io::positive(1)),
      motor.number("friction_Nm", io::non_negative()),     motor.number("damping_Nm_s", io::non_negative()),
      motor.number("rotor_inertia_kg_m2", io::positive()), motor.number("voltage_limit_V", io::positive())};
  side.spring = {spring.number("stiffness_positive_Nm_rad", io::non_negative()),
                 spring.number("stiffness_negative_Nm_rad", io::non_negative()), spring.number("rest_angle_rad")};
  side.planform = {plan.number("wing_length_m", io::positive()), plan.number("mean_chord_m", io::positive()),
                   plan.number("r33", io::positive()),           plan.number("r22", io::positive()),
                   plan.number("r11", io::positive()),           plan.number("r00", io::positive())};
  side.fluid = kFly;
  side.fluid[3] *= kLift;
  return side;
}

/// Drawn until physical. Moments vary by 7 %, products by 7 % plus about 1 % of the moments, as many are zero.
Eigen::Matrix3d drawn_inertia(const Eigen::Matrix3d& nominal, double mass_factor, Random& random) {
  for (;;) {
    Eigen::Matrix3d drawn = nominal * mass_factor;
    const double mean = drawn.trace() / 3;
    for (int i = 0; i < 3; ++i) {
      drawn(i, i) *= 1 + 0.07 * random.cut_normal();
      for (int j = 0; j < i; ++j) {
        drawn(i, j) += 0.07 * drawn(i, j) * random.cut_normal();
        drawn(i, j) += 0.01 * std::sqrt(drawn(i, i) * drawn(j, j) / (mean * mean)) *
                       std::min(drawn(i, i), drawn(j, j)) * random.cut_normal();
        drawn(j, i) = drawn(i, j);
      }
    }
    if (is_physical(drawn)) return drawn;
  }
}

void draw(RigidBody& body, Random& random) {
  const double factor = 1 + 0.03 * random.cut_normal();
  body.mass_kg *= factor;
  for (int i = 0; i < 3; ++i) body.com_m[i] += 0.3e-3 * random.cut_normal();
  body.inertia_kg_m2 = drawn_inertia(body.inertia_kg_m2, factor, random);
}

void draw(Side& side, Random& random) {
  const double degree = M_PI / 180;
  const auto scaled = [&](double& value, double sd) { value *= 1 + sd * random.cut_normal(); };
  draw(side.leading_edge, random);
  draw(side.wing, random);
  for (int i = 0; i < 3; ++i) side.shoulder_m[i] += 0.3e-3 * random.cut_normal();
  for (Hinge* hinge : {&side.stroke, &side.rotation}) {
    hinge->lower_rad += 2 * degree * random.cut_normal();
    hinge->upper_rad += 2 * degree * random.cut_normal();
    scaled(hinge->friction_Nm, 0.3);
    scaled(hinge->damping_Nm_s, 0.3);
  }
  scaled(side.spring.positive_Nm_rad, 0.05);
  scaled(side.spring.negative_Nm_rad, 0.05);
  side.spring.rest_rad += degree * random.cut_normal();
  scaled(side.motor.resistance_ohm, 0.07);
  scaled(side.motor.torque_constant_Nm_A, 0.03);
  scaled(side.motor.friction_Nm, 0.3);
  scaled(side.motor.damping_Nm_s, 0.3);
  scaled(side.motor.rotor_inertia_kg_m2, 0.07);
  side.motor.efficiency = std::min(1.0, side.motor.efficiency * (1 + 0.02 * random.cut_normal()));
  for (double& coefficient : side.fluid) scaled(coefficient, 0.05);
}

}  // namespace

double RobotParameters::mass_kg() const {
  double sum = torso.mass_kg;
  for (const Side& side : sides) sum += side.leading_edge.mass_kg + side.wing.mass_kg;
  return sum;
}

bool is_physical(const Eigen::Matrix3d& inertia) {
  const Eigen::Vector3d moments =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
  return moments[0] > 0 && moments[2] <= (moments[0] + moments[1]) * (1 - 1e-9);
}

Eigen::Matrix3d made_physical(const Eigen::Matrix3d& inertia) {
  if (is_physical(inertia)) return inertia;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(inertia);
  Eigen::Vector3d moments = axes.eigenvalues();
  moments[2] = (moments[0] + moments[1]) * (1 - 1e-6);
  return axes.eigenvectors() * moments.asDiagonal() * axes.eigenvectors().transpose();
}

RobotParameters read_parameters(const std::filesystem::path& vehicle_file) {
  const io::Config config = io::Config::load(vehicle_file);
  const io::Table root = config.root(), driver = root.table("driver"), extent = root.table("extent");
  root.schema(1);
  RobotParameters read;
  read.file_name = vehicle_file.filename().string();
  read.density_kg_m3 = root.table("air").number("density_kg_m3", io::positive(10));
  read.flapping_Hz = driver.number("flapping_Hz", io::positive(200));
  read.hold_s = driver.number("hold_s", io::positive(0.01));
  read.amplitude_limit_V = driver.number("amplitude_limit_V", io::positive());
  read.difference_limit_V = driver.number("difference_limit_V", io::non_negative());
  read.bias_limit_V = driver.number("bias_limit_V", io::non_negative());
  read.split_cycle_limit = driver.number("split_cycle_limit", {0, 0.45});
  read.below_m = extent.number("below_m", io::non_negative());
  read.above_m = extent.number("above_m", io::non_negative());
  read.around_m = extent.number("around_m", io::non_negative());
  read.torso = read_body(root, "torso");
  read.sides = {read_side(root, "left"), read_side(root, "right")};
  return read;
}

RobotParameters drawn_parameters(const RobotParameters& nominal, std::uint64_t seed) {
  Random random(seed, "figures");
  RobotParameters drawn = nominal;
  draw(drawn.torso, random);
  for (Side& side : drawn.sides) draw(side, random);
  return drawn;
}

}  // namespace flappy::blind::c
