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

/// An effect's parameters as a mean over beats: its own, where a robot of another size or kind needs others.
template <class Effect>
constexpr int mean_parameters_of() {
  if constexpr (requires { Effect::kMeanParameters; }) return static_cast<int>(Effect::kMeanParameters.size());
  else return static_cast<int>(Effect::kParameters.size());
}
inline constexpr int kMeanEffects = std::tuple_size_v<model::MeanEffects>;
template <int I>
using MeanEffectAt = std::tuple_element_t<static_cast<std::size_t>(I), model::MeanEffects>;

/// Rows of parameters before those of entry `I` of MeanEffects; of all for I = kMeanEffects.
template <int I>
constexpr int mean_rows_before() {
  if constexpr (I == 0) return 0;
  else return mean_rows_before<I - 1>() + mean_parameters_of<MeanEffectAt<I - 1>>();
}

}  // namespace FLAPPY_ISA

/// What robots of a batch share, and where their rows are: first those of inputs, actuators and the factors of products, then the body's and the
/// effects'.
struct MeanProgram {
  struct Actuator {
    std::size_t input;
    model::BeatAveraged::Role role;
    bool operator==(const Actuator&) const = default;
  };
  struct Product {
    std::size_t component;               // of force, then moment, about the torso's origin
    std::vector<std::size_t> variables;  // actuators, then motion
    bool operator==(const Product&) const = default;
  };
  std::size_t inputs = 0;
  std::vector<Actuator> actuators;
  std::vector<Product> products;
  double nominal_Hz = 0;
  bool operator==(const MeanProgram&) const = default;

  std::size_t actuator_rows() const { return inputs * model::kRows<MeanInput>; }
  std::size_t product_rows() const { return actuator_rows() + actuators.size() * model::kRows<MeanActuator>; }
  std::size_t body_rows() const { return product_rows() + products.size(); }
  std::size_t effect_rows() const { return body_rows() + model::kRows<MeanBody>; }
  std::size_t rows() const { return effect_rows() + mean_rows_before<kMeanEffects>(); }
};

/// A block's part of them. Its memory: whether it has flown, the actuators, then the inputs of the last `slots` steps.
template <class T>
struct MeanRows {
  const MeanProgram* program = nullptr;
  const T* rows = nullptr;
  T* memory = nullptr;
  std::size_t slots = 0;      // none where no robot is late
  std::uint64_t effects = 0;  // bit i: entry i of MeanEffects, of some robot
};

}  // namespace flappy::sim
