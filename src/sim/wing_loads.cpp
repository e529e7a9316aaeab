#include "sim/wing_loads.hpp"

#include <vector>

#include "sim/lanes.hpp"
#include "sim/physics_step.hpp"

namespace flappy::sim {

template <class T>
std::array<MeanWingLoads, 2> mean_wing_loads(const Block<T>& block, BlockEffects<T> in_force, const StepPlan& plan,
                                             int lane, std::span<const StepVoltage> voltages) {
  using L = model::Lanes<T, kWidth<T>>;  // as a kernel has them
  const int first = lane / kWidth<T> * kWidth<T>, own_lane = lane - first;
  std::vector<T> states, bristles;  // of the copy
  if (in_force.states != nullptr)
    states.assign(in_force.states, in_force.states + model::state_rows(in_force.kept) * kLanes<T>);
  if (in_force.contact.points > 0)
    bristles.assign(in_force.contact.memory,
                    in_force.contact.memory + in_force.contact.points * model::kRows<model::Bristle> * kLanes<T>);
  in_force.states = states.data();
  in_force.contact.memory = bristles.data();
  in_force.meter = nullptr;
  in_force.motors = nullptr;
  const Constants<L> k{plan.step_s,       plan.step_s / 2, 1 / plan.step_s,
                       plan.gravity_m_s2, plan.ground_z_m, plan.ceiling_z_m};
  const auto p = load_rows<model::Parameters<L>>(block.parameters, first);
  auto x = load_rows<model::State<L>>(block.state, first);
  auto own = p;
  Touched<L> touched;
  ActiveEffects<L> effects;
  activate(in_force, plan, first, own, touched, effects);
  Sides<WingLoads<L>> loads;
  effects.loads = &loads;
  model::Vec3<L> com_m = x.position_m + rotation_matrix(x.attitude) * centre_of_mass(p, x);
  shift_positions<true>(p, reach_beyond_stops(effects), k.half_step, x, com_m);
  std::array<MeanWingLoads, 2> mean{};
  const double share = 1 / static_cast<double>(voltages.size());
  for (const StepVoltage& v : voltages) {
    physics_step<true>(p, x, Voltages<L>{L(v.left_V), L(v.right_V)}, com_m, effects, k);
    const auto add = [&](const WingLoads<L>& of, MeanWingLoads& to) {
      const auto put = [&](const L& value, double& sum) { sum += share * static_cast<double>(value.raw[own_lane]); };
      put(of.force_N.x, to.force_N[0]), put(of.force_N.y, to.force_N[1]), put(of.force_N.z, to.force_N[2]);
      put(of.moment_Nm.x, to.moment_Nm[0]), put(of.moment_Nm.y, to.moment_Nm[1]), put(of.moment_Nm.z, to.moment_Nm[2]);
      put(of.lift_N, to.lift_N), put(of.drag_N, to.drag_N);
      put(of.aerodynamic_power_W, to.aerodynamic_power_W), put(of.mechanical_power_W, to.mechanical_power_W);
    };
    add(loads.left, mean[0]);
    add(loads.right, mean[1]);
  }
  return mean;
}

template std::array<MeanWingLoads, 2> mean_wing_loads(const Block<float>&, BlockEffects<float>, const StepPlan&, int,
                                                      std::span<const StepVoltage>);
template std::array<MeanWingLoads, 2> mean_wing_loads(const Block<double>&, BlockEffects<double>, const StepPlan&, int,
                                                      std::span<const StepVoltage>);

}  // namespace flappy::sim
