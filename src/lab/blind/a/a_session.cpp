#include "lab/blind/a/a_session.hpp"

namespace flappy::blind {

SessionChange session_change(std::uint64_t seed, std::size_t session) {
  SessionChange s;
  if (session == 0) return s;
  Random random(seed, Purpose::session, flight_number(session, 0));
  const auto within = [&](double most) { return random.between(-most, most); };
  const auto vector_within = [&](double most) {
    const double x = within(most), y = within(most);
    return Vector3d(x, y, within(most));
  };
  constexpr double kDegree = kPi / 180;
  const double weather = within(1);  // 1: a high of 4.5 hPa, and a room colder by 1 K
  s.density = weather * (4.5 / 1013 + 1.0 / 295);
  for (const std::size_t k : {0u, 1u}) {
    s.resistance[k] = 0.00393 * (within(1.8) - weather);
    s.friction[k] = within(0.08);
    s.damping[k] = s.friction[k] + 0.02 * weather;
    s.rest_angle_rad[k] = within(0.2 * kDegree);
  }
  s.torso_mass = within(2.2e-3);
  s.battery_m = vector_within(0.6e-3).cwiseProduct(Vector3d(1, 1, 0.5));
  s.battery_V = within(0.09);
  s.marker_m = vector_within(0.2e-3);
  s.marker_rad = vector_within(0.06 * kDegree);
  s.imu_rad = vector_within(0.12 * kDegree);
  s.mocap_late_s = within(0.3e-3);
  for (double& gain : s.gains) gain = within(0.04);
  return s;
}

void begin_session(Case& c, std::size_t session) {
  c.session = session;
  if (session == 0) return;
  const SessionChange s = session_change(c.seed, session);
  model::Vehicle& v = c.vehicle;
  v.air_density_kg_m3 *= 1 + s.density;
  for (const std::size_t k : {0u, 1u}) {
    model::Side& side = k == 0 ? v.left : v.right;
    side.motor.resistance_ohm *= 1 + s.resistance[k];
    for (double* friction : {&side.motor.friction_Nm, &side.stroke.friction_Nm, &side.rotation.friction_Nm})
      *friction *= 1 + s.friction[k];
    for (double* damping : {&side.motor.damping_Nm_s, &side.stroke.damping_Nm_s, &side.rotation.damping_Nm_s})
      *damping *= 1 + s.damping[k];
    side.spring.rest_angle_rad += s.rest_angle_rad[k];
  }
  v.torso.mass_kg *= 1 + s.torso_mass;
  const Vector3d shift_m = 2e-3 / v.torso.mass_kg * s.battery_m;  // it changes the inertia by less than 0.1 %
  v.torso.com_m.x += shift_m.x();
  v.torso.com_m.y += shift_m.y();
  v.torso.com_m.z += shift_m.z();
  c.battery_V += s.battery_V;
  if (!c.sensors) c.sensors = sensors_of(c.seed, c.power, c.wings);
  c.sensors->marker_m = s.marker_m;
  c.sensors->marker_turned = turned_by(s.marker_rad);
  c.sensors->imu_turned = turned_by(s.imu_rad).toRotationMatrix() * c.sensors->imu_turned;
  c.sensors->mocap_late_s = s.mocap_late_s;
  const double* share = s.gains.data();
  c.gains.each([&](double& gain) { gain *= 1 + *share++; });
}

void change_on_purpose(Case& c, const model::Changes& changes) {
  c.changes = changes;
  model::Vehicle& v = c.vehicle;
  if (changes.swapped_wings) {
    for (const auto part : {&model::Side::leading_edge, &model::Side::wing}) {
      std::swap(v.left.*part, v.right.*part);
      for (model::RigidBody* body : {&(v.left.*part), &(v.right.*part)})  // y points outwards on the left alone
        for (double* odd : {&body->com_m.y, &body->inertia_kg_m2.xy, &body->inertia_kg_m2.yz}) *odd *= -1;
    }
    std::swap(v.left.rotation, v.right.rotation);
    std::swap(v.left.planform, v.right.planform);
  }
  if (changes.added_mass_kg > 0) {
    // parallel axes: both masses about their common centre
    model::RigidBody& torso = v.torso;
    const auto& at = changes.added_at_m;
    const double whole_kg = torso.mass_kg + changes.added_mass_kg;
    const Vector3d apart(at[0] - torso.com_m.x, at[1] - torso.com_m.y, at[2] - torso.com_m.z),
        shift = changes.added_mass_kg / whole_kg * apart;
    const Matrix3d more = torso.mass_kg * changes.added_mass_kg / whole_kg *
                          (apart.squaredNorm() * Matrix3d::Identity() - apart * apart.transpose());
    model::InertiaTensor& i = torso.inertia_kg_m2;
    i.xx += more(0, 0), i.yy += more(1, 1), i.zz += more(2, 2);
    i.xy += more(0, 1), i.yz += more(1, 2), i.xz += more(0, 2);
    torso.com_m.x += shift.x(), torso.com_m.y += shift.y(), torso.com_m.z += shift.z();
    torso.mass_kg = whole_kg;
  }
}

}  // namespace flappy::blind
