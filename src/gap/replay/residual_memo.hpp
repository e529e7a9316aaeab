// Cache of the residuals of one reference flight (residuals.cpp). In reference flights a vehicle has only the effects
// of its file, so hypotheses that differ only in effects have the same residuals.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include "gap/replay/sensor_correction.hpp"

namespace flappy::gap {

class ResidualMemo {
 public:
  /// VehicleHypothesis::variates, lag_s and sensors.
  using Key = std::tuple<std::vector<double>, double, EffectValues>;
  /// The residual rows of the flight, empty if the simulation diverged.
  using Known = std::shared_ptr<const std::vector<double>>;
  /// Null: not known. All functions are thread-safe.
  Known find(const Key& key) const {
    const std::scoped_lock lock(mutex_);
    const auto at = known_.find(key);
    return at == known_.end() ? nullptr : at->second;
  }
  /// Stores rows; forgets the oldest of more than kMaxKept.
  void keep(const Key& key, Known rows) {
    const std::scoped_lock lock(mutex_);
    if (!known_.insert_or_assign(key, std::move(rows)).second) return;
    order_.push_back(key);
    if (order_.size() <= kMaxKept) return;
    known_.erase(order_.front());
    order_.pop_front();
  }
  void clear() {
    const std::scoped_lock lock(mutex_);
    known_.clear();
    order_.clear();
  }

 private:
  /// Half a megabyte each for a flight of 10 s. Fits of effects ask again for the fitted parameters and the points
  /// around them, nine in all. Size: of a cache.
  static constexpr std::size_t kMaxKept = 32;
  mutable std::mutex mutex_;
  std::map<Key, Known> known_;
  std::deque<Key> order_;
};

}  // namespace flappy::gap
