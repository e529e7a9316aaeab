// Data of vehicles with articulated wings in addition to the rows of their Block. The vehicles of a batch share modes,
// harmonics, strips and modulations, not numbers. In a Block, parameters have the single-point wings and the extent,
// drive.input has the controller's outputs, which the inputs mix, and the state's velocity is that of the torso's
// origin.
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

/// One input, as rows. `follows`: its filter over half a step.
template <class T>
struct JointedInput {
  T low, high, neutral;
  T mix[4];
  model::InputFilter<T> follows;
};

/// State in addition to the rows of State. Accelerations are those of the previous step.
template <class T>
struct JointedMemory {
  T flown;  // 0: not yet stepped since a reset
  T clock;  // fraction of the beat
  T input[model::kMaxInputs], input_rate[model::kMaxInputs];
  model::Vec3<T> acceleration_B_m_s2, angular_acceleration_rad_s2;
  T angle_rad[kSides][kJoints], rate_rad_s[kSides][kJoints], acceleration_rad_s2[kSides][kJoints];
  T torque_Nm[kSides][kJoints];  // in the last step
};

}  // namespace FLAPPY_ISA

/// An input that modulates a quantity of a side. Its coefficient differs from vehicle to vehicle.
struct Modulation {
  enum class Of { frequency, timing, scale, offset } of;
  int side;   // for timing, scale and offset
  int joint;  // for scale and offset
  int input;
  bool operator==(const Modulation&) const = default;
};

/// Structure that all vehicles of a batch share, plain, because kernels must not share code.
struct JointedShape {
  int inputs = 0, modulations = 0;
  model::Jointed::Mode modes[kSides][kJoints] = {};
  int harmonics[kSides][kJoints] = {};
  int strips[kSides] = {};
  model::FreeJoints free[kSides];
  int unknowns = model::kBodyUnknowns;
  bool timed[kSides] = {};   // an input changes the timing
  bool slides[kSides] = {};  // the wing has a C_T
  bool carries_air = false;  // a wing has added mass
  bool same_gait = false;    // both sides have the same harmonics
  // First rows of each part, after those of JointedParameters.
  int input_row = 0, modulation_row = 0, series_row[kSides] = {}, harmonic_row[kSides][kJoints] = {},
      strip_row[kSides] = {}, rows = 0;
  bool operator==(const JointedShape&) const = default;
};

struct JointedProgram {
  JointedShape shape;
  std::vector<Modulation> modulations;
  bool operator==(const JointedProgram&) const = default;
};

template <class T>
struct JointedRows {
  const JointedShape* shape = nullptr;
  const Modulation* modulations = nullptr;
  const T* rows = nullptr;
  T* memory = nullptr;
  double* work_J = nullptr;  // [2][lane]: positive muscle work, and total muscle work
};

}  // namespace flappy::sim
