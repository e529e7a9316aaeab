#include "lab/blind/a/family_a.hpp"

#include "lab/blind/a/a_session.hpp"
#include "lab/blind/a/sampled_robot.hpp"

namespace flappy::blind {
namespace {

using Words = std::vector<std::string>;

/// Added mass and inertia of a wing of the nominal robot: sums of laws::added_mass() over its strips.
constexpr double kAddedMass_kg = 2.354e-5, kAddedInertia_kg_m2 = 3.686e-10;

/// In the order of Effect.
const std::vector<FamilyEffect>& table() {
  const Words forces = {"specific_force_x", "specific_force_y", "specific_force_z"},
              torques = {"angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"};
  const Words wrench = {"specific_force_x",       "specific_force_y",       "specific_force_z",
                        "angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"};
  const Words lift = {"specific_force_z", "angular_acceleration_y", "current"},
              drive = {"specific_force_x", "specific_force_z", "angular_acceleration_x", "angular_acceleration_y",
                       "current"};
  static const std::vector<FamilyEffect> effects = {
      {"ground_effect",
       "an image source; 4 % more lift 100 mm above the ground",
       lift,
       {"height", "place"},
       "s / (1 - s), s = (1 - 2 h / sqrt(4 h^2 + R^2)) / 2",
       "Cheeseman and Bennett, ARC R&M 3021, 1955, with the source spread over the disc; R: geometry",
       {laws::kDisc_m}},
      {"ceiling_effect",
       "5 % more lift 71 mm below the ceiling, 45 % at 20 mm",
       lift,
       {"ceiling", "height"},
       "g^n - 1, g = (1 + sqrt(1 + R^2 / (8 D^2))) / 2, D not below D0",
       "Hsiao and Chirarattananon, Ceiling effects, IEEE/ASME Trans. Mechatronics, 2019; g derived here; n, D0: choice",
       {laws::kDisc_m, laws::kCeilingExponent, laws::kCeilingLeast_m}},
      {"wall_effect",
       "a pull of 0.9 % of the weight and 1.2 % less lift of the wing 160 mm from the wall",
       {"specific_force_y", "specific_force_z", "angular_acceleration_x"},
       {"wall", "place"},
       "pull R^2 / (32 d^2) of the weight; loss L / (1 + (d / D)^2)",
       "pull: image of a sink (theorem of Lagally; Milne-Thomson, Theoretical Hydrodynamics); loss: choice",
       {laws::kDisc_m * laws::kDisc_m / 32, laws::kWallLoss, laws::kWallCore_m}},
      {"body_drag",
       "faces of 1.27e-3, 1.93e-3 and 1.16e-3 m^2 as cylinders; 0.8 mN at 1 m/s along x",
       forces,
       {"velocity"},
       "F_i = -1/2 rho (1 + 10 Re_i^(-2/3)) A_i |v| v_i",
       "White, Viscous Fluid Flow: drag of a cylinder; faces: choice",
       {laws::kFace_m2[0], laws::kFace_m2[1], laws::kFace_m2[2], laws::kFaceWidth_m[0]}},
      {"added_mass",
       "23.5 mg of air on a wing, at mid-chord, and its inertia",
       drive,
       {"always", "stroke", "acceleration"},
       "rho pi/4 c^2 sqrt(1 - (2 r/R - 1)^2) per span at mid-chord, and 1/32 of it times c^2",
       "elliptic plate (Lamb, Hydrodynamics); inertia as Whitney and Wood, J. Fluid Mech. 660, 2010",
       {kAddedMass_kg, kAddedInertia_kg_m2}},
      {"rotational_lift",
       "circulation of 1.47, which saturates with the rate",
       drive,
       {"always", "stroke"},
       "F = rho C U w c^2 / sqrt(1 + (w c / (2 U w0))^2) per span",
       "Sane and Dickinson, J. Exp. Biol. 205, 2002, for the kind; C: theory of thin wings with AR / (AR + 2); w0: "
       "choice",
       {laws::kKramer, laws::kKramerRate}},
      {"wake_capture",
       "17 % of a stroke rate that lags twice by 2.1 ms",
       drive,
       {"always", "stroke"},
       "u - k w (1 - w u / sqrt((w u)^2 + t^4)) / 2, w: u behind two low-passes",
       "Birch and Dickinson, J. Exp. Biol. 206, 2003, for the kind; numbers: choice",
       {laws::kWakeShare, laws::kWakeLag_s, laws::kWakeTurn_rad_s}},
      {"clap_and_fling",
       "more lift while wings that came within a third of a radian part",
       lift,
       {"amplitude", "stroke"},
       "k g(gap / 2) exp(-(closest / n)^2 - (gap - closest) / d), g: circulation of opening plates",
       "Lighthill, J. Fluid Mech. 60, 1973 (0.69 at 60 degrees); g derived here; k, n, d: choice",
       {laws::kFling, laws::kFlingNear_rad, laws::kFlingDecay_rad, laws::kFlingLeast_rad}},
      {"wing_flexibility",
       "2.5 degrees at the tip under the mean load of hover",
       drive,
       {"always", "amplitude"},
       "twist = -a L / sqrt(1 + (a L / b)^2) shape(r), shape' = integral of c^2 r^2 beyond r / c^3",
       "torsion of a tapered sheet (Saint-Venant); numbers: choice",
       {laws::kTwist_rad, laws::kTwistMost_rad, laws::kTwistLag_s}},
      {"wing_damage",
       "6 % of one wing's area, worn off its trailing edge",
       {"specific_force_z", "angular_acceleration_x", "angular_acceleration_z", "current"},
       {"always", "amplitude"},
       "share of chord w (r/R - x) / (1 - x) beyond x",
       "Hedenstrom, Ellington and Wolf, Funct. Ecol. 15, 2001: distal trailing edge, 10 % of the area; numbers: choice "
       "within it",
       {laws::kWearAtTip, laws::kWearBegins, laws::kMembrane}},
      {"wind",
       "0.27 m/s level at 0.6 m, gusts of 0.11 m/s",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"always", "heading"},
       "ln(1 + z / z0) profile; gusts through (1 + T s / 4) / (1 + 1.357 T s + 0.1987 T^2 s^2)",
       "von Karman filter of MIL-F-8785C as MathWorks states it; turbulence of 40 % as in ISO 7730; numbers: choice",
       {laws::kWind_m_s, laws::kGust_m_s, laws::kGustTime_s, laws::kRoughness_m}},
      {"spring_hardening",
       "a leaf that wraps on its support beyond 51 degrees",
       drive,
       {"amplitude", "stroke"},
       "k a e^2 / (1 - e), e = |angle| / a - 1 > 0",
       "derived from the bending of a beam on a round support; a: choice",
       {laws::kLeaf_rad, 0.013384289 * laws::kLeaf_rad}},
      {"gear_backlash",
       "0.82 degrees between rotor and wing",
       drive,
       {"always", "stroke"},
       "K d^1.5 (1 + b d'), d: approach of the flanks beyond half the gap, never pulling",
       "Hertz; Hunt and Crossley, J. Appl. Mech. 42, 1975; numbers: choice",
       {laws::kGearGap_rad, laws::kFlank_Nm_rad15, laws::kFlankDamping_s_rad}},
      {"coulomb_friction",
       "13 uN m of the motor, 32 uN m when slow",
       drive,
       {"always", "amplitude"},
       "(f + m exp(-(v / v0)^2)) tanh(v / v1)",
       "Gaussian Stribeck curve: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30, 1994; numbers: choice",
       {laws::kSliding_Nm, laws::kMixed_Nm, laws::kStribeck_rad_s, laws::kStick_rad_s}},
      {"winding_heating",
       "copper on 13, 6 and 33 K/W; the magnet weakens",
       drive,
       {"time", "temperature"},
       "three heat capacities in a row to the air; R: +0.393 %/K of the winding, K: -0.116 %/K of the magnet",
       "copper: IEC 60228; NdFeB: makers state -0.11 to -0.12 %/K; thermal numbers: choice",
       {laws::kWinding_J_K, laws::kToMagnet_K_W, laws::kMagnet_J_K, laws::kToAir_K_W, -laws::kMagnet_1_K}},
      {"battery_sag",
       "0.69 ohm, pairs of 0.43 ohm and 0.73 s and of 0.52 ohm and 11.7 s, five cells of 27 mA h",
       drive,
       {"time", "charge", "amplitude"},
       "R i + two RC pairs + n (E(1) - E(1 - q / Q)), E = -1.031 exp(-35 s) + 3.685 + 0.2156 s - 0.1178 s^2 + 0.3201 "
       "s^3",
       "Chen and Rincon-Mora, IEEE Trans. Energy Convers. 21, 2006 (form and E); numbers: choice",
       {laws::kSeries_ohm, laws::kFast_ohm, laws::kFast_s, laws::kSlow_ohm, laws::kSlow_s}},
      {"driver_dead_zone",
       "0.37 V against the current",
       drive,
       {"amplitude", "always"},
       "-V sign(i), linear within i0",
       "dead time of bridges: Jeong and Park, IEEE Trans. Ind. Electron. 38, 1991; numbers: choice",
       {laws::kDeadTime_V, laws::kRipple_A}},
      {"driver_bandwidth",
       "coil and capacitor at 205 Hz, damped by a third",
       drive,
       {"always", "amplitude"},
       "V'' = w^2 (command - V) - 2 z w V'",
       "output filter of second order; numbers: choice",
       {laws::kFilter_rad_s, laws::kFilterDamping}},
      {"command_delay",
       "6.4 ms, and 0.76 ms for each lost packet, 29 % of all",
       drive,
       {"always", "acceleration"},
       "base + n retry, n geometric",
       "nRF24L01+ product specification: resends up to 15 times, delay in steps of 0.25 ms; numbers: choice",
       {laws::kLink_s, laws::kRetry_s, laws::kLoss}},
      {"stop_compliance",
       "rubber of 1.07 N m/rad^1.5 on the rotation stops",
       drive,
       {"always", "amplitude"},
       "hard stop in a row with K d^1.5 (1 + b rate)",
       "Hunt and Crossley, J. Appl. Mech. 42, 1975; numbers: choice",
       {laws::kRubber_Nm_rad15, laws::kRubberDamping_s_rad}},
      {"com_offset",
       "a battery of 2.3 g beside its place by 3.9 mm",
       torques,
       {"always"},
       "centre moves by m x / M",
       "choice",
       {laws::kBattery_kg, laws::kBatteryMoved_m}},
      {"inertia_products",
       "5.2, 4.4 and 3.9 % of the geometric mean of the moments",
       torques,
       {"rate", "acceleration"},
       "I_ab = +- p sqrt(I_aa I_bb)",
       "choice",
       {laws::kProducts[0], laws::kProducts[1], laws::kProducts[2]}},
      {"wing_inertia",
       "8.7 % of moments, 9.1 % of the centre, 6.5 % of a product",
       drive,
       {"always", "stroke"},
       "I (1 + a), z (1 + b), I_yz = +- c sqrt(I_yy I_zz)",
       "choice",
       {laws::kWingMoments, laws::kWingProduct, laws::kWingCentre}},
      {"tether",
       "0.21 g/m of cable, slack up to 0.42 m",
       wrench,
       {"height", "place"},
       "weight of the lifted length, and K (distance - L) to the anchor beyond L",
       "choice",
       {laws::kCable_kg_m, laws::kCableLength_m, laws::kCableSpring_N_m}},
      {"gyro_bias",
       "0.047 rad/s within a minute, and a walk",
       {"gyro"},
       {"time", "temperature"},
       "b (a (1 - exp(-t / t1)) + (1 - a) (1 - exp(-t / t2))) and a random walk",
       "MPU-6050 data sheet: 20 deg/s over the range of temperature; 8 K, times and walk: choice",
       {laws::kGyroWarm_rad_s, laws::kGyroDie_s, laws::kGyroBoard_s, laws::kGyroWalk_rad_s15}},
      {"accelerometer_misalignment",
       "0.011 rad of turn, 0.013 of skew, 0.9 % of scale",
       {"accelerometer"},
       {"always", "amplitude"},
       "scale x skew x turn, each drawn",
       "MPU-6050 data sheet: 3 % of scale and 2 % across axes at most; numbers: choice within it",
       {laws::kTurn_rad, laws::kSkew_rad, laws::kScale}},
      {"vibration_rectification",
       "7.6e-4 s^2/m of what shakes at 34 Hz, twice at 450 Hz",
       {"accelerometer"},
       {"amplitude", "always"},
       "k y^2 / (1 + (y / a)^2), y: what shakes behind the resonance of the element",
       "asymmetric rails: Analog Devices, Vibration Rectification in MEMS Accelerometers; numbers: choice",
       {laws::kRectifies_s2_m, laws::kRails_m_s2, laws::kElement_rad_s, laws::kElementDamping}},
      {"mocap_tilt",
       "9 mrad: one of three feet of the frame is 2.5 mm too high",
       {"mocap"},
       {"always", "place", "heading"},
       "the world turns about the line through the other two feet",
       "choice",
       {laws::kFoot_m, laws::kFeet_m}},
      {"marker_offset",
       "1.6 mm and 12 mrad",
       {"mocap"},
       {"rate", "heading"},
       "a rigid displacement and a small turn on the torso",
       "choice",
       {laws::kMarker_m, laws::kMarkerTurn_rad}},
      {"mocap_delay",
       "3.3 to 7.4 ms more than declared, as a saw",
       {"mocap"},
       {"velocity", "rate"},
       "d + T frac(t / beat of the clocks)",
       "Qualisys: 6 to 7 ms at 200 Hz, real-time latency tests at ETH; numbers: choice",
       {laws::kHost_s, laws::kFetch_s, laws::kBeating_s}},
      {"outside_magnetic_torque",
       "1.04e-4 N m in a field",
       torques,
       {"heading", "always"},
       "m x B, m level and fixed in the torso, B fixed in the world",
       "choice",
       {laws::kMagnetic_Nm, laws::kDip}},
      {"outside_vortex_shedding",
       "3 % of the weight at 3.1 to 5.7 Hz",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"time", "velocity"},
       "k W sin(2 pi turns), turns' = f (1 + 0.4 speed)",
       "choice",
       {laws::kShedding, laws::kSheddingLow_Hz, laws::kSheddingHigh_Hz}},
      {"outside_slosh",
       "0.71 g that swings at 3.5 Hz",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"acceleration", "time"},
       "a pendulum under the level specific force",
       "choice",
       {laws::kSlosh_kg, laws::kSlosh_rad_s, laws::kSloshDamping}},
      {"outside_yaw_thrust_loss",
       "up to 6 % less lift at some 2 rad/s of yaw",
       lift,
       {"rate"},
       "k x^2 / (1 + x^2), x = yaw rate / w",
       "choice",
       {laws::kYawLoss, laws::kYawLoss_rad_s}},
      {"outside_wing_interference",
       "6 % less lift where the amplitudes differ by 2 V",
       lift,
       {"difference"},
       "k tanh^2(difference of amplitudes / v)",
       "choice",
       {laws::kInterference, laws::kInterference_V}},
      {"outside_brush_contact",
       "35 % more resistance on the left for 20 ms, six times a second",
       {"specific_force_z", "angular_acceleration_x", "current"},
       {"time", "amplitude"},
       "R (1 + k) while open; both times exponential",
       "choice",
       {laws::kBrush, laws::kBrushOpen_s, laws::kBrush_Hz}},
      {"outside_amplitude_hysteresis",
       "4 % of the torque within 0.5 V of play",
       drive,
       {"amplitude"},
       "1 + k (play - amplitude) / width",
       "choice",
       {laws::kHysteresis, laws::kPlay_V}},
      {"outside_vortex_ring",
       "12 % less lift at half a metre per second down",
       lift,
       {"velocity"},
       "k x^2 exp(1 - x^2), x = sink rate / v",
       "choice",
       {laws::kRing, laws::kRing_m_s}},
      {"outside_humidity_front",
       "4 % of density across a front",
       lift,
       {"place"},
       "1 + k tanh(x / width)",
       "choice",
       {laws::kFront, laws::kFront_m}},
      {"outside_mocap_lens",
       "5 %/m^2 of the place",
       {"mocap"},
       {"place"},
       "p (1 + k (x^2 + y^2))",
       "choice",
       {laws::kLens_1_m2}},
  };
  return effects;
}

/// About the file's value: a share of it if `share`, else in the parameter's unit.
struct Spread {
  std::string_view ending;
  double sd;
  bool share;
};
constexpr double kDegree = kPi / 180;
constexpr Spread kSpreads[] = {{".mass_kg", 0.03, true},
                               {".com_m.x", 3e-4, false},
                               {".com_m.y", 3e-4, false},
                               {".com_m.z", 3e-4, false},
                               {".shoulder_m.x", 3e-4, false},
                               {".shoulder_m.y", 3e-4, false},
                               {".shoulder_m.z", 3e-4, false},
                               {".lower_rad", 2 * kDegree, false},
                               {".upper_rad", 2 * kDegree, false},
                               {".damping_Nm_s", 0.3, true},
                               {".friction_Nm", 0.3, true},
                               {".resistance_ohm", 0.07, true},
                               {".torque_constant_Nm_A", 0.03, true},
                               {".rotor_inertia_kg_m2", 0.07, true},
                               {".stiffness_positive_Nm_rad", 0.05, true},
                               {".stiffness_negative_Nm_rad", 0.05, true},
                               {".rest_angle_rad", kDegree, false},
                               {".mean_chord_m", 0.05, true},  // scales the aerodynamic force, and little else
                               {".rotational_damping_coefficient", 0.05, true},
                               {"air.density_kg_m3", 0.02, true}};
constexpr double kInertiaSpread = 0.07;

/// Standard normal, redrawn beyond three standard deviations.
double within_three(Random& random) {
  double n = random.normal();
  while (std::abs(n) > 3) n = random.normal();
  return n;
}

void draw_parameters(model::Vehicle& v, std::uint64_t seed) {
  Random random(seed, Purpose::parameters);
  for (model::Parameter& p : model::parameters(v))
    for (const Spread& s : kSpreads)
      if (p.path.ends_with(s.ending)) {
        const double off = s.sd * within_three(random) * (s.share ? *p.value : 1);
        *p.value = std::clamp(*p.value + off, p.low, p.high);
      }
  for (model::RigidBody* b : {&v.torso, &v.left.leading_edge, &v.left.wing, &v.right.leading_edge, &v.right.wing}) {
    model::InertiaTensor& i = b->inertia_kg_m2;
    const model::InertiaTensor declared = i;
    do {  // redraws: a flat wing's inertia is at the limit of what is physical
      i = declared;
      for (double* x : {&i.xx, &i.yy, &i.zz, &i.xy, &i.yz, &i.xz}) *x *= 1 + kInertiaSpread * within_three(random);
    } while (model::physical_fault(v));
  }
}

/// Of another laboratory; rates, latencies and positions are exact until misdeclare().
SensorSet drawn_sensors(const Assignment& a) {
  SensorSet s = sensors_of(a.seed, a.power, a.wings);
  Random random(a.seed, Purpose::other_sensors);
  constexpr double kImu_Hz[] = {400, 500, 625, 1000, 1250}, kMocap_Hz[] = {120, 150, 200, 240, 300};
  const auto one_of = [&](const auto& list) { return list[static_cast<std::size_t>(random.uniform() * 5)]; };
  s.imu.rate_hz = one_of(kImu_Hz);
  s.imu_low_pass_hz = random.between(0.3, 0.45) * s.imu.rate_hz;
  s.imu_transport_s = random.between(0.3e-3, 2.5e-3);
  declare_imu(s);
  s.imu.position_m = {random.between(-6e-3, 6e-3), random.between(-4e-3, 4e-3), random.between(-12e-3, 4e-3)};
  const Vector3d axis = random.normals().normalized();
  s.imu_turned = turned_by(kDegree * random.uniform() * axis).toRotationMatrix();
  s.mocap.rate_hz = one_of(kMocap_Hz);
  s.mocap.latency_s = random.between(8e-3, 25e-3);
  if (s.power) s.power->latency_s = random.between(1e-4, 2e-3);
  return s;
}

/// Declarations that a laboratory knows less well: the IMU's position by 1 mm, noise by a factor.
void misdeclare(flightlog::FlightHeader& h, std::uint64_t seed) {
  Random random(seed, Purpose::declarations);
  for (double& x : h.imu.position_m) x += 1e-3 * within_three(random);
  for (double* noise :
       {&h.imu.gyro_noise_rad_s, &h.imu.accel_noise_m_s2, &h.mocap.position_noise_m, &h.mocap.attitude_noise_rad})
    *noise *= random.between(0.7, 1.5);
}

/// Leads the torso along the path; harmonics, by beats, of the accelerations that a free torso would have there.
Contrast led(const Case& c, std::size_t flight, const std::vector<Torso>& path,
             const std::vector<std::array<double, 2>>& volts) {
  Robot robot = robot_of(c, flight);
  const auto& at = c.sensors->imu.position_m;
  const double beats_per_step = kRobotStep_s * c.vehicle.driver.flapping_Hz, trim = kTrim_s / kRobotStep_s;
  Contrast out;
  std::array<double, 30> sum{};
  int count = 0;
  double beat = std::ceil(trim * beats_per_step - 1e-9);
  for (std::size_t n = 0; n < path.size(); ++n) {
    robot.place_torso(path[n]);
    robot.step(volts[n][0], volts[n][1]);
    const double turns = (static_cast<double>(n) + 0.5) * beats_per_step;
    if (turns >= beat + 1) {
      for (double& x : sum) x /= std::max(1, count);
      out.beat_s.push_back((beat / beats_per_step - trim) * kRobotStep_s);
      out.change.push_back(sum);
      sum.fill(0);
      count = 0;
      beat += 1;
    }
    if (turns < beat) continue;
    ++count;
    const SinCos one = sin_cos(2 * kPi * (turns - beat)), two = sin_cos(4 * kPi * (turns - beat));
    const double waves[] = {1, 2 * one.cos, 2 * one.sin, 2 * two.cos, 2 * two.sin};
    const Vector3d force = robot.specific_force({at[0], at[1], at[2]}), turning = robot.state().turning_rad_s2;
    for (std::size_t i = 0; i < 30; ++i) {
      const auto axis = static_cast<Eigen::Index>(i / 5 % 3);
      sum[i] += waves[i % 5] * (i < 15 ? force : turning)(axis);
    }
  }
  return out;
}

class FamilyA final : public Family {
 public:
  std::string name() const override { return "a"; }
  const std::vector<FamilyEffect>& effects() const override { return table(); }
  std::vector<double> law(const std::string& effect, std::span<const double> at) const override {
    return law_of(effect, at);
  }

  FamilyFlight fly(const Assignment& a, std::size_t flight) const override {
    if (!a.proposed) check(flight);
    RobotFlight f = blind::fly(case_of(a), flight);
    if (a.conventions) misdeclare(f.log.header, a.seed);
    return {f.crashed, std::move(f.how), std::move(f.log)};
  }

  Contrast contrast(const Assignment& a, std::size_t flight, const std::string& effect,
                    double magnitude) const override {
    check(flight);
    Assignment with = a;
    if (std::erase_if(with.effects, [&](const auto& e) { return e.first == effect; }) > 0)
      throw io::InputError("effect " + effect + ": the flight was flown with it; accepted: a flight without it");
    with.effects.emplace_back(effect, magnitude);
    const Case before = case_of(a), after = case_of(with);
    std::vector<Torso> path;
    std::vector<std::array<double, 2>> volts;
    blind::fly(before, flight, [&](const Robot& robot, const std::array<double, 2>& v) {
      path.push_back(robot.torso());
      volts.push_back(v);
    });
    const Contrast without = led(before, flight, path, volts);
    Contrast out = led(after, flight, path, volts);
    for (std::size_t b = 0; b < out.change.size(); ++b)
      for (std::size_t i = 0; i < 30; ++i) out.change[b][i] -= without.change[b][i];
    return out;
  }

  FamilyFlight fly_on_board(const Assignment& a, std::size_t number, const std::array<double, 4>& start, double lasts_s,
                            OnBoard& firmware) const override {
    Torso at;
    at.position_m = {start[0], start[1], start[2]};
    at.attitude = turned_by({0, 0, start[3]});
    RobotFlight f = blind::fly_on_board(case_of(a), number, at, lasts_s, firmware);
    if (a.conventions) misdeclare(f.log.header, a.seed);
    return {f.crashed, std::move(f.how), std::move(f.log)};
  }

  FamilyEscape escape(const Assignment&, std::size_t, const EscapeAssignment&) const override {
    throw io::InputError("--family a: flies escapes by the task's own rules; accepted: escape without --family");
  }

 private:
  static void check(std::size_t flight) {
    if (flight >= Family::kFlights)
      throw io::InputError("flight " + std::to_string(flight) + ": there is none of this number; accepted: 0, 1 and 2");
  }
};

}  // namespace

Case case_of(const Assignment& a) {
  Case c = declared_case(a.vehicle_file);
  std::vector<BlindEffect> effects;
  for (const auto& [id, magnitude] : a.present_effects()) effects.push_back({id, magnitude});
  c.magnitudes = Magnitudes(effects);
  c.seed = a.seed;
  c.programme = a.hover ? Programme::hover : a.calm ? Programme::calm : Programme::rich;
  c.proposed = a.proposed;
  c.power = a.power;
  c.wings = a.wings;
  c.sensors = a.conventions ? drawn_sensors(a) : sensors_of(a.seed, a.power, a.wings);
  if (a.own_parameters) draw_parameters(c.vehicle, a.seed);
  begin_session(c, a.session);
  c.programme_of = a.programme_of;
  change_on_purpose(c, a.changes);
  return c;
}

std::unique_ptr<Family> make_family_a() { return std::make_unique<FamilyA>(); }

}  // namespace flappy::blind
