// The nominal robot of family b, for its tests.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "lab/blind/b/b_effects.hpp"
#include "lab/blind/b/b_robot.hpp"
#include "lab/blind/b/plant.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind::b {

inline const std::string kVehicle = std::string(FLAPPY_SOURCE_DIR) + "/configs/vehicles/hummingbird_nominal.toml";
using Effects = std::vector<std::pair<std::string, double>>;

inline RobotParameters nominal() {
  static const RobotParameters parameters = read_parameters(kVehicle);
  return parameters;
}

inline Assignment assignment(const Effects& effects = {}, std::uint64_t seed = 3) {
  Assignment a;
  a.vehicle_file = kVehicle;
  a.effects = effects;
  a.seed = seed;
  return a;
}

inline Plant plant(const Effects& effects = {}) { return {nominal(), effect_magnitudes_of(effects, 3)}; }

/// Far from everything.
inline Surroundings open_air() { return {-1e3, 1e3, 1e3, kGravity_m_s2}; }

/// Mean wrench that the wings of a robot held still put on it: force, then torque about the torso's origin.
inline Wrench held(const RobotParameters& f, const Beat& beat, const Effects& effects = {}) {
  Robot robot(f, effect_magnitudes_of(effects, 3), open_air(), 1, 0);
  const Twist still{Vector3d::Zero(), Vector3d(0, 0, kGravity_m_s2)};
  const Path path{{2, {0, 0, 0, 1}}, {2, still}};
  robot.put({0, 0, 0}, 0);
  Wrench sum{Vector3d::Zero(), Vector3d::Zero()};
  int count = 0;
  const int beats = 8, from = 4;
  for (int tick = 0; tick < 1000 * beats / 34; ++tick) {
    robot.drive(waveform(f, beat, tick * kTick_s));
    for (int step = 0; step < kStepsPerTick; ++step) {
      robot.led_step(path, 0);
      if (tick * kTick_s * 34 < from) continue;
      sum = sum + robot.felt().support;
      ++count;
    }
  }
  sum = sum * (-1.0 / count);
  sum.f.z() += f.mass_kg() * kGravity_m_s2;
  return sum;
}

}  // namespace flappy::blind::b
