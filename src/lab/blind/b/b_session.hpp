// Another session is another day: weather, heating, and what hands did to the robot in between. Each change is bounded
// below the effect like it at magnitude 0.2, and the header declares none. One temperature drives density (as an ideal
// gas), windings (copper, 0.393 %/K), magnets (-0.117 %/K) and grease (-2 %/K). Somebody also tunes the pilot's gains.
#pragma once

#include "lab/blind/b/b_sensors.hpp"

namespace flappy::blind::b {

/// Changes against session 0; pairs are left and right, shares are relative.
struct SessionChange {
  double warmer_K = 0;             ///< the heating keeps the room and its motors within 3 K
  double pressure = 0;             ///< weather: a share of up to 0.9 %
  double mass = 0;                 ///< new tape and another cable about the torso: a share of up to 0.4 %
  Vector3d com_m{0, 0, 0};         ///< play of the battery in its slot: a disc of 0.16 mm, and 0.06 mm up or down
  double full_supply = 0;          ///< where the charger stops: a share of up to 0.35 %
  std::array<double, 2> brush{};   ///< contact of the brushes, a share of up to 0.35 % of the resistance
  std::array<double, 2> wear{};    ///< of bearings and brushes: a share of up to 9 % of the motor's friction
  std::array<double, 2> grease{};  ///< spread anew: a share of up to 5 % of the motor's damping
  std::array<double, 2> rest_angle_rad{};  ///< screws of the hinge tightened again: up to 0.2 deg
  Vector3d imu_turn_rad{0, 0, 0};          ///< board pressed on its foam again: up to 0.15 deg, any way
  Vector3d marker_turn_rad{0, 0, 0};       ///< markers glued anew: up to 0.1 deg and 0.18 mm, any way
  Vector3d marker_m{0, 0, 0};
  double mocap_late_s = 0;           ///< load of the network: up to 0.4 ms
  double imu_late_s = 0;             ///< where the bus's poll falls after the start of the board: up to 0.1 ms
  Vector3d clamp_turn_rad{0, 0, 0};  ///< clamped anew on the bench: up to 0.1 deg and 0.1 mm, any way
  Vector3d clamp_m{0, 0, 0};
  PilotGains gains;  ///< somebody tunes the pilot: each within 4 %
};

/// In any direction, of a length that is uniform up to `longest`.
Vector3d any_way(Random& random, double longest);

/// `session`: from 1 on; make_case changes nothing in session 0.
SessionChange draw_session(std::uint64_t seed, std::size_t session);

void change(const SessionChange& by, RobotParameters& robot, SensorTruth& sensors);

/// Each wing with its edge, rotation hinge and faults goes to the other side; motors, springs and shoulders stay.
void swap_wings(RobotParameters& robot, EffectMagnitudes& effects);

/// Fixes a point mass to a link, at a point of the link's frame.
void add_weight(double mass_kg, const Vector3d& at_m, Link& link);

}  // namespace flappy::blind::b
