#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/derive.hpp"
#include "model/effects/registry.hpp"
#include "sim/storage.hpp"

namespace flappy::sim {
namespace {

using model::BeatAveraged;

BeatAveragedProgram program_of(const model::Vehicle& v, const model::BeatAveragedWrench& wrench) {
  const BeatAveraged& b = *v.beat_averaged;
  if (b.inputs.size() > kMaxInputs)
    throw std::invalid_argument("a robot of " + std::to_string(b.inputs.size()) + " inputs; at most " +
                                std::to_string(kMaxInputs) + " can be flown");
  BeatAveragedProgram p;
  p.inputs = b.inputs.size();
  p.nominal_Hz = b.nominal_Hz;
  for (const BeatAveraged::Actuator& a : b.actuators) {
    const auto input = std::ranges::find(b.inputs, a.input, &BeatAveraged::Input::name) - b.inputs.begin();
    p.actuators.push_back({static_cast<std::size_t>(input), a.role});
  }
  for (const model::BeatAveragedWrench::Product& x : wrench.products()) {
    const std::size_t first = p.variables.size();
    p.variables.insert(p.variables.end(), x.variables.begin(), x.variables.end());
    p.products.push_back({x.component, first, p.variables.size()});
  }
  return p;
}

BeatAveragedBody<double> body_of(const model::RigidBody& torso, double late_steps) {
  const model::InertiaTensor& i = torso.inertia_kg_m2;
  const model::Sym3<double> inertia{i.xx, i.yy, i.zz, i.xy, i.yz, i.xz};
  const auto [adjugate, scale] = model::inverse(inertia);
  return {torso.mass_kg,
          {torso.com_m.x, torso.com_m.y, torso.com_m.z},
          inertia,
          {scale * adjugate.xx, scale * adjugate.yy, scale * adjugate.zz, scale * adjugate.xy, scale * adjugate.yz,
           scale * adjugate.xz},
          late_steps};
}

}  // namespace

template <class T>
void Batch<T>::Storage::put_beat_averaged(std::size_t i, const model::Vehicle& as_filed) {
  const model::Vehicle v = model::built(as_filed);
  const BeatAveraged& b = *v.beat_averaged;
  const model::BeatAveragedWrench wrench(b);
  const BeatAveragedProgram program = program_of(v, wrench);
  if (!beat_averaged) {
    beat_averaged = std::make_unique<BeatAveragedStorage<T>>();
    beat_averaged->program = program;
    beat_averaged->rows.assign(blocks.size() * program.rows() * kLanes<T>, T(0));
    beat_averaged->memory.assign(blocks.size() * beat_averaged->memory_rows() * kLanes<T>, T(0));
  }
  if (program != beat_averaged->program)
    throw std::invalid_argument("robots of a batch share inputs, actuators and expressions");

  model::BeatAveragedDrive<double> drive;
  std::vector<double> of_effects;
  std::uint64_t bit = 1;
  for (const model::CatalogueEffect& e : model::catalogue_of(v)) {
    const std::vector<double> values = e.values_of(v);
    if (e.acts(values)) {
      beat_averaged->effects |= bit;
      if (e.averaged.drive != nullptr) e.averaged.drive(values.data(), drive);
    }
    of_effects.insert(of_effects.end(), values.begin(), values.end());
    bit <<= 1;
  }
  if (drive.delay_s > kLongestDelay_s)
    throw std::invalid_argument("inputs " + std::to_string(drive.delay_s) + " s late; at most " +
                                std::to_string(kLongestDelay_s) + " s are remembered");
  const double late_steps = drive.delay_s / step_s;
  if (late_steps > 0 && beat_averaged->slots == 0)
    keep_inputs(static_cast<std::size_t>(std::ceil(kLongestDelay_s / step_s)) + 2);

  std::vector<double> all;
  const auto add = [&](const auto& s) {
    const double* from = reinterpret_cast<const double*>(&s);
    all.insert(all.end(), from, from + sizeof s / sizeof(double));
  };
  for (const BeatAveraged::Input& u : b.inputs)
    add(BeatAveragedInput<double>{u.low, u.high, u.neutral, {u.mix[0], u.mix[1], u.mix[2], u.mix[3]}});
  for (const BeatAveraged::Actuator& a : b.actuators) {
    const double lag_s = a.lag_s + drive.lag_s;
    add(BeatAveragedActuator<double>{a.gain, a.offset, lag_s > 0 ? model::exp(-step_s / (2 * lag_s)) : 0});
  }
  for (const model::BeatAveragedWrench::Product& p : wrench.products()) all.push_back(p.factor);
  add(body_of(v.torso, late_steps));
  all.insert(all.end(), of_effects.begin(), of_effects.end());
  T* row = beat_averaged->row_of(i);
  for (const double x : all) *row = static_cast<T>(x), row += kLanes<T>;
}

template <class T>
std::vector<double> Batch<T>::Storage::inputs_of(std::size_t i) {
  const auto [block, lane] = at(i);
  const model::WingBeat<double> u = get<Drive<double>>(block.drive, lane).input;
  const double four[] = {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
  std::vector<double> list;
  const auto stride = static_cast<std::size_t>(jointed ? model::kRows<JointedInput> : model::kRows<BeatAveragedInput>);
  const std::size_t inputs =
      jointed ? static_cast<std::size_t>(jointed->program.shape.inputs) : beat_averaged->program.inputs;
  const T* const first =
      jointed ? jointed->row_of(i) + jointed->program.shape.input_row * kLanes<T> : beat_averaged->row_of(i);
  const T* row = first;
  const auto next = [&] {
    const T number = *row;
    row += kLanes<T>;
    return static_cast<double>(number);
  };
  for (std::size_t k = 0; k < inputs; ++k) {
    row = first + k * stride * kLanes<T>;
    const double low = next(), high = next();
    double sum = next();
    for (const double says : four) sum += next() * says;
    list.push_back(model::clamp(sum, low, high));
  }
  return list;
}

/// Gives all robots memory for the inputs of `slots` steps, and keeps the memory that they already have.
template <class T>
void Batch<T>::Storage::keep_inputs(std::size_t slots) {
  const std::vector<T> from = beat_averaged->memory;
  const std::size_t before = beat_averaged->memory_rows() * kLanes<T>;
  beat_averaged->slots = slots;
  const std::size_t now = beat_averaged->memory_rows() * kLanes<T>;
  beat_averaged->memory.assign(blocks.size() * now, T(0));
  for (std::size_t b = 0; b < blocks.size(); ++b)
    std::copy_n(&from[b * before], std::min(before, now), &beat_averaged->memory[b * now]);
}

template <class T>
std::pair<std::vector<T>, std::vector<T>> Batch<T>::Storage::get_beat_averaged(std::size_t i) const {
  std::pair<std::vector<T>, std::vector<T>> all;
  if (!beat_averaged) return all;
  const T* row = beat_averaged->row_of(i);
  for (std::size_t k = 0; k < beat_averaged->program.rows(); ++k) all.first.push_back(row[k * kLanes<T>]);
  const auto push = [&](const T& number) { all.second.push_back(number); };
  beat_averaged->for_memory_by_age(i, steps, push);
  return all;
}

template <class T>
void Batch<T>::Storage::put_beat_averaged(std::size_t i, const std::vector<T>& rows, const std::vector<T>& memory) {
  if (!beat_averaged) return;
  if (memory.size() > beat_averaged->memory_rows())
    keep_inputs((memory.size() - beat_averaged->program.memory_before_inputs()) / beat_averaged->program.inputs);
  T* row = beat_averaged->row_of(i);
  for (std::size_t k = 0; k < rows.size(); ++k) row[k * kLanes<T>] = rows[k];
  std::size_t k = 0;
  beat_averaged->for_memory_by_age(i, steps, [&](T& number) {
    if (k < memory.size()) number = memory[k++];
  });
}

template void Batch<float>::Storage::put_beat_averaged(std::size_t, const model::Vehicle&);
template void Batch<float>::Storage::keep_inputs(std::size_t);
template std::vector<double> Batch<float>::Storage::inputs_of(std::size_t);
template std::pair<std::vector<float>, std::vector<float>> Batch<float>::Storage::get_beat_averaged(std::size_t) const;
template void Batch<float>::Storage::put_beat_averaged(std::size_t, const std::vector<float>&,
                                                       const std::vector<float>&);
template void Batch<double>::Storage::put_beat_averaged(std::size_t, const model::Vehicle&);
template void Batch<double>::Storage::keep_inputs(std::size_t);
template std::vector<double> Batch<double>::Storage::inputs_of(std::size_t);
template std::pair<std::vector<double>, std::vector<double>> Batch<double>::Storage::get_beat_averaged(
    std::size_t) const;
template void Batch<double>::Storage::put_beat_averaged(std::size_t, const std::vector<double>&,
                                                        const std::vector<double>&);

}  // namespace flappy::sim
