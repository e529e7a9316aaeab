#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "lab/blind/family.hpp"

namespace flappy::blind::c {

/// The table in effects.cpp has the same order.
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
  kCamberSnap,
  kCommutatorRipple,
  kSparBending,
  kLegFlexure,
  kDownwashOnBody,
  kConverterHunting,
  kHingeStiction,
  kSpringCreep,
  kGyroNotch,
  kGyroGSensitivity,
  kDriverJitter,
  kCount
};

const std::vector<FamilyEffect>& effect_table();

/// Magnitude of each effect; 0: absent.
class Magnitudes {
 public:
  /// InputError for an id unknown or repeated, or a magnitude outside 0 to 4.
  explicit Magnitudes(const std::vector<std::pair<std::string, double>>& effects);
  double operator[](Effect effect) const { return magnitudes_[static_cast<std::size_t>(effect)]; }

 private:
  std::array<double, static_cast<std::size_t>(Effect::kCount)> magnitudes_{};
};

}  // namespace flappy::blind::c
