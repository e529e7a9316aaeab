// What may be wrong with a robot of family C, and how much of it one robot has.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "blind/family.hpp"

namespace flappy::blind::c {

/// In the order of the table in effects.cpp.
enum class Effect : std::size_t {
  kGround,
  kCeiling,
  kWall,
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
  kGearEccentricity,
  kCommutatorRipple,
  kSparBending,
  kLegFlexure,
  kDownwashOnBody,
  kSharedSupply,
  kHingeStiction,
  kSpringCreep,
  kImuMount,
  kGyroGSensitivity,
  kDriverJitter,
  kCount
};

const std::vector<FamilyEffect>& effect_table();

/// The size of each effect; 0: the robot does not have it.
class Sizes {
 public:
  /// InputError for an unknown id, one given twice, and a size outside 0 to 4.
  explicit Sizes(const std::vector<std::pair<std::string, double>>& effects);
  double operator[](Effect effect) const { return sizes_[static_cast<std::size_t>(effect)]; }

 private:
  std::array<double, static_cast<std::size_t>(Effect::kCount)> sizes_{};
};

}  // namespace flappy::blind::c
