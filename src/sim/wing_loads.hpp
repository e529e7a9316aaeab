// Loads of the wings while steps are flown again: by the physics step itself, so no second law of the air stands here.
#pragma once

#include <array>
#include <span>

#include "sim/step.hpp"

namespace flappy::sim {

/// Means over steps of what air and motor did to one wing (WingLoads of physics_step.hpp).
struct MeanWingLoads {
  double force_N[3], moment_Nm[3];  ///< of the air, in B; about the torso's origin
  double lift_N, drag_N;            ///< across and against the wing's velocity in the air
  double aerodynamic_power_W, mechanical_power_W;
};

/// Voltages of the motors in a step.
struct StepVoltage {
  double left_V, right_V;
};

/// Flies a copy of `lane` of the block on for a step with each of `voltages`, at least one, and gives the means of left
/// and right. `in_force`: as for a kernel, with rows; what it remembers stays unchanged. For vehicles with hinged wings.
template <class T>
std::array<MeanWingLoads, 2> mean_wing_loads(const Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan,
                                             int lane, std::span<const StepVoltage> voltages);

extern template std::array<MeanWingLoads, 2> mean_wing_loads(const Block<float>&, BlockEffects<float>, const StepPlan&,
                                                             int, std::span<const StepVoltage>);
extern template std::array<MeanWingLoads, 2> mean_wing_loads(const Block<double>&, BlockEffects<double>,
                                                             const StepPlan&, int, std::span<const StepVoltage>);

}  // namespace flappy::sim
