#include "gap/replay/predicted_flight.hpp"

#include <algorithm>

#include "gap/replay/reset_kernel.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {

const char* channel_name(int channel) {
  static const char* const kNames[kChannels] = {
      "torque_x",    "torque_y",     "torque_z", "force_x",      "force_y",       "force_z",
      "stroke_left", "stroke_right", "battery",  "current_left", "current_right", "path_x",
      "path_y",      "path_z",       "rotate_x", "rotate_y",     "rotate_z"};
  return kNames[channel];
}

PredictedFlight::PredictedFlight(Recording recording)
    : predictor_(std::make_shared<ResetPrediction>(std::move(recording))) {}

std::vector<std::vector<Rows>> predict_all(const std::vector<PredictedFlight>& flights,
                                           const std::vector<Candidate>& candidates, int threads) {
  const std::size_t blocks = (candidates.size() + kVehicles - 1) / kVehicles;
  std::vector<std::vector<Rows>> result(candidates.size(), std::vector<Rows>(flights.size()));
  io::parallel_for(blocks * flights.size(), threads, [&](std::size_t job) {
    const std::size_t flight = job % flights.size(), first = job / flights.size() * kVehicles;
    std::vector<const Candidate*> group;
    for (std::size_t i = first; i < std::min(first + kVehicles, candidates.size()); ++i)
      group.push_back(&candidates[i]);
    std::vector<Rows> rows = flights[flight].predict(group);
    for (std::size_t i = 0; i < group.size(); ++i) result[first + i][flight] = std::move(rows[i]);
  });
  return result;
}

}  // namespace flappy::gap
