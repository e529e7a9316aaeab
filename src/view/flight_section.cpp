#include "view/flight_section.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"
#include "flightlog/beat_averaged_motion.hpp"
#include "flightlog/flight_log.hpp"
#include "flightlog/readings.hpp"
#include "io/csv.hpp"
#include "io/installation.hpp"
#include "sim/replay.hpp"
#include "view/results.hpp"
#include "view/shape.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;
using flightlog::Column;
using flightlog::FlightLog;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kWingsEvery_s = 2e-3, kHeld_s = 1e-3;  // 15 samples per beat of 34 Hz; hold time of the driver
constexpr std::size_t kPointsOnPaper = 1500;

/// Resolutions of packed columns.
namespace step {
constexpr double kTime_s = 1e-6, kPlace_m = 1e-5, kQuaternion = 1e-5, kAngle_rad = 1e-3, kRate_rad_s = 1e-3,
                 kForce_m_s2 = 1e-2, kVoltage_V = 1e-3, kSplit = 1e-5, kCurrent_A = 1e-4, kWing_N = 1e-4,
                 kWing_W = 1e-3;
}

struct NamedColumn {
  const char* name;
  const Column& values;
  double step;
};

Column thinned(const Column& values, std::size_t every) {
  Column kept;
  for (std::size_t i = 0; i < values.size(); i += every) kept.push_back(values[i]);
  return kept;
}

/// Packs a stream. Of a stream longer than kMaxSamples it takes every n-th sample, and adds a note.
Json packed(const std::string& stream, const std::vector<NamedColumn>& columns, Packing& packing, Json& notes) {
  const std::size_t every = (columns.front().values.size() + kMaxSamples - 1) / kMaxSamples;
  if (every > 1) notes.push_back(stream + ": one of " + std::to_string(every) + " samples is shown");
  Json json;
  for (const NamedColumn& c : columns)
    json[c.name] = packing.add(every > 1 ? thinned(c.values, every) : c.values, c.step);
  return json;
}

/// The vehicle that a log declares: from the log's folder, else from `asked`, else the shipped vehicle of that name.
model::Vehicle vehicle_of(const fs::path& folder, const FlightLog& log, const fs::path& asked) {
  std::error_code none;
  for (const fs::path& file :
       {folder / log.header.vehicle, asked, fs::path(io::config_path("vehicles/" + log.header.vehicle))})
    if (!file.empty() && fs::is_regular_file(file, none)) return model::read_any_vehicle(file);
  throw io::InputError((folder / "flight.toml").string() + ": vehicle: there is no " + log.header.vehicle +
                       " in the folder; accepted: --vehicle FILE, in Python vehicle=FILE");
}

/// Strokes and rotations that the recorded voltages cause with the torso held fixed: its motion changes them little.
flightlog::WingsStream derived_wings(const FlightLog& log, const model::Vehicle& vehicle) {
  const Column& t = log.command.t_s;
  const auto held = static_cast<std::size_t>(std::floor((t.back() - t.front()) / kHeld_s));
  std::vector<double> left, right;
  sim::step_voltages({t, log.command.left_voltage_V, log.command.right_voltage_V}, t.front(), kHeld_s, held, left,
                     right);
  sim::BatchOptions options;
  options.threads = 1;
  sim::Batch<float> wings(1, vehicle, options);
  wings.reset(0, {}, sim::Start::welded);
  const int steps = static_cast<int>(std::lround(kHeld_s / options.step_s));
  const auto every = static_cast<std::size_t>(std::lround(kWingsEvery_s / kHeld_s));
  flightlog::WingsStream stream;
  for (std::size_t k = 0; k < held; ++k) {
    wings.set_voltages(0, left[k], right[k]);
    wings.step(steps);
    if ((k + 1) % every != 0) continue;
    const sim::FlapperState state = wings.state(0);
    stream.t_s.push_back(t.front() + static_cast<double>(k + 1) * kHeld_s);
    stream.left_stroke_rad.push_back(state.stroke_rad[0]);
    stream.right_stroke_rad.push_back(state.stroke_rad[1]);
    stream.left_rotation_rad.push_back(state.rotation_rad[0]);
    stream.right_rotation_rad.push_back(state.rotation_rad[1]);
  }
  return stream;
}

/// The specific force of the path that motion capture saw, up to the vehicle's bandwidth.
flightlog::ImuStream force_of_path(const FlightLog& log, const model::Vehicle& vehicle, const fs::path& folder) {
  const flightlog::BeatAveragedMotion m =
      flightlog::beat_averaged_motion(log, vehicle.beat_averaged->bandwidth_Hz, folder);
  flightlog::ImuStream stream;
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (!m.seen[i]) continue;
    stream.t_s.push_back(m.t_s(i));
    stream.accel_x_m_s2.push_back(m.force_m_s2[i].x());
    stream.accel_y_m_s2.push_back(m.force_m_s2[i].y());
    stream.accel_z_m_s2.push_back(m.force_m_s2[i].z());
  }
  return stream;
}

/// A resolution for values of an unknown unit: 1e-5 of their largest magnitude, rounded up to a power of ten.
double step_of(const Column& values) {
  double most = 0;
  for (const double x : values) most = std::max(most, std::abs(x));
  return most > 0 ? 1e-5 * std::pow(10, std::ceil(std::log10(most))) : 1;
}

/// Removes poses with swapped markers. Returns begin and end of each stretch of them; null where there is none.
Json take_swapped(FlightLog& log, Packing& packing, Json& notes) {
  flightlog::MocapStream& m = log.mocap;
  std::vector<char> swapped = flightlog::swapped_poses(log);
  const std::size_t n = swapped.size();
  const std::array<Column*, 8> columns = {&m.t_s, &m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz};
  for (std::size_t i = 1; i < n; ++i)  // a repetition of a swapped pose is swapped, too
    if (swapped[i - 1] &&
        std::ranges::all_of(columns, [&](const Column* c) { return c == &m.t_s || (*c)[i] == (*c)[i - 1]; }))
      swapped[i] = 1;
  const auto count = static_cast<std::size_t>(std::ranges::count(swapped, 1));
  if (count == 0 || count + 2 > n) return nullptr;
  Column begin_s, end_s;
  for (std::size_t i = 0; i < n; ++i) {
    if (!swapped[i]) continue;
    if (i == 0 || !swapped[i - 1]) begin_s.push_back(m.t_s[i]), end_s.push_back(0);
    end_s.back() = m.t_s[i];
  }
  for (Column* c : columns) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (!swapped[i]) (*c)[kept++] = (*c)[i];
    c->resize(kept);
  }
  notes.push_back(
      std::to_string(count) + " of " + std::to_string(n) +
      " poses are left out, whose markers were taken for others: grey in the plots of position and attitude");
  return {{"begin_s", packing.add(begin_s, step::kTime_s)}, {"end_s", packing.add(end_s, step::kTime_s)}};
}

Json json_of(const flightlog::LogAmbient& a) {
  Json walls = Json::array();
  for (const flightlog::LogWall& w : a.walls) walls.push_back({w.x_m, w.y_m, w.normal_x, w.normal_y});
  Json json = {{"ground_z_m", a.ground_z_m}, {"ceiling_z_m", a.ceiling_z_m}, {"walls", walls}};
  if (!a.spheres.empty()) json["spheres"] = a.spheres;
  if (!a.boxes.empty()) json["boxes"] = a.boxes;
  if (!a.cylinders.empty()) json["cylinders"] = a.cylinders;
  return json;
}

/// The declared latencies, from the instant of a sample to its time stamp.
Json latency_of(const flightlog::FlightHeader& h) {
  Json json = {{"mocap", h.mocap.latency_s}, {"imu", h.imu.latency_s}};
  if (h.power) json["power"] = h.power->latency_s;
  return json;
}

Json streams_of(const FlightLog& log, const std::optional<flightlog::WingsStream>& wings, Packing& packing,
                Json& notes) {
  using namespace step;
  Json json;
  const flightlog::MocapStream& m = log.mocap;
  json["mocap"] = packed("mocap.csv",
                         {{"t_s", m.t_s, kTime_s},
                          {"x_m", m.x_m, kPlace_m},
                          {"y_m", m.y_m, kPlace_m},
                          {"z_m", m.z_m, kPlace_m},
                          {"qw", m.qw, kQuaternion},
                          {"qx", m.qx, kQuaternion},
                          {"qy", m.qy, kQuaternion},
                          {"qz", m.qz, kQuaternion}},
                         packing, notes);
  const flightlog::ImuStream& i = log.imu;
  std::vector<NamedColumn> imu = {{"t_s", i.t_s, kTime_s},
                                  {"accel_x_m_s2", i.accel_x_m_s2, kForce_m_s2},
                                  {"accel_y_m_s2", i.accel_y_m_s2, kForce_m_s2},
                                  {"accel_z_m_s2", i.accel_z_m_s2, kForce_m_s2}};
  if (!i.gyro_x_rad_s.empty()) {
    imu.push_back({"gyro_x_rad_s", i.gyro_x_rad_s, kRate_rad_s});
    imu.push_back({"gyro_y_rad_s", i.gyro_y_rad_s, kRate_rad_s});
    imu.push_back({"gyro_z_rad_s", i.gyro_z_rad_s, kRate_rad_s});
  }
  if (!i.t_s.empty()) json["imu"] = packed("imu.csv", imu, packing, notes);
  const flightlog::CommandStream& c = log.command;
  std::vector<NamedColumn> command = {{"t_s", c.t_s, kTime_s}};
  for (std::size_t k = 0; k < c.declared.size(); ++k)
    command.push_back({log.header.inputs[k].c_str(), c.declared[k], step_of(c.declared[k])});
  if (c.declared.empty()) {
    command.push_back({"left_voltage_V", c.left_voltage_V, kVoltage_V});
    command.push_back({"right_voltage_V", c.right_voltage_V, kVoltage_V});
  }
  if (c.inputs) {
    command.push_back({"amplitude_V", c.inputs->amplitude_V, kVoltage_V});
    command.push_back({"difference_V", c.inputs->difference_V, kVoltage_V});
    command.push_back({"bias_V", c.inputs->bias_V, kVoltage_V});
    command.push_back({"split_cycle", c.inputs->split_cycle, kSplit});
  }
  json[c.declared.empty() ? "command" : "declared"] = packed("command.csv", command, packing, notes);
  if (wings)
    json["wings"] = packed("wings",
                           {{"t_s", wings->t_s, kTime_s},
                            {"left_stroke_rad", wings->left_stroke_rad, kAngle_rad},
                            {"left_rotation_rad", wings->left_rotation_rad, kAngle_rad},
                            {"right_stroke_rad", wings->right_stroke_rad, kAngle_rad},
                            {"right_rotation_rad", wings->right_rotation_rad, kAngle_rad}},
                           packing, notes);
  if (log.power) {
    std::vector<NamedColumn> power = {{"t_s", log.power->t_s, kTime_s},
                                      {"battery_V", log.power->battery_V, kVoltage_V}};
    if (!log.power->left_current_A.empty()) {
      power.push_back({"left_current_A", log.power->left_current_A, kCurrent_A});
      power.push_back({"right_current_A", log.power->right_current_A, kCurrent_A});
    }
    json["power"] = packed("power.csv", power, packing, notes);
  }
  return json;
}

/// What a simulator wrote of the wings beside the log.
Json loads_of(const fs::path& file, Packing& packing, Json& notes) {
  const io::CsvTable table = io::read_csv(file);
  std::vector<NamedColumn> columns = {{"t_s", table.column("t_s"), step::kTime_s}};
  for (const auto& [name, resolution] : {std::pair("left_lift_N", step::kWing_N),
                                         {"left_drag_N", step::kWing_N},
                                         {"right_lift_N", step::kWing_N},
                                         {"right_drag_N", step::kWing_N},
                                         {"left_mechanical_power_W", step::kWing_W},
                                         {"right_mechanical_power_W", step::kWing_W}})
    columns.push_back({name, table.column(name), resolution});
  return packed(flightlog::log_file::kWingLoads, columns, packing, notes);
}

/// A column over the flight time, thinned to about kPointsOnPaper points.
Series on_paper(const std::string& name, Colour colour, bool dashed, const Column& t, const Column& values,
                double factor = 1) {
  Series s{.name = name, .colour = colour, .x = {}, .y = {}, .low = {}, .high = {}, .dashed = dashed};
  const std::size_t every = values.size() / kPointsOnPaper + 1;
  for (std::size_t i = 0; i < values.size(); i += every) {
    s.x.push_back(t[i] - t.front());
    s.y.push_back(factor * values[i]);
  }
  return s;
}

/// Roll, pitch and yaw of R = Rz Ry Rx; the angles are continuous beyond half a turn.
std::array<Column, 3> attitude_of(const flightlog::MocapStream& m) {
  std::array<Column, 3> angles;
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    const double w = m.qw[i], x = m.qx[i], y = m.qy[i], z = m.qz[i];
    const std::array<double, 3> now = {std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                                       std::asin(std::clamp(2 * (w * y - z * x), -1.0, 1.0)),
                                       std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))};
    for (std::size_t k = 0; k < 3; ++k) {
      const double before = angles[k].empty() ? now[k] : angles[k].back();
      angles[k].push_back(before + std::remainder(now[k] - before, 2 * std::numbers::pi));
    }
  }
  return angles;
}

void add_on_paper(Section& section, const std::vector<ShownFlight>& flights) {
  Figure place{.id = "position",
               .title = "Position",
               .note = "motion capture, W",
               .x = {.title = "time (s)"},
               .y = {.title = "position (m)"},
               .categories = {},
               .series = {}};
  Figure turn = place, volts = place, inputs = place;
  turn.id = "attitude", turn.title = "Attitude", turn.y.title = "angle (deg)";
  volts.id = "inputs", volts.title = "Inputs of the wing beat", volts.y.title = "input (V)", volts.note = "command.csv";
  inputs.id = "declared", inputs.title = "Inputs", inputs.y.title = "input (as declared)", inputs.note = "command.csv";
  for (std::size_t k = 0; k < flights.size() && k < 2; ++k) {
    const FlightLog& log = flights[k].log;
    const flightlog::MocapStream& m = log.mocap;
    const bool dashed = k > 0;
    const std::string of = flights.size() > 1 ? ", " + flights[k].name : "";
    place.series.push_back(on_paper("x" + of, Colour::blue, dashed, m.t_s, m.x_m));
    place.series.push_back(on_paper("y" + of, Colour::vermillion, dashed, m.t_s, m.y_m));
    place.series.push_back(on_paper("z" + of, Colour::green, dashed, m.t_s, m.z_m));
    const std::array<Column, 3> angles = attitude_of(m);
    turn.series.push_back(on_paper("roll" + of, Colour::blue, dashed, m.t_s, angles[0], kDegrees));
    turn.series.push_back(on_paper("pitch" + of, Colour::vermillion, dashed, m.t_s, angles[1], kDegrees));
    turn.series.push_back(on_paper("yaw" + of, Colour::green, dashed, m.t_s, angles[2], kDegrees));
    for (std::size_t i = 0; i < log.command.declared.size(); ++i)
      inputs.series.push_back(on_paper(spoken(log.header.inputs[i]) + of, static_cast<Colour>(i % std::size(kColours)),
                                       dashed, log.command.t_s, log.command.declared[i]));
    if (!log.command.inputs) continue;
    const flightlog::BeatInputs& u = *log.command.inputs;
    volts.series.push_back(on_paper("amplitude" + of, Colour::blue, dashed, log.command.t_s, u.amplitude_V));
    volts.series.push_back(on_paper("difference" + of, Colour::vermillion, dashed, log.command.t_s, u.difference_V));
    volts.series.push_back(on_paper("bias" + of, Colour::green, dashed, log.command.t_s, u.bias_V));
  }
  section.add_on_paper(place);
  section.add_on_paper(turn);
  if (!volts.series.empty()) section.add_on_paper(volts);
  if (!inputs.series.empty()) section.add_on_paper(inputs);
}

/// The name of a folder, preceded by that of its parent folder where another flight's folder has the same name.
std::string name_among(const std::vector<fs::path>& folders, const fs::path& folder) {
  const auto whole = [](const fs::path& path) {
    const fs::path full = fs::absolute(path).lexically_normal();
    return full.has_filename() ? full : full.parent_path();
  };
  const fs::path own = whole(folder);
  const auto alike =
      std::ranges::count_if(folders, [&](const fs::path& other) { return whole(other).filename() == own.filename(); });
  return (alike > 1 ? own.parent_path().filename() / own.filename() : own.filename()).string();
}

void check_count(std::size_t flights) {
  if (flights > kMaxFlights)
    throw io::InputError(std::to_string(flights) + " flights are more than one page shows; accepted: up to " +
                         std::to_string(kMaxFlights));
}

}  // namespace

Section flight_section(const std::vector<fs::path>& folders, const FlightOptions& options, Packing& packing) {
  check_count(folders.size());
  std::vector<ShownFlight> flights;
  for (const fs::path& folder : folders) {
    flights.push_back({name_among(folders, folder), folder, flightlog::read_flight_log(folder)});
    flightlog::require_flown(flights.back().log, folder);
  }
  return flight_section(std::move(flights), options, packing);
}

Section flight_section(std::vector<ShownFlight> flights, const FlightOptions& options, Packing& packing) {
  check_count(flights.size());
  Json list = Json::array();
  for (ShownFlight& shown : flights) {
    const std::string& name = shown.name;
    const fs::path& folder = shown.folder;
    FlightLog& log = shown.log;
    const model::Vehicle vehicle = vehicle_of(folder, log, options.vehicle);
    const bool winged = !vehicle.beat_averaged,
               derived = winged && !vehicle.jointed && !log.wings && log.command.declared.empty();
    Json notes = Json::array();
    const flightlog::ImuStream path = winged ? flightlog::ImuStream() : force_of_path(log, vehicle, folder);
    const Json swapped = take_swapped(log, packing, notes);
    Json streams = streams_of(log, derived ? derived_wings(log, vehicle) : log.wings, packing, notes);
    if (const fs::path file = folder / flightlog::log_file::kWingLoads; fs::exists(file))
      streams["loads"] = loads_of(file, packing, notes);
    if (!winged) {
      streams["path"] = packed("path",
                               {{"t_s", path.t_s, step::kTime_s},
                                {"accel_x_m_s2", path.accel_x_m_s2, step::kForce_m_s2},
                                {"accel_y_m_s2", path.accel_y_m_s2, step::kForce_m_s2},
                                {"accel_z_m_s2", path.accel_z_m_s2, step::kForce_m_s2}},
                               packing, notes);
    }
    list.push_back({{"name", name},
                    {"declared", log.header.vehicle},
                    {"flapping_Hz", log.header.flapping_Hz},
                    {"gravity_m_s2", log.header.gravity_m_s2},
                    {"vehicle", shape_of(vehicle)},
                    {"ambient", json_of(log.header.ambient)},
                    {"wings", !winged     ? "none"
                              : derived   ? "derived"
                              : log.wings ? "recorded"
                                          : "still"},
                    {"latency_s", latency_of(log.header)},
                    {"streams", streams},
                    {"swapped", swapped},
                    {"notes", notes}});
  }
  std::vector<std::string> sources;
  std::string names;
  for (const ShownFlight& f : flights) {
    sources.push_back(f.folder.string());
    names += (names.empty() ? "" : ", ") + f.name;
  }
  Section section("flight", (flights.size() > 1 ? "Flights " : "Flight ") + names, io::joined(sources));
  Json block = {{"kind", "flights"}, {"goal_m", nullptr}, {"flights", list}};
  if (options.goal_m) block["goal_m"] = *options.goal_m;
  section.add(std::move(block));
  add_on_paper(section, flights);
  return section;
}

}  // namespace flappy::view
