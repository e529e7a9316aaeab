#include "rollout/fly.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <set>

#include "rollout/recorder.hpp"
#include "rollout/settle.hpp"
#include "io/parallel.hpp"
#include "sim/storage.hpp"

namespace flappy::rollout {
namespace {

namespace fs = std::filesystem;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// "0042"; all names of a run are of one length.
std::string log_name(std::size_t i, std::size_t count) {
  const std::size_t width = std::max<std::size_t>(4, std::to_string(count - 1).size());
  const std::string digits = std::to_string(i);
  return std::string(width - digits.size(), '0') + digits;
}

/// Refuses, before anything flies, a folder that cannot be written or where logs of this run would lie beside others.
void prepare_log_folder(const fs::path& folder, std::size_t count, const std::string& vehicle) {
  if (std::ranges::count(flightlog::log_file::kAll, vehicle) > 0)
    throw io::InputError("vehicle: " + vehicle + " is also the name of a file of the log; accepted: another name");
  std::error_code error;
  const auto refuse = [&](const std::string& what) {
    throw io::InputError(folder.string() + ": " + what +
                         "; accepted: a new folder, an empty one, or logs of as many flights to replace");
  };
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) refuse("is no folder");
  io::make_folder(folder);
  const bool is_log = fs::exists(folder / flightlog::log_file::kHeader, error);
  std::set<std::string> foreign;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    bool belongs = count == 1 && is_log;  // the writer of logs looks closer
    const bool number = name.size() < 10 && name.find_first_not_of("0123456789") == std::string::npos;
    if (count > 1 && number) belongs = std::stoul(name) < count && name == log_name(std::stoul(name), count);
    if (!belongs) foreign.insert(name);
  }
  if (error) throw io::InputError(folder.string() + ": cannot be read: " + error.message());
  if (!foreign.empty()) refuse("holds " + *foreign.begin());
}

int processors(const FlyConfig& config) { return io::thread_count(config.fleet.batch.threads); }

/// Flights that are flown together.
template <class T>
class Part {
 public:
  Part(const FlyConfig& config, std::size_t first, std::size_t count, bool logged)
      : config_(config), first_(first), fleet_(make_fleet(config, first, count)), scores_(count), ended_(count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto flapper = config.fleet.first_flapper + static_cast<std::uint32_t>(first + i);
      const model::Vehicle vehicle = config.vehicle_of(flapper);
      if (config.randomisation) fleet_.set_vehicle(i, vehicle);
      if (config.fleet.task.start.settled) continue;
      if (config.welded) {
        const sim::RandomKey key{config.fleet.seed, flapper, 0, sim::Stream::start};
        fleet_.start(i, 0, config.fleet.task.sample_start(key), sim::Start::welded);
      } else if (config.randomisation) {
        fleet_.start(i, 0);  // where its own centre of mass is counts
      }
      if (logged) recorders_.emplace_back(config, fleet_, i, vehicle);
    }
    if (config.fleet.task.start.settled) start_settled(logged);
    fleet_.set_actor(config.actor);
    fleet_.record(logged);
  }

  void step(FlyResult& result) {
    excite();
    fleet_.step();
    const auto before = std::chrono::steady_clock::now();
    ++tick_;
    const double t_s = tick_ * fleet_.period_s();
    const flight::Target target = fleet_.target(0);  // of all, as they started together
    const bool settled = t_s >= config_.settle_s - 1e-9;
    const std::size_t n = scores_.size();
    io::parallel_for(n, n > 32 ? fleet_.batch().storage().threads : 1, [&](std::size_t i) {
      if (!config_.welded) scores_[i].add(fleet_.truth(i), target, fleet_.batch().status(i), t_s, settled);
      if (ended_[i] == 0) ended_[i] = fleet_.ended(i);
      if (!recorders_.empty()) recorders_[i].record();
    });
    result.scoring_s += seconds_since(before);
  }

  void finish(FlyResult& result) {
    for (std::size_t i = 0; i < scores_.size(); ++i) {
      result.hash = sim::mixed(result.hash, fleet_.batch().hash(i, i + 1));
      for (std::size_t k = 0; k < result.ended.size(); ++k) result.ended[k] += ended_[i] >> k & 1;
      result.handed_back += fleet_.handed_back(i);
      const double captured_s = fleet_.captured_s(i);
      if (captured_s > 0) result.capture_s.push_back(captured_s);
      result.successes += captured_s > 0 && fleet_.lost_s(i) == 0 && !scores_[i].crashed;
    }
    result.flown_s = tick_ * fleet_.period_s();
    result.steps += static_cast<double>(fleet_.batch().storage().steps) * static_cast<double>(scores_.size());
  }

  std::size_t write_logs(const FlyOptions& options) const {
    std::atomic<std::size_t> written = 0;
    io::parallel_for(recorders_.size(), config_.fleet.batch.threads, [&](std::size_t i) {
      const bool alone = options.count == 1;
      const fs::path folder = alone ? options.log_folder : options.log_folder / log_name(first_ + i, options.count);
      if (!recorders_[i].write(folder)) return;
      flightlog::write_vehicle(folder, config_.vehicle_file_name, config_.vehicle_text);
      ++written;
    });
    return written;
  }

  const std::vector<FlightScore>& scores() const { return scores_; }

 private:
  void start_settled(bool logged) {
    const auto vehicle = [&](std::uint32_t flapper) { return config_.vehicle_of(flapper); };
    const auto pool = settle<T>(fleet_.options(), fleet_.size(), kHover_s, vehicle);
    for (std::size_t i = 0; i < fleet_.size(); ++i) {
      fleet_.start(i, 0, pool[i]);
      if (logged)
        recorders_.emplace_back(config_, fleet_, i,
                                vehicle(fleet_.options().first_flapper + static_cast<std::uint32_t>(i)));
    }
  }

  static flight::Fleet<T> make_fleet(const FlyConfig& config, std::size_t first, std::size_t count) {
    flight::FleetOptions o = config.fleet;
    if (!config.actor) o.task.forbid_actions();
    o.first_flapper += static_cast<std::uint32_t>(first);
    // threads that share a few blocks wait for each other more than they fly
    const auto most = static_cast<std::size_t>(processors(config));
    o.batch.threads = static_cast<int>(std::clamp<std::size_t>(count / 64, 1, most));
    return flight::Fleet<T>(count, config.vehicle, o);
  }

  void excite() {
    if (tick_ > 0 && !config_.excitation.changes()) return;
    const sim::Input input = config_.excitation.at(tick_ * fleet_.period_s());
    for (std::size_t i = 0; i < fleet_.size(); ++i) fleet_.set_added(i, input);
  }

  const FlyConfig& config_;
  std::size_t first_;
  flight::Fleet<T> fleet_;
  std::vector<FlightScore> scores_;
  std::vector<std::uint32_t> ended_;  // the bits that came first
  std::vector<Recorder<T>> recorders_;
  int tick_ = 0;
};

template <class T>
FlyResult fly_all(const FlyConfig& config, const FlyOptions& options) {
  const bool logged = !options.log_folder.empty();
  std::size_t at_a_time = options.count;
  if (logged) {
    prepare_log_folder(options.log_folder, options.count, config.vehicle_file_name);
    const double room = options.log_bytes / (Recorder<T>::bytes_per_s(config) * config.duration_s);
    at_a_time = std::clamp<std::size_t>(static_cast<std::size_t>(std::min(room, 1e6)), 1, options.count);
    if (at_a_time > 16) at_a_time -= at_a_time % 16;  // whole blocks
  }
  const auto ticks = std::max<std::int64_t>(1, std::llround(config.duration_s * config.fleet.control_hz));
  const double all = static_cast<double>(ticks) * static_cast<double>(options.count);

  const auto start = std::chrono::steady_clock::now();
  FlyResult result;
  std::vector<FlightScore> scores;
  for (std::size_t first = 0; first < options.count && !result.stopped; first += at_a_time) {
    const std::size_t count = std::min(at_a_time, options.count - first);
    Part<T> part(config, first, count, logged);
    for (std::int64_t tick = 0; tick < ticks && !result.stopped; ++tick) {
      part.step(result);
      const double done = static_cast<double>(first) * static_cast<double>(ticks) +
                          static_cast<double>(count) * static_cast<double>(tick + 1);
      result.stopped = options.keep_going && !options.keep_going(done / all);
    }
    part.finish(result);
    if (logged) result.logs += part.write_logs(options);
    scores.insert(scores.end(), part.scores().begin(), part.scores().end());
  }
  result.summary = summarise(scores);
  result.wall_s = seconds_since(start);
  return result;
}

}  // namespace

FlyResult fly(const FlyConfig& config, const FlyOptions& options) {
  return config.precision == "float" ? fly_all<float>(config, options) : fly_all<double>(config, options);
}

}  // namespace flappy::rollout
