// Contents of a Batch, for the parts of the project that work on its blocks.
#pragma once

#include <bit>
#include <memory>

#include "flappy/batch.hpp"
#include "model/contact.hpp"
#include "model/effects/registry.hpp"
#include "sim/jointed_block.hpp"
#include "sim/step.hpp"

namespace flappy::sim {

/// Copies a struct of numbers into one lane of its rows, or back.
template <class S, class T, int lanes>
void put(const S& s, T (*rows)[lanes], int lane) {
  const double* from = reinterpret_cast<const double*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(double); ++i) rows[i][lane] = static_cast<T>(from[i]);
}
template <class S, class T, int lanes>
S get(const T (*rows)[lanes], int lane) {
  S s;
  double* to = reinterpret_cast<double*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(double); ++i) to[i] = rows[i][lane];
  return s;
}

inline std::uint64_t mixed(std::uint64_t h, std::uint64_t word) {  // splitmix64's finaliser
  h = (h ^ word) * 0x9e3779b97f4a7c15ULL;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ULL;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebULL;
  return h ^ (h >> 31);
}

template <class T>
std::uint64_t bits_of(T value) {
  if constexpr (sizeof(T) == 4) return std::bit_cast<std::uint32_t>(value);
  else return std::bit_cast<std::uint64_t>(value);
}

/// A unique_ptr whose copy points to a copy.
template <class X>
struct CopiedPointer : std::unique_ptr<X> {
  using std::unique_ptr<X>::unique_ptr;
  using std::unique_ptr<X>::operator=;
  CopiedPointer(const CopiedPointer& other) : std::unique_ptr<X>(other ? std::make_unique<X>(*other) : nullptr) {}
};

template <class T>
struct BeatAveragedStorage {
  BeatAveragedProgram program;
  std::vector<T> rows, memory;  // [block][row][lane]
  std::size_t slots = 0;        // number of steps whose inputs are remembered
  std::uint64_t effects = 0;    // bits of BeatAveragedEffects that any robot has

  std::size_t memory_rows() const { return program.memory_before_inputs() + slots * program.inputs; }
  /// First number of a robot; the next ones follow kLanes apart.
  T* row_of(std::size_t i) { return &rows[i / kLanes<T> * program.rows() * kLanes<T> + i % kLanes<T>]; }
  T* memory_of(std::size_t i) { return &memory[i / kLanes<T> * memory_rows() * kLanes<T> + i % kLanes<T>]; }
  /// Calls `use(number)` for the whole memory of a robot, past inputs from the newest on. `steps`: of the batch so far,
  /// which determines the slots.
  void for_memory_by_age(std::size_t i, std::int64_t steps, const auto& use) {
    T* const own = memory_of(i);
    const std::size_t before = program.memory_before_inputs();
    for (std::size_t k = 0; k < before; ++k) use(own[k * kLanes<T>]);
    for (std::size_t age = 0; age < slots; ++age) {
      const std::size_t slot = (static_cast<std::size_t>(steps) % slots + slots - 1 - age) % slots;
      for (std::size_t k = 0; k < program.inputs; ++k) use(own[(before + slot * program.inputs + k) * kLanes<T>]);
    }
  }
  BeatAveragedRows<T> block(std::size_t b) {
    const BeatAveragedProgram& p = program;
    return {row_of(b * kLanes<T>),
            memory_of(b * kLanes<T>),
            slots,
            effects,
            p.inputs,
            p.actuators.size(),
            p.products.size(),
            p.actuators.data(),
            p.products.data(),
            p.variables.data(),
            p.nominal_Hz,
            p.actuator_row(),
            p.product_row(),
            p.body_row(),
            p.effect_row()};
  }
  /// Calls `use(number)` for each number that influences motion: past inputs only if the robot has a delay, a hanging
  /// weight only if it has one.
  void for_memory(std::size_t i, const auto& use) {
    const bool late = row_of(i)[(program.effect_row() - 1) * kLanes<T>] > 0;  // BeatAveragedBody::late_steps
    const bool hangs = row_of(i)[program.hanging_row() * kLanes<T>] > 0;
    const std::size_t used = late ? memory_rows() : program.memory_before_inputs();
    for (std::size_t k = 0; k < used; ++k)
      if (hangs || k == 0 || k > kHanging) use(memory_of(i)[k * kLanes<T>]);
  }
};

template <class T>
struct JointedVehicles {
  struct alignas(64) Row {
    T lanes[kLanes<T>];
  };
  JointedVehicles() = default;
  JointedVehicles(const JointedVehicles& other)
      : program(other.program), rows(other.rows), memory(other.memory), work_J(other.work_J) {
    point(other.blocks.size());
  }

  JointedProgram program;
  std::vector<Row> rows, memory;  // [block][row]
  std::vector<double> work_J;     // [block][positive, all][lane]

  static constexpr std::size_t kMemoryRows = model::kRows<JointedMemory>;
  std::size_t row_count() const { return static_cast<std::size_t>(program.shape.rows); }
  /// First number of a vehicle; the next ones follow kLanes apart.
  T* row_of(std::size_t i) { return rows[i / kLanes<T> * row_count()].lanes + i % kLanes<T>; }
  T* memory_of(std::size_t i) { return memory[i / kLanes<T> * kMemoryRows].lanes + i % kLanes<T>; }
  double* work_of(std::size_t i) { return &work_J[i / kLanes<T> * 2 * kLanes<T> + i % kLanes<T>]; }
  std::vector<JointedRows<T>> blocks;

  void point(std::size_t count) {
    for (std::size_t b = 0; b < count; ++b)
      blocks.push_back({&program.shape, program.modulations.data(), row_of(b * kLanes<T>), memory_of(b * kLanes<T>),
                        work_of(b * kLanes<T>)});
  }
};

template <class T>
struct Batch<T>::Storage {
  std::size_t count = 0;
  int threads = 1;
  double step_s = 0;
  int steps_per_update = 1;
  World world;
  double hold_s = 0;
  std::int64_t steps = 0;
  StepBlock<T> kernel = nullptr;
  std::vector<Block<T>> blocks;
  std::vector<std::uint64_t> lane_effects;              // bits of each lane; empty while no flapper has an effect
  std::vector<std::uint64_t> block_effects;             // their union
  std::vector<T> effect_rows;                           // [block][row][lane]
  std::uint64_t effects_kept = 0;                       // effects with memory, because some vehicle has named them
  std::vector<T> effect_states;                         // [block][row][lane]
  std::vector<MotorRows<T>> motors;                     // [block], if energy is metered
  CopiedPointer<BeatAveragedStorage<T>> beat_averaged;  // of beat-averaged robots
  CopiedPointer<JointedVehicles<T>> jointed;            // of articulated wings
  std::vector<model::ContactPoint> points;  // points of contact; names and bodies are the same for the whole batch
  std::vector<model::ContactPoint::Body> points_on;
  std::vector<T> contact_rows, contact_memory;  // [block][point][row][lane]

  struct Place {
    Block<T>& block;
    int lane;
  };
  Place at(std::size_t i) {
    if (i >= count)
      throw std::out_of_range("no flapper " + std::to_string(i) + " in a batch of " + std::to_string(count));
    return {blocks[i / kLanes<T>], static_cast<int>(i % kLanes<T>)};
  }
  StepPlan plan() const {
    return {step_s,
            steps_per_update,
            world.gravity_m_s2,
            world.ground_z_m,
            world.ceiling_z_m,
            world.walls.data(),
            world.walls.size(),
            world.shapes.data(),
            world.shapes.size()};
  }
  BlockEffects<T> effects_of(std::size_t b) {
    BlockEffects<T> all;
    if (!block_effects.empty())
      all = {block_effects[b], &effect_rows[b * model::kEffectRows * kLanes<T>], effects_kept,
             effect_states.data() + b * state_size()};
    if (!motors.empty()) all.motors = &motors[b];
    if (beat_averaged) all.beat_averaged = beat_averaged->block(b);
    if (!points.empty())
      all.contact = {static_cast<int>(points.size()), points_on.data(), row_of_contact(b * kLanes<T>),
                     memory_of_contact(b * kLanes<T>), kLanes<T>};
    if (jointed) all.jointed = &jointed->blocks[b];
    return all;
  }
  static constexpr std::size_t kContactRows = model::kRows<model::ContactConstants>;
  static constexpr std::size_t kContactMemory = model::kRows<model::Bristle>;
  /// First number of flapper `i`; the next ones follow kLanes apart.
  T* row_of_contact(std::size_t i) {
    return &contact_rows[i / kLanes<T> * points.size() * kContactRows * kLanes<T> + i % kLanes<T>];
  }
  T* memory_of_contact(std::size_t i) {
    return &contact_memory[i / kLanes<T> * points.size() * kContactMemory * kLanes<T> + i % kLanes<T>];
  }
  std::size_t contact_memory_size() const { return points.size() * kContactMemory * kLanes<T>; }
  /// Calls `use(number)` for each value that the points of contact of flapper `i` remember.
  void for_contact_memory(std::size_t i, const auto& use) {
    for (std::size_t k = 0; k < points.size() * kContactMemory; ++k) use(memory_of_contact(i)[k * kLanes<T>]);
  }
  std::size_t state_size() const { return static_cast<std::size_t>(model::state_rows(effects_kept)) * kLanes<T>; }
  /// Calls `use(number)` for each value that the effects in `set` remember of flapper `i`.
  void for_states(std::size_t i, std::uint64_t set, const auto& use) {
    if (effect_states.empty()) return;
    T* number = effect_states.data() + i / kLanes<T> * state_size() + i % kLanes<T>;
    for (std::size_t e = 0; e < model::effects().size(); ++e) {
      if (!(effects_kept >> e & 1)) continue;
      for (int row = 0; row < model::effects()[e].states; ++row, number += kLanes<T>)
        if (set >> e & 1) use(*number);
    }
  }
  std::uint64_t effects_of_lane(std::size_t i) const { return lane_effects.empty() ? 0 : lane_effects[i]; }
  Ahead::Part block_after(std::size_t b) const {
    if (b + 1 < blocks.size()) return {&blocks[b + 1], sizeof(Block<T>)};
    return {nullptr, 0};
  }

  void put_vehicle(Block<T>& block, int lane, const model::Vehicle& v);
  /// Throws std::invalid_argument unless it shares the batch's inputs, actuators and expressions.
  void put_beat_averaged(std::size_t i, const model::Vehicle& as_filed);
  void keep_inputs(std::size_t slots);
  /// Inputs of a vehicle without motors, mixed from the controller's outputs that were set.
  std::vector<double> inputs_of(std::size_t i);
  /// Rows and memory of a beat-averaged robot, for put_beat_averaged() into any batch; empty for other vehicles.
  std::pair<std::vector<T>, std::vector<T>> get_beat_averaged(std::size_t i) const;
  void put_beat_averaged(std::size_t i, const std::vector<T>& rows, const std::vector<T>& memory);
  /// The numbers of model::Hanging, kLanes apart, of a robot with a weight on a line; else null.
  T* hanging_weight(std::size_t i) {
    if (!beat_averaged || !(beat_averaged->row_of(i)[beat_averaged->program.hanging_row() * kLanes<T>] > 0))
      return nullptr;
    return beat_averaged->memory_of(i) + kLanes<T>;
  }
  /// Throws std::invalid_argument unless the vehicle shares the batch's modes, harmonics, strips and modulations.
  void put_jointed(std::size_t i, const model::Vehicle& v);
  std::pair<std::vector<T>, std::vector<T>> get_jointed(std::size_t i) const;
  void put_jointed(std::size_t i, const std::vector<T>& rows, const std::vector<T>& memory);
  /// Motor constants for the energy meter of flapper `i`, for put_motors() into any batch; empty without a meter.
  std::vector<T> get_motors(std::size_t i) const;
  void put_motors(std::size_t i, const std::vector<T>& rows);
  void clear_energy(std::size_t i);
  /// Throws std::invalid_argument if its points differ from those of the batch, or are too stiff for the step.
  void put_contact(std::size_t i, const model::Vehicle& v);
  /// Constants and memory of a flapper's points of contact, for put_contact() into any batch with the same points.
  std::pair<std::vector<T>, std::vector<T>> get_contact(std::size_t i);
  void put_contact(std::size_t i, const std::vector<T>& rows, const std::vector<T>& memory);
  void put_effects(std::size_t i, const model::Vehicle& v);
  void put_effects_of_sensors(std::size_t i, const model::Vehicle& v);
  void put_effect_rows(std::size_t i, const model::Vehicle& v);
  /// The effects of flapper `i` with their parameters and memory, for put_effects() into any batch.
  std::uint64_t get_effects(std::size_t i, std::vector<T>& rows, std::vector<T>& states);
  void put_effects(std::size_t i, std::uint64_t set, const std::vector<T>& rows, const std::vector<T>& states);
  void keep_effects(std::uint64_t set);
  void unite_effects(std::size_t b);
  void put_state(std::size_t i, const FlapperState& state, Start start);
};

struct StorageAccess {
  template <class T>
  static auto& of(Batch<T>& batch) {
    return *batch.storage_;
  }
};
template <class T>
auto& storage_of(Batch<T>& batch) {
  return StorageAccess::of(batch);
}

}  // namespace flappy::sim
