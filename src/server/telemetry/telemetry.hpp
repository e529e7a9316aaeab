// Publishes the watched flappers of a training, an evaluation or flights while they run: flapper_topics.hpp, and
//
//   /clock                   rosgraph_msgs/Clock     flight time of the first watched flapper
//   /flappy/training         TrainingMetrics         progress of a training
//   /flappy/watch            Watch                   subscribed where commands are enabled: flapper of the first slot
//   /diagnostics             DiagnosticArray         once a second: number of samples shown and dropped
//   In these names, /flappy stands for the namespace of the configuration.
//
// The flight thread puts samples into a ring; another thread publishes them. What does not fit is dropped and counted.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <thread>

#include "server/telemetry/flapper_topics.hpp"
#include "server/telemetry/ring.hpp"

namespace flappy::server {

struct TrainingSample {
  std::string run;
  std::uint64_t update = 0, updates = 0, episodes = 0, env_steps = 0;
  double mean_return = 0, success = 0, updates_per_s = 0, env_steps_per_s = 0;
};

class Telemetry : public rollout::Watch {
 public:
  Telemetry(const io::DdsConfig& config, const flight::Sensors& sensors);
  ~Telemetry() override;  ///< publishes what is left in the ring

  void see(const rollout::FlightSample& sample) override;
  /// Publishes the newest sample within a tenth of a second; older ones may be skipped.
  void show(const TrainingSample& sample);

  std::uint64_t shown() const { return shown_; }
  std::uint64_t dropped() const { return ring_.dropped(); }

 private:
  static constexpr std::size_t kRing = 4096;

  void run();
  void write(const rollout::FlightSample& sample);
  void serve();

  io::DdsConfig config_;
  Participant participant_;
  std::vector<FlapperTopics> flappers_;
  Writer<Clock> clock_;
  std::optional<Writer<TrainingMetrics>> training_;  // created at the first show()
  Writer<DiagnosticArray> diagnostics_;
  std::optional<Reader<server::Watch>> watch_;
  Ring<rollout::FlightSample, kRing> ring_;
  std::mutex training_mutex_;
  std::optional<TrainingSample> training_sample_;
  std::atomic<std::uint64_t> shown_ = 0;
  double last_served_s_ = 0, last_diagnosed_s_ = 0;
  std::atomic<bool> over_ = false;
  std::thread thread_;  // last member, because the thread uses the others
};

/// Returns null where the configuration does not enable telemetry.
std::shared_ptr<Telemetry> telemetry_of(const io::DdsConfig& config, const flight::Sensors& sensors);

}  // namespace flappy::server
