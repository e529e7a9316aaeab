// What vehicles with four angles a wing (model/jointed.hpp) have beside the rows of their Block. Those of a batch share modes, harmonics, strips and
// which input acts on what, and differ in every number.
//
// In a Block, parameters have the single-point wings and the extent, drive.input is what a controller says, which the vehicle's inputs mix, and the
// velocity of the state is that of the torso's origin.
#pragma once

#include <vector>

#include "model/beat_averaged.hpp"
#include "model/jointed_dynamics.hpp"
#include "model/strip_aerodynamics.hpp"
#include "sim/block.hpp"

namespace flappy::sim {

using model::kJoints;
inline constexpr int kSides = 2;  // left, right

inline namespace FLAPPY_ISA {

/// Of one input, as rows. `follows`: its filter over half a step.
template <class T>
struct JointedInput {
  T low, high, neutral;
  T mix[4];
  model::InputFilter<T> follows;
};

/// What moves besides the rows of State. Angles of free joints, rates, and accelerations of the step before.
template <class T>
struct JointedMemory {
  T flown;  // 0: starts
  T clock;  // beats, its fraction
  T input[model::kMostInputs], input_rate[model::kMostInputs];
  model::Vec3<T> acceleration_B_m_s2, angular_acceleration_rad_s2;
  T angle_rad[kSides][kJoints], rate_rad_s[kSides][kJoints], acceleration_rad_s2[kSides][kJoints];
  T torque_Nm[kSides][kJoints];  // of the last step
};

}  // namespace FLAPPY_ISA

/// An input that acts on something of a side; its coefficient is each vehicle's own.
struct Modulation {
  enum class Of { frequency, timing, scale, offset } of;
  int side;   // of timing, scale and offset
  int joint;  // of scale and offset
  int input;
  bool operator==(const Modulation&) const = default;
};

/// What vehicles of a batch share, plain, as kernels are not to share code.
struct JointedShape {
  int inputs = 0, modulations = 0;
  model::Jointed::Mode modes[kSides][kJoints] = {};
  int harmonics[kSides][kJoints] = {};
  int strips[kSides] = {};
  model::FreeJoints free[kSides];
  int unknowns = model::kBodyUnknowns;
  bool timed[kSides] = {};   // some input shifts the phase
  bool slides[kSides] = {};  // some C_T
  bool carries_air = false;  // some added mass
  bool same_gait = false;    // both sides have the same harmonics
  // Where rows are, after those of the vehicle's JointedParameters.
  int input_row = 0, modulation_row = 0, series_row[kSides] = {}, harmonic_row[kSides][kJoints] = {},
      strip_row[kSides] = {}, rows = 0;
  bool operator==(const JointedShape&) const = default;
};

struct JointedProgram {
  JointedShape shape;
  std::vector<Modulation> modulations;
  bool operator==(const JointedProgram&) const = default;
};

/// A block's part.
template <class T>
struct JointedRows {
  const JointedShape* shape = nullptr;
  const Modulation* modulations = nullptr;
  const T* rows = nullptr;
  T* memory = nullptr;
  double* work_J = nullptr;  // [two][lane]: positive muscle work, and all of it
};

}  // namespace flappy::sim
