// What robots that are known by the beat (model/beat_averaged.hpp) have beside the rows of their Block. Those of a batch share inputs, actuators and
// expressions, and differ in every number.
//
// In a Block, drive.input is what a controller says, which the vehicle's inputs mix; sides, phase and voltages say nothing.
#pragma once

#include <tuple>
#include <vector>

#include "model/beat_averaged.hpp"
#include "model/effects/registry.hpp"
#include "sim/block.hpp"

namespace flappy::sim {

using model::kMostInputs;
/// Inputs are remembered for so long at most, for effects of the drive that are late.
inline constexpr double kLongestDelay_s = 0.5;

inline namespace FLAPPY_ISA {

/// Of one input, as rows.
template <class T>
struct MeanInput {
  T low, high, neutral;
  T mix[4];
};

/// Of one actuator.
template <class T>
struct MeanActuator {
  T gain, offset;
  T kept;  // of its distance to where its input wants it, in half a step
};

/// Of the body.
template <class T>
struct MeanBody {
  T mass_kg;
  model::Vec3<T> com_m;
  model::Sym3<T> inertia_kg_m2, inverse_inertia;
  T late_steps;  // of inputs
};

inline constexpr int kMeanEffects = std::tuple_size_v<model::MeanEffects>;
template <int I>
using MeanEffectAt = std::tuple_element_t<static_cast<std::size_t>(I), model::MeanEffects>;

/// Rows of parameters before those of entry `I` of MeanEffects; of all for I = kMeanEffects.
template <int I>
constexpr int mean_rows_before() {
  if constexpr (I == 0) return 0;
  else return mean_rows_before<I - 1>() + static_cast<int>(model::mean_parameters<MeanEffectAt<I - 1>>().size());
}

}  // namespace FLAPPY_ISA

/// An actuator of all robots of a batch.
struct DrivenActuator {
  std::size_t input;
  model::BeatAveraged::Role role;
  bool operator==(const DrivenActuator&) const = default;
};

/// A product of the expressions, whose factor is each robot's own.
struct MeanProduct {
  std::size_t component;    // of force, then moment, about the torso's origin
  std::size_t first, last;  // of MeanProgram::variables
  bool operator==(const MeanProduct&) const = default;
};

/// What robots of a batch share.
struct MeanProgram {
  std::size_t inputs = 0;
  std::vector<DrivenActuator> actuators;
  std::vector<MeanProduct> products;
  std::vector<std::size_t> variables;  // of products: actuators, then motion
  double nominal_Hz = 0;
  bool operator==(const MeanProgram&) const = default;

  // Where their rows are: first those of inputs, actuators and the factors of products, then the body's and the effects'.
  std::size_t actuator_row() const { return inputs * model::kRows<MeanInput>; }
  std::size_t product_row() const { return actuator_row() + actuators.size() * model::kRows<MeanActuator>; }
  std::size_t body_row() const { return product_row() + products.size(); }
  std::size_t effect_row() const { return body_row() + model::kRows<MeanBody>; }
  std::size_t rows() const { return effect_row() + mean_rows_before<kMeanEffects>(); }
};

/// A block's part, plain, as kernels are not to share code. Memory: whether it has flown, the actuators, then the inputs of the last `slots` steps.
template <class T>
struct MeanRows {
  const T* rows = nullptr;
  T* memory = nullptr;
  std::size_t slots = 0;      // none where no robot is late
  std::uint64_t effects = 0;  // bit i: entry i of MeanEffects, of some robot
  std::size_t inputs = 0, actuator_count = 0, product_count = 0;
  const DrivenActuator* actuators = nullptr;
  const MeanProduct* products = nullptr;
  const std::size_t* variables = nullptr;
  double nominal_Hz = 0;
  std::size_t actuator_row = 0, product_row = 0, body_row = 0, effect_row = 0;
};

}  // namespace flappy::sim
