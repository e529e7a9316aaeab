#include "gap/replay/prediction.hpp"

#include "gap/replay/beat_averaged_prediction.hpp"
#include "gap/replay/reset_prediction.hpp"

namespace flappy::gap {

std::shared_ptr<PredictedFlight> prediction_of(const model::Vehicle& vehicle, const std::filesystem::path& folder,
                                               flightlog::FlightLog log, const std::vector<int>& channels) {
  if (vehicle.beat_averaged) return std::make_shared<BeatAveragedPrediction>(folder, std::move(log), vehicle, channels);
  return std::make_shared<ResetPrediction>(Recording(folder, std::move(log), vehicle));
}

}  // namespace flappy::gap
