// Sensors, estimator, controller and episode of a block of flappers, one row for each number. Bodies are in sim::Block.
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
inline constexpr int kLateRows = kMaxActions + 1;  // four numbers that act, and one delay
inline constexpr int kImuSampleRows = model::kRows<ImuSample>;

template <class T>
struct alignas(64) FlightBlock {
  T imu[kImuRows][kLanes<T>];
  T seen[1][kLanes<T>];  // 1: motion capture sees the flapper; 0: a burst of losses
  T estimator[kEstimatorRows][kLanes<T>];
  T truth[kTruthRows][kLanes<T>];        // at the end of the last period
  T estimate[kEstimateRows][kLanes<T>];  // at the end of the last period
  T controller[kControllerRows][kLanes<T>];
  T episode[kEpisodeRows][kLanes<T>];
  T observation[kMaxObservation][kLanes<T>];
  std::uint32_t flapper[kLanes<T>], flight[kLanes<T>];  // key of the random numbers: flapper and episode
  std::uint32_t tick[kLanes<T>];                        // control periods since the start
  std::uint32_t segment[kLanes<T>];                     // current segment of the path
  std::uint32_t ended[kLanes<T>];                       // bits of Ended
};

/// Where the samples of one control period are written for recorders, [sample][row][lane]; null: nowhere.
template <class T>
struct Tap {
  T* imu = nullptr;    // rows of ImuSample
  T* mocap = nullptr;  // rows of MocapSample
};

template <class T>
struct FlightSpace {
  sim::Block<T>& body;
  sim::BlockEffects<T> effects;
  FlightBlock<T>& flight;
  T* ring;    // IMU increments that the estimator may still apply, [slot][row of Increment][lane]
  T* queue;   // motion-capture poses in transit, [slot][row of MocapSample][lane]
  T* past;    // earlier observations, [action ago][row of the observation][lane]; unused without a history
  T* memory;  // what the recurrent actor remembers, [unit][lane]; unused if the actor is not recurrent
  // [kLateRows][lane]: the offsets or voltages that act now, then the delay of the last action in control periods. It is
  // used only if late_most > 0.
  T* late;
  Tap<T> tap;
  sim::Ahead ahead;  // memory of the next block, which the first physics steps prefetch
};

/// Stages of a control period, in order.
enum Stage { kSteer, kPhysics, kSense, kEstimate, kReward, kStages };

/// Everything that a control period has in common for all blocks.
template <class T>
struct FlightPlan {
  sim::StepBlock<T> step;
  const sim::StepPlan* physics;
  // from here to ahead_s: the Period of this control period (schedule.hpp)
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
  int actions;          // elements of an action
  bool sets_voltages;   // an action sets motor voltages; else it is an offset to the wing-beat inputs
  std::uint32_t parts;  // observed parts, bits of Part
  int observed, past;   // rows of the present observation, and of all earlier ones together
  PathView<T> path;
  policy::ActorView<T> actor;
  std::uint32_t action_repeat;  // control periods per action
  std::uint32_t late_most;      // most control periods by which an action acts later
  bool late_drawn;              // each flight draws a late_most of its own
  std::uint32_t period;  // control periods since the fleet began: counter of the exploration noise's random numbers
  bool explores;
  T noise_kept, noise_fresh;        // weights of the last noise and of a new standard normal in the next noise
  T noise_low, noise_more;          // standard deviation for the fleet's first flapper, and its increment per flapper
  std::uint32_t first_flapper;      // number of the fleet's first flapper, from which noise_more counts
  std::uint64_t* cycles = nullptr;  // processor cycles of each Stage, for a benchmark on one thread
};

/// Flies a block through one control period, all stages in order. Blocks may fly on different threads.
template <class T>
using FlyBlock = void (*)(const FlightSpace<T>&, const FlightPlan<T>&);

}  // namespace flappy::flight
