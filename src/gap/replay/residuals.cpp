#include "gap/replay/residuals.hpp"

#include <algorithm>
#include <map>

#include "gap/replay/reset_kernel.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

/// [vehicle][flight].
std::vector<Residuals> predict_all(const Flights& flights, const std::vector<const VehicleHypothesis*>& vehicles,
                                   int threads) {
  const std::size_t blocks = (vehicles.size() + kVehicles - 1) / kVehicles;
  std::vector<Residuals> result(vehicles.size(), Residuals(flights.size()));
  io::parallel_for(blocks * flights.size(), threads, [&](std::size_t job) {
    const std::size_t flight = job % flights.size(), first = job / flights.size() * kVehicles;
    const std::size_t last = std::min(first + kVehicles, vehicles.size());
    std::vector<Rows> rows = flights[flight]->predict(
        {vehicles.begin() + static_cast<std::ptrdiff_t>(first), vehicles.begin() + static_cast<std::ptrdiff_t>(last)});
    for (std::size_t i = 0; i < rows.size(); ++i) result[first + i][flight] = std::move(rows[i]);
  });
  return result;
}

/// Errors undone in the log: none for a beat-averaged vehicle, which predicts with its effects of sensors.
EffectValues sensors_of(const VehicleHypothesis& h) {
  EffectValues sensors = h.vehicle.beat_averaged ? EffectValues() : sensor_effects(h.vehicle.effects);
  sensors.insert(h.sensors.begin(), h.sensors.end());
  return sensors;
}

}  // namespace

std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads) {
  const Flights references = references_of(flights), tests = tests_of(flights);
  if (references.empty()) return residuals_with_effects(flights, vehicles, threads);
  // vehicles that differ only in effects share one prediction of the references
  std::vector<VehicleHypothesis> without;
  std::vector<std::size_t> shared;
  for (const VehicleHypothesis& v : vehicles) {
    const auto same = std::ranges::find_if(without, [&](const VehicleHypothesis& other) {
      return other.variates == v.variates && other.lag_s == v.lag_s && other.sensors == v.sensors;
    });
    shared.push_back(static_cast<std::size_t>(same - without.begin()));
    if (same != without.end()) continue;
    without.push_back(v);
    without.back().vehicle.effects = v.file_effects;
  }
  const std::vector<Residuals> of_references = residuals_with_effects(references, without, threads);
  std::vector<Residuals> list = residuals_with_effects(tests, vehicles, threads);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Residuals& reference = of_references[shared[i]];
    if (reference.empty()) list[i].clear();
    if (!list[i].empty()) list[i].insert(list[i].begin(), reference.begin(), reference.end());
  }
  return list;
}

std::vector<Residuals> residuals_with_effects(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles,
                                              int threads) {
  // vehicles with the same errors of sensors share a corrected log
  std::map<EffectValues, std::vector<std::size_t>> by_sensors;
  for (std::size_t i = 0; i < vehicles.size(); ++i) by_sensors[sensors_of(vehicles[i])].push_back(i);
  std::vector<Residuals> list(vehicles.size());
  const auto compare = [&](const Flights& seen, const std::vector<std::size_t>& which, int at_once) {
    std::vector<const VehicleHypothesis*> group;
    for (const std::size_t i : which) group.push_back(&vehicles[i]);
    std::vector<Residuals> predicted = predict_all(seen, group, at_once);
    for (std::size_t g = 0; g < which.size(); ++g) {
      Residuals& s = predicted[g];
      const bool whole = std::ranges::none_of(s, [](const Rows& rows) { return rows.empty(); });
      for (std::size_t f = 0; whole && f < seen.size(); ++f)
        for (std::size_t i = 0; i < s[f].size(); ++i) s[f][i] = seen[f]->measured()[i] - s[f][i];
      if (whole) list[which[g]] = std::move(s);
    }
  };
  std::vector<std::pair<EffectValues, std::vector<std::size_t>>> corrected;
  for (auto& [sensors, which] : by_sensors) {
    if (sensors.empty()) compare(flights, which, threads);
    else corrected.emplace_back(sensors, which);
  }
  // fewer corrected logs than threads: each log gets several threads for its flights
  const int at_once =
      std::max(1, io::thread_count(threads) / static_cast<int>(std::max<std::size_t>(1, corrected.size())));
  io::parallel_for(corrected.size(), threads, [&](std::size_t k) {
    Flights seen(flights.size());
    io::parallel_for(flights.size(), at_once,
                     [&](std::size_t f) { seen[f] = flights[f]->corrected(corrected[k].first); });
    compare(seen, corrected[k].second, at_once);
  });
  return list;
}

}  // namespace flappy::gap
