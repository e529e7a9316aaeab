#include "rollout/fly.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <set>

#include "flightlog/ros/flight_mcap.hpp"
#include "io/parallel.hpp"
#include "io/read_files.hpp"
#include "model/jointed.hpp"
#include "rollout/outcome.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"

namespace flappy::rollout {
namespace {

namespace fs = std::filesystem;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Folder name of flight `i`, as "0042"; all names of a run have the same length.
std::string log_name(std::size_t i, std::size_t count) {
  const std::size_t width = std::max<std::size_t>(4, std::to_string(count - 1).size());
  const std::string digits = std::to_string(i);
  return std::string(width - digits.size(), '0') + digits;
}

/// Throws io::InputError if it cannot be written or holds files of another run.
void prepare_log_folder(const fs::path& folder, std::size_t count, const std::string& vehicle) {
  if (std::ranges::count(flightlog::log_file::kAll, vehicle) > 0)
    throw io::InputError("vehicle: " + vehicle + " is also the name of a file of the log; accepted: another name");
  if (vehicle.find('\\') != std::string::npos)
    throw io::InputError("vehicle: " + vehicle +
                         " has a backslash, as folders of other systems; accepted: another name");
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
    bool belongs = count == 1 && is_log;
    const bool number = name.size() < 10 && name.find_first_not_of("0123456789") == std::string::npos;
    if (count > 1 && number) belongs = std::stoul(name) < count && name == log_name(std::stoul(name), count);
    if (!belongs) foreign.insert(name);
  }
  if (error) throw io::InputError(folder.string() + ": cannot be read: " + error.message());
  if (!foreign.empty()) refuse("holds " + *foreign.begin());
  io::require_unread_folder(folder);
  if (count == 1) return flightlog::require_replaceable(folder);  // a log that is written replaces the one of before
  for (std::size_t i = 0; i < count; ++i) flightlog::require_replaceable(folder / log_name(i, count));
  for (std::size_t i = 0; i < count; ++i)
    // else logs of an earlier run would stay beside those of one that is stopped
    if (const fs::path old = folder / log_name(i, count); fs::exists(old / flightlog::log_file::kHeader))
      fs::remove_all(old);
}

/// Removes an earlier log, but not its folder, which may be a link.
void remove_log(const fs::path& folder) {
  if (!fs::exists(folder / flightlog::log_file::kHeader)) return;
  for (const auto& entry : fs::directory_iterator(folder)) fs::remove(entry.path());
}

/// Writes the logs of flights, numbered from `first`; returns the number of logs written.
template <class T>
std::size_t write_logs(const Rollout<T>& flights, std::size_t first, const FlyOptions& options) {
  const FlyConfig& config = flights.config();
  std::atomic<std::size_t> written = 0;
  io::parallel_for(flights.recorders().size(), config.fleet.batch.threads, [&](std::size_t i) {
    const bool alone = options.count == 1;
    const fs::path folder = alone ? options.log_folder : options.log_folder / log_name(first + i, options.count);
    if (!flights.recorders()[i].write(folder)) return remove_log(folder);
    flightlog::write_vehicle(folder, config.vehicle_file_name, config.vehicle_text);
    ++written;
  });
  return written;
}

template <class T>
FlyResult fly_all(const FlyConfig& config, const FlyOptions& options) {
  const bool logged = !options.log_folder.empty();
  const bool recorded = logged || !options.mcap.empty();
  if (!options.mcap.empty()) {
    if (options.count > 1)
      throw io::InputError("--mcap: is of one flight, not of " + std::to_string(options.count) +
                           "; accepted: --count 1");
    if (!model::mixed_inputs(config.vehicle).empty())
      throw io::InputError(
          "--mcap: holds voltages, and this vehicle has other inputs; accepted: a vehicle with motors");
    io::check_output(options.mcap);
  }
  std::size_t at_a_time = options.count;
  if (logged) {
    prepare_log_folder(options.log_folder, options.count, config.vehicle_file_name);
    const double room = options.log_bytes / (Recorder<T>::bytes_per_s(config) * config.duration_s);
    at_a_time = std::clamp<std::size_t>(static_cast<std::size_t>(std::min(room, 1e6)), 1, options.count);
    if (at_a_time > 16) at_a_time -= at_a_time % 16;  // fills whole blocks
  }
  const auto start = std::chrono::steady_clock::now();
  Progress progress{options.keep_going,
                    static_cast<double>(Rollout<T>::ticks(config)) * static_cast<double>(options.count)};
  FlyResult result;
  std::vector<FlightScore> all_scores;
  for (std::size_t first = 0; first < options.count && !result.stopped; first += at_a_time) {
    FlyConfig part = config;
    part.fleet.first_flapper += static_cast<std::uint32_t>(first);
    const std::size_t count = std::min(at_a_time, options.count - first);
    Rollout<T> flights(std::move(part), count);
    const flight::Fleet<T>& fleet = flights.fleet();
    if (recorded) flights.record();
    std::vector<FlightScore> scores(count);
    std::vector<std::uint32_t> ended(count);  // bits of Ended at the tick of the first end
    while (!flights.over() && !result.stopped) {
      flights.step();
      const auto before = std::chrono::steady_clock::now();
      const flight::Target target = fleet.target(0);  // the same for all, because they started together
      const bool settled = flights.t_s() >= config.settle_s - 1e-9;
      flights.each([&](std::size_t i) {
        if (!config.welded) scores[i].add(fleet.truth(i), target, fleet.events(i), flights.t_s(), settled);
        if (ended[i] == 0) ended[i] = fleet.ended(i);
      });
      result.scoring_s += seconds_since(before);
      result.stopped = !progress.add(static_cast<double>(count));
    }
    for (std::size_t i = 0; i < count; ++i) {
      result.hash = sim::mixed(result.hash, fleet.batch().hash(i, i + 1));
      for (std::size_t k = 0; k < result.ended.size(); ++k) result.ended[k] += ended[i] >> k & 1;
      result.handed_back += fleet.handed_back(i);
      const double captured_s = fleet.captured_s(i);
      if (captured_s > 0) result.capture_s.push_back(captured_s);
      result.successes +=
          Outcome{
              .captured_s = captured_s, .lost_s = fleet.lost_s(i), .status = fleet.events(i), .ended = fleet.ended(i)}
              .success();
    }
    result.flown_s = flights.t_s();
    result.steps += flights.physics_steps();
    if (logged) result.logs += write_logs(flights, first, options);
    if (!options.mcap.empty()) {
      const auto log = flights.recorders().front().log();
      result.mcap = log.has_value();
      if (log) flightlog::ros::write_flight_mcap(options.mcap, *log, {}, flights.recorders().front().wing_loads());
      else fs::remove(options.mcap);  // the file is that of an earlier flight
    }
    all_scores.insert(all_scores.end(), scores.begin(), scores.end());
  }
  result.summary = summarise(all_scores);
  result.wall_s = seconds_since(start);
  return result;
}

}  // namespace

FlyResult fly(const FlyConfig& config, const FlyOptions& options) {
  return config.precision == "float" ? fly_all<float>(config, options) : fly_all<double>(config, options);
}

}  // namespace flappy::rollout
