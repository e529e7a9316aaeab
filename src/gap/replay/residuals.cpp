#include "gap/replay/residuals.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>

#include "gap/replay/reset_kernel.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

/// With references, so many flights of a block has each thread to fly before the next vehicles: more would need more
/// memory, and with fewer, threads would wait for each other. Size: of a loop.
constexpr std::size_t kJobsOfThread = 4;

/// Errors undone in the log: none for a beat-averaged vehicle, which predicts with its effects of sensors.
EffectValues sensors_of(const VehicleHypothesis& h) {
  EffectValues sensors = h.vehicle.beat_averaged ? EffectValues() : sensor_effects(h.vehicle.effects);
  sensors.insert(h.sensors.begin(), h.sensors.end());
  return sensors;
}

/// Calls use(i, residual) with the residual of each vehicle with its effects, on any thread. It does so when all flights
/// of the vehicle's block are flown, so that few blocks are in memory. Vehicles with different errors of sensors may be in one block.
void compare_each(const FlightList& flights, const std::vector<const VehicleHypothesis*>& vehicles, int threads,
                  const std::function<void(std::size_t, Residuals)>& use) {
  std::vector<ComparedVehicle> compared;
  for (const VehicleHypothesis* v : vehicles) compared.push_back({v, sensors_of(*v)});
  const std::size_t blocks = (vehicles.size() + kVehicles - 1) / kVehicles;
  std::vector<Residuals> open(vehicles.size(), Residuals(flights.size()));
  std::vector<std::atomic<std::size_t>> flown(blocks);
  io::parallel_for(blocks * flights.size(), threads, [&](std::size_t job) {
    const std::size_t flight = job % flights.size(), block = job / flights.size(), first = block * kVehicles;
    const std::size_t last = std::min(first + kVehicles, vehicles.size());
    std::vector<Rows> rows = flights[flight]->compare(
        {compared.begin() + static_cast<std::ptrdiff_t>(first), compared.begin() + static_cast<std::ptrdiff_t>(last)});
    for (std::size_t i = first; i < last; ++i) open[i][flight] = std::move(rows[i - first]);
    if (flown[block].fetch_add(1) + 1 < flights.size()) return;
    for (std::size_t i = first; i < last; ++i) use(i, std::move(open[i]));
  });
}

std::vector<Residuals> compare(const FlightList& flights, const std::vector<const VehicleHypothesis*>& vehicles,
                               int threads) {
  std::vector<Residuals> list(vehicles.size(), Residuals(flights.size()));
  compare_each(flights, vehicles, threads, [&](std::size_t i, Residuals residual) { list[i] = std::move(residual); });
  return list;
}

/// Rows of all references.
using OfReferences = std::vector<ResidualMemo::Known>;

/// [vehicle] Without the effects of the vehicles; those that are not known are computed and kept.
std::vector<OfReferences> compare_references(const FlightList& references,
                                             const std::vector<const VehicleHypothesis*>& vehicles, int threads) {
  const auto key = [](const VehicleHypothesis& v) { return ResidualMemo::Key{v.variates, v.lag_s, v.sensors}; };
  std::map<ResidualMemo::Key, OfReferences> by_key;
  std::vector<VehicleHypothesis> open;
  std::vector<OfReferences*> of_open;
  for (const VehicleHypothesis* v : vehicles) {
    const auto [at, fresh] = by_key.try_emplace(key(*v));
    if (!fresh) continue;
    for (const auto& f : references) at->second.push_back(f->memo().find(at->first));
    if (std::ranges::none_of(at->second, [](const auto& known) { return known == nullptr; })) continue;
    open.push_back(*v);
    open.back().vehicle.effects = v->file_effects;
    of_open.push_back(&at->second);
  }
  std::vector<const VehicleHypothesis*> pointers;
  for (const VehicleHypothesis& v : open) pointers.push_back(&v);
  std::vector<Residuals> computed = compare(references, pointers, threads);
  for (std::size_t i = 0; i < open.size(); ++i)
    for (std::size_t f = 0; f < references.size(); ++f) {
      (*of_open[i])[f] = std::make_shared<const Rows>(std::move(computed[i][f]));
      references[f]->memo().keep(key(open[i]), (*of_open[i])[f]);
    }
  std::vector<OfReferences> list;
  for (const VehicleHypothesis* v : vehicles) list.push_back(by_key.at(key(*v)));
  return list;
}

}  // namespace

void for_residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads,
                   const std::function<void(std::size_t, Residuals)>& use) {
  // vehicles without effects first: a block steps faster if none of its vehicles has an effect
  std::vector<std::size_t> order(vehicles.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_partition(order, [&](std::size_t i) {
    return sensor_effects(vehicles[i].vehicle.effects).size() == vehicles[i].vehicle.effects.size();
  });
  // residuals of references are kept until the tests are flown, so only some vehicles are flown at once
  const std::size_t jobs = kJobsOfThread * static_cast<std::size_t>(io::thread_count(threads)),
                    flown = (flights.tests.empty() ? flights.references : flights.tests).size(),
                    blocks = std::max<std::size_t>(1, jobs / std::max<std::size_t>(1, flown)),
                    at_once = flights.references.empty() ? order.size() : blocks * kVehicles;
  for (std::size_t first = 0; first < order.size(); first += at_once) {
    std::vector<const VehicleHypothesis*> these;
    for (std::size_t i = first; i < std::min(first + at_once, order.size()); ++i) these.push_back(&vehicles[order[i]]);
    const std::vector<OfReferences> of_references = compare_references(flights.references, these, threads);
    const auto join = [&](std::size_t i, Residuals of_tests) {
      Residuals all;
      for (const auto& rows : of_references[i]) all.push_back(*rows);
      std::ranges::move(of_tests, std::back_inserter(all));
      if (std::ranges::any_of(all, &Rows::empty)) all.clear();
      use(order[first + i], std::move(all));
    };
    if (flights.tests.empty()) io::parallel_for(these.size(), threads, [&](std::size_t i) { join(i, {}); });
    else compare_each(flights.tests, these, threads, join);
  }
}

std::vector<Residuals> residuals(const Flights& flights, const std::vector<VehicleHypothesis>& vehicles, int threads) {
  std::vector<Residuals> list(vehicles.size());
  for_residuals(flights, vehicles, threads, [&](std::size_t i, Residuals residual) { list[i] = std::move(residual); });
  return list;
}

TestResiduals tests_of(const Flights& flights, Residuals residual) {
  residual.erase(residual.begin(), residual.begin() + static_cast<std::ptrdiff_t>(flights.references.size()));
  return residual;
}

}  // namespace flappy::gap
