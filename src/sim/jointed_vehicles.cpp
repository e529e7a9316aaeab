#include <stdexcept>

#include "model/derive_jointed.hpp"
#include "sim/storage.hpp"

namespace flappy::sim {
namespace {

using model::Jointed;

const Jointed::Wing& wing_of(const Jointed& v, int side) { return side == 0 ? v.left : v.right; }

/// Calls `use(modulation, coefficient)` for every quantity that an input modulates.
void for_modulations(const Jointed& v, const auto& use) {
  using Of = Modulation::Of;
  for (int i = 0; i < static_cast<int>(v.inputs.size()); ++i) {
    const Jointed::Input& input = v.inputs[static_cast<std::size_t>(i)];
    const auto add = [&](Of of, int side, int joint, double coefficient) {
      if (coefficient != 0) use(Modulation{of, side, joint, i}, coefficient);
    };
    add(Of::frequency, 0, 0, input.frequency);
    for (int side = 0; side < kSides; ++side) {
      const double sign = side == 0 ? 1 : -1;
      add(Of::timing, side, 0, input.timing + sign * input.timing_opposed);
      for (int j = 0; j < kJoints; ++j) {
        const auto k = static_cast<std::size_t>(j);
        if (wing_of(v, side).angles[k].mode == Jointed::Mode::free) continue;
        add(Of::offset, side, j, input.offset_rad[k] + sign * input.offset_opposed_rad[k]);
        if (wing_of(v, side).angles[k].mode == Jointed::Mode::driven)
          add(Of::scale, side, j, input.scale[k] + sign * input.scale_opposed[k]);
      }
    }
  }
}

JointedProgram program_of(const Jointed& v) {
  JointedProgram p;
  JointedShape& s = p.shape;
  s.inputs = static_cast<int>(v.inputs.size());
  for_modulations(v, [&](const Modulation& m, double) {
    p.modulations.push_back(m);
    if (m.of == Modulation::Of::timing) s.timed[m.side] = true;
  });
  s.modulations = static_cast<int>(p.modulations.size());
  s.rows = model::kRows<model::JointedParameters>;
  const auto take = [&](int count) {
    const int first = s.rows;
    s.rows += count;
    return first;
  };
  s.input_row = take(s.inputs * model::kRows<JointedInput>);
  s.modulation_row = take(s.modulations);
  s.same_gait = true;
  for (int side = 0; side < kSides; ++side) {
    const Jointed::Wing& w = wing_of(v, side);
    for (int j = 0; j < kJoints; ++j) {
      const Jointed::Angle& a = w.angles[static_cast<std::size_t>(j)];
      const Jointed::Angle& other = v.left.angles[static_cast<std::size_t>(j)];
      s.modes[side][j] = a.mode;
      if (a.mode == Jointed::Mode::free) s.free[side].unknown[j] = s.unknowns++;
      s.harmonics[side][j] = static_cast<int>(a.cos_rad.size());
      s.harmonic_row[side][j] = take(2 * s.harmonics[side][j]);
      s.same_gait = s.same_gait && a.mode == other.mode && a.cos_rad == other.cos_rad && a.sin_rad == other.sin_rad;
    }
    s.strips[side] = static_cast<int>(w.strips.size());
    s.strip_row[side] = take(s.strips[side] * model::kRows<model::Strip>);
    s.series_row[side] = take(model::kRows<model::SeriesOfForce>);
    s.slides[side] = !w.tangential_cos.empty();
    s.carries_air = s.carries_air || w.added_mass > 0;
  }
  return p;
}

}  // namespace

template <class T>
void Batch<T>::Storage::put_jointed(std::size_t i, const model::Vehicle& v) {
  const Jointed& j = *v.jointed;
  if (j.inputs.size() > model::kMaxInputs)
    throw std::invalid_argument("a vehicle of " + std::to_string(j.inputs.size()) + " inputs; at most " +
                                std::to_string(model::kMaxInputs) + " can be flown");
  const JointedProgram program = program_of(j);
  if (!jointed) {
    jointed = std::make_unique<JointedVehicles<T>>();
    jointed->program = program;
    jointed->rows.assign(blocks.size() * jointed->row_count(), {});
    jointed->memory.assign(blocks.size() * jointed->kMemoryRows, {});
    jointed->work_J.assign(blocks.size() * 2 * kLanes<T>, 0.0);
    jointed->point(blocks.size());
  }
  if (program != jointed->program)
    throw std::invalid_argument("vehicles of a batch share modes, harmonics, strips and what inputs act on");

  std::vector<double> all;
  const auto add = [&](const auto& s) {
    const double* from = reinterpret_cast<const double*>(&s);
    all.insert(all.end(), from, from + sizeof s / sizeof(double));
  };
  add(model::derive_jointed(v));
  for (const Jointed::Input& u : j.inputs)
    add(JointedInput<double>{
        u.low, u.high, u.neutral, {u.mix[0], u.mix[1], u.mix[2], u.mix[3]}, model::input_filter(u.lag_s, step_s / 2)});
  for_modulations(j, [&](const Modulation&, double coefficient) { all.push_back(coefficient); });
  for (int side = 0; side < kSides; ++side) {
    const Jointed::Wing& w = wing_of(j, side);
    for (const Jointed::Angle& a : w.angles)
      for (std::size_t k = 0; k < a.cos_rad.size(); ++k) all.insert(all.end(), {a.cos_rad[k], a.sin_rad[k]});
    for (const model::Strip<double>& strip : model::derive_strips(w, v.air_density_kg_m3, side == 0 ? 1 : -1))
      add(strip);
    add(model::derive_series(w));
  }
  T* row = jointed->row_of(i);
  for (const double x : all) *row = static_cast<T>(x), row += kLanes<T>;
}

template <class T>
std::pair<std::vector<T>, std::vector<T>> Batch<T>::Storage::get_jointed(std::size_t i) const {
  std::pair<std::vector<T>, std::vector<T>> all;
  for (std::size_t k = 0; k < jointed->row_count(); ++k) all.first.push_back(jointed->row_of(i)[k * kLanes<T>]);
  for (std::size_t k = 0; k < jointed->kMemoryRows; ++k) all.second.push_back(jointed->memory_of(i)[k * kLanes<T>]);
  return all;
}

template <class T>
void Batch<T>::Storage::put_jointed(std::size_t i, const std::vector<T>& rows, const std::vector<T>& memory) {
  if (!jointed) return;
  for (std::size_t k = 0; k < rows.size(); ++k) jointed->row_of(i)[k * kLanes<T>] = rows[k];
  for (std::size_t k = 0; k < memory.size(); ++k) jointed->memory_of(i)[k * kLanes<T>] = memory[k];
}

template void Batch<float>::Storage::put_jointed(std::size_t, const model::Vehicle&);
template std::pair<std::vector<float>, std::vector<float>> Batch<float>::Storage::get_jointed(std::size_t) const;
template void Batch<float>::Storage::put_jointed(std::size_t, const std::vector<float>&, const std::vector<float>&);
template void Batch<double>::Storage::put_jointed(std::size_t, const model::Vehicle&);
template std::pair<std::vector<double>, std::vector<double>> Batch<double>::Storage::get_jointed(std::size_t) const;
template void Batch<double>::Storage::put_jointed(std::size_t, const std::vector<double>&, const std::vector<double>&);

}  // namespace flappy::sim
