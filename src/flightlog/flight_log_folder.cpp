#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "flightlog/flight_log.hpp"
#include "io/config.hpp"
#include "io/csv.hpp"
#include "io/log.hpp"
#include "io/read_files.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;
using namespace log_file;

[[noreturn]] void refuse(const fs::path& place, const std::string& what, std::string_view accepted) {
  throw io::InputError(place.string() + ": " + what + (accepted.empty() ? "" : "; accepted: " + std::string(accepted)));
}

/// Name of the vehicle that a log to be replaced declares, whose file may be in the folder; empty where the header cannot
/// be read.
std::string declared_vehicle(const fs::path& folder) {
  std::string vehicle;
  try {
    vehicle = io::Config::load(folder / kHeader).root().string("vehicle");
  } catch (const io::InputError&) {  // then no vehicle's file is expected
  }
  io::allow_update(folder / kHeader);  // read for this alone
  return vehicle;
}

void require_log(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder / kHeader, ignored)) refuse(folder, "is no flight log", "a folder with " + kHeader);
}

/// A temporary folder next to another one; the destructor removes it.
struct SiblingFolder {
  explicit SiblingFolder(const fs::path& beside) : path(beside.string() + ".tmp" + std::to_string(getpid())) {
    fs::create_directories(path);
  }
  ~SiblingFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  SiblingFolder(const SiblingFolder&) = delete;
  SiblingFolder& operator=(const SiblingFolder&) = delete;

  fs::path path;
};

}  // namespace

void require_replaceable(const fs::path& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (!fs::exists(status)) return;
  constexpr std::string_view kAccepted = "a new folder, an empty one, or a flight log to replace";
  if (!fs::is_directory(status)) refuse(folder, "is no folder", kAccepted);
  std::vector<std::string> known = kAll;
  known.push_back(declared_vehicle(folder));
  bool empty = true, has_header = false;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::find(known, name) == known.end() || !entry.is_regular_file(error))
      refuse(folder, "holds " + name + ", which is no part of a flight log", kAccepted);
    empty = false;
    has_header |= name == kHeader;
  }
  if (error) refuse(folder, "cannot be written: " + error.message(), "");
  if (!empty && !has_header) refuse(folder, "holds files, but no " + kHeader, kAccepted);
}

std::vector<fs::path> flights_in(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / kHeader, error)) return {folder};
  std::vector<fs::path> flights;
  for (const fs::directory_entry& e : fs::directory_iterator(folder, error))
    if (fs::exists(e.path() / kHeader, error)) flights.push_back(e.path());
  std::ranges::sort(flights);
  return flights;
}

void check_each_once(const std::vector<std::string>& folders) {
  for (std::size_t i = 0; i < folders.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (std::error_code none; fs::equivalent(folders[i], folders[k], none))
        throw io::InputError(folders[i] + ": is given twice; accepted: each flight once");
}

FlightLog read_flight_log(const fs::path& folder) {
  std::error_code error;
  LogFiles files;
  const std::vector<std::string> optional = {kImu, kPower, kWings, kAttitude, kForces, kPolicy};
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".csv") || name == kTruth || name == kJoints || name == kWingLoads) continue;
    // A misspelt name of an optional stream is an error, because the stream would otherwise be ignored silently.
    const std::string nearest = io::nearest_name(name, optional);
    if (!nearest.empty() && nearest != name)
      refuse(entry.path(), "is no stream of a flight log", io::joined(optional) + io::did_you_mean(name, optional));
    if (!nearest.empty()) files[name] = io::read_text(entry.path());
  }
  if (error) refuse(folder, "cannot be read: " + error.message(), "");
  if (const std::vector<fs::path> inside = flights_in(folder); !inside.empty() && inside.front() != folder)
    refuse(folder, "is no flight, but a folder of " + std::to_string(inside.size()), (folder / "*").string());
  for (const auto& name : {kHeader, kCommand}) files[name] = io::read_text(folder / name);
  if (!files.contains(kForces) || fs::exists(folder / kMocap, error)) files[kMocap] = io::read_text(folder / kMocap);
  FlightLog log = parse_flight_log(files, folder);
  const auto warn = [&](const char* table, const std::string& name) {
    io::log(io::LogLevel::warning,
            (folder / kHeader).string() + ": " + table + ": is declared, but there is no " + name + ": done without");
  };
  if (log.header.power && !log.power) warn("power", kPower);
  if (log.header.wings && !log.wings) warn("wings", kWings);
  if (log.header.attitude && !log.attitude) warn("attitude", kAttitude);
  if (!log.header.policy.empty() && !log.policy) warn("policy", kPolicy);
  return log;
}

void write_flight_log(const fs::path& folder, const FlightLog& log) {
  const LogFiles files = flight_log_files(log);
  parse_flight_log(files, folder);
  io::require_unread_folder(folder);
  require_replaceable(folder);
  try {
    const fs::path named = folder.has_filename() ? folder : folder.parent_path();
    const fs::path target = fs::weakly_canonical(named);  // else a link would be replaced, not its folder
    const SiblingFolder fresh(target);
    for (const auto& [name, text] : files) io::write_atomically(fresh.path / name, text);
    if (fs::exists(target)) {
      const SiblingFolder old(fresh.path);
      fs::rename(target, old.path / "log");
      std::error_code failed;
      fs::rename(fresh.path, target, failed);
      if (failed) {
        fs::rename(old.path / "log", target);
        throw fs::filesystem_error("", failed);
      }
    } else {
      fs::rename(fresh.path, target);
    }
  } catch (const fs::filesystem_error& error) {
    refuse(folder, "cannot be written: " + error.code().message(), "");
  }
}

void write_truth(const fs::path& folder, const std::vector<std::string>& names, const std::vector<Column>& columns) {
  require_log(folder);
  io::write_atomically(folder / kTruth, io::csv_text(names, columns));
}

void write_vehicle(const fs::path& folder, const std::string& name, std::string_view text) {
  require_log(folder);
  io::write_atomically(folder / name, text);
}

}  // namespace flappy::flightlog
