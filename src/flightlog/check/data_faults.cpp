#include "flightlog/check/data_faults.hpp"

#include <algorithm>
#include <cmath>

#include "flightlog/check/check_parts.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

/// Least share of a stream's samples that must exist, and largest relative deviation of its rate from the declared one.
constexpr double kMinShare = 0.5, kRateTolerance = 0.2;

struct DeclaredStream {
  std::string file;
  const Column* t_s;
  double rate_hz;                       ///< declared rate
  std::vector<const Column*> measured;  ///< columns that noise prevents from repeating; empty without declared noise
  double begin_s() const { return t_s->front(); }
  double end_s() const { return t_s->back(); }
  std::size_t last_line() const { return t_s->size() + 1; }
};

/// Rate of the commands, missing ones included; no header declares it.
double command_rate_hz(const Column& t_s) { return stream_statistics(kCommand, t_s, 1).rate_hz; }

/// First those that every diagnosis needs (commands, mocap and, with voltages, IMU), then the others.
std::vector<DeclaredStream> streams_of(const FlightLog& log) {
  const MocapStream& m = log.mocap;
  const ImuStream& s = log.imu;
  const FlightHeader& h = log.header;
  std::vector<DeclaredStream> list = {{kCommand, &log.command.t_s, command_rate_hz(log.command.t_s), {}}};
  if (log.forces) list.push_back({kForces, &log.forces->t_s, h.rig->rate_hz, {}});
  else list.push_back({kMocap, &m.t_s, h.mocap.rate_hz, {}});
  // an estimate may be logged more often than it is made, and rounded
  if (h.mocap.position_noise_m > 0 && h.mocap.source == PoseSource::motion_capture)
    list[1].measured = {&m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz};
  if (h.imu.rate_hz > 0) list.push_back({kImu, &s.t_s, h.imu.rate_hz, {}});
  if (h.imu.gyro_noise_rad_s > 0) list.back().measured = {&s.gyro_x_rad_s, &s.gyro_y_rad_s, &s.gyro_z_rad_s};
  if (log.power) {
    list.push_back({kPower, &log.power->t_s, h.power->rate_hz, {}});
    if (h.power->current_noise_A > 0) list.back().measured = {&log.power->left_current_A, &log.power->right_current_A};
  }
  if (log.wings) {
    list.push_back({kWings, &log.wings->t_s, h.wings->rate_hz, {}});
    if (h.wings->noise_rad > 0) list.back().measured = {&log.wings->left_stroke_rad, &log.wings->right_stroke_rad};
  }
  return list;
}

bool repeats(const DeclaredStream& s, std::size_t i) {
  return !s.measured.empty() &&
         std::ranges::all_of(s.measured, [&](const Column* c) { return (*c)[i] == (*c)[i - 1]; });
}

/// Begin and end, s: medians over the first three streams, so that one faulty stream does not change them.
std::pair<double, double> flight_of(const std::vector<DeclaredStream>& streams) {
  std::vector<double> begins, ends;
  for (std::size_t k = 0; k < std::min<std::size_t>(3, streams.size()); ++k)
    begins.push_back(streams[k].begin_s()), ends.push_back(streams[k].end_s());
  return {io::median(begins), io::median(ends)};
}

std::vector<DataFault> missing(const std::vector<DeclaredStream>& streams) {
  std::vector<DataFault> faults;
  const auto [begin_s, end_s] = flight_of(streams);
  for (const DeclaredStream& s : streams) {
    std::size_t fresh = 1, line = 0;
    for (std::size_t i = 1; i < s.t_s->size(); ++i) {
      const bool again = repeats(s, i);
      fresh += !again;
      if (line == 0 && (again || (*s.t_s)[i] - (*s.t_s)[i - 1] > 1.5 / s.rate_hz)) line = i + 2;
    }
    const double expected = s.rate_hz * std::max(end_s - begin_s, 0.0);
    // a film may hold seconds of a flight
    if (static_cast<double>(fresh) >= kMinShare * (s.file == kWings ? static_cast<double>(s.t_s->size()) : expected)) {
      const StreamStatistics seen = stream_statistics(s.file, *s.t_s, s.rate_hz);
      if (std::abs(seen.rate_hz / s.rate_hz - 1) > kRateTolerance && s.file != kCommand)
        faults.push_back({s.file, 2,
                          format("%.4g samples/s, %.4g declared: thinned out, repeated, or t_s not in seconds",
                                 seen.rate_hz, s.rate_hz)});
      continue;
    }
    if (line == 0) line = s.begin_s() > begin_s + 0.1 * (end_s - begin_s) ? 2 : s.last_line();
    faults.push_back({s.file, line,
                      format("%.0f %% of the flight's samples are missing, at most %.0f %% can be",
                             100 * (1 - static_cast<double>(fresh) / expected), 100 * (1 - kMinShare))});
  }
  return faults;
}

std::vector<DataFault> too_short(std::vector<DeclaredStream> streams, double flapping_Hz, bool with_imu) {
  streams.erase(streams.begin() + (with_imu ? 3 : 2), streams.end());
  const double least_s = std::max(flapping_Hz > 0 ? kMinBeats / flapping_Hz : 0, kMinTime_s);
  const auto& last = *std::ranges::max_element(streams, {}, &DeclaredStream::begin_s);
  const auto& first = *std::ranges::min_element(streams, {}, &DeclaredStream::end_s);
  const double common_s = first.end_s() - last.begin_s();
  if (common_s >= least_s) return {};
  const auto& shortest =
      *std::ranges::min_element(streams, {}, [](const DeclaredStream& s) { return s.end_s() - s.begin_s(); });
  const double shortest_s = shortest.end_s() - shortest.begin_s();
  if (shortest_s < least_s)
    return {{shortest.file, shortest.last_line(),
             format("the flight lasts %.3g s, at least %.3g s", shortest_s, least_s) +
                 (flapping_Hz > 0 ? format(" (%.0f beats)", least_s * flapping_Hz) : "") + " are needed"}};
  return {
      {last.file, 2,
       format("begins at %.6g s, %s ends at %.6g s: streams overlap by %.3g s, at least %.3g s needed; another clock, "
              "or another flight",
              last.begin_s(), first.file.c_str(), first.end_s(), std::max(common_s, 0.0), least_s)}};
}

const Finding* find(const CheckReport& report, const std::string& check) {
  const auto at = std::ranges::find(report.findings, check, &Finding::check);
  return at == report.findings.end() || at->verdict == Verdict::not_tested ? nullptr : &*at;
}

double value(const Finding& f, const std::string& name) {
  return std::ranges::find(f.values, name, &std::pair<std::string, double>::first)->second;
}

/// The streams among command, mocap, imu, power and wings whose clocks run at another speed than the others.
std::vector<DataFault> wrong_clocks(const FlightLog& log, const CheckReport& report) {
  std::vector<DataFault> faults;
  const auto blame = [&](const std::string& file, const Column& t_s, double speed) {
    // The first line at which the clock is off by 1 ms, which no check notices yet.
    faults.push_back({file, line_at(t_s, 1e-3 / speed),
                      format("its clock runs off those of the other streams by %.2g %%", 100 * speed)});
  };
  const Finding *against_mocap = find(report, "clock speed"), *imu = find(report, "imu beat");
  const auto off = [](const Finding* beat) { return beat && beat->verdict == Verdict::warning; };
  const bool mocap_off = against_mocap && !against_mocap->fault.file.empty();
  if (off(imu)) {
    const double ratio = value(*imu, "ratio");
    const Finding *frequency = find(report, "flapping frequency"), *power = find(report, "power beat"),
                  *wings = find(report, "wings beat");
    // A third stream decides whether the commands' or the IMU's clock is wrong; else the declared frequency does.
    bool of_command = off(power) || off(wings) || (against_mocap && !mocap_off);
    if (!of_command && !against_mocap && !power && !wings && frequency) {
      const double driven = value(*frequency, "frequency_Hz") / log.header.flapping_Hz;
      of_command = std::abs(driven - 1) > std::abs(driven * ratio - 1);
    }
    if (of_command) blame(kCommand, log.command.t_s, std::abs(ratio - 1));
    else blame(kImu, log.imu.t_s, std::abs(ratio - 1));
  } else {
    if (mocap_off) {
      const double speed = std::abs(value(*against_mocap, "per_s"));
      if (imu) blame(kMocap, log.mocap.t_s, speed);
      else blame(kImu, log.imu.t_s, speed);
    }
    for (const auto& [check, file, t_s] : {std::tuple("power beat", kPower, log.power ? &log.power->t_s : nullptr),
                                           std::tuple("wings beat", kWings, log.wings ? &log.wings->t_s : nullptr)})
      if (const Finding* beat = find(report, check); off(beat)) blame(file, *t_s, std::abs(value(*beat, "ratio") - 1));
  }
  return faults;
}

}  // namespace

std::vector<DataFault> data_faults(const FlightLog& log, const CheckReport& report,
                                   const std::filesystem::path& folder) {
  const std::vector<DeclaredStream> streams = streams_of(log);
  // With missing samples, no further check is meaningful.
  std::vector<DataFault> faults = missing(streams);
  if (faults.empty()) faults = too_short(streams, log.header.flapping_Hz, log.header.inputs.empty() && !log.header.rig);
  if (faults.empty()) {
    faults = wrong_clocks(log, report);
    const bool clocks_off = !faults.empty();  // then currents are compared with the wrong voltages
    for (const Finding& f : report.findings) {
      const bool named = f.fault.file.empty() || f.check == "clock speed" || (clocks_off && f.fault.file == kPower) ||
                         std::ranges::find(faults, f.fault.file, &DataFault::file) != faults.end();
      if (!named) faults.push_back({f.fault.file, f.fault.line, f.check + ": " + f.text});
    }
  }
  for (DataFault& f : faults) f.file = (folder / f.file).string();
  return faults;
}

std::vector<DataFault> data_faults(const std::vector<FlightLog>& logs, const std::vector<std::string>& folders) {
  std::vector<DataFault> all;
  const std::vector<CheckReport> reports = check_flights(logs);
  for (std::size_t i = 0; i < logs.size(); ++i)
    for (DataFault& fault : data_faults(logs[i], reports[i], folders[i])) all.push_back(std::move(fault));
  return all;
}

FlightLog read_faultless_log(const std::filesystem::path& folder) {
  FlightLog log = read_flight_log(folder);
  if (const auto faults = data_faults(log, folder); !faults.empty())
    throw io::InputError(faults.front().file + ":" + std::to_string(faults.front().line) + ": " + faults.front().what +
                         "; accepted: flights that flappy-gap check finds no fault in");
  return log;
}

}  // namespace flappy::flightlog
