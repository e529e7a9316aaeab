#include "flightlog/import/mapping.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flappy::flightlog {
namespace {

using io::non_negative;
using io::positive;
using Names = std::vector<std::string>;

struct StreamKeys {
  std::string name;
  Names columns, optional_columns, declared;
  bool has_frame, has_world;
  bool has_rate = true;
};

const std::vector<StreamKeys> kStreams = {
    {"command",
     {"left_voltage_V", "right_voltage_V"},
     {"amplitude_V", "difference_V", "bias_V", "split_cycle", "phase_rad"},
     {},
     false,
     false,
     false},
    {"mocap",
     {"x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"},
     {},
     {"latency_s", "position_noise_m", "attitude_noise_rad"},
     true,
     true},
    {"imu",
     {"gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2"},
     {},
     {"latency_s", "bandwidth_hz", "position_m", "gyro_noise_rad_s", "gyro_bias_sd_rad_s", "accel_noise_m_s2"},
     true,
     false},
    {"power",
     {"battery_V", "left_current_A", "right_current_A"},
     {},
     {"battery_nominal_V", "latency_s", "voltage_noise_V", "current_noise_A"},
     false,
     false},
    {"rig",
     {"force_x_N", "force_y_N", "force_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm"},
     {},
     {"support", "latency_s", "position_m", "attitude", "force_noise_N", "moment_noise_Nm", "resonance_hz"},
     false,
     false},
    {"wings",
     {"left_stroke_rad", "left_rotation_rad", "right_stroke_rad", "right_rotation_rad"},
     {},
     {"noise_rad"},
     false,
     false},
    {"attitude", {"qw", "qx", "qy", "qz"}, {}, {"latency_s", "noise_rad"}, true, true},
    {"policy", {}, {}, {"numbers"}, false, false, false},
};
constexpr double kUnitTolerance = 1e-3;  // a quaternion may be longer or shorter than 1 by so much, as in flight.toml
const Names kAngles = {"roll_rad", "pitch_rad", "yaw_rad"};
const Names kRotations = {"vector", "xyz", "xzy", "yxz", "yzx", "zxy", "zyx"};
/// In place of the pitch: acceleration in W, without gravity.
const Names kAcceleration = {"acceleration_x_m_s2", "acceleration_y_m_s2", "acceleration_z_m_s2"};

/// A stream's keys, reduced or replaced as its table says: declared inputs, no gyro, no currents, angles.
StreamKeys narrowed(StreamKeys keys, const io::Table& table, bool declared_inputs) {
  const auto drop = [](Names& names, std::string_view part) {
    std::erase_if(names, [&](const std::string& name) { return name.find(part) != std::string::npos; });
  };
  if (keys.name == "command" && declared_inputs) keys.columns = read_inputs(table), keys.optional_columns.clear();
  if (keys.name == "policy") keys.columns = read_policy_numbers(table);
  if (keys.name == "imu" && !read_gyro(table, declared_inputs)) drop(keys.columns, "gyro"), drop(keys.declared, "gyro");
  if (keys.name == "power" && !read_currents(table, declared_inputs))
    drop(keys.columns, "current"), drop(keys.declared, "current");
  if (!keys.has_world) return keys;
  if (keys.name == "mocap" && read_pose_source(table, declared_inputs) == PoseSource::estimate_without_pitch) {
    keys.columns = {"x_m", "y_m", "z_m", "roll_rad", "yaw_rad"};
    keys.columns.insert(keys.columns.end(), kAcceleration.begin(), kAcceleration.end());
    keys.has_frame = keys.has_world = false;
    return keys;
  }
  if (keys.name == "mocap" && (table.has("body") || table.has("markers"))) {
    keys.columns.clear();
    return keys;
  }
  const auto columns = table.optional_table("columns");
  if (columns && std::ranges::any_of(kAngles, [&](const std::string& name) { return columns->has(name); })) {
    std::erase_if(keys.columns, [](const std::string& name) { return name.starts_with('q'); });
    keys.columns.insert(keys.columns.end(), kAngles.begin(), kAngles.end());
  }
  return keys;
}

/// A name, or several of which a recording has one.
FieldNames read_field(const io::Table& table, const std::string& key) {
  if (!table.is_array(key)) return {table.string(key)};
  FieldNames names = table.strings(key);
  if (names.empty()) table.fail(key, "is empty", "names of fields");
  return names;
}

/// The columns of a rigid body, whose fields the program's reader names.
void read_body(StreamMapping& stream) {
  const io::Table& table = stream.table;
  stream.body = table.string("body");
  if (table.has("rotation")) stream.rotation = table.choice("rotation", kRotations);
  Names columns = {"x_m", "y_m", "z_m"};
  for (const char* name : {"qw", "qx", "qy", "qz"})
    if (stream.rotation.empty()) columns.emplace_back(name);
  for (const char* name : {"rx_rad", "ry_rad", "rz_rad"})
    if (!stream.rotation.empty()) columns.emplace_back(name);
  for (const std::string& name : columns) stream.columns.push_back({name, stream.channel, {stream.body + "." + name}});
}

/// The three columns of a point, which a table may call by any of several fields.
void add_point(StreamMapping& stream, const std::string& name) {
  for (const std::size_t axis : {0, 1, 2})
    stream.columns.push_back({name + kPointAxes[axis], stream.channel, point_fields(name, axis)});
}

/// The places of markers, which are fields of their own.
void read_markers(StreamMapping& stream) {
  const io::Table& table = stream.table;
  stream.tolerance_m = table.number_or("tolerance_m", stream.tolerance_m, positive(1));
  if (stream.says_axes) table.fail("frame", "is given with markers, whose places are in B", "no frame");
  if (table.is_table("markers")) {
    const io::Table markers = table.table("markers");
    stream.markers = markers.keys();
    for (const std::string& name : stream.markers) stream.marker_places_m.push_back(markers.numbers(name, 3));
    if (table.has("at_rest")) table.fail("at_rest", "is given with places of markers", "one of the two");
  } else {
    stream.markers = table.strings("markers");
    const io::Table rest = table.table("at_rest");
    rest.accept({"file", "position_m", "yaw_rad"});
    stream.at_rest = AtRest{rest.file("file"), rest.numbers("position_m", 3), rest.number_or("yaw_rad", 0)};
  }
  if (stream.markers.size() < 3)
    table.fail("markers", "has " + std::to_string(stream.markers.size()) + " markers",
               "at least 3 that are not in one line");
  for (const std::string& name : stream.markers) add_point(stream, name);
}

/// Digitised points of the wings, and of the body where the mapping has markers.
void read_points(StreamMapping& stream, bool clamped) {
  const io::Table& table = stream.table;
  const io::Table points = table.table("points");
  points.accept({kWingPoints.begin(), kWingPoints.end()});
  for (const char* key : kWingPoints) {
    const std::string name = points.string(key);
    if (const auto used = std::ranges::find(stream.points, name); used != stream.points.end())
      points.fail(
          key, "\"" + name + "\" is " + kWingPoints[static_cast<std::size_t>(used - stream.points.begin())] + ", too",
          "six points");
    stream.points.push_back(name);
  }
  stream.stroke_plane_rad = table.number_or("stroke_plane_rad", 0, {-std::numbers::pi / 2, std::numbers::pi / 2});
  stream.length_tolerance = table.number_or("length_tolerance", stream.length_tolerance, positive(1));
  if (table.has("markers")) {
    if (table.has("attitude")) table.fail("attitude", "is given with markers, which show it", "one of the two");
    read_markers(stream);
  } else if (table.has("attitude")) {
    if (!clamped) table.fail("attitude", "is given for a robot that flies", "markers, or none: that of mocap");
    const std::vector<double> q = table.numbers("attitude", 4);
    stream.attitude = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    if (std::abs(stream.attitude.norm() - 1) > kUnitTolerance)
      table.fail("attitude", "has another length than 1", "a quaternion w, x, y, z of length 1");
    stream.attitude.normalize();
  }
  for (const std::string& name : stream.points)
    if (std::ranges::find(stream.markers, name) == stream.markers.end()) add_point(stream, name);
}

void read_columns(const StreamKeys& keys, StreamMapping& stream) {
  const io::Table& table = stream.table;
  Names known = keys.columns;
  known.insert(known.end(), keys.optional_columns.begin(), keys.optional_columns.end());
  const io::Table columns = table.table("columns");
  columns.accept(known);
  const auto scale = table.optional_table("scale"), offset = table.optional_table("offset"),
             from = table.optional_table("from");
  for (const auto* part : {&scale, &offset, &from})
    if (*part) (*part)->accept(known);
  for (const std::string& name : known) {
    if (std::ranges::find(keys.columns, name) == keys.columns.end() && !columns.has(name)) {
      for (const auto* part : {&scale, &offset, &from})
        if (*part && (*part)->has(name)) (*part)->fail(name, "has no such column", "columns of " + columns.path());
      continue;
    }
    ColumnMapping column{name, stream.channel, read_field(columns, name)};
    if (scale && scale->has(name)) column.scale = scale->number(name);
    if (offset) column.offset = offset->number_or(name, 0);
    if (from) column.channel = from->string_or(name, stream.channel);
    stream.columns.push_back(std::move(column));
  }
  Names given, missing;
  if (!keys.optional_columns.empty())
    for (const char* input : {"amplitude_V", "difference_V", "bias_V", "split_cycle"})
      (columns.has(input) ? given : missing).emplace_back(input);
  if (!given.empty() && !missing.empty())
    columns.fail(given.front(), "is given without " + io::joined(missing), "all four inputs of the wing beat, or none");
}

StreamMapping read_stream(const StreamKeys& all_keys, const io::Table& table, bool declared_inputs, bool clamped) {
  const StreamKeys keys = narrowed(all_keys, table, declared_inputs);
  Names accepted = {"channel",  "time",    "time_field", "time_unit", "clock", "late_s",
                    "sequence", "columns", "scale",      "offset",    "from",  "frame_rate_hz"};
  accepted.insert(accepted.end(), keys.declared.begin(), keys.declared.end());
  if (keys.has_frame) accepted.emplace_back("frame");
  if (keys.has_world) accepted.emplace_back("world");
  if (keys.has_rate) accepted.emplace_back("rate_hz");
  if (keys.name == "command") accepted.insert(accepted.end(), {"inputs", "flown"});
  if (keys.name == "mocap")
    accepted.insert(accepted.end(), {"source", "body", "rotation", "markers", "tolerance_m", "at_rest", "unit_m"});
  if (keys.name == "wings")
    accepted.insert(accepted.end(), {"points", "markers", "tolerance_m", "at_rest", "unit_m", "attitude", "world",
                                     "stroke_plane_rad", "length_tolerance"});
  if (keys.name == "imu") accepted.emplace_back("gyro");
  if (keys.name == "power") accepted.emplace_back("currents");
  table.accept(accepted);
  StreamMapping s{.name = keys.name, .table = table};
  if (const auto flown = keys.name == "command" ? table.optional_table("flown") : std::nullopt) {
    s.flown_fields = read_field(*flown, "field");
    s.flown_above = flown->number("above");
  }
  s.channel = table.string("channel");
  const std::string time = table.choice_or("time", "stamp", {"stamp", "received", "field", "frame"});
  s.time = time == "stamp" ? TimeOf::stamp : time == "received" ? TimeOf::received : TimeOf::field;
  if (time == "frame") {
    s.time_fields = {kFrame};
    s.time_unit_ns = 1e9 / table.number("frame_rate_hz", {1e-3, 1e6});
    for (const char* key : {"time_field", "time_unit"})
      if (table.has(key)) table.fail(key, "is given with time = \"frame\"", "frame_rate_hz alone");
  } else if (s.time == TimeOf::field) {
    s.time_fields = read_field(table, "time_field");
    if (s.time_fields.size() > 2)
      table.fail("time_field", "has more than two fields", "a field, or one of the date and one of the time of day");
    const bool said = table.has("time_unit");
    const std::string unit = table.choice_or("time_unit", "s", {"s", "ms", "us", "ns"});
    if (said) s.time_unit_ns = unit == "s" ? 1e9 : unit == "ms" ? 1e6 : unit == "us" ? 1e3 : 1;
  } else {
    for (const char* key : {"time_field", "time_unit"})
      if (table.has(key)) table.fail(key, "is given with time = \"" + time + "\"", "time = \"field\"");
  }
  if (time != "frame" && table.has("frame_rate_hz"))
    table.fail("frame_rate_hz", "is given with time = \"" + time + "\"", "time = \"frame\"");
  s.clock = table.string_or("clock", kReceiver);
  if (s.time == TimeOf::received && s.clock != kReceiver)
    table.fail("clock", "\"" + s.clock + "\" is not the clock of times of receipt",
               "\"" + kReceiver + "\", or time = \"stamp\"");
  s.late_s = table.number_or("late_s", s.late_s, positive(1e3));
  s.sequence = table.string_or("sequence", "");
  const bool captured = keys.name == "mocap";
  if (keys.has_frame) {
    s.says_axes = table.has("frame");
    const std::string axes =
        table.choice_or("frame", "flu", captured ? Names{"flu", "frd", "fur", "luf"} : Names{"flu", "frd"});
    s.axes = axes == "flu" ? Axes::flu : axes == "frd" ? Axes::frd : axes == "fur" ? Axes::fur : Axes::luf;
  }
  const bool filmed = keys.name == "wings";
  if (keys.has_world || (filmed && table.has("points"))) {
    s.says_world = table.has("world");
    Names worlds = {"enu", "ned", "ned_x_north"};
    if (captured || filmed) worlds.emplace_back("y_up");
    const std::string world = table.choice_or("world", "enu", worlds);
    s.world = world == "enu"    ? World::enu
              : world == "ned"  ? World::ned
              : world == "y_up" ? World::y_up
                                : World::ned_x_north;
  }
  s.measures_rate = keys.has_rate && !table.has("rate_hz");
  const char* instead = filmed                 ? (table.has("points") ? "points" : "")
                        : !captured            ? ""
                        : table.has("body")    ? "body"
                        : table.has("markers") ? "markers"
                                               : "";
  if (*instead != 0)
    for (const char* key : {"columns", "scale", "offset", "from"})
      if (table.has(key)) table.fail(key, "is given with " + std::string(instead), "one of the two");
  const auto only_with = [&](const std::string& other, const Names& names) {
    for (const std::string& key : names)
      if (table.has(key) && !table.has(other)) table.fail(key, "is given without " + other, other);
  };
  if (instead == std::string_view("body") && table.has("markers"))
    table.fail("markers", "is given with body", "one of the two");
  if (captured) only_with("body", {"rotation"});
  if (captured) only_with("markers", {"unit_m"});
  if (captured || filmed) only_with("markers", {"at_rest", "tolerance_m"});
  if (filmed) only_with("points", {"unit_m", "markers", "attitude", "world", "stroke_plane_rad", "length_tolerance"});
  if ((captured || filmed) && table.has("unit_m")) s.unit_m = table.number("unit_m", positive(1e3));
  if (instead == std::string_view("body")) read_body(s);
  else if (instead == std::string_view("markers")) read_markers(s);
  else if (instead == std::string_view("points")) read_points(s, clamped);
  else read_columns(keys, s);
  return s;
}

/// Reads the declared values of flight.toml; a rate that is left out is 0 until it is measured.
void read_declared(const io::Table& root, FlightHeader& h) {
  const io::Range rate = positive(1e6), latency = non_negative(10);
  const auto rate_of = [&](const io::Table& table) { return table.number_or("rate_hz", 0, rate); };
  const bool declared = !h.inputs.empty();
  const auto rig = root.optional_table("rig");
  if (rig) {
    h.rig = read_rig(*rig);
    h.rig->rate_hz = rate_of(*rig);
  }
  if (!rig) {
    const io::Table mocap = root.table("mocap");
    h.mocap = {rate_of(mocap), mocap.number("latency_s", latency), mocap.number("position_noise_m", non_negative(1)),
               mocap.number("attitude_noise_rad", non_negative(1)), read_pose_source(mocap, declared)};
  }
  if (!rig && (!declared || root.has("imu"))) {
    const io::Table imu = root.table("imu");
    h.imu.rate_hz = rate_of(imu);
    h.imu.latency_s = imu.number("latency_s", latency);
    h.imu.bandwidth_hz = imu.number("bandwidth_hz", rate);
    std::ranges::copy(imu.numbers("position_m", 3, {-1, 1}), h.imu.position_m.begin());
    h.imu.accel_noise_m_s2 = imu.number("accel_noise_m_s2", non_negative(1e3));
    h.imu.gyro = read_gyro(imu, declared);
    if (h.imu.gyro) {
      h.imu.gyro_noise_rad_s = imu.number("gyro_noise_rad_s", non_negative(10));
      std::ranges::copy(imu.numbers("gyro_bias_sd_rad_s", 3, non_negative(10)), h.imu.gyro_bias_sd_rad_s.begin());
    }
  }
  if (const auto power = root.optional_table("power")) {
    h.power = {power->number("battery_nominal_V", positive(100)), rate_of(*power), power->number("latency_s", latency),
               power->number("voltage_noise_V", non_negative(10))};
    h.power->currents = read_currents(*power, declared);
    if (h.power->currents) h.power->current_noise_A = power->number("current_noise_A", non_negative(10));
  }
  if (const auto attitude = root.optional_table("attitude"))
    h.attitude = {rate_of(*attitude), attitude->number("latency_s", latency),
                  attitude->number("noise_rad", non_negative(1))};
  if (const auto wings = root.optional_table("wings"))
    h.wings = {rate_of(*wings), wings->number("noise_rad", non_negative(1))};
  if (const auto policy = root.optional_table("policy")) h.policy = read_policy_numbers(*policy);
}

}  // namespace

FieldNames point_fields(const std::string& name, std::size_t axis) {
  FieldNames fields;
  const char small = "xyz"[axis], large = "XYZ"[axis];
  fields.push_back(name + kPointAxes[axis]);
  for (const char* between : {"_", "."})
    for (const char letter : {large, small}) fields.push_back(name + between + letter);
  return fields;
}

Wanted Mapping::wanted() const {
  Wanted wanted;
  for (const StreamMapping& s : streams) {
    std::set<std::string>& own = wanted[s.channel];
    own.insert(s.time_fields.begin(), s.time_fields.end());
    if (!s.sequence.empty()) own.insert(s.sequence);
    own.insert(s.flown_fields.begin(), s.flown_fields.end());
    for (const ColumnMapping& c : s.columns) {
      wanted[c.channel].insert(c.fields.begin(), c.fields.end());
      wanted[c.channel].insert(s.time_fields.begin(), s.time_fields.end());
    }
  }
  return wanted;
}

Wanted Mapping::wanted_times() const {
  Wanted times;
  for (const StreamMapping& s : streams) {
    times[s.channel].insert(s.time_fields.begin(), s.time_fields.end());
    for (const ColumnMapping& c : s.columns) times[c.channel].insert(s.time_fields.begin(), s.time_fields.end());
  }
  return times;
}

Mapping read_mapping(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const io::Config config = io::Config::load(path, overrides);
  const io::Table root = config.root();
  root.schema(1);
  Names accepted = {"schema", "vehicle", "vehicle_sha256", "flapping_Hz", "gravity_m_s2",
                    "start",  "ambient", "clocks",         "dds",         "session"};
  for (const StreamKeys& keys : kStreams) accepted.push_back(keys.name);
  root.accept(accepted);
  Mapping m;
  m.file = path;
  FlightHeader& h = m.header;
  h.vehicle = read_vehicle_name(root);
  h.session = root.string_or("session", "");
  h.vehicle_sha256 = root.string_or("vehicle_sha256", "");
  const io::Table command = root.table("command");
  if (command.has("inputs")) h.inputs = read_inputs(command);
  h.flapping_Hz = read_flapping(root, h.inputs);
  h.gravity_m_s2 = root.number("gravity_m_s2", non_negative(100));
  m.from_first = root.choice_or("start", "first", {"first", "clock"}) == "first";
  h.ambient = read_ambient(root.table("ambient"));
  for (const StreamKeys& keys : kStreams) {
    const bool declared = !h.inputs.empty(), flies = !root.has("rig");
    const bool needed =
        keys.name == "command" || (flies && (keys.name == "mocap" || (keys.name == "imu" && !declared)));
    if (!flies && root.has(keys.name))
      for (const char* other : {"mocap", "imu", "attitude", "policy"})
        if (keys.name == other) root.fail(keys.name, "is of a robot that flies", "[rig] without it, or none");
    if (!needed && !root.has(keys.name)) continue;
    m.streams.push_back(read_stream(keys, root.table(keys.name), declared, !flies));
  }
  read_declared(root, h);
  m.dds = io::read_dds_config(root);
  if (const auto clocks = root.optional_table("clocks"))
    for (const std::string& name : clocks->keys()) {
      const bool used = std::ranges::find(m.streams, name, &StreamMapping::clock) != m.streams.end();
      if (!used || name == kReceiver) clocks->fail(name, "is no clock of a stream", "names that clock = \"...\" has");
      const io::Table clock = clocks->table(name);
      clock.accept({"offset_s"});
      if (clock.has("offset_s")) m.offsets_s[name] = clock.number("offset_s", {-4e9, 4e9});
    }
  root.finish();
  return m;
}

}  // namespace flappy::flightlog
