// What a training, an evaluation or flights show of themselves while they run: the flappers that are watched (flapper_topics.hpp),
// and
//
//   /clock                   rosgraph_msgs/Clock     time of the first one's flight
//   /flappy/training         TrainingMetrics         how far a training is
//   /flappy/watch            Watch                   taken, where commands are: shows that flapper in the first place
//   /diagnostics             DiagnosticArray         once a second: shown and dropped
//
// Flight threads leave samples in a ring and go on; a thread of its own writes them. What does not fit is dropped and counted.
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
  /// Writes what is in the ring.
  ~Telemetry() override;

  void see(const rollout::FlightSample& sample) override;
  /// The newest is shown, within a tenth of a second.
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
  std::optional<Writer<TrainingMetrics>> training_;  // of what trains
  Writer<DiagnosticArray> diagnostics_;
  std::optional<Reader<server::Watch>> watch_;
  Ring<rollout::FlightSample, kRing> ring_;
  std::mutex training_mutex_;
  std::optional<TrainingSample> training_sample_;
  std::atomic<std::uint64_t> shown_ = 0;
  double last_served_s_ = 0, last_diagnosed_s_ = 0;
  std::atomic<bool> over_ = false;
  std::thread thread_;  // last: it uses the others
};

/// Telemetry of a program whose configuration asks for it; nothing otherwise.
std::shared_ptr<Telemetry> telemetry_of(const io::DdsConfig& config, const flight::Sensors& sensors);

}  // namespace flappy::server
