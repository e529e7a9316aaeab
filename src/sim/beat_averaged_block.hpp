// Data of beat-averaged robots in addition to the rows of their Block. The robots of a batch share inputs, actuators
// and expressions, not numbers. In a Block, drive.input has the controller's outputs, which the vehicle's inputs mix;
// sides, phase and voltages are unused.
#pragma once

#include <tuple>
#include <vector>

#include "model/beat_averaged.hpp"
#include "model/effects/registry.hpp"
#include "sim/block.hpp"

namespace flappy::sim {

using model::kMaxInputs;
/// Longest delay of inputs by effects of the drive: inputs of that time are remembered.
inline constexpr double kLongestDelay_s = 0.5;

inline namespace FLAPPY_ISA {

template <class T>
struct BeatAveragedInput {
  T low, high, neutral;
  T mix[4];
};

template <class T>
struct BeatAveragedActuator {
  T gain, offset;
  T kept;  // share of its distance to the commanded value that remains after half a step
};

template <class T>
struct BeatAveragedBody {
  T mass_kg;
  model::Vec3<T> com_m;
  model::Sym3<T> inertia_kg_m2, inverse_inertia;
  T late_steps;  // delay of the inputs, in steps
};

/// Numbers that a weight on a line remembers.
inline constexpr std::size_t kHanging = static_cast<std::size_t>(model::kRows<model::Hanging>);

inline constexpr int kBeatAveragedEffects = std::tuple_size_v<model::BeatAveragedEffects>;
template <int I>
using BeatAveragedEffectAt = std::tuple_element_t<static_cast<std::size_t>(I), model::BeatAveragedEffects>;

/// Number of rows of parameters before those of effect `I` of BeatAveragedEffects; of all for I = kBeatAveragedEffects.
template <int I>
constexpr int beat_averaged_rows_before() {
  if constexpr (I == 0) return 0;
  else
    return beat_averaged_rows_before<I - 1>() +
           static_cast<int>(model::beat_averaged_parameters<BeatAveragedEffectAt<I - 1>>().size());
}

template <class Effect, int I = 0>
constexpr int beat_averaged_index() {
  if constexpr (std::is_same_v<BeatAveragedEffectAt<I>, Effect>) return I;
  else return beat_averaged_index<Effect, I + 1>();
}
inline constexpr int kSlungLoad = beat_averaged_index<model::SlungLoad>();

}  // namespace FLAPPY_ISA

/// An actuator, the same for all robots of a batch.
struct DrivenActuator {
  std::size_t input;
  model::BeatAveraged::Role role;
  bool operator==(const DrivenActuator&) const = default;
};

/// A product of the expressions. Its factor differs from robot to robot.
struct BeatAveragedProduct {
  std::size_t component;    // 0 to 2: force, 3 to 5: moment about the torso's origin
  std::size_t first, last;  // range in BeatAveragedProgram::variables
  bool operator==(const BeatAveragedProduct&) const = default;
};

/// Structure that all robots of a batch share.
struct BeatAveragedProgram {
  std::size_t inputs = 0;
  std::vector<DrivenActuator> actuators;
  std::vector<BeatAveragedProduct> products;
  std::vector<std::size_t> variables;  // indices in the products: actuators, then motion
  double nominal_Hz = 0;
  bool operator==(const BeatAveragedProgram&) const = default;

  // Order of the rows: inputs, actuators, factors of products, body, effects.
  std::size_t actuator_row() const { return inputs * model::kRows<BeatAveragedInput>; }
  std::size_t product_row() const { return actuator_row() + actuators.size() * model::kRows<BeatAveragedActuator>; }
  std::size_t body_row() const { return product_row() + products.size(); }
  std::size_t effect_row() const { return body_row() + model::kRows<BeatAveragedBody>; }
  /// Numbers of the memory before the inputs.
  std::size_t memory_before_inputs() const { return 1 + kHanging + actuators.size(); }
  /// Mass of a weight on a line.
  std::size_t hanging_row() const { return effect_row() + beat_averaged_rows_before<kSlungLoad>(); }
  std::size_t rows() const { return effect_row() + beat_averaged_rows_before<kBeatAveragedEffects>(); }
};

/// Pointers to the data of one block, plain, because kernels must not share code. Order of the memory: whether the
/// robot has flown, a weight on a line, the actuators, then the inputs of the last `slots` steps.
template <class T>
struct BeatAveragedRows {
  const T* rows = nullptr;
  T* memory = nullptr;
  std::size_t slots = 0;      // 0 if no robot has a delay
  std::uint64_t effects = 0;  // bit i: effect i of BeatAveragedEffects, if any robot has it
  std::size_t inputs = 0, actuator_count = 0, product_count = 0;
  const DrivenActuator* actuators = nullptr;
  const BeatAveragedProduct* products = nullptr;
  const std::size_t* variables = nullptr;
  double nominal_Hz = 0;
  std::size_t actuator_row = 0, product_row = 0, body_row = 0, effect_row = 0;
};

}  // namespace flappy::sim
