#include "flightlog/readings.hpp"

#include <algorithm>

namespace flappy::flightlog {

std::vector<PoseReading> pose_readings(const FlightLog& log) {
  const MocapStream& m = log.mocap;
  std::vector<PoseReading> poses;
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    const PoseReading pose{
        m.t_s[i] - log.header.mocap.latency_s, {m.x_m[i], m.y_m[i], m.z_m[i]}, {m.qw[i], m.qx[i], m.qy[i], m.qz[i]}};
    const bool lost = log.header.mocap.position_noise_m > 0 && !poses.empty() &&
                      pose.position_m == poses.back().position_m && pose.quaternion == poses.back().quaternion;
    if (!lost) poses.push_back(pose);
  }
  return poses;
}

std::size_t last_not_after(const std::vector<double>& times, double t_s) {
  const auto after = std::ranges::upper_bound(times, t_s);
  return after == times.begin() ? 0 : static_cast<std::size_t>(after - times.begin()) - 1;
}

}  // namespace flappy::flightlog
