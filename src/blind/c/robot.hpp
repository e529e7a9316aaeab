// One robot: its figures, what is wrong with it, and its motion from tick to tick of the driver.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>

#include "blind/c/air.hpp"
#include "blind/c/drive.hpp"
#include "blind/c/mechanism.hpp"

namespace flappy::blind::c {

class Robot {
 public:
  Robot(const Assignment& assignment, std::size_t flight);
  Robot(const Robot&) = delete;  // drive and air look at its figures
  Robot& operator=(const Robot&) = delete;

  const Figures& figures() const { return figures_; }
  const Sizes& sizes() const { return sizes_; }
  Mechanism& mechanism() { return *mechanism_; }
  const Mechanism& mechanism() const { return *mechanism_; }
  const Drive& drive() const { return *drive_; }
  double step_s() const { return step_s_; }
  std::size_t steps_per_tick() const { return steps_; }
  bool is_finite() const { return mechanism_->is_finite(); }

  /// The driver applies these voltages and holds them for a tick; `after` is called after each step.
  void tick(const std::array<double, 2>& voltages, const std::function<void()>& after);
  /// The same with the torso moving as it was: `held` has its motion at the start of each step and after the last.
  void tick_held(const std::array<double, 2>& voltages, const Motion* held, const std::function<void()>& after);

 private:
  void step(const Motion* held);

  Sizes sizes_;
  Figures figures_;
  double step_s_;
  std::size_t steps_;
  std::unique_ptr<Mechanism> mechanism_;
  std::unique_ptr<Drive> drive_;
  std::unique_ptr<Air> air_;
  std::array<double, 2> friction_Nm_{};
  long done_ = 0;
};

/// What an accelerometer at a place in B would measure if it were free of faults.
Eigen::Vector3d specific_force_B(const Motion& motion, const Eigen::Vector3d& place_B);

}  // namespace flappy::blind::c
