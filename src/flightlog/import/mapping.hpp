// MAPPING.toml: how the channels of a recording become the streams of a flight log. A complete one, with every key:
//
//   schema = 1
//   vehicle = "hummingbird_nominal.toml"     # this, [ambient] and each stream's declared values: as in flight.toml
//   vehicle_sha256 = "..."                   # optional
//   flapping_Hz = 34.0
//   gravity_m_s2 = 9.81
//   start = "first"                          # the log's 0 s: "first" sample (default), or 0 of the receiver's "clock"
//
//   [ambient]
//   air_density_kg_m3 = 1.18
//   ground_z_m = 0.0
//   ceiling_z_m = 3.0
//   walls = []
//
//   [clocks.robot]                           # optional; without it, a clock that a stream names is measured
//   offset_s = 0.0                           # optional: the receiver's time less this clock's
//
//   [command]
//   channel = "/wing_input"                  # a topic; of a CSV, its file's stem; "*": the only channel
//   inputs = ["left_flap", "tail"]           # optional: columns in place of voltages; then [imu], flapping_Hz optional
//   time = "stamp"                           # default; "received", "field", or "frame"
//   frame_rate_hz = 5000.0                   # with time = "frame": row n of a table, from 0, is n/frame_rate_hz
//   time_field = "timestamp"                 # the field of the time, with time = "field"; or two: ["date", "time"]
//   time_unit = "us"                         # its unit: "s", "ms", "us", "ns"; default: as the table says, else "s"
//   clock = "robot"                          # the clock of the stamps; "receiver" (default): of times of receipt
//   late_s = 0.02                            # default; late: delayed by more than this beyond the stream's least
//   sequence = "tick"                        # optional: field that counts samples; else the rate gives the lost ones
//   [command.columns]                        # the field for each column of command.csv
//   left_voltage_V = "left_voltage_v"
//   right_voltage_V = "right_voltage_v"
//   [command.scale]                          # optional, like [command.offset]: column = scale x field + offset;
//                                            # default: by the unit that a table's row of units says, else 1
//   left_voltage_V = 7.4
//   [command.offset]
//   left_voltage_V = 0.0
//   [command.from]                           # optional: columns from another channel, whose last value holds
//   right_voltage_V = "/right_wing_input"
//
//   [command.flown]                          # optional: the log lasts from the first to the last sample where
//   field = "thrust"                         # ... this field of the channel is
//   above = 0.0                              # ... above this value
//
//   [mocap]                                  # keys as above; roll_rad, pitch_rad, yaw_rad may replace qw to qz
//   world = "enu"                            # frame of position and attitude. "ned" is turned to east, north, up,
//                                            # "ned_x_north" to north, west, up
//                                            # "y_up" (y up) to x, -z, y
//   frame = "flu"                            # default; or "frd": frame of the body; turned to x forward, y left, z up.
//                                            # Of mocap also "fur" (y up, z right), "luf" (x left, y up, z forward)
//   body = "robot"                           # in place of columns: a rigid body of an export of Motive, QTM, Vicon
//   rotation = "vector"                      # what three numbers of its rotation are, where the file does not say:
//                                            # axis times angle, or angles about axes of the body in turn, as "xyz"
//   [mocap.markers]                          # in place of columns: places of markers in B, m, at least three
//   nose = [0.05, 0.0, 0.01]
//   tolerance_m = 0.005                      # of [mocap]; default; a marker farther from its place is a wrong one
//   [mocap.at_rest]                          # gives these places instead; then markers = ["nose", ...] of [mocap]
//   file = "rest.csv"                        # the robot at rest and level
//   position_m = [0.0, 0.0, 0.03]            # of B's origin in W
//   yaw_rad = 0.0                            # default
//   unit_m = 1.0                             # unit of markers, m; default: the table's row of units, else 1
//   rate_hz = 200                            # optional in every stream; measured if missing
//   latency_s = 0.0                          # time used less measured instant; 0 if the stamp is that instant
//   position_noise_m = 1e-4
//   attitude_noise_rad = 2e-3
//   source = "motion_capture"                # default; or, with declared inputs, "estimate": the robot's own. Or
//                                            # "estimate_without_pitch": columns x_m, y_m, z_m, roll_rad, yaw_rad and
//                                            # acceleration_x_m_s2, ..., in W without gravity, which give the pitch
//
//   [imu]                                    # frame as above; columns are specific force and rate
//   latency_s, bandwidth_hz, position_m, gyro_noise_rad_s, gyro_bias_sd_rad_s, accel_noise_m_s2
//   gyro = true                              # default; false, with declared inputs only: no gyro, noise, bias
//   [power]                                  # optional
//   battery_nominal_V, latency_s, voltage_noise_V, current_noise_A
//   currents = true                          # default; false, with declared inputs only: battery_V alone
//   [wings]                                  # optional
//   noise_rad
//   [wings.points]                           # in place of columns: digitised points (wing_film.hpp), by their names in
//   left_root = "pt1"                        # the table; also left_tip, left_trailing, right_root, right_tip,
//                                            # right_trailing
//   unit_m = 1e-3                            # unit of the points, m; default as in [mocap]
//   length_tolerance = 0.1                   # default; a length that differs by a larger share from its median is wrong
//   stroke_plane_rad = 0.0                   # default; Phi of model/jointed.hpp
//   [wings.markers]                          # points of the body, as in [mocap], with tolerance_m and at_rest; or
//   attitude = [1.0, 0.0, 0.0, 0.0]          # default; a clamped robot's: turns the axes of the points to B
//   world = "enu"                            # axes of the points, where [mocap] gives the attitude
//   [rig]                                    # of a clamped robot, in place of mocap and imu: columns are those of
//                                            # forces.csv, other keys those of [rig] in flight.toml
//   [attitude]                               # optional: attitude of a second estimator; world and frame as above
//   latency_s, noise_rad
//   [policy]                                 # optional: what an exported policy got and gave
//   numbers = ["observation_x_error", ...]   # names of its columns (FlightHeader::policy)
//
//   [dds]                                    # for flappy-record: io/dds_config.hpp
//
// Angles turn W to B about z by yaw, then the new y by pitch, then the new x by roll (Diebel, Representing Attitude,
// 2006, sequence 1-2-3). As y points left, pitch > 0 is nose down; degrees, nose up, need the scale
// pitch_rad = -0.017453292519943295. With world = "ned" and frame = "frd" angles are as in aviation, nose up.
//
// Fields of named elements: "position[left_stroke]" (joint), "transforms[torso].transform.translation.x" (transform).
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "flightlog/import/channels.hpp"
#include "io/config.hpp"
#include "io/dds_config.hpp"

namespace flappy::flightlog {

/// Keys of [wings.points]: of each wing two points of its axis of rotation, and one behind it.
inline constexpr std::array kWingPoints = {"left_root",  "left_tip",  "left_trailing",
                                           "right_root", "right_tip", "right_trailing"};

enum class TimeOf { stamp, received, field };
enum class World { enu, ned, ned_x_north, y_up };
/// Axes of a body: forward-left-up, forward-right-down, forward-up-right, left-up-forward.
enum class Axes { flu, frd, fur, luf };

/// Names that a field may have: the first of them that a recording has counts.
using FieldNames = std::vector<std::string>;
struct ColumnMapping {
  std::string column, channel;
  FieldNames fields;
  std::optional<double> scale;  ///< none: by the unit that the recording says, else 1
  double offset = 0;
};

/// A recording of the robot at rest and level, which gives the markers' places in B.
struct AtRest {
  std::filesystem::path file;
  std::vector<double> position_m;  ///< of B's origin in W
  double yaw_rad = 0;              ///< of B
};

struct StreamMapping {
  std::string name, channel;  ///< "imu", "/imu"
  TimeOf time = TimeOf::stamp;
  FieldNames time_fields;              ///< with TimeOf::field: one, or two whose sum is the time: date and time of day
  std::optional<double> time_unit_ns;  ///< none: as the recording says, else 1e9
  std::string clock;                   ///< kReceiver, or a name in Mapping::offsets_s or of a clock to measure
  double late_s = 0.02;
  std::string sequence;  ///< empty: none
  std::vector<ColumnMapping> columns;
  World world = World::enu;
  Axes axes = Axes::flu;
  bool says_world = false, says_axes = false, measures_rate = false;
  std::string body;  ///< of an export of motion capture, in place of columns; empty: none
  std::string
      rotation;  ///< what three numbers of its rotation are: "vector", or axes of angles, as "xyz"; empty: not said
  std::vector<std::string> markers;                  ///< whose places give the pose, in place of columns; empty: none
  std::vector<std::vector<double>> marker_places_m;  ///< in B; empty until place_markers() where at_rest gives them
  double tolerance_m = 0.005;                        ///< a marker farther from its place is a wrong one
  std::optional<double> unit_m;                      ///< unit of markers and points; none: the table's, else 1 m
  std::vector<std::string> points;  ///< [kWingPoints] names of the wings' points; empty: columns instead
  double stroke_plane_rad = 0, length_tolerance = 0.1;           ///< with points
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< with points of a clamped robot: to B
  std::optional<AtRest> at_rest;
  FieldNames flown_fields;  ///< command stream only: what is above flown_above in flight; empty: the whole log
  double flown_above = 0;
  io::Table table;  ///< the stream's table in the file, for error messages
};

/// Name of the clock of the times of receipt.
inline const std::string kReceiver = "receiver";

struct Mapping {
  std::filesystem::path file;
  FlightHeader header;     ///< rates still to be measured are 0
  bool from_first = true;  ///< whether the log's 0 s is the first sample; else 0 of the receiver's clock
  std::map<std::string, double> offsets_s;  ///< given offsets of clocks
  io::DdsConfig dds;                        ///< how a recorder reaches the robot
  std::vector<StreamMapping> streams;       ///< command, mocap, and imu, power, wings, attitude and policy where mapped

  Wanted wanted() const;
  Wanted wanted_times() const;  ///< those of them that are times
};

/// Fields that a table may have for a coordinate of a point, as "pt1_X" of "pt1".
FieldNames point_fields(const std::string& name, std::size_t axis);

/// InputError "file:line:column: key: ..." for a file that is no valid mapping.
Mapping read_mapping(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::flightlog
