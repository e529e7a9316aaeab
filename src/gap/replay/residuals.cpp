#include "gap/replay/residuals.hpp"

#include <algorithm>
#include <iterator>
#include <map>

#include "gap/replay/reset_kernel.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

/// [vehicle][flight].
std::vector<Residuals> predict_all(const FlightList& flights, const std::vector<const VehicleHypothesis*>& vehicles,
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

/// With the effects of a vehicle in reference flights, too.
std::vector<Residuals> residuals_with_effects(const FlightList& flights, const std::vector<VehicleHypothesis>& vehicles,
                                              int threads) {
  // vehicles with the same errors of sensors share a corrected log
  std::map<EffectValues, std::vector<std::size_t>> by_sensors;
  for (std::size_t i = 0; i < vehicles.size(); ++i) by_sensors[sensors_of(vehicles[i])].push_back(i);
  std::vector<Residuals> list(vehicles.size());
  const auto compare = [&](const FlightList& seen, const std::vector<std::size_t>& which, int at_once) {
    std::vector<const VehicleHypothesis*> these;
    for (const std::size_t i : which) these.push_back(&vehicles[i]);
    std::vector<Residuals> predicted = predict_all(seen, these, at_once);
    for (std::size_t k = 0; k < which.size(); ++k) {
      Residuals& s = predicted[k];
      const bool whole = std::ranges::none_of(s, [](const Rows& rows) { return rows.empty(); });
      for (std::size_t f = 0; whole && f < seen.size(); ++f)
        for (std::size_t i = 0; i < s[f].size(); ++i) s[f][i] = seen[f]->measured()[i] - s[f][i];
      if (whole) list[which[k]] = std::move(s);
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
    FlightList seen(flights.size());
    io::parallel_for(flights.size(), at_once,
                     [&](std::size_t f) { seen[f] = flights[f]->corrected(corrected[k].first); });
    compare(seen, corrected[k].second, at_once);
  });
  return list;
}

/// Residuals without the effects of the vehicles; those that are not known are computed and kept.
std::vector<Residuals> residuals_of_references(const FlightList& references,
                                               const std::vector<VehicleHypothesis>& vehicles, int threads) {
  std::map<ResidualMemo::Key, Residuals> by_key;  // empty rows: not known, or a simulation that diverges
  std::vector<VehicleHypothesis> open;
  std::vector<Residuals*> of_open;
  for (const VehicleHypothesis& v : vehicles) {
    const auto [at, fresh] = by_key.try_emplace({v.variates, v.lag_s, v.sensors});
    if (!fresh) continue;
    for (const auto& f : references)
      if (std::optional<Rows> known = f->memo().find(at->first)) at->second.push_back(std::move(*known));
    if (at->second.size() == references.size()) continue;
    open.push_back(v);
    open.back().vehicle.effects = v.file_effects;
    of_open.push_back(&at->second);
  }
  std::vector<Residuals> computed = residuals_with_effects(references, open, threads);
  for (std::size_t i = 0; i < open.size(); ++i) {
    *of_open[i] = computed[i].empty() ? Residuals(references.size()) : std::move(computed[i]);
    for (std::size_t f = 0; f < references.size(); ++f)
      references[f]->memo().keep({open[i].variates, open[i].lag_s, open[i].sensors}, (*of_open[i])[f]);
  }
  std::vector<Residuals> list;
  for (const VehicleHypothesis& v : vehicles) {
    list.push_back(by_key.at({v.variates, v.lag_s, v.sensors}));
    if (std::ranges::any_of(list.back(), &Rows::empty)) list.back().clear();
  }
  return list;
}

}  // namespace

std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads) {
  std::vector<Residuals> list = residuals_of_references(flights.references, vehicles, threads);
  std::vector<Residuals> of_tests = residuals_with_effects(flights.tests, vehicles, threads);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const bool diverged = list[i].size() < flights.references.size() || of_tests[i].size() < flights.tests.size();
    if (diverged) list[i].clear();
    else std::ranges::move(of_tests[i], std::back_inserter(list[i]));
  }
  return list;
}

TestResiduals tests_of(const Flights& flights, Residuals residual) {
  residual.erase(residual.begin(), residual.begin() + static_cast<std::ptrdiff_t>(flights.references.size()));
  return residual;
}

}  // namespace flappy::gap
