#include "flappy/batch.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <stdexcept>

#include "io/parallel.hpp"
#include "model/derive.hpp"
#include "model/effects/registry.hpp"
#include "model/vehicle_dynamics.hpp"
#include "sim/kernels.hpp"
#include "sim/storage.hpp"

namespace flappy::sim {
namespace {

using model::Parameters;
using model::State;
using model::Vec3;

/// Largest h^2 omega^2 of a contact: above kStiffestContact, the limit of files, around which vehicles are drawn.
constexpr double kStiffestDrawn = 2;

/// Velocity of the centre of mass relative to the torso origin, in W.
Vec3<double> com_minus_origin_velocity(const Parameters<double>& p, const State<double>& x) {
  const auto whole = model::whole_vehicle<double>(p, {model::place_wing<+1>(p.left, x.left, x.body_rate_rad_s),
                                                      model::place_wing<-1>(p.right, x.right, x.body_rate_rad_s)});
  return model::rotation_matrix(x.attitude) * (model::cross(x.body_rate_rad_s, whole.com) + whole.com_rate);
}

/// 1 / R and N K / R, left and right; empty for vehicles without motors.
template <class T>
std::vector<T> motor_rows(const model::Vehicle& v) {
  std::vector<T> rows;
  if (v.beat_averaged || v.jointed) return rows;
  for (const model::Motor& m : {v.left.motor, v.right.motor}) {
    rows.push_back(static_cast<T>(1 / m.resistance_ohm));
    rows.push_back(static_cast<T>(m.gear_ratio * m.torque_constant_Nm_A / m.resistance_ohm));
  }
  return rows;
}

}  // namespace

template <class T>
void Batch<T>::Storage::put_vehicle(Block<T>& block, int lane, const model::Vehicle& v) {
  put(model::derive(v, step_s), block.parameters, lane);
  auto drive = get<Drive<double>>(block.drive, lane);
  drive.limit = {v.driver.amplitude_limit_V, v.driver.difference_limit_V, v.driver.bias_limit_V,
                 v.driver.split_cycle_limit};
  put(drive, block.drive, lane);
  block.phase_per_update[lane] =
      static_cast<std::uint32_t>(std::llround(v.driver.flapping_Hz * v.driver.hold_s * 0x1p32));
}

template <class T>
std::vector<T> Batch<T>::Storage::get_motors(std::size_t i) const {
  std::vector<T> rows;
  for (int r = 0; r < 4 && !motors.empty(); ++r) rows.push_back(motors[i / kLanes<T>].rows[r][i % kLanes<T>]);
  return rows;
}

template <class T>
void Batch<T>::Storage::put_motors(std::size_t i, const std::vector<T>& rows) {
  if (motors.empty()) return;
  if (rows.empty()) throw std::logic_error("a snapshot from where no energy is metered");
  MotorRows<T>& to = motors[i / kLanes<T>];
  for (std::size_t r = 0; r < 4; ++r) to.rows[r][i % kLanes<T>] = rows[r];
}

template <class T>
void Batch<T>::Storage::clear_energy(std::size_t i) {
  if (!motors.empty()) motors[i / kLanes<T>].energy_J[i % kLanes<T>] = 0;
  if (jointed) jointed->work_of(i)[0] = jointed->work_of(i)[kLanes<T>] = 0;
}

template <class T>
void Batch<T>::Storage::put_contact(std::size_t i, const model::Vehicle& v) {
  if (v.contact.empty() && points.empty()) return;
  if (!std::ranges::equal(v.contact, points, [](const model::ContactPoint& a, const model::ContactPoint& b) {
        return a.name == b.name && a.on == b.on;
      }))
    throw std::invalid_argument("all flappers of a batch have the same points of contact");
  if (const auto fault = model::contact_fault(v, step_s, kStiffestDrawn))
    throw std::invalid_argument(fault->path + ": " + fault->what + "; accepted: " + fault->accepted);
  T* rows = row_of_contact(i);
  for (const auto& constants : model::contact_constants(v)) {
    const double* from = reinterpret_cast<const double*>(&constants);
    for (std::size_t k = 0; k < kContactRows; ++k, rows += kLanes<T>) *rows = static_cast<T>(from[k]);
  }
}

template <class T>
std::pair<std::vector<T>, std::vector<T>> Batch<T>::Storage::get_contact(std::size_t i) {
  std::pair<std::vector<T>, std::vector<T>> all;
  for (std::size_t k = 0; k < points.size() * kContactRows; ++k) all.first.push_back(row_of_contact(i)[k * kLanes<T>]);
  for_contact_memory(i, [&](T number) { all.second.push_back(number); });
  return all;
}

template <class T>
void Batch<T>::Storage::put_contact(std::size_t i, const std::vector<T>& rows, const std::vector<T>& memory) {
  if (rows.size() != points.size() * kContactRows)
    throw std::invalid_argument("all flappers of a batch have the same points of contact");
  for (std::size_t k = 0; k < rows.size(); ++k) row_of_contact(i)[k * kLanes<T>] = rows[k];
  std::size_t next = 0;
  for_contact_memory(i, [&](T& number) { number = memory[next++]; });
}

/// Effects of sensors only: beat-averaged robots have others in rows of their own, articulated wings have none.
template <class T>
void Batch<T>::Storage::put_effects_of_sensors(std::size_t i, const model::Vehicle& v) {
  model::Vehicle seen;
  for (const auto& [id, values] : v.effects) {
    const int e = model::effect_index(id.c_str());
    if (e >= 0 && model::sensor_effects() >> e & 1) seen.effects.emplace(id, values);
  }
  put_effects(i, seen);
}

/// A lane that lacks an effect of its block gets magnitudes of 0.
template <class T>
void Batch<T>::Storage::put_effects(std::size_t i, const model::Vehicle& v) {
  if (v.beat_averaged || v.jointed) return put_effects_of_sensors(i, v);
  if (v.effects.empty() && lane_effects.empty()) return;
  std::uint64_t named = 0;
  for (const auto& [id, values] : v.effects) {
    const int e = model::effect_index(id.c_str());
    if (e < 0) throw std::invalid_argument("no effect \"" + id + "\"");
    if (id == model::CommandDelay::kInfo.id) {
      const double late_s = model::effects()[static_cast<std::size_t>(e)].values(values)[0];
      if (late_s > (model::CommandDelay::kSlots - 2) * step_s)
        throw std::invalid_argument("command_delay keeps " + std::to_string(model::CommandDelay::kSlots) +
                                    " steps, too few for " + std::to_string(late_s) + " s");
    }
    if (model::effects()[static_cast<std::size_t>(e)].states > 0) named |= std::uint64_t{1} << e;
  }
  keep_effects(named);
  put_effect_rows(i, v);
  unite_effects(i / kLanes<T>);
}

template <class T>
void Batch<T>::Storage::unite_effects(std::size_t b) {
  block_effects[b] = 0;
  for (std::size_t lane = 0; lane < kLanes<T>; ++lane) block_effects[b] |= lane_effects[b * kLanes<T> + lane];
}

template <class T>
void Batch<T>::Storage::put_effect_rows(std::size_t i, const model::Vehicle& v) {
  T* rows = &effect_rows[i / kLanes<T> * model::kEffectRows * kLanes<T> + i % kLanes<T>];
  const auto put_row = [&](int row, double value) {
    rows[static_cast<std::size_t>(row) * kLanes<T>] = static_cast<T>(value);
  };
  lane_effects[i] = 0;
  for (std::size_t e = 0; e < model::effects().size(); ++e) {
    const model::CatalogueEffect& entry = model::effects()[e];
    const std::vector<double> values = entry.values_of(v);
    if (entry.change == nullptr && entry.acts(values)) lane_effects[i] |= std::uint64_t{1} << e;
    for (std::size_t k = 0; k < values.size(); ++k) put_row(entry.first_row + static_cast<int>(k), values[k]);
  }
  const auto side_constants = model::effect_constants(v);
  const double* from = reinterpret_cast<const double*>(&side_constants);
  for (int k = 0; k < 2 * model::kRows<model::SideConstants>; ++k) put_row(model::kEffectParameterRows + k, from[k]);
}

template <class T>
std::uint64_t Batch<T>::Storage::get_effects(std::size_t i, std::vector<T>& rows, std::vector<T>& states) {
  const std::uint64_t set = effects_of_lane(i);
  if (set == 0) return 0;
  const T* row = &effect_rows[i / kLanes<T> * model::kEffectRows * kLanes<T> + i % kLanes<T>];
  for (int k = 0; k < model::kEffectRows; ++k, row += kLanes<T>) rows.push_back(*row);
  for_states(i, set, [&](T number) { states.push_back(number); });
  return set;
}

template <class T>
void Batch<T>::Storage::put_effects(std::size_t i, std::uint64_t set, const std::vector<T>& rows,
                                    const std::vector<T>& states) {
  if (set == 0) return put_effects(i, model::Vehicle{});
  std::uint64_t with_memory = 0;
  for (std::size_t e = 0; e < model::effects().size(); ++e)
    if (model::effects()[e].states > 0) with_memory |= set & std::uint64_t{1} << e;
  keep_effects(with_memory);
  T* row = &effect_rows[i / kLanes<T> * model::kEffectRows * kLanes<T> + i % kLanes<T>];
  for (std::size_t k = 0; k < rows.size(); ++k) row[k * kLanes<T>] = rows[k];
  lane_effects[i] = set;
  for_states(i, ~std::uint64_t{0}, [](T& number) { number = 0; });
  std::size_t next = 0;
  for_states(i, set, [&](T& number) { number = states[next++]; });
  unite_effects(i / kLanes<T>);
}

template <class T>
void Batch<T>::Storage::keep_effects(std::uint64_t set) {
  if (lane_effects.empty()) {
    lane_effects.assign(blocks.size() * kLanes<T>, 0);
    block_effects.assign(blocks.size(), 0);
    effect_rows.assign(blocks.size() * model::kEffectRows * kLanes<T>, T(0));
    for (std::size_t j = 0; j < lane_effects.size(); ++j) put_effect_rows(j, model::Vehicle{});
  }
  const std::uint64_t before = effects_kept;
  if ((set & ~before) == 0) return;
  const std::vector<T> from = effect_states;
  const std::size_t from_size = state_size();
  effects_kept |= set;
  effect_states.assign(blocks.size() * state_size(), T(0));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const T* old = from.data() + b * from_size;
    T* now = effect_states.data() + b * state_size();
    for (std::size_t e = 0; e < model::effects().size(); ++e) {
      const std::size_t size = static_cast<std::size_t>(model::effects()[e].states) * kLanes<T>;
      if (before >> e & 1) {
        std::copy_n(old, size, now);
        old += size;
      }
      if (effects_kept >> e & 1) now += size;
    }
  }
}

template <class T>
Batch<T>::Batch(std::size_t count, const model::Vehicle& vehicle, const BatchOptions& options)
    : storage_(std::make_unique<Storage>()) {
  Storage& s = *storage_;
  // the controller of a vehicle without motors decides how long inputs hold
  const bool undriven = vehicle.beat_averaged || vehicle.jointed;
  const double steps = undriven ? 1 : vehicle.driver.hold_s / options.step_s;
  if (!(options.step_s > 0) || std::llround(steps) < 1 || std::abs(steps - std::round(steps)) > 1e-6)
    throw std::invalid_argument("the driver's hold (" + std::to_string(vehicle.driver.hold_s) +
                                " s) is no whole number of physics steps");
  s.count = count;
  s.threads = io::thread_count(options.threads);
  s.step_s = options.step_s;
  s.steps_per_update = static_cast<int>(std::llround(steps));
  s.world = options.world;
  s.hold_s = vehicle.driver.hold_s;
  s.kernel = vehicle.beat_averaged ? beat_averaged_step_kernel<T>(options.instruction_set)
             : vehicle.jointed     ? jointed_step_kernel<T>(options.instruction_set)
                                   : step_kernel<T>(options.instruction_set);
  s.blocks.resize((count + kLanes<T> - 1) / kLanes<T>);
  // lanes beyond the last flapper are copies, so that every lane holds the numbers of a real vehicle
  Block<T> block{};
  for (int lane = 0; lane < kLanes<T>; ++lane) {
    s.put_vehicle(block, lane, vehicle);
    State<double> x{};
    x.attitude.w = 1;
    put(x, block.state, lane);
  }
  for (Block<T>& b : s.blocks) b = block;
  for (std::size_t i = 0; vehicle.beat_averaged && i < s.blocks.size() * kLanes<T>; ++i)
    s.put_beat_averaged(i, vehicle);
  for (std::size_t i = 0; vehicle.jointed && i < s.blocks.size() * kLanes<T>; ++i) s.put_jointed(i, vehicle);
  if (options.meters_energy && !undriven) s.motors.resize(s.blocks.size());
  for (std::size_t i = 0; i < count; ++i) s.put_motors(i, motor_rows<T>(vehicle));
  for (std::size_t i = 0; i < count && !vehicle.effects.empty(); ++i) s.put_effects(i, vehicle);
  if (vehicle.contact.empty()) return;
  s.points = vehicle.contact;
  for (const model::ContactPoint& p : s.points) s.points_on.push_back(p.on);
  s.contact_rows.assign(s.blocks.size() * s.points.size() * Storage::kContactRows * kLanes<T>, T(0));
  s.contact_memory.assign(s.blocks.size() * s.points.size() * Storage::kContactMemory * kLanes<T>, T(0));
  s.keep_effects(0);  // contact is a stage of the step with effects
  for (std::size_t i = 0; i < s.blocks.size() * kLanes<T>; ++i) s.put_contact(i, vehicle);
}

template <class T>
Batch<T>::~Batch() = default;
template <class T>
Batch<T>::Batch(const Batch& other) : storage_(std::make_unique<Storage>(*other.storage_)) {}
template <class T>
Batch<T>& Batch<T>::operator=(const Batch& other) {
  return *this = Batch(other);
}
template <class T>
Batch<T>::Batch(Batch&&) noexcept = default;
template <class T>
Batch<T>& Batch<T>::operator=(Batch&&) noexcept = default;

template <class T>
std::size_t Batch<T>::size() const {
  return storage_->count;
}

template <class T>
void Batch<T>::set_vehicle(std::size_t i, const model::Vehicle& vehicle) {
  if (vehicle.driver.hold_s != storage_->hold_s)
    throw std::invalid_argument("all flappers of a batch share the driver's hold");
  if (vehicle.beat_averaged.has_value() != (storage_->beat_averaged != nullptr) ||
      vehicle.jointed.has_value() != (storage_->jointed != nullptr))
    throw std::invalid_argument("all flappers of a batch are of one kind");
  const auto [block, lane] = storage_->at(i);
  storage_->put_vehicle(block, lane, vehicle);
  if (storage_->beat_averaged) storage_->put_beat_averaged(i, vehicle);
  if (storage_->jointed) storage_->put_jointed(i, vehicle);
  storage_->put_effects(i, vehicle);
  storage_->put_contact(i, vehicle);
  storage_->put_motors(i, motor_rows<T>(vehicle));
}

/// Puts flapper `i` into `state`, held as `start` says, and clears its status; everything else stays.
template <class T>
void Batch<T>::Storage::put_state(std::size_t i, const FlapperState& state, Start start) {
  const auto [block, lane] = at(i);
  State<double> x{};
  x.position_m = {state.position_m[0], state.position_m[1], state.position_m[2]};
  x.attitude = {state.attitude[0], state.attitude[1], state.attitude[2], state.attitude[3]};
  x.body_rate_rad_s = {state.body_rate_rad_s[0], state.body_rate_rad_s[1], state.body_rate_rad_s[2]};
  const auto hinges = [&](int side) -> model::SideState<double> {
    const double stroke = state.stroke_rate_rad_s[side], rotation = state.rotation_rate_rad_s[side];
    return {state.stroke_rad[side],
            state.rotation_rad[side],
            stroke,
            rotation,
            stroke - step_s * state.stroke_acceleration_rad_s2[side],
            rotation - step_s * state.rotation_acceleration_rad_s2[side]};
  };
  x.left = hinges(0);
  x.right = hinges(1);
  const Vec3<double> velocity{state.velocity_m_s[0], state.velocity_m_s[1], state.velocity_m_s[2]};
  x.com_velocity_m_s = velocity + com_minus_origin_velocity(get<Parameters<double>>(block.parameters, lane), x);
  if (start == Start::standing && points.empty()) x.support = static_cast<double>(model::Support::standing);
  if (start == Start::welded) x.support = static_cast<double>(model::Support::welded);
  put(x, block.state, lane);
  block.status[lane] = 0;
}

template <class T>
void Batch<T>::reset(std::size_t i, const FlapperState& state, Start start) {
  const auto [block, lane] = storage_->at(i);
  storage_->put_state(i, state, start);
  auto drive = get<Drive<double>>(block.drive, lane);
  drive.input = {0, 0, 0, 0};
  drive.voltages = {0, 0};
  put(drive, block.drive, lane);
  block.phase[lane] = 0;
  storage_->clear_energy(i);
  storage_->for_states(i, ~std::uint64_t{0}, [](T& number) { number = 0; });
  storage_->for_contact_memory(i, [](T& number) { number = 0; });
  if (storage_->beat_averaged) *storage_->beat_averaged->memory_of(i) = 0;
  for (std::size_t k = 0; storage_->jointed && k < JointedVehicles<T>::kMemoryRows; ++k)
    storage_->jointed->memory_of(i)[k * kLanes<T>] = 0;
}

template <class T>
void Batch<T>::set_input(std::size_t i, const Input& input) {
  const auto [block, lane] = storage_->at(i);
  auto drive = get<Drive<double>>(block.drive, lane);
  drive.input = {input.amplitude_V, input.difference_V, input.bias_V, input.split_cycle};
  put(drive, block.drive, lane);
  block.status[lane] &= ~kDirect;
}

template <class T>
void Batch<T>::set_voltages(std::size_t i, double left_V, double right_V) {
  const auto [block, lane] = storage_->at(i);
  const auto p = get<Parameters<double>>(block.parameters, lane);
  const auto clipped = [](double value, double limit) { return model::clamp(value, -limit, limit); };
  auto drive = get<Drive<double>>(block.drive, lane);
  drive.voltages = {clipped(left_V, p.left.voltage_limit_V), clipped(right_V, p.right.voltage_limit_V)};
  put(drive, block.drive, lane);
  block.status[lane] |= kDirect;
}

template <class T>
void Batch<T>::step(int steps) {
  if (steps < 0) throw std::invalid_argument("a number of steps below 0");
  if (steps == 0) return;
  Storage& s = *storage_;
  const StepPlan plan = s.plan();
  io::parallel_for(s.blocks.size(), s.threads, [&](std::size_t b) {
    s.kernel(s.blocks[b], s.effects_of(b), plan, s.steps, steps, {{s.block_after(b)}});
  });
  s.steps += steps;
}

template <class T>
FlapperState Batch<T>::state(std::size_t i) const {
  const auto [block, lane] = storage_->at(i);
  const auto x = get<State<double>>(block.state, lane);
  const Vec3<double> v =
      x.com_velocity_m_s - com_minus_origin_velocity(get<Parameters<double>>(block.parameters, lane), x);
  const double step_s = storage_->step_s;
  const auto stroke_acceleration = [&](const model::SideState<double>& q) {
    return (q.stroke_rate_rad_s - q.stroke_rate_before_rad_s) / step_s;
  };
  const auto rotation_acceleration = [&](const model::SideState<double>& q) {
    return (q.rotation_rate_rad_s - q.rotation_rate_before_rad_s) / step_s;
  };
  return {{x.position_m.x, x.position_m.y, x.position_m.z},
          {x.attitude.w, x.attitude.x, x.attitude.y, x.attitude.z},
          {v.x, v.y, v.z},
          {x.body_rate_rad_s.x, x.body_rate_rad_s.y, x.body_rate_rad_s.z},
          {x.left.stroke_rad, x.right.stroke_rad},
          {x.left.rotation_rad, x.right.rotation_rad},
          {x.left.stroke_rate_rad_s, x.right.stroke_rate_rad_s},
          {x.left.rotation_rate_rad_s, x.right.rotation_rate_rad_s},
          {stroke_acceleration(x.left), stroke_acceleration(x.right)},
          {rotation_acceleration(x.left), rotation_acceleration(x.right)}};
}

template <class T>
HeldImpulse Batch<T>::held_impulse(std::size_t i) const {
  const auto [block, lane] = storage_->at(i);
  const auto x = get<State<double>>(block.state, lane);
  return {{x.impulse_N_s.x, x.impulse_N_s.y, x.impulse_N_s.z},
          {x.angular_impulse_Nm_s.x, x.angular_impulse_Nm_s.y, x.angular_impulse_Nm_s.z}};
}

template <class T>
HeldImpulse Batch<T>::stand_impulse(std::size_t i) const {
  const auto [block, lane] = storage_->at(i);
  const auto p = get<Parameters<double>>(block.parameters, lane);
  const auto x = get<State<double>>(block.state, lane);
  const Vec3<double> rest{0, 0, 0};
  Vec3<double> momentum = rest, spin = rest;
  const auto add = [&](const auto& side, const model::WingPose<double>& pose) {
    momentum = momentum + pose.momentum;
    spin = spin + model::angular_momentum(pose, model::wing_inertia(side, pose), side.shoulder_m);
  };
  add(p.left, model::place_wing<+1>(p.left, x.left, rest));
  add(p.right, model::place_wing<-1>(p.right, x.right, rest));
  const Vec3<double> force = x.impulse_N_s - momentum, moment = x.angular_impulse_Nm_s - spin;
  return {{force.x, force.y, force.z}, {moment.x, moment.y, moment.z}};
}

template <class T>
double Batch<T>::energy_J(std::size_t i) const {
  const int lane = storage_->at(i).lane;
  if (storage_->jointed) return storage_->jointed->work_of(i)[0];
  if (storage_->motors.empty()) throw std::logic_error("a batch without BatchOptions::meters_energy has no energy");
  return storage_->motors[i / kLanes<T>].energy_J[lane];
}

template <class T>
WingJoints Batch<T>::joints(std::size_t i) const {
  storage_->at(i);
  if (!storage_->jointed) throw std::logic_error("a batch of vehicles without driven angles has no torques of theirs");
  WingJoints all{};
  const T* number = storage_->jointed->memory_of(i);
  const auto next = [&](std::size_t first, double(&to)[2][4]) {
    const T* from = number + first * kLanes<T>;
    for (auto& side : to)
      for (double& joint : side) joint = *from, from += kLanes<T>;
  };
  next(offsetof(JointedMemory<T>, angle_rad) / sizeof(T), all.angle_rad);
  next(offsetof(JointedMemory<T>, rate_rad_s) / sizeof(T), all.rate_rad_s);
  next(offsetof(JointedMemory<T>, torque_Nm) / sizeof(T), all.torque_Nm);
  for (int side = 0; side < kSides; ++side)
    for (int j = 0; j < kJoints; ++j)
      all.driven[side][j] = storage_->jointed->program.shape.modes[side][j] != model::Jointed::Mode::free;
  const double* work = storage_->jointed->work_of(i);
  all.work_J = work[kLanes<T>];
  return all;
}

template <class T>
Start Batch<T>::support(std::size_t i) const {
  const auto [block, lane] = storage_->at(i);
  const double support = get<State<double>>(block.state, lane).support;
  return support > 1.5 ? Start::welded : support > 0.5 ? Start::standing : Start::flying;
}

template <class T>
std::uint32_t Batch<T>::status(std::size_t i) const {
  const auto [block, lane] = storage_->at(i);
  return block.status[lane] & ~kDirect;
}

template <class T>
std::size_t Batch<T>::count_status(std::uint32_t bits) const {
  std::size_t n = 0;
  for (std::size_t i = 0; i < size(); ++i) n += (status(i) & bits) != 0;
  return n;
}

template <class T>
std::uint64_t Batch<T>::hash(std::size_t first, std::size_t last) const {
  std::uint64_t all = 0;
  for (std::size_t i = first; i < last; ++i) {
    const auto [block, lane] = storage_->at(i);
    std::uint64_t h = 0;
    for (const auto& row : block.state) h = mixed(h, bits_of(row[lane]));
    for (const auto& row : block.drive) h = mixed(h, bits_of(row[lane]));
    h = mixed(mixed(h, block.phase[lane]), block.status[lane]);
    storage_->for_states(i, storage_->effects_of_lane(i) & ~model::sensor_effects(),
                         [&](T number) { h = mixed(h, bits_of(number)); });
    storage_->for_contact_memory(i, [&](T number) { h = mixed(h, bits_of(number)); });
    if (storage_->beat_averaged)
      storage_->beat_averaged->for_memory(i, [&](T number) { h = mixed(h, bits_of(number)); });
    for (std::size_t k = 0; storage_->jointed && k < JointedVehicles<T>::kMemoryRows; ++k)
      h = mixed(h, bits_of(storage_->jointed->memory_of(i)[k * kLanes<T>]));
    all = mixed(all, h);
  }
  return all;
}

template <class T>
std::size_t Batch<T>::bytes_per_flapper() {
  return sizeof(Block<T>) / kLanes<T>;
}

template class Batch<float>;
template class Batch<double>;

}  // namespace flappy::sim
