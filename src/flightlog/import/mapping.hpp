// What becomes of a recording's channels in a flight log: MAPPING.toml. A complete one, with every key:
//
//   schema = 1
//   vehicle = "hummingbird_nominal.toml"     # these, [ambient] and what is declared of each stream are those of flight.toml
//   vehicle_sha256 = "..."                   # optional
//   flapping_Hz = 34.0
//   gravity_m_s2 = 9.81
//   start = "first"                          # the log's 0 s: "first" sample (default), or that of the "clock"
//
//   [ambient]
//   air_density_kg_m3 = 1.18
//   ground_z_m = 0.0
//   ceiling_z_m = 3.0
//   walls = []
//
//   [clocks.robot]                           # optional; a clock that a stream names is else measured
//   offset_s = 0.0                           # optional: the receiver's time less this clock's
//
//   [command]
//   channel = "/wing_input"                  # a topic; a CSV's is the stem of its name; "*": the only one of the recording
//   inputs = ["left_flap", "tail"]           # optional: columns in place of voltages; [imu] and flapping_Hz are then optional
//   time = "stamp"                           # default; "received", or "field"
//   time_field = "timestamp"                 # with time = "field": where it is, and
//   time_unit = "us"                         # ... in what: "s" (default), "ms", "us", "ns"
//   clock = "robot"                          # whose the stamps are; "receiver" (default): those that say when it was received
//   late_s = 0.02                            # default; a sample that took longer than the stream's quickest by more is counted as late
//   sequence = "tick"                        # optional: a field that counts samples; lost ones are else known by the rate
//   [command.columns]                        # of command.csv: the field of each
//   left_voltage_V = "left_voltage_v"
//   right_voltage_V = "right_voltage_v"
//   [command.scale]                          # optional, as the next: column = scale x field + offset
//   left_voltage_V = 7.4
//   [command.offset]
//   left_voltage_V = 0.0
//   [command.from]                           # optional: columns whose field is of another channel, as it last was
//   right_voltage_V = "/right_wing_input"
//
//   [command.flown]                          # optional: the log lasts from the first to the last sample at which
//   field = "thrust"                         # ... this field of the channel
//   above = 0.0                              # ... is above this
//
//   [mocap]                                  # channel, time and columns as above, roll_rad, pitch_rad, yaw_rad in place of qw to qz where
//                                            # the recording has angles, and
//   world = "enu"                            # default; or "ned": the frame of position and attitude, turned to z up
//   frame = "flu"                            # default; or "frd": the body's, turned to x forward, y left, z up
//   rate_hz = 200                            # optional everywhere: measured
//   latency_s = 0.0                          # from the instant measured to the time taken: 0 for stamps of that instant
//   position_noise_m = 1e-4
//   attitude_noise_rad = 2e-3
//
//   [imu]                                    # frame as above; columns are specific force and rate
//   latency_s, bandwidth_hz, position_m, gyro_noise_rad_s, gyro_bias_sd_rad_s, accel_noise_m_s2
//   gyro = true                              # default; false beside inputs: no gyro, nor its noise and bias
//   [power]                                  # optional
//   battery_nominal_V, latency_s, voltage_noise_V, current_noise_A
//   currents = true                          # default; false beside inputs: battery_V alone
//   [wings]                                  # optional
//   noise_rad
//   [attitude]                               # optional; world and frame as above: a second estimator's
//   latency_s, noise_rad
//
//   [dds]                                    # for flappy-record: io/dds_config.hpp
//
// Angles turn W to B about z by yaw, then about the new y by pitch, then about the new x by roll (Diebel, Representing Attitude, 2006,
// sequence 1-2-3). As y points left, pitch > 0 is nose down: the scale of an angle that is nose up, or in degrees, says so,
// pitch_rad = -0.017453292519943295. With world = "ned" and frame = "frd" they are as in aviation, nose up.
//
// A joint's value is "position[left_stroke]", a transform's "transforms[torso].transform.translation.x".
#pragma once

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

enum class TimeOf { stamp, received, field };

struct ColumnMapping {
  std::string column, channel, field;
  double scale = 1, offset = 0;
};

struct StreamMapping {
  std::string name, channel;  ///< "imu", "/imu"
  TimeOf time = TimeOf::stamp;
  std::string time_field;
  double time_unit_ns = 1e9;
  std::string clock;  ///< kReceiver, or a name
  double late_s = 0.02;
  std::string sequence;  ///< empty: none
  std::vector<ColumnMapping> columns;
  bool frd = false, ned = false, measures_rate = false;
  std::string flown_field;  ///< of the command's: what says that the robot flies; empty: all of it does
  double flown_above = 0;
  io::Table table;  ///< where faults are
};

/// The clock of the times of receipt.
inline const std::string kReceiver = "receiver";

struct Mapping {
  std::filesystem::path file;
  FlightHeader header;  ///< rates that are measured are 0
  bool from_first = true;
  std::map<std::string, double> offsets_s;  ///< of clocks, where given
  io::DdsConfig dds;                        ///< where a recorder finds the robot
  std::vector<StreamMapping> streams;       ///< command, mocap, and imu, power, wings and attitude where mapped

  /// What a recording is read for.
  Wanted wanted() const;
};

/// InputError for what is no mapping.
Mapping read_mapping(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::flightlog
