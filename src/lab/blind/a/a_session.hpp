// What differs between sessions: the same robot on another day. Each change stays below the effect that resembles it
// most, at a magnitude of 0.2.
#pragma once

#include "lab/blind/a/flights.hpp"

namespace flappy::blind {

/// Changes of a session from session 0, where all are 0. Each is uniform, or a sum of two that are, within +- what is
/// stated. Pairs are left, right.
struct SessionChange {
  double density = 0;                      ///< share, 0.78 %: weather, which cold air and high pressure make denser
  std::array<double, 2> resistance{};      ///< share, 1.1 %: copper in the room's air, warm from earlier flights
  std::array<double, 2> friction{};        ///< share, 8 %: wear of motor and joints
  std::array<double, 2> damping{};         ///< share, 10 %: the same wear, and grease that is stiffer in cold air
  std::array<double, 2> rest_angle_rad{};  ///< 0.2 degrees: hinge tightened again
  double torso_mass = 0;                   ///< share, 0.22 %: tape and cable ties
  Vector3d battery_m = Vector3d::Zero();   ///< 0.6, 0.6 and 0.3 mm: battery of 2 g put back into its bay
  double battery_V = 0;                    ///< 0.09 V: where the charger stops
  Vector3d marker_m = Vector3d::Zero();    ///< 0.2 mm an axis: marker body glued on again
  Vector3d marker_rad = Vector3d::Zero();  ///< 0.06 degrees an axis
  Vector3d imu_rad = Vector3d::Zero();     ///< 0.12 degrees an axis: IMU pressed back onto its foam
  double mocap_late_s = 0;                 ///< 0.3 ms: clocks of motion capture and robot synchronised again
  /// Shares, 4 %, of all 18: the pilot's gains are tuned a little between days.
  std::array<double, 18> gains{};
};

SessionChange session_change(std::uint64_t seed, std::size_t session);

/// Takes a case of session 0 to another session. What the log declares stays.
void begin_session(Case& c, std::size_t session);

/// Swaps the wings and adds the weight. Effects taken away are left to the caller.
void change_on_purpose(Case& c, const model::Changes& changes);

}  // namespace flappy::blind
