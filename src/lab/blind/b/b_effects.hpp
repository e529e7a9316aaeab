// The effects of simulator B, and the random properties of a robot that decide their direction and sign.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "lab/blind/family.hpp"

namespace flappy::blind::b {

/// Numbers of the effects, in the order of family_effects(); kEffects is how many there are.
enum Effect : std::size_t {
  kGroundEffect,
  kCeilingEffect,
  kWallEffect,
  kBodyDrag,
  kAddedMass,
  kRotationalLift,
  kWakeCapture,
  kClapAndFling,
  kWingFlexibility,
  kWingDamage,
  kWind,
  kSpringHardening,
  kGearBacklash,
  kCoulombFriction,
  kWindingHeating,
  kBatterySag,
  kDriverDeadZone,
  kDriverBandwidth,
  kCommandDelay,
  kStopCompliance,
  kComOffset,
  kInertiaProducts,
  kWingInertia,
  kTether,
  kGyroBias,
  kAccelerometerMisalignment,
  kVibrationRectification,
  kMocapTilt,
  kMarkerOffset,
  kMocapDelay,
  kLooseScrew,
  kEdgeBending,
  kMotorCogging,
  kSoftImuMount,
  kHingeCreep,
  kCommandDropout,
  kMagnetSaturation,
  kTornFlap,
  kBandAgeing,
  kSpringSlip,
  kEffects,
};

/// Those that the catalogue of flappy-gap lacks begin with "outside_".
const std::vector<FamilyEffect>& family_effects();

/// Number of an effect. InputError, with the nearest name, for an unknown id.
std::size_t effect_number(const std::string& id);

/// Magnitudes of a robot's effects, in multiples of the typical magnitude in family_effects(); 0: the robot lacks it.
/// The properties below are for magnitude 1. They are drawn for every robot, whatever effects it has.
struct EffectMagnitudes {
  std::array<double, kEffects> magnitude{};
  double operator[](Effect e) const { return magnitude[e]; }
  bool any(Effect e) const { return magnitude[e] != 0; }

  int damaged_side = 0;           ///< 0: left, 1: right
  double wind_direction_rad = 0;  ///< the wind blows towards it, from x of W
  /// Displacement of the torso's centre of mass in B.
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();
  std::size_t marker = 0;                                ///< which of kMarkers_m moved
  Eigen::Vector3d marker_m = Eigen::Vector3d::Zero();    ///< its displacement in B
  Eigen::Vector3d products = Eigen::Vector3d::Zero();    ///< xy, xz, yz, as shares of the mean moment
  Eigen::Vector3d skew = Eigen::Vector3d::Zero();        ///< of the accelerometer's axes: a, b, c of skewed()
  Eigen::Vector3d gyro_drift = Eigen::Vector3d::Zero();  ///< way of the bias that the gyroscope warms up to
  double mocap_tilt_direction_rad = 0;                   ///< horizontal axis of the tilt, from x of W
  double mocap_scale_sign = 1;                           ///< +1: the room is reported too large
  double wing_com_m = 0;  ///< by which both wings' centres of mass are farther from the leading edge
  double wing_product_kg_m2 =
      0;  ///< added to the left wing's product of inertia yz; the right one's is its mirror image
  Eigen::Vector2d tether_foot_m = Eigen::Vector2d::Zero();  ///< x, y of the anchor in W
  double delay_sign = 1;                                    ///< +1: frames are stamped later and later; -1: earlier
  Eigen::Vector3d screw_m = Eigen::Vector3d::Zero();        ///< place of the loose screw in B
  std::array<double, 2> cogging_phase_rad{};                ///< on each side
  int torn_side = 0;                                        ///< of the torn flap; 0: left, 1: right
  double flap_opens = 1;  ///< +1: air from behind opens the flap, as the wing sweeps backward; -1: from before
  std::array<double, 2> creep_sign{1, 1};  ///< +1 or -1 on each side: way in which the stops creep
  std::array<double, 2> ageing{1, 1};      ///< 0.6 to 1.4 on each side: factor of the band's loss of stiffness
};

/// InputError for an effect unknown or named twice, or a magnitude outside 0 to 4.
EffectMagnitudes effect_magnitudes_of(const std::vector<std::pair<std::string, double>>& effects, std::uint64_t seed);

}  // namespace flappy::blind::b
