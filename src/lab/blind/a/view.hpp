// The pilot's view: the true state with white noise, gyro bias and 1 mm of position drift, as a filter would leave.
#pragma once

#include "flight/pid.hpp"
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

class View {
 public:
  View(std::uint64_t seed, std::uint64_t flight) : random_(seed, 100 * flight + 151) {
    gyro_bias_rad_s_ = 0.01 * random_.normals();
  }
  /// Called once in each control period.
  flight::Estimate<double> see(const Torso& torso) {
    position_drift_m_ += 0.1e-3 * random_.normals() - 0.01 * position_drift_m_;
    const auto vec3 = [](const Vector3d& v) { return model::Vec3<double>{v.x(), v.y(), v.z()}; };
    const Quaterniond q = torso.attitude * turned_by(0.003 * random_.normals());
    const Vector3d velocity = torso.velocity_m_s + 0.01 * random_.normals();
    const Vector3d rate = torso.rate_rad_s + gyro_bias_rad_s_ + 0.05 * random_.normals();
    flight::Estimate<double> seen{};
    seen.position_m = vec3(torso.position_m + position_drift_m_);
    seen.attitude = {q.w(), q.x(), q.y(), q.z()};
    seen.velocity_m_s = vec3(velocity);
    seen.body_rate_rad_s = vec3(rate);
    return seen;
  }

 private:
  Random random_;
  Vector3d gyro_bias_rad_s_, position_drift_m_ = Vector3d::Zero();
};

}  // namespace flappy::blind
