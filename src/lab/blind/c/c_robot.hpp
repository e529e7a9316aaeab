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

/// Specific force at a point of B, in B (m/s^2): the reading of an ideal accelerometer.
Eigen::Vector3d specific_force_B(const Motion& motion, const Eigen::Vector3d& place_B);

}  // namespace flappy::blind::c
