#pragma once

#include <algorithm>
#include <functional>
#include <memory>

#include "lab/blind/c/c_air.hpp"
#include "lab/blind/c/c_drive.hpp"
#include "lab/blind/c/mechanism.hpp"

namespace flappy::blind::c {

class Robot {
 public:
  Robot(const Assignment& assignment, std::size_t flight);
  Robot(const Robot&) = delete;  // drive and air point to its parameters
  Robot& operator=(const Robot&) = delete;

  const RobotParameters& parameters() const { return parameters_; }
  const Magnitudes& magnitudes() const { return magnitudes_; }
  Mechanism& mechanism() { return *mechanism_; }
  const Mechanism& mechanism() const { return *mechanism_; }
  const Drive& drive() const { return *drive_; }
  double step_s() const { return step_s_; }
  std::size_t steps_per_tick() const { return steps_; }
  bool is_finite() const { return mechanism_->is_finite(); }

  /// Commands voltages, which the driver holds for a tick; calls `after` at the end of each step.
  void tick(const std::array<double, 2>& voltages, const std::function<void()>& after);
  /// A tick in which the torso follows `held`: its motion at the start of each step and after the last. Null: free.
  void tick_held(const std::array<double, 2>& voltages, const Motion* held, const std::function<void()>& after);

 private:
  void step(const Motion* held);

  Magnitudes magnitudes_;
  RobotParameters parameters_;
  double step_s_;
  std::size_t steps_;
  std::unique_ptr<Mechanism> mechanism_;
  std::unique_ptr<Drive> drive_;
  std::unique_ptr<Air> air_;
  std::array<double, 2> friction_Nm_{};
  long done_ = 0;
};

// Constants of effects on the bodies at magnitude 1. All: choice, as of a battery that slid in its tray, a cable on one side, and
// a wing film of another thickness towards its edge.
inline constexpr double kComLevel_m = 0.83e-3, kComUp_m = 0.46e-3;  ///< of the whole robot
inline constexpr double kProductXz = 0.0737, kProductYz = 0.0551;   ///< over sqrt(Ixx Izz), sqrt(Iyy Izz) of the torso
inline constexpr double kWingCom_m = 1.27e-3,
                        kWingProduct_kg_m2 = 1.13e-9;  ///< of each wing, along and across the span

/// Of motor and stroke hinge, before the wing.
double dry_friction_Nm(const Side& side);
double stiffness_Nm_rad(const Spring& spring, double angle_rad);
/// Torque that the spring that engages adds to the linear one's, at an angle from rest.
double second_spring_Nm(const Spring& spring, double angle_rad);

/// Specific force at a point of B, in B (m/s^2): the reading of an ideal accelerometer.
Eigen::Vector3d specific_force_B(const Motion& motion, const Eigen::Vector3d& place_B);

}  // namespace flappy::blind::c
