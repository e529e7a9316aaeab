#include "lab/blind/a/family_a.hpp"

#include "lab/blind/a/a_session.hpp"
#include "lab/blind/a/sampled_robot.hpp"

namespace flappy::blind {
namespace {

using Words = std::vector<std::string>;

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
      {"ground_effect", "Hayden's law with 0.05 for 0.038", lift, {"height", "place"}},
      {"ceiling_effect", "10 % more force at the ceiling, halved 80 mm below", lift, {"ceiling", "height"}},
      {"wall_effect",
       "5 % less force of the wing at the wall, and a pull of 4 % of the weight within 150 mm",
       {"specific_force_y", "specific_force_z", "angular_acceleration_x"},
       {"wall", "place"}},
      {"body_drag", "areas of 1.2, 2.2 and 1.5e-3 m^2, each with its own component", forces, {"velocity"}},
      {"added_mass", "rho pi/4 c^2 of each strip", drive, {"always", "stroke", "acceleration"}},
      {"rotational_lift", "circulation of 0.75 pi, limited by the rate", drive, {"always", "stroke"}},
      {"wake_capture", "15 % of a stroke rate that lags by 3 ms", drive, {"always", "stroke"}},
      {"clap_and_fling", "more lift where the wings part", lift, {"amplitude", "stroke"}},
      {"wing_flexibility", "one mode of twist of 8e-3 N m/rad", drive, {"always", "amplitude"}},
      {"wing_damage",
       "5 % of one wing's area, at its tip",
       {"specific_force_z", "angular_acceleration_x", "angular_acceleration_z", "current"},
       {"always", "amplitude"}},
      {"wind",
       "0.3 m/s level, gusts of 0.1 m/s",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"always", "heading"}},
      {"spring_hardening", "4.5 %/rad and 5 %/rad^3", drive, {"amplitude", "stroke"}},
      {"gear_backlash", "1 deg between rotor and wing", drive, {"always", "stroke"}},
      {"coulomb_friction", "the motor's friction once more, and Stribeck's 80 %", drive, {"always", "amplitude"}},
      {"winding_heating", "copper on 12 and 30 K/W", drive, {"time", "temperature"}},
      {"battery_sag", "0.8 and 0.9 ohm, 0.06 V/C", drive, {"time", "charge", "amplitude"}},
      {"driver_dead_zone", "0.4 V, soft", drive, {"amplitude", "always"}},
      {"driver_bandwidth", "second order, 1 ms late", drive, {"always", "amplitude"}},
      {"command_delay", "8.8 ms, jittering", drive, {"always", "acceleration"}},
      {"stop_compliance", "rotation stops of 8.3 rad/(N m), hardening", drive, {"always", "amplitude"}},
      {"com_offset", "1 mm, level", torques, {"always"}},
      {"inertia_products", "5 % of the geometric mean of the moments", torques, {"rate", "acceleration"}},
      {"wing_inertia", "10 % of moments and centre, 8 % of a product", drive, {"always", "stroke"}},
      {"tether", "0.2 g/m, lying on the ground", wrench, {"height", "place"}},
      {"gyro_bias", "0.05 rad/s within 12 s, and a walk", {"gyro"}, {"time", "temperature"}},
      {"accelerometer_misalignment", "0.02 rad an axis, 0.5 % of scale", {"accelerometer"}, {"always", "amplitude"}},
      {"vibration_rectification", "1e-3 s^2/m of what shakes", {"accelerometer"}, {"amplitude", "always"}},
      {"mocap_tilt", "0.01 rad about a level axis", {"mocap"}, {"always", "place", "heading"}},
      {"marker_offset", "2 mm", {"mocap"}, {"rate", "heading"}},
      {"mocap_delay", "5 ms more than declared", {"mocap"}, {"velocity", "rate"}},
      {"outside_magnetic_torque", "1e-4 N m in a field", torques, {"heading", "always"}},
      {"outside_vortex_shedding",
       "3 % of the weight at 3 to 6 Hz",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"time", "velocity"}},
      {"outside_slosh",
       "0.7 g on 2 cm, at 3.5 Hz",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"acceleration", "time"}},
      {"outside_yaw_thrust_loss", "up to 6 % less lift at 2 rad/s of yaw", lift, {"rate"}},
      {"outside_wing_interference", "6 % less lift where the amplitudes differ by 2 V", lift, {"difference"}},
      {"outside_brush_contact",
       "35 % more resistance on the left for 20 ms, six times a second",
       {"specific_force_z", "angular_acceleration_x", "current"},
       {"time", "amplitude"}},
      {"outside_amplitude_hysteresis", "4 % of the torque within 0.5 V of play", drive, {"amplitude"}},
      {"outside_vortex_ring", "12 % less lift at half a metre per second down", lift, {"velocity"}},
      {"outside_humidity_front", "4 % of density across a front", lift, {"place"}},
      {"outside_mocap_lens", "5 %/m^2 of the place", {"mocap"}, {"place"}},
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
  Random random(seed, 201);
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
  Random random(a.seed, 202);
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
  Random random(seed, 203);
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
  change_on_purpose(c, a.changes);
  return c;
}

std::unique_ptr<Family> make_family_a() { return std::make_unique<FamilyA>(); }

}  // namespace flappy::blind
