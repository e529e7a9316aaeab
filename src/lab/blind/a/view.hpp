// The pilot's view: the true state with white noise, gyro bias and 1 mm of position drift, as a filter would leave.
#pragma once

#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

class View {
 public:
  View(std::uint64_t seed, std::uint64_t flight) : random_(seed, Purpose::view, flight) {
    gyro_bias_rad_s_ = 0.01 * random_.normals();
  }
  /// Called once in each control period.
  Torso see(const Torso& torso) {
    position_drift_m_ += 0.1e-3 * random_.normals() - 0.01 * position_drift_m_;
    Torso seen;
    seen.position_m = torso.position_m + position_drift_m_;
    seen.attitude = torso.attitude * turned_by(0.003 * random_.normals());
    seen.velocity_m_s = torso.velocity_m_s + 0.01 * random_.normals();
    seen.rate_rad_s = torso.rate_rad_s + gyro_bias_rad_s_ + 0.05 * random_.normals();
    return seen;
  }

 private:
  Random random_;
  Vector3d gyro_bias_rad_s_, position_drift_m_ = Vector3d::Zero();
};

}  // namespace flappy::blind
