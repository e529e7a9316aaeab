// What flies a block of flappers: one row for each number, beside the block of their bodies.
#pragma once

#include "flight/controllers.hpp"
#include "flight/episode.hpp"
#include "flight/schedule.hpp"
#include "policy/actor.hpp"
#include "sim/step.hpp"

namespace flappy::flight {

using sim::kLanes;

inline constexpr int kImuRows = model::kRows<Imu>, kEstimatorRows = model::kRows<Estimator>,
                     kTruthRows = model::kRows<Truth>;
inline constexpr int kEstimateRows = model::kRows<Estimate>, kEpisodeRows = model::kRows<Episode>;
inline constexpr int kIncrementRows = model::kRows<Increment>, kMocapRows = model::kRows<MocapSample>;
inline constexpr int kImuSampleRows = model::kRows<ImuSample>;

template <class T>
struct alignas(64) FlightBlock {
  T imu[kImuRows][kLanes<T>];
  T seen[1][kLanes<T>];  // by motion capture
  T estimator[kEstimatorRows][kLanes<T>];
  T truth[kTruthRows][kLanes<T>];        // at the end of the last period
  T estimate[kEstimateRows][kLanes<T>];  //   the same
  T controller[kControllerRows][kLanes<T>];
  T episode[kEpisodeRows][kLanes<T>];
  T observation[kMaxObservation][kLanes<T>];
  std::uint32_t flapper[kLanes<T>], flight[kLanes<T>];  // whose noise: part of the key of random numbers
  std::uint32_t tick[kLanes<T>];                        // control periods since the start
  std::uint32_t segment[kLanes<T>];                     // of the path
  std::uint32_t ended[kLanes<T>];                       // bits of Ended
};

/// Samples of one control period, for whoever records them: [sample][row][lane].
template <class T>
struct Tap {
  T* imu = nullptr;    // rows of ImuSample
  T* mocap = nullptr;  // rows of MocapSample
};

/// One block and what belongs to it.
template <class T>
struct FlightSpace {
  sim::Block<T>& body;
  sim::BlockEffects<T> effects;
  FlightBlock<T>& flight;
  T* ring;   // [slot][row of Increment][lane]
  T* queue;  // [slot][row of MocapSample][lane]
  T* past;   // [action ago][row of the observation][lane]; none without a history
  Tap<T> tap;
  sim::Ahead ahead;
};

/// Stages of a control period, in order.
enum Stage { kSteer, kPhysics, kSense, kEstimate, kReward, kStages };

/// How all blocks fly through one control period.
template <class T>
struct FlightPlan {
  sim::StepBlock<T> step;
  const sim::StepPlan* physics;
  std::int64_t first_step;
  const Slice* slices;
  const Correction* corrections;
  const Advance *advance, *replay;
  int slice_count, correction_count, replay_count, push_slot;
  Advance newest;
  double ahead_s;
  std::uint64_t seed;
  bool losses;
  ImuConstants<T> imu;
  MocapConstants<T> mocap;
  EstimatorConstants<T> estimator;
  int controller_kind;
  ControllerConstants<T> controller;
  TaskConstants<T> task;
  int actions;          // numbers of an action
  bool sets_voltages;   // the action is the motors' voltages, not what is added to the wing beat's inputs
  std::uint32_t parts;  // observed
  int observed, past;   // rows of an observation, and of those remembered
  PathView<T> path;
  policy::ActorView<T> actor;
  std::uint32_t action_repeat;  // control periods for which an action stays
  std::uint32_t period;         // since the fleet began; counts samples of exploration
  bool explores;
  T noise_kept, noise_fresh;  // shares of the last and of a new normal in the noise, from action to action
  T noise_low, noise_more;    // its standard deviation: of the fleet's first flapper, and from each to the next
  std::uint32_t first_flapper;
  std::uint64_t* cycles = nullptr;  // spent in each stage, for a benchmark on one thread
};

/// Flies a block through one control period.
template <class T>
using FlyBlock = void (*)(const FlightSpace<T>&, const FlightPlan<T>&);

}  // namespace flappy::flight
