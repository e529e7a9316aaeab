// What may be wrong with a robot of this family: its effects by number, with what they draw.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "blind/family.hpp"

namespace flappy::blind::b {

/// The order is that of family_effects().
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

/// All of them, in words.
const std::vector<FamilyEffect>& family_effects();

/// Number of an effect. InputError with the nearest name where there is none.
std::size_t effect_number(const std::string& id);

/// Sizes of a robot's effects, 0 for those it has not, and what they draw of their own, which does not depend on sizes.
struct Ailments {
  std::array<double, kEffects> size{};
  double operator[](Effect e) const { return size[e]; }
  bool any(Effect e) const { return size[e] != 0; }

  int damaged_side = 0;
  double wind_direction_rad = 0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();         ///< of length 1 mm
  Eigen::Vector3d marker_m = Eigen::Vector3d::Zero();      ///< of length 2 mm
  Eigen::Vector3d products = Eigen::Vector3d::Zero();      ///< xy, xz, yz: share of the mean moment
  Eigen::Vector3d misalignment = Eigen::Vector3d::Zero();  ///< rotation vector of length 0.02 rad
  Eigen::Vector3d gyro_drift = Eigen::Vector3d::Zero();    ///< warm-up, rad/s
  double mocap_tilt_direction_rad = 0;
  std::array<double, 2> wing_inertia{1, 1};  ///< signs of the change of each side
  double wing_product = 1;
  Eigen::Vector2d tether_foot_m = Eigen::Vector2d::Zero();
  double delay_sign = 1;
  Eigen::Vector3d screw_m = Eigen::Vector3d::Zero();
  std::array<double, 2> cogging_phase_rad{}, gear_phase_rad{}, creep_sign{1, 1}, ageing{1, 1};
};

/// InputError for an effect that is unknown or named twice, and a size below 0 or above 4.
Ailments ailments_of(const std::vector<std::pair<std::string, double>>& effects, std::uint64_t seed);

}  // namespace flappy::blind::b
