// Effects of this family by number, and the random properties that they draw.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "blind/family.hpp"

namespace flappy::blind::b {

/// Numbers of the effects, in the order of family_effects().
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
  kGearEccentricity,
  kBandAgeing,
  kCommonSupply,
  kEffects,
};

const std::vector<FamilyEffect>& family_effects();

/// Number of an effect. InputError, with the nearest name, for an unknown id.
std::size_t effect_number(const std::string& id);

/// Magnitudes of a robot's effects, 0 for those it lacks, and random properties, which do not depend on them.
struct EffectMagnitudes {
  std::array<double, kEffects> magnitude{};
  double operator[](Effect e) const { return magnitude[e]; }
  bool any(Effect e) const { return magnitude[e] != 0; }

  int damaged_side = 0;
  double wind_direction_rad = 0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();         ///< displacement, 1 mm long
  Eigen::Vector3d marker_m = Eigen::Vector3d::Zero();      ///< displacement, 2 mm long
  Eigen::Vector3d products = Eigen::Vector3d::Zero();      ///< xy, xz, yz, as shares of the mean moment
  Eigen::Vector3d misalignment = Eigen::Vector3d::Zero();  ///< rotation vector, 0.02 rad long
  Eigen::Vector3d gyro_drift = Eigen::Vector3d::Zero();    ///< by warm-up, rad/s
  double mocap_tilt_direction_rad = 0;
  std::array<double, 2> wing_inertia{1, 1};  ///< sign of the change on each side
  double wing_product = 1;
  Eigen::Vector2d tether_foot_m = Eigen::Vector2d::Zero();
  double delay_sign = 1;
  Eigen::Vector3d screw_m = Eigen::Vector3d::Zero();
  std::array<double, 2> cogging_phase_rad{}, gear_phase_rad{}, creep_sign{1, 1}, ageing{1, 1};
};

/// InputError for an effect unknown or named twice, or a magnitude outside 0 to 4.
EffectMagnitudes effect_magnitudes_of(const std::vector<std::pair<std::string, double>>& effects, std::uint64_t seed);

}  // namespace flappy::blind::b
