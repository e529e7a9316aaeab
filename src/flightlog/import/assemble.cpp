#include "flightlog/import/assemble.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "flightlog/import/clock.hpp"
#include "flightlog/import/marker_pose.hpp"
#include "flightlog/import/recorded_units.hpp"
#include "flightlog/import/sources.hpp"
#include "flightlog/import/wing_film.hpp"
#include "flightlog/rotation.hpp"
#include "flightlog/stream_statistics.hpp"
#include "io/log.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr double kQuaternionTolerance = 1e-3;
/// A larger least delay is implausible for messages that arrive at all: the stamps are probably of another clock.
constexpr double kOddOffset_s = 0.5;
using Columns = std::map<std::string, Column>;

/// "4 lacks x_m, 1 no time".
std::string reasons(const StreamReport& report) {
  std::vector<std::string> parts;
  for (const auto& [why, count] : report.why_unusable) parts.push_back(std::to_string(count) + " " + why);
  return io::joined(parts);
}

/// Joins names for an error message; only the first 30, because there may be thousands.
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMax = 30;
  if (names.size() <= kMax) return names.empty() ? "nothing" : io::shortened(io::joined(names), 2000);
  return io::shortened(io::joined({names.begin(), names.begin() + kMax}), 2000) + " and " +
         std::to_string(names.size() - kMax) + " more";
}

const Channel& channel_of(const Channels& channels, const StreamMapping& s, const std::string& name,
                          const std::string& key) {
  const Channel* found = channels.find(name);
  if (found && !found->received_ns().empty()) return *found;
  std::vector<std::string> names = channels.names();
  if (!found) s.table.fail(key, "\"" + name + "\" is not recorded", listed(names) + io::did_you_mean(name, names));
  std::erase_if(names, [&](const std::string& other) { return channels.find(other)->received_ns().empty(); });
  s.table.fail(key, "\"" + name + "\" has no samples", "a channel that has some: " + listed(names));
}

bool is_optional(const StreamMapping& s) {
  return s.name == "power" || s.name == "wings" || s.name == "attitude" || s.name == "policy";
}

/// Whether an optional stream has no samples in the recording.
bool left_out(const Channels& channels, const StreamMapping& s) {
  const Channel* found = channels.find(s.channel);
  return is_optional(s) && (!found || found->received_ns().empty());
}

const std::vector<double>& field_of(const Channel& channel, const io::Table& table, const std::string& key,
                                    const std::string& field) {
  if (const auto* found = channel.column(field)) return *found;
  const std::vector<std::string> names = channel.fields();
  table.fail(key, "\"" + field + "\" is no field of the channel", listed(names) + io::did_you_mean(field, names));
}

/// The first field that the channel has.
const std::vector<double>& field_of(const Channel& channel, const io::Table& table, const std::string& key,
                                    const FieldNames& fields) {
  for (const std::string& field : fields)
    if (const auto* found = channel.column(field)) return *found;
  return field_of(channel, table, key, fields.front());
}

[[noreturn]] void fail_without_capture(const StreamMapping& s) {
  s.table.fail("body", "is given for a table without the head of a motion-capture program",
               "columns, or an export with its head");
}

/// InputError where neither the file nor the mapping says which axis is up.
void require_world(const Capture& capture, const StreamMapping& s) {
  if (capture.says_up || s.says_world) return;
  s.table.fail(
      "world", "is missing: " + capture.program + "'s files do not say which axis is up",
      capture.program == "Motive" ? "\"y_up\" (the program's default), \"enu\" (z up)" : "\"enu\" (z up), \"y_up\"");
}

/// The field of a column that a body of an export has. InputError for a body that is not there, and where the file does
/// not say which way its axes point, or what its rotations are.
const std::vector<double>& field_of_body(const Channel& channel, const StreamMapping& s, const std::string& field) {
  const Capture* capture = channel.capture();
  if (!capture) fail_without_capture(s);
  if (std::ranges::find(capture->bodies, s.body) == capture->bodies.end())
    s.table.fail("body",
                 "\"" + s.body + "\" is no rigid body of the recording" +
                     (std::ranges::find(capture->markers, s.body) == capture->markers.end() ? "" : ", but a marker"),
                 listed(capture->bodies) + io::did_you_mean(s.body, capture->bodies));
  require_world(*capture, s);
  if (!capture->says_up && !s.says_axes)
    s.table.fail("frame", "is missing: " + capture->program + "'s files do not say which axis of the body is forward",
                 "\"fur\" (x forward, y up), \"luf\" (z forward, y up), \"flu\" (x forward, z up), \"frd\"");
  if (const auto* found = channel.column(field)) return *found;
  if (s.rotation.empty())
    s.table.fail("rotation", "is missing: the file does not say what the three numbers of its rotation are",
                 "\"vector\" (axis times angle), or axes of angles in turn, as \"xyz\"");
  s.table.fail("rotation", "is given, but the file says what its rotation is", "no rotation");
}

/// The factor from a coordinate of a point to m: as the mapping says, else by the unit that the recording says, else 1.
double unit_of_point(const Channel& channel, const StreamMapping& s, const std::string& field) {
  if (s.unit_m) return *s.unit_m;
  const std::string unit = channel.unit(field);
  if (unit.empty()) return 1;
  const auto known = recorded_unit(unit);
  if (!known || known->suffix != "_m")
    s.table.fail(s.points.empty() ? "markers" : "points", "\"" + field + "\" is in " + io::shortened(unit),
                 known ? "fields of lengths" : "the unit in m as unit_m");
  return known->factor;
}

/// A coordinate of a marker or of a point of the wings, m. InputError for one that is not there, and where the file does not
/// say which axis is up.
std::vector<double> field_of_marker(const Channel& channel, const StreamMapping& s, const FieldNames& fields) {
  const Capture* capture = channel.capture();
  if (capture) require_world(*capture, s);
  for (const std::string& field : fields)
    if (const auto* found = channel.column(field)) {
      std::vector<double> values = *found;
      const double unit = unit_of_point(channel, s, field);
      for (double& value : values) value *= unit;
      return values;
    }
  const std::string& field = fields.front();
  const std::string name = field.substr(0, field.rfind('.'));
  const std::vector<std::string> names = capture ? capture->markers : channel.fields();
  const bool is_marker = std::ranges::find(s.markers, name) != s.markers.end();
  s.table.fail(is_marker ? "markers" : "points",
               "\"" + name + "\" is no " + (is_marker ? "marker" : "point") + " of the recording" +
                   (capture ? "" : ", by fields as " + field + " or " + fields[1]),
               listed(names) + io::did_you_mean(name, names));
}

/// The name of the field that a channel has of those that the mapping gives.
const std::string& given_name(const Channel& channel, const FieldNames& fields) {
  const auto found = std::ranges::find_if(fields, [&](const std::string& field) { return channel.column(field); });
  return found == fields.end() ? fields.front() : *found;
}

/// The factor from a field to its column: as the mapping says, else by the unit that the recording says.
double scale_of(const Channel& channel, const io::Table& columns, const ColumnMapping& c) {
  if (c.scale) return *c.scale;
  const std::string& field = given_name(channel, c.fields);
  const std::string unit = channel.unit(field);
  const std::string_view quantity = quantity_of(c.column);
  if (unit.empty() || quantity.empty()) return 1;
  const auto known = recorded_unit(unit);
  if (!known || known->suffix != quantity)
    columns.fail(c.column, "\"" + field + "\" is in " + io::shortened(unit),
                 known ? "a field of another unit" : "its factor to SI as scale." + c.column);
  return known->factor;
}

/// The unit of the times in ns: as the mapping says, else as the recording does, else a second.
double time_unit_ns(const Channel& channel, const StreamMapping& s) {
  if (s.time_unit_ns) return *s.time_unit_ns;
  const auto unit = recorded_unit(channel.unit(s.time_fields.front()));
  return 1e9 * (unit && unit->suffix == "_s" ? unit->factor : 1);
}

/// The unit ("s", "ms", "us" or "ns") in which `value` lies between `least_s` and `most_s`; empty where no unit fits.
std::string unit_for(double value, double least_s, double most_s) {
  for (const auto& [unit, seconds] :
       {std::pair("s", 1.0), std::pair("ms", 1e-3), std::pair("us", 1e-6), std::pair("ns", 1e-9)})
    if (value * seconds >= least_s && value * seconds <= most_s) return unit;
  return "";
}

[[noreturn]] void refuse_unit(const StreamMapping& s, const std::string& what, const std::string& unit) {
  const std::string key = s.table.has("time_unit") ? "time_unit" : "time_field";
  s.table.fail(key, what, unit.empty() ? "times of a flight" : "time_unit = \"" + unit + "\"");
}

/// InputError for times that show another unit than declared: after the year 2100, or at intervals that no robot has.
void require_unit(const Channel& channel, const StreamMapping& s) {
  constexpr double kLatest_s = 4.1e9;                    // the year 2100
  constexpr double kLongest_s = 10, kShortest_s = 1e-6;  // mean interval of samples
  constexpr double kTail = 0.05;                         // share of the times at either end that is ignored
  std::vector<double> times = field_of(channel, s.table, "time_field", s.time_fields.front());
  std::erase_if(times, [](double t) { return !std::isfinite(t); });
  if (times.size() < 2 || s.time_fields.size() > 1 || s.time_fields.front() == kFrame) return;
  const double low = io::quantile(times, kTail), middle = std::abs(io::median(times)),
               high = io::quantile(times, 1 - kTail);
  const double step = (high - low) / ((1 - 2 * kTail) * static_cast<double>(times.size() - 1)),
               unit_s = 1e-9 * time_unit_ns(channel, s);
  if (middle * unit_s > kLatest_s)
    refuse_unit(s, "times of \"" + s.time_fields.front() + "\" reach " + io::format("%.3g", middle * unit_s) + " s",
                unit_for(middle, 0, kLatest_s));
  if (step > 0 && ((step * unit_s > kLongest_s && !is_optional(s)) || step * unit_s < kShortest_s))
    refuse_unit(s, "samples are " + io::format("%.2g", step * unit_s) + " s apart by \"" + s.time_fields.front() + "\"",
                unit_for(step, 2e-5, 1));
}

std::vector<std::int64_t> field_times(const Channel& channel, const StreamMapping& s) {
  const double unit_ns = time_unit_ns(channel, s);
  std::vector<std::int64_t> times;
  for (const std::string& field : s.time_fields) {  // each rounded alone: a date has no place for ns beside it
    const std::vector<double>& part = field_of(channel, s.table, "time_field", field);
    times.resize(part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
      const double t_ns = part[i] * unit_ns;
      if (!(std::abs(t_ns) < kLatest_ns)) times[i] = kNoTime;
      else if (times[i] != kNoTime) times[i] += std::llround(t_ns);
    }
  }
  return times;
}

/// The times of a channel's rows that the mapping selects, stamps still on their own clock.
std::vector<std::int64_t> raw_times(const Channel& channel, const StreamMapping& s) {
  if (s.time == TimeOf::received) return channel.received_ns();
  if (s.time == TimeOf::stamp) return channel.stamp_ns();
  return field_times(channel, s);
}

std::vector<StampedReceipt> stamped_receipts(const Channel& channel, const StreamMapping& s) {
  std::vector<StampedReceipt> pairs;
  const std::vector<std::int64_t> stamps = raw_times(channel, s);
  for (std::size_t i = 0; i < stamps.size(); ++i)
    if (stamps[i] != kNoTime && channel.received_ns()[i] != kNoTime)
      pairs.emplace_back(stamps[i], channel.received_ns()[i]);
  return pairs;
}

bool all_missing(const std::vector<std::int64_t>& times) {
  return std::ranges::all_of(times, [](std::int64_t t) { return t == kNoTime; });
}

/// The clock lines of a recording: one for all streams of a clock, because the quickest message of all bounds it.
class Clocks {
 public:
  Clocks(const Channels& channels, const Mapping& mapping) : mapping_(mapping) {
    for (const StreamMapping& s : mapping.streams) {
      if (left_out(channels, s)) continue;
      const Channel& channel = channel_of(channels, s, s.channel, "channel");
      if (s.time == TimeOf::received) continue;
      if (s.time == TimeOf::field && s.time_fields.front() == kFrame && !channel.column(kFrame))
        s.table.fail("time", "\"frame\" is given for a recording that is no table",
                     "a table with a row for each frame");
      if (s.time == TimeOf::field) require_unit(channel, s);
      auto& pairs = pairs_[s.clock];
      const std::vector<StampedReceipt> own = stamped_receipts(channel, s);
      pairs.insert(pairs.end(), own.begin(), own.end());
    }
    for (const auto& [name, pairs] : pairs_) add(name, without_outliers(pairs));
  }

  /// Converts the stamps of a stream to the receiver's clock.
  const ClockLine& line(const StreamMapping& s) const { return lines_.at(s.clock); }
  /// The line of the quickest messages of the stream's clock: the reference of delays.
  const ClockLine& quickest(const StreamMapping& s) const { return quickest_.at(s.clock); }
  const std::vector<ClockReport>& reports() const { return reports_; }

 private:
  void add(const std::string& name, const std::vector<StampedReceipt>& pairs) {
    const auto given = mapping_.offsets_s.find(name);
    if (pairs.empty() && name != kReceiver && given == mapping_.offsets_s.end()) {
      const auto stream = std::ranges::find(mapping_.streams, name, &StreamMapping::clock);
      stream->table.fail("clock", "\"" + name + "\" cannot be measured: no sample says when it was received",
                         "clocks." + name + ".offset_s");
    }
    ClockLine below = pairs.empty() ? ClockLine() : ClockLine::below(pairs);
    ClockReport report{name, below.offset_s(), below.drift(), true, pairs.size()};
    if (!pairs.empty()) {
      const auto [first, last] = std::ranges::minmax(pairs);
      report.span_s = 1e-9 * static_cast<double>(last.first - first.first);
    }
    quickest_.emplace(name, below);
    if (name == kReceiver) {
      lines_.emplace(name, ClockLine());
    } else if (given != mapping_.offsets_s.end()) {
      lines_.emplace(name, ClockLine(std::llround(1e9 * given->second)));
      report.offset_s = given->second;
      report.drift = 0;
      report.measured = false;
    } else {
      lines_.emplace(name, below);
    }
    if (!pairs.empty() || !report.measured) reports_.push_back(report);
  }

  const Mapping& mapping_;
  std::map<std::string, std::vector<StampedReceipt>> pairs_;
  std::map<std::string, ClockLine> lines_, quickest_;
  std::vector<ClockReport> reports_;
};

struct Timed {
  const Channel* channel;
  std::vector<std::int64_t> t_ns;  ///< on the receiver's clock
};

Timed timed(const Channel& channel, const StreamMapping& s, const Clocks& clocks) {
  Timed timed{&channel, raw_times(channel, s)};
  if (s.time == TimeOf::received) return timed;
  const ClockLine& line = clocks.line(s);
  for (std::int64_t& t : timed.t_ns)
    if (t != kNoTime) t = line.received_ns(t);
  return timed;
}

/// For each of `times`, the index of the last of `held` that is not after it; held.size() where there is none.
std::vector<std::size_t> last_rows(const std::vector<std::int64_t>& times, const std::vector<std::int64_t>& held) {
  std::vector<std::size_t> order(held.size()), rows;
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](std::size_t i) { return held[i] == kNoTime; });
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return held[i]; });
  for (const std::int64_t t : times) {
    const auto after = std::ranges::upper_bound(order, t, {}, [&](std::size_t i) { return held[i]; });
    rows.push_back(after == order.begin() ? held.size() : *(after - 1));
  }
  return rows;
}

struct Quaternion {
  double w, x, y, z;
  constexpr Quaternion operator*(const Quaternion& q) const {
    return {w * q.w - x * q.x - y * q.y - z * q.z, w * q.x + x * q.w + y * q.z - z * q.y,
            w * q.y - x * q.z + y * q.w + z * q.x, w * q.z + x * q.y - y * q.x + z * q.w};
  }
};

constexpr double kHalfRoot = std::numbers::sqrt2 / 2;

/// Turns the axes of a recording's world to those of W.
constexpr Quaternion turn_of(World world) {
  switch (world) {
    case World::ned:
      return {0, kHalfRoot, kHalfRoot, 0};  // north, east, down to east, north, up
    case World::ned_x_north:
      return {0, -1, 0, 0};  // to north, west, up
    case World::y_up:
      return {kHalfRoot, kHalfRoot, 0, 0};  // about x
    case World::enu:
      break;
  }
  return {1, 0, 0, 0};
}

/// Turns the axes of B to those of a recording's body.
constexpr Quaternion turn_of(Axes axes) {
  switch (axes) {
    case Axes::frd:
      return {0, 1, 0, 0};  // forward, left, up to forward, right, down
    case Axes::fur:
      return {kHalfRoot, -kHalfRoot, 0, 0};  // about x
    case Axes::luf:
      return {0.5, -0.5, -0.5, -0.5};  // x to z, y to x, z to y
    case Axes::flu:
      break;
  }
  return {1, 0, 0, 0};
}

struct Stream {
  const StreamMapping& mapping;
  std::vector<std::int64_t> t_ns;
  Columns columns;
  std::vector<std::string> notes;                  ///< warnings about markers
  std::vector<const ColumnMapping*> not_measured;  ///< of each row, the first column that it says is not measured
  std::vector<std::string> faults;  ///< [row] why the points of the wings are unusable; "": they are usable
  StreamReport report;

  void turn() {
    if (mapping.axes == Axes::frd)
      for (const char* name : {"gyro_y_rad_s", "gyro_z_rad_s", "accel_y_m_s2", "accel_z_m_s2"})
        if (const auto c = columns.find(name); c != columns.end())
          for (double& value : c->second) value = -value;
    if (!columns.contains("qw") || (mapping.axes == Axes::flu && mapping.world == World::enu)) return;
    const Quaternion world = turn_of(mapping.world), axes = turn_of(mapping.axes);
    Column &qw = columns["qw"], &qx = columns["qx"], &qy = columns["qy"], &qz = columns["qz"];
    for (std::size_t i = 0; i < qw.size(); ++i) {
      const Quaternion q = world * Quaternion{qw[i], qx[i], qy[i], qz[i]} * axes;
      qw[i] = q.w, qx[i] = q.x, qy[i] = q.y, qz[i] = q.z;
    }
    if (!columns.contains("x_m")) return;
    Column &x = columns["x_m"], &y = columns["y_m"], &z = columns["z_m"];
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (mapping.world == World::ned) std::swap(x[i], y[i]), z[i] = -z[i];
      if (mapping.world == World::ned_x_north) y[i] = -y[i], z[i] = -z[i];
      if (mapping.world == World::y_up) std::swap(y[i], z[i]), y[i] = -y[i];
    }
  }
};

double farthest(const Column& values) {
  double most = 0;
  for (const double v : values)
    if (std::isfinite(v) && std::abs(v) > std::abs(most)) most = v;
  return most;
}

/// Replaces the columns of the acceleration by the pitch with which the specific force has no part along x of B: with
/// u the specific force, turned back by the yaw, tan(pitch) = u_x / u_z.
void derive_pitch(Stream& s, double gravity_m_s2) {
  const auto ax = s.columns.extract("acceleration_x_m_s2"), ay = s.columns.extract("acceleration_y_m_s2"),
             az = s.columns.extract("acceleration_z_m_s2");
  if (ax.empty()) return;
  const Column& yaw = s.columns["yaw_rad"];
  Column pitch;
  for (std::size_t i = 0; i < yaw.size(); ++i)
    pitch.push_back(std::atan2(std::cos(yaw[i]) * ax.mapped()[i] + std::sin(yaw[i]) * ay.mapped()[i],
                               az.mapped()[i] + gravity_m_s2));
  s.columns["pitch_rad"] = std::move(pitch);
}

/// Share of a column that may be out of range: a few flipped bits. More are another unit.
constexpr double kFew = 0.01;

/// Replaces the columns of angles by those of the quaternion.
void turn_angles(Stream& s) {
  if (!s.columns.contains("roll_rad")) return;
  Column roll = s.columns["roll_rad"], pitch = s.columns["pitch_rad"];
  const Column yaw = s.columns["yaw_rad"];
  constexpr double kMax_rad = 2 * std::numbers::pi + 0.1;
  for (const auto& [name, angles] : {std::pair("roll_rad", &roll), std::pair("pitch_rad", &pitch)}) {
    const auto beyond = [&](double angle) { return std::isfinite(angle) && std::abs(angle) > kMax_rad; };
    if (static_cast<double>(std::ranges::count_if(*angles, beyond)) > kFew * static_cast<double>(angles->size()))
      s.mapping.table.table("columns").fail(
          name, "reaches " + io::shortest_digits(farthest(*angles)) + ": likely in degrees",
          "radians: " + s.mapping.name + ".scale." + name + " = 0.017453292519943295");
    std::ranges::replace_if(*angles, beyond, std::numeric_limits<double>::quiet_NaN());
  }
  for (const char* name : {"roll_rad", "pitch_rad", "yaw_rad"}) s.columns.erase(name);
  for (std::size_t i = 0; i < roll.size(); ++i) {
    const auto about = [](double angle, double x, double y, double z) {
      const double sine = std::sin(angle / 2);
      return Quaternion{std::cos(angle / 2), sine * x, sine * y, sine * z};
    };
    const Quaternion q = about(yaw[i], 0, 0, 1) * about(pitch[i], 0, 1, 0) * about(roll[i], 1, 0, 0);
    s.columns["qw"].push_back(q.w), s.columns["qx"].push_back(q.x);
    s.columns["qy"].push_back(q.y), s.columns["qz"].push_back(q.z);
  }
}

/// Replaces three numbers of the rotation of a body by the quaternion, as the mapping says what they are.
void turn_rotations(Stream& s) {
  if (!s.columns.contains("rx_rad")) return;
  const auto rx = s.columns.extract("rx_rad"), ry = s.columns.extract("ry_rad"), rz = s.columns.extract("rz_rad");
  for (std::size_t i = 0; i < s.t_ns.size(); ++i) {
    const Eigen::Vector3d r(rx.mapped()[i], ry.mapped()[i], rz.mapped()[i]);
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    if (s.mapping.rotation == "vector") q = exponential(r);
    else
      for (const char axis : s.mapping.rotation) q = q * exponential(r[axis - 'x'] * Eigen::Vector3d::Unit(axis - 'x'));
    s.columns["qw"].push_back(q.w()), s.columns["qx"].push_back(q.x());
    s.columns["qy"].push_back(q.y()), s.columns["qz"].push_back(q.z());
  }
}

Eigen::Vector3d place_of(const Columns& columns, const std::string& marker, std::size_t i) {
  return {columns.at(marker + ".x_m")[i], columns.at(marker + ".y_m")[i], columns.at(marker + ".z_m")[i]};
}

/// Replaces the columns of markers by those of the pose, NaN where none agrees with them, and its residual.
void pose_of_markers(Stream& s) {
  const std::vector<std::string>& names = s.mapping.markers;
  if (names.empty()) return;
  Places places;
  for (const auto& p : s.mapping.marker_places_m) places.emplace_back(p[0], p[1], p[2]);
  if (!pose_by_markers(places, places)) s.mapping.table.fail("markers", "are in one line", "at least 3 that are not");
  MarkerTracker tracker(places, s.mapping.tolerance_m);
  Columns pose;
  for (std::size_t i = 0; i < s.t_ns.size(); ++i) {
    Places seen;
    for (const std::string& name : names) seen.push_back(place_of(s.columns, name, i));
    const double none = std::numeric_limits<double>::quiet_NaN();
    const MarkerPose at = tracker.next(seen).value_or(
        MarkerPose{Eigen::Vector3d::Constant(none), Eigen::Quaterniond(none, none, none, none), none});
    const auto add = [&](const char* column, double value) { pose[column].push_back(value); };
    add("x_m", at.position.x()), add("y_m", at.position.y()), add("z_m", at.position.z());
    add("qw", at.attitude.w()), add("qx", at.attitude.x()), add("qy", at.attitude.y()), add("qz", at.attitude.z());
    add("residual_m", at.residual_m);
  }
  s.columns = std::move(pose);
  const auto note = [&](std::size_t frames, const std::string& what) {
    if (frames > 0) s.notes.push_back(std::to_string(frames) + (frames == 1 ? " frame " : " frames ") + what);
  };
  for (std::size_t k = 0; k < tracker.swapped().size(); ++k)
    note(tracker.swapped()[k],
         "with " + names[tracker.pair(k).first] + " and " + names[tracker.pair(k).second] + " swapped: put right");
  for (std::size_t k = 0; k < names.size(); ++k) {
    note(tracker.left_out()[k], "with " + names[k] + " far from its place: done without it");
    note(tracker.lost()[k], "in which " + names[k] + " was not seen");
  }
  for (const auto& [i, j] : tracker.alike())
    s.notes.push_back(names[i] + " and " + names[j] + " can be swapped without a trace but the frames before");
}

Eigen::Quaterniond attitude_of(const Columns& c, std::size_t i) {
  return {c.at("qw")[i], c.at("qx")[i], c.at("qy")[i], c.at("qz")[i]};
}

Eigen::Quaterniond eigen_of(const Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

/// Attitudes, B to W, at the times of a film, by those of motion capture, which arrive `latency_s` later. None where
/// motion capture pauses.
std::vector<std::optional<Eigen::Quaterniond>> attitudes_at(const std::vector<std::int64_t>& t_ns, const Stream& mocap,
                                                            double latency_s) {
  constexpr double kLongestPause = 3;  // periods; a robot turns little within them
  const auto latency_ns = std::llround(1e9 * latency_s);
  const double pause_ns = kLongestPause * 1e9 / mocap.report.rate_hz;
  std::vector<std::optional<Eigen::Quaterniond>> attitudes;
  for (const std::int64_t t : t_ns) {
    attitudes.emplace_back();
    if (t == kNoTime) continue;
    const auto after = std::ranges::lower_bound(mocap.t_ns, t + latency_ns);
    if (after == mocap.t_ns.end()) continue;
    const auto k = static_cast<std::size_t>(after - mocap.t_ns.begin());
    if (*after == t + latency_ns) {
      attitudes.back() = attitude_of(mocap.columns, k).normalized();
    } else if (k > 0) {
      const auto step = static_cast<double>(*after - mocap.t_ns[k - 1]);
      const double share = static_cast<double>(t + latency_ns - mocap.t_ns[k - 1]) / step;
      if (step < pause_ns)
        attitudes.back() =
            attitude_of(mocap.columns, k - 1).normalized().slerp(share, attitude_of(mocap.columns, k).normalized());
    }
  }
  return attitudes;
}

/// Replaces the columns of digitised points by the angles of the wings, with the deviation, which the log has no place
/// for. `mocap`: the stream that shows the attitude where the points do not; or null.
void angles_of_points(Stream& s, const Stream* mocap, double latency_s) {
  const StreamMapping& m = s.mapping;
  if (m.points.empty()) return;
  std::vector<FilmedFrame> frames(s.t_ns.size());
  const Eigen::Quaterniond to_world = eigen_of(turn_of(m.world));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto at = [&](std::size_t point) { return place_of(s.columns, m.points[point], i); };
    frames[i].wings = {WingPoints{at(0), at(1), at(2)}, WingPoints{at(3), at(4), at(5)}};
    frames[i].attitude = to_world.conjugate() * m.attitude.conjugate();
  }
  Column residual;
  if (!m.markers.empty()) {
    pose_of_markers(s);
    residual = s.columns.at("residual_m");
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].attitude = attitude_of(s.columns, i);
      if (std::isnan(residual[i])) frames[i].attitude.reset();
    }
  } else if (mocap) {
    const auto attitudes = attitudes_at(s.t_ns, *mocap, latency_s);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].attitude = attitudes[i];
      if (attitudes[i]) frames[i].attitude = to_world.conjugate() * *attitudes[i];
    }
  }
  const FilmedWings wings = filmed_wings(frames, m.points, m.stroke_plane_rad, m.length_tolerance);
  if (2 * wings.swapped > wings.whole)
    m.table.table("points").fail("left_root",
                                 "\"" + m.points[0] + "\" is on the right of \"" + m.points[3] + "\" in " +
                                     std::to_string(wings.swapped) + " of " + std::to_string(wings.whole) + " frames",
                                 "left and right as the robot has them, and axes of the points as " +
                                     std::string(m.markers.empty() ? "world and attitude" : "markers") + " say");
  s.columns.clear();
  if (!residual.empty()) s.columns["residual_m"] = std::move(residual);
  for (const auto& [left, right] : wings.angles) {
    s.columns["left_stroke_rad"].push_back(left.stroke_rad);
    s.columns["left_rotation_rad"].push_back(left.rotation_rad);
    s.columns["right_stroke_rad"].push_back(right.stroke_rad);
    s.columns["right_rotation_rad"].push_back(right.rotation_rad);
    s.columns["deviation_rad"].push_back(std::max(std::abs(left.deviation_rad), std::abs(right.deviation_rad)));
  }
  s.faults = wings.faults;
  s.report.stroke_noise_rad = wings.stroke_noise_rad;
}

/// Length of the quaternion of sample `i`; 1 where the stream has none.
double length_of_rotation(const Stream& s, std::size_t i) {
  if (!s.columns.contains("qw")) return 1;
  double square = 0;
  for (const char* name : {"qw", "qx", "qy", "qz"}) square += std::pow(s.columns.at(name)[i], 2);
  return std::sqrt(square);
}

/// Times on the receiver's clock: the range in which most samples of all streams lie, and the part for the log.
struct Span {
  TimeRange recorded, flown;
};

Column seconds(const std::vector<std::int64_t>& t_ns, std::int64_t start_ns) {
  Column t_s;
  for (const std::int64_t t : t_ns) t_s.push_back(static_cast<double>(t - start_ns) / 1e9);
  return t_s;
}

bool has_none(const Stream& s, std::size_t i) {
  return !s.not_measured[i] &&
         std::ranges::all_of(s.columns, [&](const auto& column) { return std::isnan(column.second[i]); });
}

const std::string kBeyond = " is out of range";

/// InputError where more than kFew of a column is out of range.
void require_range(const Stream& s) {
  for (const auto& [name, column] : s.columns)
    if (const auto beyond = s.report.why_unusable.find(name + kBeyond);
        beyond != s.report.why_unusable.end() &&
        static_cast<double>(beyond->second) > kFew * static_cast<double>(s.t_ns.size())) {
      const std::string limit = io::shortest_digits(column_limit(name));
      s.mapping.table.table("columns").fail(name,
                                            "reaches " + io::shortest_digits(farthest(column)) + ": in another unit?",
                                            "numbers from -" + limit + " to " + limit);
    }
}

/// Why a sample cannot be used; empty where it can.
std::string fault_of(const Stream& s, std::size_t i, const Span& span) {
  if (s.t_ns[i] == kNoTime) return "no time";
  if (!span.recorded.contains(s.t_ns[i])) return "apart from the rest of the recording";
  if (!s.faults.empty() && !s.faults[i].empty()) return s.faults[i];
  if (const ColumnMapping* c = s.not_measured[i]) return c->fields.front() + " is not measured, as the message says";
  if (const auto residual = s.columns.find("residual_m");
      residual != s.columns.end() && std::isnan(residual->second[i]))
    return "no pose agrees with the markers";
  for (const auto& [name, column] : s.columns) {
    if (std::isnan(column[i])) return "lacks " + name;
    if (!std::isfinite(column[i])) return name + " is no finite number";
    if (std::abs(column[i]) > column_limit(name)) return name + kBeyond;
  }
  const double length = length_of_rotation(s, i);
  return std::abs(length - 1) <= kQuaternionTolerance ? "" : "quaternion of another length than 1";
}

/// Drops unusable samples and those at the time of another; sorts; counts reordered and lost ones. `sequence`: counts
/// of the samples, or null. `shared`: whether other streams use the channel.
void tidy(Stream& s, const std::vector<double>* sequence, const Span& span, bool shared) {
  // Many rows without any number belong to another stream of the channel; a few are faulty samples.
  constexpr double kOthersShare = 0.1;
  std::size_t none = 0;
  for (std::size_t i = 0; i < s.t_ns.size(); ++i) none += has_none(s, i);
  const bool has_others =
      shared && s.faults.empty() && static_cast<double>(none) > kOthersShare * static_cast<double>(s.t_ns.size());
  std::vector<std::size_t> rows;
  std::int64_t latest = kNoTime;
  for (std::size_t i = 0; i < s.t_ns.size(); ++i) {
    if (has_others && has_none(s, i)) continue;
    const bool recorded = s.t_ns[i] != kNoTime && span.recorded.contains(s.t_ns[i]);
    if (recorded && !span.flown.contains(s.t_ns[i])) continue;
    if (const std::string fault = fault_of(s, i, span); !fault.empty()) {
      ++s.report.unusable;
      ++s.report.why_unusable[fault];
      continue;
    }
    if (s.t_ns[i] < latest) ++s.report.reordered;
    latest = std::max(latest, s.t_ns[i]);
    rows.push_back(i);
  }
  require_range(s);
  std::ranges::stable_sort(rows, {}, [&](std::size_t i) { return s.t_ns[i]; });
  const auto again =
      std::unique(rows.begin(), rows.end(), [&](std::size_t i, std::size_t k) { return s.t_ns[i] == s.t_ns[k]; });
  s.report.twice = static_cast<std::size_t>(rows.end() - again);
  rows.erase(again, rows.end());
  const auto kept = [&](const auto& all) {
    std::remove_cvref_t<decltype(all)> some;
    for (const std::size_t i : rows) some.push_back(all[i]);
    return some;
  };
  s.t_ns = kept(s.t_ns);
  for (auto& [name, column] : s.columns) column = kept(column);
  s.report.samples = rows.size();
  if (rows.size() < 2) return;
  const StreamStatistics seen = stream_statistics(s.mapping.name, seconds(s.t_ns, s.t_ns.front()), 1);
  s.report.rate_hz = seen.rate_hz;
  s.report.lost = seen.missing;
  if (!sequence) return;
  s.report.lost = 0;
  const std::vector<double> counts = kept(*sequence);
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (const double steps = counts[i] - counts[i - 1]; steps > 1 && steps < 1e6)  // else the count was reset
      s.report.lost += static_cast<std::size_t>(steps) - 1;
}

/// Delays are relative to the clock's quickest message, lateness to the stream's: some sensors always take longer.
void count_delays(Stream& s, const Channel& channel, const ClockLine& quickest) {
  const std::vector<StampedReceipt> pairs = without_outliers(stamped_receipts(channel, s.mapping));
  if (pairs.empty()) return;
  const ClockLine own = ClockLine::below(pairs);
  std::vector<double> delays_s;
  for (const auto& [stamp, received] : pairs) {
    delays_s.push_back(1e-9 * static_cast<double>(received - quickest.received_ns(stamp)));
    s.report.late += 1e-9 * static_cast<double>(received - own.received_ns(stamp)) > s.mapping.late_s;
  }
  s.report.delay_most_s = *std::ranges::max_element(delays_s);
  s.report.delay_median_s = io::median(delays_s);
}

/// The range in which most samples of all streams lie, and the part of it in which the robot flew. InputError where
/// most samples of a stream lie outside the range.
Span span_of(const Channels& channels, const Mapping& mapping, const Clocks& clocks) {
  std::vector<std::int64_t> all;
  std::vector<std::pair<const StreamMapping*, TimeRange>> own;
  for (const StreamMapping& s : mapping.streams) {
    if (left_out(channels, s)) continue;
    std::vector<std::int64_t> times = timed(channel_of(channels, s, s.channel, "channel"), s, clocks).t_ns;
    std::erase(times, kNoTime);
    all.insert(all.end(), times.begin(), times.end());
    if (!times.empty()) own.emplace_back(&s, main_range(std::move(times)));
  }
  Span span{main_range(std::move(all)), {}};
  for (const auto& [s, range] : own)
    if (range.to_ns < span.recorded.from_ns || range.from_ns > span.recorded.to_ns)
      s->table.fail(s->table.has("clock") ? "clock" : "channel",
                    "\"" + s->channel + "\" was recorded " +
                        io::format("%.4g", 1e-9 * std::abs(static_cast<double>(range.from_ns) -
                                                           static_cast<double>(span.recorded.from_ns))) +
                        " s from the others",
                    "streams of one recording; another clock is named by clock, its offset by clocks.NAME.offset_s");
  const StreamMapping& command = mapping.streams.front();
  if (command.flown_fields.empty()) return span;
  const Channel& channel = channel_of(channels, command, command.channel, "channel");
  const std::vector<double>& says = field_of(channel, command.table.table("flown"), "field", command.flown_fields);
  const Timed times = timed(channel, command, clocks);
  std::swap(span.flown.from_ns, span.flown.to_ns);
  for (std::size_t i = 0; i < says.size(); ++i)
    if (std::isfinite(says[i]) && says[i] > command.flown_above && times.t_ns[i] != kNoTime &&
        span.recorded.contains(times.t_ns[i]))
      span.flown = {std::min(span.flown.from_ns, times.t_ns[i]), std::max(span.flown.to_ns, times.t_ns[i])};
  if (span.flown.from_ns >= span.flown.to_ns)
    command.table.table("flown").fail("above", "\"" + command.flown_fields.front() + "\" is never above it",
                                      "what it exceeds while the robot flies");
  return span;
}

/// "3 usable samples, 5 that are not (4 lacks x_m, 1 no time), and 2 at the time of another".
std::string usable(const StreamReport& report) {
  std::string text =
      std::to_string(report.samples) + " usable samples, " + std::to_string(report.unusable) + " that are not";
  if (report.unusable > 0) text += " (" + reasons(report) + ")";
  return text + ", and " + std::to_string(report.twice) + " at the time of another";
}

Stream read_stream(const Channels& channels, const StreamMapping& mapping, const Clocks& clocks, const Span& span,
                   bool shared, const FlightHeader& header, const Stream* mocap) {
  const Channel& channel = channel_of(channels, mapping, mapping.channel, "channel");
  if (!mapping.body.empty() && !channel.capture()) fail_without_capture(mapping);
  const bool timeless = all_missing(raw_times(channel, mapping)) && !channel.received_ns().empty();
  if (timeless && mapping.time == TimeOf::field)
    mapping.table.fail("time_field", "no sample has a time there",
                       "a field of numbers, or of dates as 2026-05-04T10:15:00, 04.05.2026 10:15:00");
  if (timeless)
    mapping.table.fail("time",
                       mapping.time == TimeOf::stamp ? "samples of this channel have no stamp"
                                                     : "samples of this channel do not say when they were received",
                       mapping.time == TimeOf::stamp ? "\"received\", or \"field\" with time_field"
                                                     : "\"stamp\", or \"field\" with time_field");
  const Timed own = timed(channel, mapping, clocks);
  Stream s{mapping, own.t_ns, {}, {}, std::vector<const ColumnMapping*>(own.t_ns.size()), {}, {}};
  s.report.stream = mapping.name;
  s.report.channel = mapping.channel;
  for (const ColumnMapping& c : mapping.columns) {
    Column column;
    if (!mapping.body.empty() || !mapping.markers.empty() || !mapping.points.empty()) {
      s.columns[c.column] = mapping.body.empty() ? field_of_marker(channel, mapping, c.fields)
                                                 : field_of_body(channel, mapping, c.fields.front());
      continue;
    }
    const io::Table columns = mapping.table.table("columns");
    const bool own_channel = c.channel == mapping.channel;
    const Channel& other = own_channel ? channel : channel_of(channels, mapping, c.channel, "from");
    if (own_channel) {
      column = field_of(channel, columns, c.column, c.fields);
    } else {
      const std::vector<double>& values = field_of(other, columns, c.column, c.fields);
      for (const std::size_t row : last_rows(own.t_ns, timed(other, mapping, clocks).t_ns))
        column.push_back(row < values.size() ? values[row] : std::numeric_limits<double>::quiet_NaN());
    }
    const double scale = scale_of(other, columns, c);
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (is_not_measured(column[i]) && !s.not_measured[i]) s.not_measured[i] = &c;
      column[i] = scale * column[i] + c.offset;
    }
    s.columns[c.column] = std::move(column);
  }
  if (mapping.time != TimeOf::received) count_delays(s, channel, clocks.quickest(mapping));
  derive_pitch(s, header.gravity_m_s2);
  turn_angles(s);
  turn_rotations(s);
  if (mapping.points.empty()) pose_of_markers(s);
  angles_of_points(s, mocap, header.mocap.latency_s);
  const std::string& counted = mapping.sequence;
  tidy(s, counted.empty() ? nullptr : &field_of(channel, mapping.table, "sequence", counted), span, shared);
  if (s.t_ns.size() < 2 && !is_optional(mapping))
    mapping.table.fail("channel", "\"" + mapping.channel + "\" has " + usable(s.report), "at least 2 usable ones");
  s.turn();
  return s;
}

/// The mean specific force of the IMU, m/s2, turned to W by the attitude `q` of each pose.
template <typename Attitude>
Eigen::Vector3d mean_force(const Stream& mocap, const Stream& imu, const Attitude& q) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const std::vector<std::size_t> rows = last_rows(imu.t_ns, mocap.t_ns);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i] < mocap.t_ns.size())
      sum += q(rows[i]) * Eigen::Vector3d(imu.columns.at("accel_x_m_s2")[i], imu.columns.at("accel_y_m_s2")[i],
                                          imu.columns.at("accel_z_m_s2")[i]);
  return sum / static_cast<double>(rows.size());
}

double tilt_of(const Eigen::Vector3d& force) { return std::atan2(force.head<2>().norm(), force.z()); }

/// InputError where the axes that the mapping gives a body of an export contradict gravity: over a flight, the specific
/// force in W is on average up, but for the change of speed by the flight's time.
void require_up(const Stream& mocap, const Stream& imu, double gravity_m_s2) {
  constexpr double kMaxTilt_rad = std::numbers::pi / 4;  // beyond, another axis is nearer to up
  constexpr double kMinPull = 0.5;  // share of gravity; a robot in free fall does not show up and down
  double size_m_s2 = 0;
  for (std::size_t i = 0; i < imu.t_ns.size(); ++i)
    size_m_s2 += std::hypot(imu.columns.at("accel_x_m_s2")[i], imu.columns.at("accel_y_m_s2")[i],
                            imu.columns.at("accel_z_m_s2")[i]) /
                 static_cast<double>(imu.t_ns.size());
  if (size_m_s2 < kMinPull * gravity_m_s2) return;
  const double tilt_rad = tilt_of(mean_force(mocap, imu, [&](std::size_t i) { return attitude_of(mocap.columns, i); }));
  if (tilt_rad < kMaxTilt_rad) return;
  const Eigen::Quaterniond world = eigen_of(turn_of(mocap.mapping.world)), axes = eigen_of(turn_of(mocap.mapping.axes));
  std::vector<std::string> fitting;
  for (const auto& [world_name, w] : {std::pair("enu", World::enu), std::pair("y_up", World::y_up)})
    for (const auto& [axes_name, a] : {std::pair("flu", Axes::flu), std::pair("frd", Axes::frd),
                                       std::pair("fur", Axes::fur), std::pair("luf", Axes::luf)}) {
      const auto turned = [&](std::size_t i) {
        return eigen_of(turn_of(w)) * world.conjugate() * attitude_of(mocap.columns, i) * axes.conjugate() *
               eigen_of(turn_of(a));
      };
      if (tilt_of(mean_force(mocap, imu, turned)) < kMaxTilt_rad)
        fitting.push_back(std::string("world = \"") + world_name + "\" with frame = \"" + axes_name + "\"");
    }
  mocap.mapping.table.fail(
      mocap.mapping.says_world ? "world" : "channel",
      "the mean force on the IMU points " + io::format("%.0f", tilt_rad * 180 / std::numbers::pi) +
          " degrees away from up",
      "axes of the recording; by the IMU fit " + (fitting.empty() ? "none" : io::joined(fitting, " or ")));
}

void put(FlightLog& log, Stream& s, std::int64_t start_ns) {
  const Column t_s = seconds(s.t_ns, start_ns);
  const double rate_hz = s.report.rate_hz;
  Columns& c = s.columns;
  if (s.mapping.name == "command") {
    CommandStream& to = log.command;
    to.t_s = t_s;
    for (const std::string& name : log.header.inputs) to.declared.push_back(c[name]);
    if (!log.header.inputs.empty()) return;
    to = {t_s, c["left_voltage_V"], c["right_voltage_V"], {}, {}};
    if (c.contains("amplitude_V"))
      to.inputs = BeatInputs{c["amplitude_V"], c["difference_V"], c["bias_V"], c["split_cycle"]};
    if (c.contains("phase_rad")) to.phase_rad = c["phase_rad"];
  } else if (s.mapping.name == "mocap") {
    log.mocap = {t_s, c["x_m"], c["y_m"], c["z_m"], c["qw"], c["qx"], c["qy"], c["qz"]};
    if (s.mapping.measures_rate) log.header.mocap.rate_hz = rate_hz;
  } else if (s.mapping.name == "imu") {
    log.imu = {t_s,
               c["gyro_x_rad_s"],
               c["gyro_y_rad_s"],
               c["gyro_z_rad_s"],
               c["accel_x_m_s2"],
               c["accel_y_m_s2"],
               c["accel_z_m_s2"]};
    if (s.mapping.measures_rate) log.header.imu.rate_hz = rate_hz;
  } else if (s.mapping.name == "power") {
    log.power = PowerStream{t_s, c["battery_V"], c["left_current_A"], c["right_current_A"]};
    if (s.mapping.measures_rate) log.header.power->rate_hz = rate_hz;
  } else if (s.mapping.name == "attitude") {
    log.attitude = AttitudeStream{t_s, c["qw"], c["qx"], c["qy"], c["qz"]};
    if (s.mapping.measures_rate) log.header.attitude->rate_hz = rate_hz;
  } else if (s.mapping.name == "rig") {
    log.forces = ForcesStream{
        t_s, c["force_x_N"], c["force_y_N"], c["force_z_N"], c["moment_x_Nm"], c["moment_y_Nm"], c["moment_z_Nm"]};
    if (s.mapping.measures_rate) log.header.rig->rate_hz = rate_hz;
  } else if (s.mapping.name == "policy") {
    log.policy.emplace().t_s = t_s;
    for (const std::string& name : log.header.policy) log.policy->numbers.push_back(c[name]);
  } else {
    log.wings =
        WingsStream{t_s, c["left_stroke_rad"], c["left_rotation_rad"], c["right_stroke_rad"], c["right_rotation_rad"]};
    if (s.mapping.measures_rate) log.header.wings->rate_hz = rate_hz;
  }
}

}  // namespace

Imported assemble(const Channels& channels, const Mapping& mapping) {
  const Clocks clocks(channels, mapping);
  std::vector<Stream> streams;
  streams.reserve(mapping.streams.size());
  Imported out;
  out.log.header = mapping.header;
  const Span span = span_of(channels, mapping, clocks);
  for (const StreamMapping& s : mapping.streams) {
    std::string why;
    if (!left_out(channels, s)) {
      const bool shared = std::ranges::count(mapping.streams, s.channel, &StreamMapping::channel) > 1;
      const auto mocap = std::ranges::find(streams, "mocap", [](const Stream& other) { return other.mapping.name; });
      Stream stream =
          read_stream(channels, s, clocks, span, shared, mapping.header, mocap == streams.end() ? nullptr : &*mocap);
      if (stream.t_ns.size() >= 2) {
        for (const std::string& note : stream.notes) out.report.warnings.push_back(s.name + ": " + note);
        if (stream.columns.contains("residual_m")) stream.report.residual_m = stream.columns.at("residual_m");
        if (stream.columns.contains("deviation_rad")) stream.report.deviation_rad = stream.columns.at("deviation_rad");
        if (stream.report.unusable > 0)
          out.report.warnings.push_back(s.name + ": " + std::to_string(stream.report.unusable) +
                                        " samples are unusable: " + reasons(stream.report));
        streams.push_back(std::move(stream));
        continue;
      }
      why = " has " + usable(stream.report);
    } else {
      why = channels.find(s.channel) ? " has no samples" : " is not recorded";
    }
    out.report.warnings.push_back(s.name + ": " + s.channel + why + ": done without");
    if (s.name == "power") out.log.header.power.reset();
    else if (s.name == "wings") out.log.header.wings.reset();
    else if (s.name == "policy") out.log.header.policy.clear();
    else out.log.header.attitude.reset();
  }
  const auto imu = std::ranges::find(streams, "imu", [](const Stream& s) { return s.mapping.name; });
  for (const Stream& s : streams)
    if ((!s.mapping.body.empty() || !s.mapping.markers.empty()) && imu != streams.end())
      require_up(s, *imu, mapping.header.gravity_m_s2);
  out.report.clocks = clocks.reports();
  if (mapping.from_first) {
    out.report.start_ns = streams.front().t_ns.front();
    for (const Stream& s : streams) out.report.start_ns = std::min(out.report.start_ns, s.t_ns.front());
  }
  for (Stream& s : streams) {
    put(out.log, s, out.report.start_ns);
    out.report.streams.push_back(s.report);
  }
  return out;
}

std::string report_text(const ImportReport& report) {
  std::string text;
  char line[256];
  const auto add = [&](const char* format, auto... values) {
    std::snprintf(line, sizeof line, format, values...);
    text += line;
  };
  add("  %-8s %9s %9s %6s %6s %6s %6s %8s  %21s  %s\n", "stream", "samples", "Hz", "never", "twice", "late", "order",
      "unusable", "delay ms, median most", "channel");
  for (const StreamReport& s : report.streams)
    add("  %-8s %9zu %9.2f %6zu %6zu %6zu %6zu %8zu  %12.3f %8.3f  %s\n", s.stream.c_str(), s.samples, s.rate_hz,
        s.lost, s.twice, s.late, s.reordered, s.unusable, 1e3 * s.delay_median_s, 1e3 * s.delay_most_s,
        s.channel.c_str());
  for (const StreamReport& s : report.streams)
    if (!s.residual_m.empty())
      add("  markers: residual %.3f mm median, %.3f mm most\n", 1e3 * io::median(s.residual_m),
          1e3 * *std::ranges::max_element(s.residual_m));
  for (const StreamReport& s : report.streams)
    if (!s.deviation_rad.empty())
      add("  wings: deviation, which the log leaves out, %.4f rad median, %.4f rad most; noise of the stroke %.4f rad, "
          "by the "
          "scatter of the wings' length\n",
          io::median(s.deviation_rad), *std::ranges::max_element(s.deviation_rad), s.stroke_noise_rad);
  for (const ClockReport& c : report.clocks) {
    if (c.name == kReceiver) {
      const bool odd = c.offset_s < 0 || c.offset_s > kOddOffset_s;
      add("  stamps of the receiver's clock: the quickest of %zu came %.6f s later%s\n", c.stamps, c.offset_s,
          odd ? ", so they may be of another clock" : "");
      continue;
    }
    add("  clock %s: the receiver's is ahead by %.6f s", c.name.c_str(), c.offset_s);
    if (c.measured) add(", drifting by %.1f us/s, by %zu stamps over %.1f s\n", 1e6 * c.drift, c.stamps, c.span_s);
    else text += ", as the mapping says\n";
  }
  return text;
}

void place_markers(Mapping& mapping, std::vector<std::string>& warnings) {
  for (StreamMapping& s : mapping.streams) {
    if (!s.at_rest) continue;
    Wanted wanted;
    for (const ColumnMapping& c : s.columns) wanted[kOnlyChannel].insert(c.fields.begin(), c.fields.end());
    Channels channels(wanted);
    read_source(s.at_rest->file, channels, warnings);
    const Channel& channel = channel_of(channels, s, kOnlyChannel, "markers");
    const Eigen::Vector3d origin(s.at_rest->position_m[0], s.at_rest->position_m[1], s.at_rest->position_m[2]);
    const Eigen::Quaterniond attitude = exponential({0, 0, s.at_rest->yaw_rad});
    s.marker_places_m.clear();
    for (const std::string& name : s.markers) {
      std::array<double, 3> middle = {};
      for (std::size_t k = 0; k < 3; ++k) {
        std::vector<double> values = field_of_marker(channel, s, point_fields(name, k));
        std::erase_if(values, [](double value) { return !std::isfinite(value); });
        if (values.empty()) s.table.fail("markers", "\"" + name + "\" is never seen at rest", "markers that are");
        middle[k] = io::median(values);
      }
      const Eigen::Vector3d place = eigen_of(turn_of(s.world)) * Eigen::Vector3d(middle[0], middle[1], middle[2]);
      const Eigen::Vector3d in_body = attitude.conjugate() * (place - origin);
      s.marker_places_m.push_back({in_body.x(), in_body.y(), in_body.z()});
    }
  }
}

Imported import_recording(const std::vector<std::filesystem::path>& files, const Mapping& given,
                          const std::filesystem::path& out) {
  Mapping mapping = given;
  Channels channels(mapping.wanted(), mapping.wanted_times());
  std::vector<std::string> warnings;
  const auto log_warnings = [&] {
    for (const std::string& warning : warnings) io::log(io::LogLevel::warning, warning);
  };
  Imported imported;
  try {
    place_markers(mapping, warnings);
    for (const std::filesystem::path& file : files) read_source(file, channels, warnings);
    imported = assemble(channels, mapping);
  } catch (const io::InputError&) {
    log_warnings();  // warnings may explain why something is missing
    throw;
  }
  for (const std::string& warning : imported.report.warnings)
    warnings.push_back(mapping.file.string() + ": " + warning);
  for (std::string& warning : warnings) warning = io::printable(warning);  // JSON must be UTF-8
  log_warnings();
  imported.report.warnings = std::move(warnings);
  write_flight_log(out, imported.log);
  return imported;
}

nlohmann::ordered_json json_of(const ImportReport& report) {
  using Json = nlohmann::ordered_json;
  Json streams = Json::array(), clocks = Json::array();
  for (const StreamReport& s : report.streams) {
    streams.push_back({{"name", s.stream},
                       {"channel", s.channel},
                       {"samples", s.samples},
                       {"rate_hz", s.rate_hz},
                       {"never", s.lost},
                       {"twice", s.twice},
                       {"late", s.late},
                       {"out_of_order", s.reordered},
                       {"unusable", s.unusable},
                       {"why_unusable", s.why_unusable},
                       {"delay_median_s", s.delay_median_s},
                       {"delay_most_s", s.delay_most_s}});
    if (!s.residual_m.empty()) streams.back()["residual_m"] = s.residual_m;
    if (!s.deviation_rad.empty())
      streams.back()["deviation_rad"] = s.deviation_rad, streams.back()["stroke_noise_rad"] = s.stroke_noise_rad;
  }
  for (const ClockReport& c : report.clocks)
    clocks.push_back({{"name", c.name},
                      {"offset_s", c.offset_s},
                      {"drift", c.drift},
                      {"measured", c.measured},
                      {"stamps", c.stamps},
                      {"span_s", c.span_s}});
  return {{"start_ns", report.start_ns}, {"streams", streams}, {"clocks", clocks}, {"warnings", report.warnings}};
}

}  // namespace flappy::flightlog
