// The log of a flight, as any laboratory can write it: a folder of one header and one table for each stream.
//
//   flight.toml   what is declared: FlightHeader, `schema = 1`
//   command.csv   t_s,left_voltage_V,right_voltage_V; optional: amplitude_V,difference_V,bias_V,split_cycle and phase_rad.
//                 Of a robot without such motors: t_s and the inputs that [command] declares, nothing else
//   mocap.csv     t_s,x_m,y_m,z_m,qw,qx,qy,qz
//   imu.csv       t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2
//   power.csv     optional, declared in [power]: t_s,battery_V,left_current_A,right_current_A
//   attitude.csv  optional, declared in [attitude]: t_s,qw,qx,qy,qz, as a second estimator had it
//   wings.csv     optional, declared in [wings]: t_s,left_stroke_rad,left_rotation_rad,right_stroke_rad,right_rotation_rad
//   truth.csv     only from a simulator: the full state; no reader here opens it
//   joints.csv    the same of vehicles with driven wings: angles, rates and torques of all joints, power and work of their muscles
//
// Where inputs are declared, imu.csv is optional as well; [imu] gyro = false: it has no gyro; [power] currents = false:
// power.csv has the battery alone.
//
// All streams share one clock; each has its own rate and may have gaps; time increases. World W: z up. Body B: x
// forward, y left, z up. Quaternion w, x, y, z, body to world, of length 1.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/files.hpp"

namespace flappy::io {
class Table;
}

namespace flappy::flightlog {

/// Longest gap within a stream of a log, and lowest mean rate of a stream: the work of programs grows with a flight's duration, and so stays bounded.
inline constexpr double kLongestGap_s = 600, kSlowest_Hz = 0.1;

/// The largest magnitude that a log may have in a column, of any stream or of declared inputs.
double column_limit(const std::string& column);

/// A vertical wall through (x, y); its normal points into the free space and has length 1.
struct LogWall {
  double x_m = 0, y_m = 0, normal_x = 1, normal_y = 0;
  bool operator==(const LogWall&) const = default;
};

/// What surrounded the flight; far away where there was none.
struct LogAmbient {
  double air_density_kg_m3 = 1.18, ground_z_m = -1e3, ceiling_z_m = 1e3;
  std::vector<LogWall> walls;
  // solids in the room, optional: centre and radius; centre, edges and attitude (w, x, y, z); ends of the axis and radius
  std::vector<std::array<double, 4>> spheres;
  std::vector<std::array<double, 10>> boxes;
  std::vector<std::array<double, 7>> cylinders;
  bool operator==(const LogAmbient&) const = default;
};

/// Noise is the standard deviation of one sample, latency the mean from the instant measured to the sample's t_s.
struct MocapHeader {
  double rate_hz = 0, latency_s = 0, position_noise_m = 0, attitude_noise_rad = 0;
  bool operator==(const MocapHeader&) const = default;
};

struct ImuHeader {
  double rate_hz = 0, latency_s = 0, bandwidth_hz = 0;
  std::array<double, 3> position_m = {0, 0, 0};  ///< in B
  double gyro_noise_rad_s = 0;
  std::array<double, 3> gyro_bias_sd_rad_s = {0, 0, 0};
  double accel_noise_m_s2 = 0;
  bool gyro = true;  ///< whether imu.csv has one; without, its noise and bias are 0
  bool operator==(const ImuHeader&) const = default;
};

/// Voltage at a motor = command x battery_V / battery_nominal_V.
struct PowerHeader {
  double battery_nominal_V = 0, rate_hz = 0, latency_s = 0, voltage_noise_V = 0, current_noise_A = 0;
  bool currents = true;  ///< whether power.csv has them; without, their noise is 0
  bool operator==(const PowerHeader&) const = default;
};

struct WingsHeader {
  double rate_hz = 0, noise_rad = 0;
  bool operator==(const WingsHeader&) const = default;
};

/// Of a second estimator's attitude, as a rotation vector.
struct AttitudeHeader {
  double rate_hz = 0, latency_s = 0, noise_rad = 0;
  bool operator==(const AttitudeHeader&) const = default;
};

/// All of flight.toml.
struct FlightHeader {
  std::string vehicle;              ///< name of the vehicle's file as declared, without folder
  std::string vehicle_sha256;       ///< of that file's bytes, lower-case hex; empty where not declared
  std::vector<std::string> inputs;  ///< columns of command.csv in place of voltages; empty: it has voltages
  double flapping_Hz = 0;           ///< 0 where inputs are declared and nothing flaps
  double gravity_m_s2 = 9.81;
  LogAmbient ambient;
  MocapHeader mocap;
  ImuHeader imu;  ///< of rate 0 where there is none
  std::optional<PowerHeader> power;
  std::optional<WingsHeader> wings;
  std::optional<AttitudeHeader> attitude;
  bool operator==(const FlightHeader&) const = default;
};

using Column = std::vector<double>;

/// The inputs of the wing beat that made the voltages.
struct BeatInputs {
  Column amplitude_V, difference_V, bias_V, split_cycle;
  bool operator==(const BeatInputs&) const = default;
};

/// t_s is when the driver applied the voltages, or the inputs; they hold until the next.
struct CommandStream {
  Column t_s, left_voltage_V, right_voltage_V;
  std::optional<BeatInputs> inputs;
  std::optional<Column> phase_rad;    ///< of the beat, 2 pi each; wrapped or not
  std::vector<Column> declared = {};  ///< in the order of FlightHeader::inputs; where they are, there are no voltages
  bool operator==(const CommandStream&) const = default;
};

/// The torso origin in W; t_s is when the sample arrived.
struct MocapStream {
  Column t_s, x_m, y_m, z_m, qw, qx, qy, qz;
  bool operator==(const MocapStream&) const = default;
};

/// Rate and specific force in B, the rate empty where there is no gyro, all where there is no IMU; t_s is when the sample arrived.
struct ImuStream {
  Column t_s, gyro_x_rad_s, gyro_y_rad_s, gyro_z_rad_s, accel_x_m_s2, accel_y_m_s2, accel_z_m_s2;
  bool operator==(const ImuStream&) const = default;
};

/// Instantaneous and signed; currents empty where they are not logged.
struct PowerStream {
  Column t_s, battery_V, left_current_A, right_current_A;
  bool operator==(const PowerStream&) const = default;
};

struct WingsStream {
  Column t_s, left_stroke_rad, left_rotation_rad, right_stroke_rad, right_rotation_rad;
  bool operator==(const WingsStream&) const = default;
};

struct AttitudeStream {
  Column t_s, qw, qx, qy, qz;
  bool operator==(const AttitudeStream&) const = default;
};

struct FlightLog {
  FlightHeader header;
  CommandStream command;
  MocapStream mocap;
  ImuStream imu;
  std::optional<PowerStream> power;  ///< only where the header has it, as the next
  std::optional<WingsStream> wings;
  std::optional<AttitudeStream> attitude;
  bool operator==(const FlightLog&) const = default;
};

/// The names of the files.
namespace log_file {
inline const std::string kHeader = "flight.toml", kCommand = "command.csv", kMocap = "mocap.csv", kImu = "imu.csv",
                         kPower = "power.csv", kWings = "wings.csv", kAttitude = "attitude.csv", kTruth = "truth.csv",
                         kJoints = "joints.csv";
inline const std::vector<std::string> kAll = {kHeader, kCommand,  kMocap, kImu,   kPower,
                                              kWings,  kAttitude, kTruth, kJoints};
}  // namespace log_file

/// Columns of truth.csv: pose, motion and wings, as the flapper has them, and its gyro's bias.
inline const std::vector<std::string> kMotionNames = {"t_s",
                                                      "x_m",
                                                      "y_m",
                                                      "z_m",
                                                      "qw",
                                                      "qx",
                                                      "qy",
                                                      "qz",
                                                      "velocity_x_m_s",
                                                      "velocity_y_m_s",
                                                      "velocity_z_m_s",
                                                      "rate_x_rad_s",
                                                      "rate_y_rad_s",
                                                      "rate_z_rad_s",
                                                      "left_stroke_rad",
                                                      "left_rotation_rad",
                                                      "right_stroke_rad",
                                                      "right_rotation_rad",
                                                      "left_stroke_rate_rad_s",
                                                      "left_rotation_rate_rad_s",
                                                      "right_stroke_rate_rad_s",
                                                      "right_rotation_rate_rad_s",
                                                      "left_stroke_acceleration_rad_s2",
                                                      "left_rotation_acceleration_rad_s2",
                                                      "right_stroke_acceleration_rad_s2",
                                                      "right_rotation_acceleration_rad_s2",
                                                      "gyro_bias_x_rad_s",
                                                      "gyro_bias_y_rad_s",
                                                      "gyro_bias_z_rad_s"};

/// Reads the keys of [ambient].
LogAmbient read_ambient(const io::Table& ambient);

/// `inputs`, `flapping_Hz`, `gyro` of [imu] and `currents` of [power], as a log and the mapping of an import have them.
std::vector<std::string> read_inputs(const io::Table& command);
double read_flapping(const io::Table& root, const std::vector<std::string>& inputs);
bool read_gyro(const io::Table& imu, bool declared_inputs);
bool read_currents(const io::Table& power, bool declared_inputs);

/// Texts of the files of a log by name, truth.csv left out.
using LogFiles = std::map<std::string, std::string>;

/// Reads a log. InputError "folder/file:line: column: what is wrong; what is accepted" for a file or column that is
/// missing, unknown or faulty, time that does not increase, a quaternion whose length is not 1 to 1e-3 (others are
/// normalised), and streams that never overlap. Warns of an optional stream that is declared without its file, and does
/// without it. Never opens truth.csv.
FlightLog read_flight_log(const std::filesystem::path& folder);

/// The same from texts; `folder` stands for the place in messages.
FlightLog parse_flight_log(const LogFiles& files, const std::filesystem::path& folder);

/// InputError "place: ..." where inputs are declared, of what needs voltages, and with them an IMU that has a gyro.
void require_voltages(const FlightLog& log, const std::string& place);

/// InputError where one of these folders is given twice, under whatever name.
void check_each_once(const std::vector<std::string>& folders);

/// The texts that parse_flight_log reads back exactly, quaternions to the last digit where their length is 1.
LogFiles flight_log_files(const FlightLog& log);

/// Writes a log as a whole or not at all. The folder is created, or replaced, truth.csv, vehicle and all, if it is a
/// flight log already. InputError if it holds anything else, if it cannot be written, or if the log would be refused when read.
void write_flight_log(const std::filesystem::path& folder, const FlightLog& log);

/// Adds truth.csv to a log; columns of one length. InputError if the folder holds no flight log.
void write_truth(const std::filesystem::path& folder, const std::vector<std::string>& names,
                 const std::vector<Column>& columns);

/// Adds the file of the vehicle, `name` as the header declares it, so that the folder stands alone. InputError as above.
void write_vehicle(const std::filesystem::path& folder, const std::string& name, std::string_view text);

}  // namespace flappy::flightlog
