#include "flightlog/flight_log.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "io/config.hpp"
#include "io/csv.hpp"
#include "io/toml_writer.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;
using namespace log_file;
using io::non_negative;
using io::positive;
using io::shortest_digits;

constexpr double kUnitTolerance = 1e-3;

/// A column and the largest absolute value accepted: what a vehicle file and a flight may bring about. Improbable values
/// are left to the checks.
template <class Stream>
struct Field {
  const char* name;
  Column Stream::*column;
  double limit;
};

constexpr double kLatest = 1e10;  // s; allows clocks that count from 1970
constexpr double kMaxRemembered = 1e30;
constexpr double kMax_V = 1e3, kMax_A = 1e7, kMax_rad_s = 1e6, kMax_m_s2 = 1e9;
const std::vector<Field<CommandStream>> kCommandFields = {{"t_s", &CommandStream::t_s, kLatest},
                                                          {"left_voltage_V", &CommandStream::left_voltage_V, kMax_V},
                                                          {"right_voltage_V", &CommandStream::right_voltage_V, kMax_V}};
const std::vector<Field<BeatInputs>> kInputFields = {{"amplitude_V", &BeatInputs::amplitude_V, kMax_V},
                                                     {"difference_V", &BeatInputs::difference_V, kMax_V},
                                                     {"bias_V", &BeatInputs::bias_V, kMax_V},
                                                     {"split_cycle", &BeatInputs::split_cycle, 0.5}};
const std::string kPhase = "phase_rad";
constexpr double kPhaseLimit = 1e9, kInputLimit = 1e6;
const std::vector<Field<MocapStream>> kMocapFields = {
    {"t_s", &MocapStream::t_s, kLatest}, {"x_m", &MocapStream::x_m, 1e6}, {"y_m", &MocapStream::y_m, 1e6},
    {"z_m", &MocapStream::z_m, 1e6},     {"qw", &MocapStream::qw, 2},     {"qx", &MocapStream::qx, 2},
    {"qy", &MocapStream::qy, 2},         {"qz", &MocapStream::qz, 2}};
const std::vector<Field<ImuStream>> kImuFields = {{"t_s", &ImuStream::t_s, kLatest},
                                                  {"gyro_x_rad_s", &ImuStream::gyro_x_rad_s, kMax_rad_s},
                                                  {"gyro_y_rad_s", &ImuStream::gyro_y_rad_s, kMax_rad_s},
                                                  {"gyro_z_rad_s", &ImuStream::gyro_z_rad_s, kMax_rad_s},
                                                  {"accel_x_m_s2", &ImuStream::accel_x_m_s2, kMax_m_s2},
                                                  {"accel_y_m_s2", &ImuStream::accel_y_m_s2, kMax_m_s2},
                                                  {"accel_z_m_s2", &ImuStream::accel_z_m_s2, kMax_m_s2}};
const std::vector<Field<ImuStream>> kAccelFields = {kImuFields[0], kImuFields[4], kImuFields[5], kImuFields[6]};
const std::vector<Field<PowerStream>> kPowerFields = {{"t_s", &PowerStream::t_s, kLatest},
                                                      {"battery_V", &PowerStream::battery_V, kMax_V},
                                                      {"left_current_A", &PowerStream::left_current_A, kMax_A},
                                                      {"right_current_A", &PowerStream::right_current_A, kMax_A}};
const std::vector<Field<PowerStream>> kBatteryFields = {kPowerFields[0], kPowerFields[1]};
const std::vector<Field<AttitudeStream>> kAttitudeFields = {{"t_s", &AttitudeStream::t_s, kLatest},
                                                            {"qw", &AttitudeStream::qw, 2},
                                                            {"qx", &AttitudeStream::qx, 2},
                                                            {"qy", &AttitudeStream::qy, 2},
                                                            {"qz", &AttitudeStream::qz, 2}};
const std::vector<Field<WingsStream>> kWingsFields = {{"t_s", &WingsStream::t_s, kLatest},
                                                      {"left_stroke_rad", &WingsStream::left_stroke_rad, 1e3},
                                                      {"left_rotation_rad", &WingsStream::left_rotation_rad, 1e3},
                                                      {"right_stroke_rad", &WingsStream::right_stroke_rad, 1e3},
                                                      {"right_rotation_rad", &WingsStream::right_rotation_rad, 1e3}};

constexpr double kMax_N = 1e4, kMax_Nm = 1e4;
const std::vector<Field<ForcesStream>> kForcesFields = {{"t_s", &ForcesStream::t_s, kLatest},
                                                        {"force_x_N", &ForcesStream::force_x_N, kMax_N},
                                                        {"force_y_N", &ForcesStream::force_y_N, kMax_N},
                                                        {"force_z_N", &ForcesStream::force_z_N, kMax_N},
                                                        {"moment_x_Nm", &ForcesStream::moment_x_Nm, kMax_Nm},
                                                        {"moment_y_Nm", &ForcesStream::moment_y_Nm, kMax_Nm},
                                                        {"moment_z_Nm", &ForcesStream::moment_z_Nm, kMax_Nm}};

template <class Stream>
std::optional<double> limit_in(const std::vector<Field<Stream>>& fields, const std::string& column) {
  const auto found = std::ranges::find(fields, column, &Field<Stream>::name);
  return found == fields.end() ? std::nullopt : std::optional(found->limit);
}

[[noreturn]] void refuse(const std::string& place, const std::string& what, std::string_view accepted) {
  throw io::InputError(place + ": " + what + (accepted.empty() ? "" : "; accepted: " + std::string(accepted)));
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The boolean `key`, by default true: whether a stream has a part. Only logs with declared inputs may lack it.
bool has_part(const io::Table& stream, const char* key, bool declared_inputs) {
  const bool has = stream.boolean_or(key, true);
  if (!has && !declared_inputs) stream.fail(key, "is false in a log with voltages", "true, or [command] inputs");
  return has;
}

/// Divides by the length, unless it is 1 to the last digits, so that written values read back exactly.
void normalise(double length, std::initializer_list<double*> components) {
  if (std::abs(length - 1) <= 4 * std::numeric_limits<double>::epsilon()) return;
  for (double* c : components) *c /= length;
}

// ---- the header

ImuHeader parse_imu_header(const io::Table& imu, bool declared_inputs) {
  const io::Range rate = positive(1e6);
  ImuHeader h;
  h.rate_hz = imu.number("rate_hz", rate);
  h.latency_s = imu.number("latency_s", non_negative(10));
  h.bandwidth_hz = imu.number("bandwidth_hz", rate);
  std::ranges::copy(imu.numbers("position_m", 3, {-1, 1}), h.position_m.begin());
  h.accel_noise_m_s2 = imu.number("accel_noise_m_s2", non_negative(1e3));
  h.gyro = read_gyro(imu, declared_inputs);
  if (!h.gyro) return h;
  h.gyro_noise_rad_s = imu.number("gyro_noise_rad_s", non_negative(100));
  std::ranges::copy(imu.numbers("gyro_bias_sd_rad_s", 3, non_negative(100)), h.gyro_bias_sd_rad_s.begin());
  return h;
}

PowerHeader parse_power_header(const io::Table& power, bool declared_inputs) {
  PowerHeader h{power.number("battery_nominal_V", positive(100)), power.number("rate_hz", positive(1e6)),
                power.number("latency_s", non_negative(10)), power.number("voltage_noise_V", non_negative(10))};
  h.currents = read_currents(power, declared_inputs);
  if (h.currents) h.current_noise_A = power.number("current_noise_A", non_negative(10));
  return h;
}

FlownHeader parse_flown(const io::Table& flown) {
  flown.accept({"start_s", "start_pose", "start_memory", "start_phase", "imu_latency_s", "mode", "begin_s",
                "hand_back_s", "policy_crc32", "controller_crc32"});
  const io::Range time{-kLatest, kLatest};
  FlownHeader h{.start_s = flown.number("start_s", time)};
  if (flown.has("start_pose"))
    std::ranges::copy(flown.numbers("start_pose", 7, {-1e6, 1e6}), h.start_pose.emplace().begin());
  constexpr std::int64_t kWord = 0xffffffff;
  if (flown.has("start_memory")) {
    h.start_memory = flown.numbers("start_memory", {-kMaxRemembered, kMaxRemembered});
    h.start_phase = static_cast<std::uint32_t>(flown.integer_or("start_phase", 0, 0, kWord));
  }
  if (flown.has("imu_latency_s")) h.imu_latency_s = flown.number("imu_latency_s", non_negative(10));
  h.mode = flown.choice_or("mode", "", {"hover", "stay", "task"});
  if (flown.has("begin_s")) h.begin_s = flown.number("begin_s", time);
  if (flown.has("hand_back_s")) h.hand_back_s = flown.number("hand_back_s", time);
  const auto crc = [&](const char* key, std::optional<std::uint32_t>& to) {
    if (flown.has(key)) to = static_cast<std::uint32_t>(flown.integer_or(key, 0, 0, kWord));
  };
  crc("policy_crc32", h.policy_crc32);
  crc("controller_crc32", h.controller_crc32);
  return h;
}

FlightHeader parse_header(const io::Table& root) {
  root.schema(1);
  root.accept({"schema", "vehicle", "vehicle_sha256", "session", "flapping_Hz", "gravity_m_s2", "ambient", "command",
               "mocap", "imu", "power", "wings", "attitude", "policy", "changes", "flown", "rig"});
  FlightHeader h;
  h.vehicle = read_vehicle_name(root);
  h.session = root.string_or("session", "");
  h.vehicle_sha256 = root.string_or("vehicle_sha256", "");
  if (!h.vehicle_sha256.empty() &&
      (h.vehicle_sha256.size() != 64 || h.vehicle_sha256.find_first_not_of("0123456789abcdef") != std::string::npos))
    root.fail("vehicle_sha256", "is no SHA-256", "64 digits of 0 to 9 and a to f");
  if (const auto command = root.optional_table("command")) h.inputs = read_inputs(*command);
  h.flapping_Hz = read_flapping(root, h.inputs);
  h.gravity_m_s2 = root.number("gravity_m_s2", non_negative(100));

  h.ambient = read_ambient(root.table("ambient"));

  const io::Range rate = positive(1e6), latency = non_negative(10);
  const bool declared = !h.inputs.empty();
  if (const auto rig = root.optional_table("rig")) {
    for (const char* other : {"mocap", "imu", "attitude", "policy", "flown"})
      if (root.has(other))
        root.fail(other, "is of a robot that flies", "[rig] without it, or [" + std::string(other) + "] without [rig]");
    if (declared) root.table("command").fail("inputs", "is given of a clamped robot", "the voltages of its motors");
    h.rig = read_rig(*rig);
    h.rig->rate_hz = rig->number("rate_hz", rate);
  } else {
    const io::Table mocap = root.table("mocap");
    h.mocap = {mocap.number("rate_hz", rate), mocap.number("latency_s", latency),
               mocap.number("position_noise_m", non_negative(1)), mocap.number("attitude_noise_rad", non_negative(1))};
    h.mocap.source = read_pose_source(mocap, declared);
    if (!declared || root.has("imu")) h.imu = parse_imu_header(root.table("imu"), declared);
  }
  if (const auto power = root.optional_table("power")) h.power = parse_power_header(*power, declared);
  if (const auto wings = root.optional_table("wings"))
    h.wings = {wings->number("rate_hz", rate), wings->number("noise_rad", non_negative(1))};
  if (const auto attitude = root.optional_table("attitude"))
    h.attitude = {attitude->number("rate_hz", rate), attitude->number("latency_s", latency),
                  attitude->number("noise_rad", non_negative(1))};
  if (const auto policy = root.optional_table("policy")) {
    policy->accept({"numbers"});
    h.policy = read_policy_numbers(*policy);
  }
  h.changes = model::read_changes(root);
  if (const auto flown = root.optional_table("flown")) h.flown = parse_flown(*flown);
  root.finish();
  return h;
}

std::string header_text(const FlightHeader& h) {
  std::string text;
  const auto line = [&](const std::string& key, const std::string& value) { text += key + " = " + value + "\n"; };
  const auto number = [&](const std::string& key, double value) { line(key, io::toml_number(value)); };
  const auto array = [](const auto& values) {
    std::string list;
    for (const double value : values) list += (list.empty() ? "" : ", ") + io::toml_number(value);
    return "[" + list + "]";
  };
  line("schema", "1");
  line("vehicle", io::toml_string(h.vehicle));
  if (!h.vehicle_sha256.empty()) line("vehicle_sha256", io::toml_string(h.vehicle_sha256));
  if (!h.session.empty()) line("session", io::toml_string(h.session));
  if (h.flapping_Hz > 0) number("flapping_Hz", h.flapping_Hz);
  number("gravity_m_s2", h.gravity_m_s2);

  text += "\n[ambient]\n";
  number("air_density_kg_m3", h.ambient.air_density_kg_m3);
  number("ground_z_m", h.ambient.ground_z_m);
  number("ceiling_z_m", h.ambient.ceiling_z_m);
  std::string walls;
  for (const LogWall& w : h.ambient.walls)
    walls += (walls.empty() ? "" : ", ") + array(std::array{w.x_m, w.y_m, w.normal_x, w.normal_y});
  line("walls", "[" + walls + "]");
  const auto solids = [&](const char* key, const auto& rows) {
    std::string list;
    for (const auto& row : rows) list += (list.empty() ? "" : ", ") + array(row);
    if (!list.empty()) line(key, "[" + list + "]");
  };
  solids("spheres", h.ambient.spheres);
  solids("boxes", h.ambient.boxes);
  solids("cylinders", h.ambient.cylinders);

  if (!h.inputs.empty()) {
    std::string list;
    for (const std::string& name : h.inputs) list += (list.empty() ? "" : ", ") + io::toml_string(name);
    text += "\n[command]\n";
    line("inputs", "[" + list + "]");
  }

  if (h.rig) {
    text += "\n[rig]\n";
    line("support", io::toml_string("clamped"));
    number("rate_hz", h.rig->rate_hz);
    number("latency_s", h.rig->latency_s);
    line("position_m", array(h.rig->position_m));
    line("attitude", array(h.rig->attitude));
    number("force_noise_N", h.rig->force_noise_N);
    number("moment_noise_Nm", h.rig->moment_noise_Nm);
    if (h.rig->resonance_hz > 0) number("resonance_hz", h.rig->resonance_hz);
  } else {
    text += "\n[mocap]\n";
    number("rate_hz", h.mocap.rate_hz);
    number("latency_s", h.mocap.latency_s);
    number("position_noise_m", h.mocap.position_noise_m);
    number("attitude_noise_rad", h.mocap.attitude_noise_rad);
  }
  if (h.mocap.source != PoseSource::motion_capture)
    line("source", io::toml_string(kPoseSources[static_cast<std::size_t>(h.mocap.source)]));

  if (h.imu.rate_hz > 0) {
    text += "\n[imu]\n";
    number("rate_hz", h.imu.rate_hz);
    number("latency_s", h.imu.latency_s);
    number("bandwidth_hz", h.imu.bandwidth_hz);
    line("position_m", array(h.imu.position_m));
    if (h.imu.gyro) {
      number("gyro_noise_rad_s", h.imu.gyro_noise_rad_s);
      line("gyro_bias_sd_rad_s", array(h.imu.gyro_bias_sd_rad_s));
    } else {
      line("gyro", "false");
    }
    number("accel_noise_m_s2", h.imu.accel_noise_m_s2);
  }

  if (h.power) {
    text += "\n[power]\n";
    number("battery_nominal_V", h.power->battery_nominal_V);
    number("rate_hz", h.power->rate_hz);
    number("latency_s", h.power->latency_s);
    number("voltage_noise_V", h.power->voltage_noise_V);
    if (h.power->currents) number("current_noise_A", h.power->current_noise_A);
    else line("currents", "false");
  }
  if (h.wings) {
    text += "\n[wings]\n";
    number("rate_hz", h.wings->rate_hz);
    number("noise_rad", h.wings->noise_rad);
  }
  if (h.attitude) {
    text += "\n[attitude]\n";
    number("rate_hz", h.attitude->rate_hz);
    number("latency_s", h.attitude->latency_s);
    number("noise_rad", h.attitude->noise_rad);
  }
  if (!h.policy.empty()) {
    text += "\n[policy]\n";
    std::string list;
    for (const std::string& name : h.policy) list += (list.empty() ? "" : ", ") + io::toml_string(name);
    line("numbers", "[" + list + "]");
  }
  text += model::changes_text(h.changes);
  if (h.flown) {
    text += "\n[flown]\n";
    number("start_s", h.flown->start_s);
    if (h.flown->start_pose) line("start_pose", array(*h.flown->start_pose));
    if (!h.flown->start_memory.empty()) {
      line("start_memory", array(h.flown->start_memory));
      line("start_phase", std::to_string(h.flown->start_phase));
    }
    if (h.flown->imu_latency_s) number("imu_latency_s", *h.flown->imu_latency_s);
    if (!h.flown->mode.empty()) line("mode", io::toml_string(h.flown->mode));
    if (h.flown->begin_s) number("begin_s", *h.flown->begin_s);
    if (h.flown->hand_back_s) number("hand_back_s", *h.flown->hand_back_s);
    if (h.flown->policy_crc32) line("policy_crc32", std::to_string(*h.flown->policy_crc32));
    if (h.flown->controller_crc32) line("controller_crc32", std::to_string(*h.flown->controller_crc32));
  }
  return text;
}

// ---- a stream

/// InputError where a required column is missing or a column is neither required nor optional.
class StreamReader {
 public:
  StreamReader(std::string_view text, const fs::path& path, const std::vector<std::string>& required,
               const std::vector<std::string>& optional = {})
      : table_(io::parse_csv(text, path.string())) {
    std::vector<std::string> known = required;
    known.insert(known.end(), optional.begin(), optional.end());
    const std::string list = io::joined(known);
    const std::string header = table_.name + ":1";
    for (const auto& name : table_.names) {
      if (std::ranges::find(known, name) != known.end()) continue;
      const std::string same = io::in_another_unit(name, known);
      if (!same.empty())
        refuse(header, name + ": unknown column; accepted here with another unit: \"" + same + "\"", "");
      refuse(header, name + ": unknown column", list + io::did_you_mean(name, known));
    }
    for (const auto& name : required) {
      if (!has(name)) refuse(header, name + ": column is missing", list);
    }
    const std::size_t count = table_.columns.front().size();
    if (count < 2) refuse(table_.name, "holds " + std::to_string(count) + " samples", "at least 2");
  }

  bool has(std::string_view name) const { return std::ranges::find(table_.names, name) != table_.names.end(); }

  /// `file:line` of a sample.
  std::string place(std::size_t row) const { return table_.name + ":" + std::to_string(row + 2); }

  Column take(const std::string& name, double limit) const {
    const Column& column = table_.column(name);
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (std::abs(column[i]) <= limit) continue;
      const std::string bound = shortest_digits(limit);
      refuse(place(i), name + ": " + shortest_digits(column[i]) + " is out of range",
             "a number from -" + bound + " to " + bound);
    }
    return column;
  }

  template <class Part>
  void fill(Part& part, const std::vector<Field<Part>>& fields) const {
    for (const auto& field : fields) part.*field.column = take(field.name, field.limit);
  }

  void require_times(const Column& t_s) const {
    for (std::size_t i = 1; i < t_s.size(); ++i) {
      const std::string after = " of the line before", now = "t_s: " + shortest_digits(t_s[i]);
      if (!(t_s[i] > t_s[i - 1]))
        refuse(place(i), now + " does not come after " + shortest_digits(t_s[i - 1]) + after, "times that increase");
      if (t_s[i] - t_s[i - 1] > kLongestGap_s)
        refuse(place(i), now + " comes " + shortest_digits(t_s[i] - t_s[i - 1]) + " s after that" + after,
               "gaps of at most " + shortest_digits(kLongestGap_s) + " s within a flight");
    }
    const double span_s = t_s.back() - t_s.front();
    if (static_cast<double>(t_s.size()) < kSlowest_Hz * span_s)
      refuse(table_.name, std::to_string(t_s.size()) + " samples over " + shortest_digits(span_s) + " s",
             "at least one in " + shortest_digits(1 / kSlowest_Hz) + " s on the whole");
  }

 private:
  io::CsvTable table_;
};

template <class Stream>
std::vector<std::string> names_of(const std::vector<Field<Stream>>& fields) {
  std::vector<std::string> names;
  for (const auto& field : fields) names.emplace_back(field.name);
  return names;
}

template <class Stream>
Stream parse_stream(const std::string& text, const fs::path& path, const std::vector<Field<Stream>>& fields) {
  const StreamReader reader(text, path, names_of(fields));
  Stream stream;
  reader.fill(stream, fields);
  reader.require_times(stream.t_s);
  return stream;
}

/// A stream whose columns besides t_s the header names.
void parse_declared(const std::string& text, const fs::path& path, const std::vector<std::string>& declared,
                    Column& t_s, std::vector<Column>& columns) {
  std::vector<std::string> names = {"t_s"};
  names.insert(names.end(), declared.begin(), declared.end());
  const StreamReader reader(text, path, names);
  t_s = reader.take("t_s", kLatest);
  reader.require_times(t_s);
  for (const std::string& name : declared) columns.push_back(reader.take(name, kInputLimit));
}

CommandStream parse_command(const std::string& text, const fs::path& path) {
  std::vector<std::string> optional = names_of(kInputFields);
  optional.push_back(kPhase);
  const StreamReader reader(text, path, names_of(kCommandFields), optional);
  CommandStream command;
  reader.fill(command, kCommandFields);
  reader.require_times(command.t_s);
  std::string missing;
  for (const auto& field : kInputFields) {
    if (reader.has(field.name)) command.inputs.emplace();
    else missing += (missing.empty() ? "" : ", ") + std::string(field.name);
  }
  if (command.inputs && !missing.empty())
    refuse(path.string() + ":1", missing + ": missing, while other inputs of the wing beat are given",
           "all four or none");
  if (command.inputs) reader.fill(*command.inputs, kInputFields);
  if (reader.has(kPhase)) command.phase_rad = reader.take(kPhase, kPhaseLimit);
  return command;
}

template <class Stream>
Stream parse_turned(const std::string& text, const fs::path& path, const std::vector<Field<Stream>>& fields) {
  Stream m = parse_stream(text, path, fields);
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    const double length = std::sqrt(m.qw[i] * m.qw[i] + m.qx[i] * m.qx[i] + m.qy[i] * m.qy[i] + m.qz[i] * m.qz[i]);
    if (std::abs(length - 1) > kUnitTolerance)
      refuse(path.string() + ":" + std::to_string(i + 2), "qw, qx, qy, qz: length is " + shortest_digits(length),
             "a quaternion of length 1 to within " + shortest_digits(kUnitTolerance));
    normalise(length, {&m.qw[i], &m.qx[i], &m.qy[i], &m.qz[i]});
  }
  return m;
}

template <class Stream>
void add_columns(const Stream& stream, const std::vector<Field<Stream>>& fields, std::vector<std::string>& names,
                 std::vector<Column>& columns) {
  for (const auto& field : fields) {
    names.emplace_back(field.name);
    columns.push_back(stream.*field.column);
  }
}

template <class Stream>
std::string stream_text(const Stream& stream, const std::vector<Field<Stream>>& fields) {
  std::vector<std::string> names;
  std::vector<Column> columns;
  add_columns(stream, fields, names, columns);
  return io::csv_text(names, columns);
}

std::string declared_text(const Column& t_s, const std::vector<std::string>& declared,
                          const std::vector<Column>& values) {
  std::vector<std::string> names = {"t_s"};
  std::vector<Column> columns = {t_s};
  names.insert(names.end(), declared.begin(), declared.end());
  columns.insert(columns.end(), values.begin(), values.end());
  return io::csv_text(names, columns);
}

std::string command_text(const CommandStream& command, const std::vector<std::string>& inputs) {
  if (!inputs.empty()) return declared_text(command.t_s, inputs, command.declared);
  std::vector<std::string> names;
  std::vector<Column> columns;
  add_columns(command, kCommandFields, names, columns);
  if (command.inputs) add_columns(*command.inputs, kInputFields, names, columns);
  if (command.phase_rad) {
    names.push_back(kPhase);
    columns.push_back(*command.phase_rad);
  }
  return io::csv_text(names, columns);
}

// ---- the whole

void require_overlap(const FlightLog& log, const fs::path& folder) {
  std::vector<std::pair<std::string, const Column*>> streams = {{kCommand, &log.command.t_s}};
  if (log.forces) streams.emplace_back(kForces, &log.forces->t_s);
  else streams.emplace_back(kMocap, &log.mocap.t_s);
  if (!log.imu.t_s.empty()) streams.emplace_back(kImu, &log.imu.t_s);
  if (log.power) streams.emplace_back(kPower, &log.power->t_s);
  if (log.wings) streams.emplace_back(kWings, &log.wings->t_s);
  if (log.attitude) streams.emplace_back(kAttitude, &log.attitude->t_s);
  const auto& last = *std::ranges::max_element(streams, {}, [](const auto& s) { return s.second->front(); });
  const auto& first = *std::ranges::min_element(streams, {}, [](const auto& s) { return s.second->back(); });
  if (last.second->front() >= first.second->back())
    refuse((folder / last.first).string() + ":2",
           "t_s: begins at " + shortest_digits(last.second->front()) + " s, when " + first.first + " has ended at " +
               shortest_digits(first.second->back()) + " s",
           "streams that overlap, of one clock");
}

const std::string& text_of(const LogFiles& files, const std::string& name, const fs::path& folder) {
  const auto found = files.find(name);
  if (found == files.end())
    refuse((folder / name).string(), "is missing",
           name == kForces ? "a folder with flight.toml, command.csv and forces.csv, as [rig] says"
                           : "a folder with flight.toml, command.csv, mocap.csv and imu.csv");
  return found->second;
}

/// InputError where an optional file exists but the header has no table of the same name.
void require_declared(const std::string& name, const fs::path& folder, bool declared) {
  const std::string table = "[" + name.substr(0, name.find('.')) + "]";
  if (!declared)
    refuse((folder / name).string(), "is there, but " + kHeader + " has no " + table, table + ", or no " + name);
}

const std::vector<Field<ImuStream>>& imu_fields(const FlightHeader& h) {
  return h.imu.gyro ? kImuFields : kAccelFields;
}

const std::vector<Field<PowerStream>>& power_fields(const FlightHeader& h) {
  return h.power && !h.power->currents ? kBatteryFields : kPowerFields;
}

template <class Stream>
std::optional<Stream> parse_optional(const LogFiles& files, const std::string& name, const fs::path& folder,
                                     bool declared, const std::vector<Field<Stream>>& fields) {
  const auto found = files.find(name);
  if (found == files.end()) return std::nullopt;
  require_declared(name, folder, declared);
  return parse_stream(found->second, folder / name, fields);
}

std::vector<std::string> read_names(const io::Table& table, const char* key) {
  constexpr std::string_view kAccepted = "names of columns, of letters, digits and _";
  std::vector<std::string> names = table.strings(key);
  if (names.empty()) table.fail(key, "is empty", kAccepted);
  for (const std::string& name : names) {
    const bool plain = std::ranges::all_of(
        name, [](char c) { return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c); });
    if (!plain || name.empty() || is_digit(name.front()) || name == "t_s")
      table.fail(key, "\"" + name + "\" is no name of a column", kAccepted);
    if (std::ranges::count(names, name) > 1) table.fail(key, "\"" + name + "\" is there twice", "each once");
  }
  return names;
}

}  // namespace

double column_limit(const std::string& column) {
  if (column == kPhase) return kPhaseLimit;
  for (const std::optional<double> limit :
       {limit_in(kCommandFields, column), limit_in(kInputFields, column), limit_in(kMocapFields, column),
        limit_in(kImuFields, column), limit_in(kPowerFields, column), limit_in(kAttitudeFields, column),
        limit_in(kWingsFields, column), limit_in(kForcesFields, column)})
    if (limit) return *limit;
  return kInputLimit;
}

bool is_sparse(const Column& t_s) {
  for (std::size_t i = 1; i < t_s.size(); ++i)
    if (t_s[i] - t_s[i - 1] > kLongestGap_s) return true;
  return static_cast<double>(t_s.size()) < kSlowest_Hz * (t_s.back() - t_s.front());
}

std::string read_vehicle_name(const io::Table& root) {
  const std::string name = root.string("vehicle");
  if (name.empty() || name.find_first_of("/\\") != std::string::npos)
    root.fail("vehicle", "\"" + name + "\" is no file name", "the name of the vehicle's file, without folder");
  return name;
}

LogAmbient read_ambient(const io::Table& ambient) {
  LogAmbient a;
  const io::Range place = {-1e6, 1e6};
  a.air_density_kg_m3 = ambient.number("air_density_kg_m3", non_negative(100));
  a.ground_z_m = ambient.number("ground_z_m", place);
  a.ceiling_z_m = ambient.number("ceiling_z_m", place);
  if (a.ceiling_z_m <= a.ground_z_m)
    ambient.fail("ceiling_z_m", shortest_digits(a.ceiling_z_m) + " is not above the ground",
                 "a number above " + shortest_digits(a.ground_z_m));
  for (const auto& row : ambient.rows("walls", 4, place)) {
    LogWall wall = {row[0], row[1], row[2], row[3]};
    const double length = std::hypot(wall.normal_x, wall.normal_y);
    if (std::abs(length - 1) > kUnitTolerance)
      ambient.fail("walls",
                   "normal of wall " + std::to_string(a.walls.size()) + " has length " + shortest_digits(length),
                   "[x_m, y_m, normal_x, normal_y], the normal of length 1");
    normalise(length, {&wall.normal_x, &wall.normal_y});
    a.walls.push_back(wall);
  }
  const auto read = [&]<std::size_t n>(const char* key, std::vector<std::array<double, n>>& to, auto possible,
                                       const char* accepted) {
    if (!ambient.has(key)) return;
    for (const auto& row : ambient.rows(key, n, place)) {
      to.emplace_back();
      std::ranges::copy(row, to.back().begin());
      if (!possible(to.back())) ambient.fail(key, "number " + std::to_string(to.size() - 1) + " is no solid", accepted);
    }
  };
  read(
      "spheres", a.spheres, [](const auto& s) { return s[3] > 0; }, "[x_m, y_m, z_m, radius_m], the radius above 0");
  read(
      "boxes", a.boxes,
      [](const auto& b) {
        return std::min({b[3], b[4], b[5]}) > 0 &&
               std::abs(std::hypot(std::hypot(b[6], b[7]), std::hypot(b[8], b[9])) - 1) <= kUnitTolerance;
      },
      "[x_m, y_m, z_m, three edges above 0, qw, qx, qy, qz], the quaternion of length 1");
  read(
      "cylinders", a.cylinders,
      [](const auto& c) { return c[6] > 0 && !(c[0] == c[3] && c[1] == c[4] && c[2] == c[5]); },
      "[two ends of the axis, radius_m], the radius above 0");
  return a;
}

std::vector<std::string> read_inputs(const io::Table& command) { return read_names(command, "inputs"); }

std::vector<std::string> read_policy_numbers(const io::Table& policy) {
  std::vector<std::string> numbers = read_names(policy, "numbers");
  for (const std::string& name : numbers)
    if (!name.starts_with("observation_") && !name.starts_with("action_"))
      policy.fail("numbers", "\"" + name + "\" is neither seen nor done by a policy",
                  "observation_ or action_ and a name of contract.json, as in observation_x_error");
  return numbers;
}

double read_flapping(const io::Table& root, const std::vector<std::string>& inputs) {
  return inputs.empty() || root.has("flapping_Hz") ? root.number("flapping_Hz", positive(1e4)) : 0;
}

PoseSource read_pose_source(const io::Table& mocap, bool declared_inputs) {
  const std::string source = mocap.choice_or("source", kPoseSources.front(), kPoseSources);
  if (source != kPoseSources.front() && !declared_inputs)
    mocap.fail("source", "\"" + source + "\" is too coarse for motion within a wing beat",
               "\"" + kPoseSources.front() + "\", or declared inputs (command.inputs)");
  return static_cast<PoseSource>(std::ranges::find(kPoseSources, source) - kPoseSources.begin());
}

bool read_gyro(const io::Table& imu, bool declared_inputs) { return has_part(imu, "gyro", declared_inputs); }

bool read_currents(const io::Table& power, bool declared_inputs) {
  return has_part(power, "currents", declared_inputs);
}

RigHeader read_rig(const io::Table& rig) {
  rig.choice_or("support", "clamped", {"clamped"});
  RigHeader h;
  h.latency_s = rig.number("latency_s", non_negative(10));
  std::ranges::copy(rig.numbers("position_m", 3, {-1, 1}), h.position_m.begin());
  std::ranges::copy(rig.numbers("attitude", 4, {-1, 1}), h.attitude.begin());
  auto& [w, x, y, z] = h.attitude;
  const double length = std::sqrt(w * w + x * x + y * y + z * z);
  if (std::abs(length - 1) > kUnitTolerance)
    rig.fail("attitude", "has length " + shortest_digits(length), "a quaternion w, x, y, z of length 1");
  normalise(length, {&w, &x, &y, &z});
  h.force_noise_N = rig.number("force_noise_N", non_negative(100));
  h.moment_noise_Nm = rig.number("moment_noise_Nm", non_negative(100));
  if (rig.has("resonance_hz")) h.resonance_hz = rig.number("resonance_hz", positive(1e6));
  return h;
}

void require_flown(const FlightLog& log, const std::string& place) {
  if (log.header.rig) refuse(place, "is of a clamped robot", "the log of a flight, without [rig]");
}

void require_voltages(const FlightLog& log, const std::string& place) {
  if (log.header.inputs.empty()) return;
  refuse(place, "is driven by " + io::joined(log.header.inputs),
         "a flight driven by left_voltage_V and right_voltage_V");
}

FlightLog parse_flight_log(const LogFiles& files, const fs::path& folder) {
  const io::Table root = io::Config::parse(text_of(files, kHeader, folder), (folder / kHeader).string()).root();
  FlightLog log;
  log.header = parse_header(root);
  const FlightHeader& h = log.header;
  const std::string& command = text_of(files, kCommand, folder);
  if (h.inputs.empty()) log.command = parse_command(command, folder / kCommand);
  else parse_declared(command, folder / kCommand, h.inputs, log.command.t_s, log.command.declared);
  if (h.rig) text_of(files, kForces, folder);
  else log.mocap = parse_turned(text_of(files, kMocap, folder), folder / kMocap, kMocapFields);
  if (h.rig && files.contains(kMocap))
    refuse((folder / kMocap).string(), "is there, but " + kHeader + " has [rig]", "forces.csv alone, or no [rig]");
  log.forces = parse_optional(files, kForces, folder, h.rig.has_value(), kForcesFields);
  if (h.imu.rate_hz > 0) text_of(files, kImu, folder);
  log.imu = parse_optional(files, kImu, folder, h.imu.rate_hz > 0, imu_fields(h)).value_or(ImuStream{});
  log.power = parse_optional(files, kPower, folder, h.power.has_value(), power_fields(h));
  log.wings = parse_optional(files, kWings, folder, h.wings.has_value(), kWingsFields);
  if (const auto found = files.find(kAttitude); found != files.end()) {
    require_declared(kAttitude, folder, h.attitude.has_value());
    log.attitude = parse_turned(found->second, folder / kAttitude, kAttitudeFields);
  }
  if (const auto found = files.find(kPolicy); found != files.end()) {
    require_declared(kPolicy, folder, !h.policy.empty());
    PolicyStream& policy = log.policy.emplace();
    parse_declared(found->second, folder / kPolicy, h.policy, policy.t_s, policy.numbers);
  }
  require_overlap(log, folder);
  return log;
}

LogFiles flight_log_files(const FlightLog& log) {
  const FlightHeader& h = log.header;
  LogFiles files = {{kHeader, header_text(h)}, {kCommand, command_text(log.command, h.inputs)}};
  if (log.forces) files[kForces] = stream_text(*log.forces, kForcesFields);
  else files[kMocap] = stream_text(log.mocap, kMocapFields);
  if (h.imu.rate_hz > 0) files[kImu] = stream_text(log.imu, imu_fields(h));
  if (log.power) files[kPower] = stream_text(*log.power, power_fields(h));
  if (log.wings) files[kWings] = stream_text(*log.wings, kWingsFields);
  if (log.policy) files[kPolicy] = declared_text(log.policy->t_s, h.policy, log.policy->numbers);
  if (log.attitude) files[kAttitude] = stream_text(*log.attitude, kAttitudeFields);
  return files;
}

}  // namespace flappy::flightlog
