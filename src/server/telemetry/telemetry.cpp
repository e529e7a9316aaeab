#include "server/telemetry/telemetry.hpp"

#include <chrono>

#include "io/progress.hpp"

namespace flappy::server {
namespace {

using std::chrono::milliseconds;

constexpr double kServed_s = 0.1, kDiagnosed_s = 1;  // periods of serve() and of the diagnostics
constexpr milliseconds kIdle{1};                     // sleep while the ring is empty

}  // namespace

Telemetry::Telemetry(const io::DdsConfig& config, const flight::Sensors& sensors)
    : rollout::Watch(config.watch),
      config_(config),
      participant_(config),
      clock_(participant_, "/clock", kSensorData),
      diagnostics_(participant_, "/diagnostics", kReliable) {
  flappers_.reserve(size());
  for (std::size_t slot = 0; slot < size(); ++slot)
    flappers_.emplace_back(participant_, config.name_space, slot, sensors);
  if (config.commands) watch_.emplace(participant_, "/" + config.name_space + "/watch", kReliable);
  thread_ = std::thread([this] { run(); });
}

Telemetry::~Telemetry() {
  over_ = true;
  thread_.join();
}

void Telemetry::see(const rollout::FlightSample& sample) { ring_.push(sample); }

void Telemetry::show(const TrainingSample& sample) {
  const std::lock_guard lock(training_mutex_);
  training_sample_ = sample;
}

void Telemetry::write(const rollout::FlightSample& sample) {
  if (sample.slot >= flappers_.size()) return;
  flappers_[sample.slot].write(sample);
  if (sample.slot == 0) clock_.write({time_of(sample.t_s)});
  ++shown_;
}

void Telemetry::serve() {
  std::optional<TrainingSample> training;
  {
    const std::lock_guard lock(training_mutex_);
    training.swap(training_sample_);
  }
  if (training) {
    TrainingMetrics m{};
    char world[] = "";
    m.header = {now(), world};
    m.run = training->run.data();
    m.update = training->update, m.updates = training->updates, m.episodes = training->episodes;
    m.env_steps = training->env_steps, m.mean_return = training->mean_return, m.success = training->success;
    m.updates_per_s = training->updates_per_s, m.env_steps_per_s = training->env_steps_per_s;
    if (!training_) training_.emplace(participant_, "/" + config_.name_space + "/training", kLatched);
    training_->write(m);
  }
  if (watch_) watch_->take([&](const server::Watch& w, const dds_sample_info_t&) { set_flapper(0, w.flapper); });
  if (io::steady_seconds() - last_diagnosed_s_ < kDiagnosed_s) return;
  last_diagnosed_s_ = io::steady_seconds();
  std::string names[] = {"shown", "dropped"}, values[] = {std::to_string(shown()), std::to_string(dropped())};
  std::string status = "telemetry", message = dropped() > 0 ? "drops samples" : "keeps up", nothing;
  KeyValue pairs[] = {{names[0].data(), values[0].data()}, {names[1].data(), values[1].data()}};
  DiagnosticStatus s{};
  s.level = dropped() > 0 ? 1 : 0;
  s.name = status.data();
  s.message = message.data();
  s.hardware_id = nothing.data();
  s.values = {2, 2, pairs, false};
  DiagnosticArray m{};
  m.header = {now(), nothing.data()};
  m.status = {1, 1, &s, false};
  diagnostics_.write(m);
}

void Telemetry::run() {
  rollout::FlightSample sample;
  for (;;) {
    const bool last = over_;  // read before the ring, so that every sample pushed before over_ was set is published
    bool any = false;
    while (ring_.pop(sample)) {
      write(sample);
      any = true;
      if (io::steady_seconds() - last_served_s_ >= kServed_s) break;
    }
    if (last || io::steady_seconds() - last_served_s_ >= kServed_s) {
      last_served_s_ = io::steady_seconds();
      serve();
    }
    if (last && !any) return;
    if (!any) std::this_thread::sleep_for(kIdle);
  }
}

std::shared_ptr<Telemetry> telemetry_of(const io::DdsConfig& config, const flight::Sensors& sensors) {
  return config.enabled ? std::make_shared<Telemetry>(config, sensors) : nullptr;
}

}  // namespace flappy::server
