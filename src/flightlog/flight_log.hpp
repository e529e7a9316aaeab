// The log of a flight, in a format that any laboratory can write: a folder with a header and one table for each stream.
//
//   flight.toml   the header: FlightHeader, `schema = 1`
//   command.csv   t_s,left_voltage_V,right_voltage_V; optional: amplitude_V,difference_V,bias_V,split_cycle,
//                 phase_rad. Where [command] declares inputs instead of voltages: t_s and these inputs only
//   mocap.csv     t_s,x_m,y_m,z_m,qw,qx,qy,qz
//   imu.csv       t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2
//   power.csv     optional, declared in [power]: t_s,battery_V,left_current_A,right_current_A
//   attitude.csv  optional, declared in [attitude]: t_s,qw,qx,qy,qz, from a second estimator
//   wings.csv     optional, [wings]: t_s,left_stroke_rad,left_rotation_rad,right_stroke_rad,right_rotation_rad
//   forces.csv    only of a clamped robot, which [rig] declares, in place of mocap.csv and imu.csv:
//                 t_s,force_x_N,force_y_N,force_z_N,moment_x_Nm,moment_y_Nm,moment_z_Nm
//   policy.csv    optional, declared in [policy]: t_s and its numbers, for each inference of an exported policy
//   truth.csv     only from a simulator: the full state; read_flight_log() never opens it, nor joints.csv and
//   wing_loads.csv
//   joints.csv    only from a simulator, articulated wings: angles, rates, torques, power and work of all joints
//
// With declared inputs, imu.csv is optional, may lack a gyro ([imu] gyro = false), and power.csv may lack the currents
// ([power] currents = false).
//
// All streams share one clock; each has its own rate and may have gaps; time increases. World W: z up. Body B: x
// forward, y left, z up. Quaternion w, x, y, z, body to world, of length 1.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/files.hpp"
#include "model/changes.hpp"

namespace flappy::io {
class Table;
}

namespace flappy::flightlog {

/// Longest gap and lowest mean rate of a stream. They bound a log's duration, and so the work of all programs.
inline constexpr double kLongestGap_s = 600, kSlowest_Hz = 0.1;

/// Whether a stream, whose times increase, has a longer gap or a lower rate.
bool is_sparse(const std::vector<double>& t_s);

/// The largest absolute value that a log may have in a column; a name that no stream has is taken for a declared input.
double column_limit(const std::string& column);

/// A vertical wall through (x, y); its normal points into the free space and has length 1.
struct LogWall {
  double x_m = 0, y_m = 0, normal_x = 1, normal_y = 0;
  bool operator==(const LogWall&) const = default;
};

/// The surroundings of the flight. The defaults put ground and ceiling too far away to matter.
struct LogAmbient {
  double air_density_kg_m3 = 1.18, ground_z_m = -1e3, ceiling_z_m = 1e3;
  std::vector<LogWall> walls;
  // Solids in W. Sphere: centre, radius. Box: centre, edges, attitude (w, x, y, z). Cylinder: ends of the axis, radius.
  std::vector<std::array<double, 4>> spheres;
  std::vector<std::array<double, 10>> boxes;
  std::vector<std::array<double, 7>> cylinders;
  bool operator==(const LogAmbient&) const = default;
};

/// What measured the pose in mocap.csv. An estimate is the robot's own, from an estimator on board; where it has no
/// pitch, the pitch was derived from the specific force, which then has no part along x of B.
enum class PoseSource { motion_capture, estimate, estimate_without_pitch };
inline const std::vector<std::string> kPoseSources = {"motion_capture", "estimate", "estimate_without_pitch"};

/// In all headers: noise is the sd of one sample, latency the mean time from the measured instant to t_s.
struct MocapHeader {
  double rate_hz = 0, latency_s = 0, position_noise_m = 0, attitude_noise_rad = 0;
  PoseSource source = PoseSource::motion_capture;
  bool operator==(const MocapHeader&) const = default;
};

struct ImuHeader {
  double rate_hz = 0, latency_s = 0, bandwidth_hz = 0;
  std::array<double, 3> position_m = {0, 0, 0};  ///< in B
  double gyro_noise_rad_s = 0;
  std::array<double, 3> gyro_bias_sd_rad_s = {0, 0, 0};
  double accel_noise_m_s2 = 0;
  bool gyro = true;  ///< whether imu.csv has gyro columns; if not, noise and bias of the gyro are 0
  bool operator==(const ImuHeader&) const = default;
};

/// Voltage at a motor = command x battery_V / battery_nominal_V.
struct PowerHeader {
  double battery_nominal_V = 0, rate_hz = 0, latency_s = 0, voltage_noise_V = 0, current_noise_A = 0;
  bool currents = true;  ///< whether power.csv has current columns; if not, their noise is 0
  bool operator==(const PowerHeader&) const = default;
};

struct WingsHeader {
  double rate_hz = 0, noise_rad = 0;
  bool operator==(const WingsHeader&) const = default;
};

/// A second estimator of the attitude; its noise is that of the rotation vector.
struct AttitudeHeader {
  double rate_hz = 0, latency_s = 0, noise_rad = 0;
  bool operator==(const AttitudeHeader&) const = default;
};

/// A stand that holds the torso, with a six-axis sensor: table [rig]. The log of such a robot has no motion.
struct RigHeader {
  double rate_hz = 0, latency_s = 0;
  std::array<double, 3> position_m = {0, 0, 0};   ///< place of the point about which the sensor gives moments, B
  std::array<double, 4> attitude = {1, 0, 0, 0};  ///< w, x, y, z; turns the sensor's axes to B
  double force_noise_N = 0, moment_noise_Nm = 0;
  double resonance_hz = 0;  ///< lowest natural frequency of the robot on its sensor; 0: not known
  bool operator==(const RigHeader&) const = default;
};

/// How exported C (flappy-export) flew, for its replay: table [flown]. Times are on the log's clock.
struct FlownHeader {
  double start_s = 0;                               ///< flappy_controller_start()
  std::optional<std::array<double, 7>> start_pose;  ///< told to it: m; attitude w, x, y, z
  /// What estimator and feedback remembered then, if they did not start anew: the numbers of flappy_estimator,
  /// flappy_motion and flappy_feedback; and the phase of the beat, 2^32 each.
  std::vector<double> start_memory;
  std::uint32_t start_phase = 0;
  /// By how much the robot takes samples of the IMU to be late, where that is not ImuHeader::latency_s.
  std::optional<double> imu_latency_s;
  std::string mode;  ///< "hover", "stay": flappy_controller_hover(), _stay() after it; "task": neither; "": not known
  std::optional<double> begin_s;                                ///< flappy_controller_begin(): the policy acts
  std::optional<double> hand_back_s;                            ///< when the policy handed back
  std::optional<std::uint32_t> policy_crc32, controller_crc32;  ///< FLAPPY_POLICY_CRC32 of what flew, and so on
  bool operator==(const FlownHeader&) const = default;
};

/// All of flight.toml.
struct FlightHeader {
  std::string vehicle;              ///< name of the vehicle's file, without folder
  std::string vehicle_sha256;       ///< lower-case hex; empty where not declared
  std::string session;              ///< name of the session, as a day or a battery; empty: the flight is its own
  std::vector<std::string> inputs;  ///< columns of command.csv in place of voltages; empty: it has voltages
  double flapping_Hz = 0;           ///< 0 where inputs are declared and nothing flaps
  double gravity_m_s2 = 9.81;
  LogAmbient ambient;
  MocapHeader mocap;
  ImuHeader imu;  ///< rate_hz is 0 where there is no IMU
  std::optional<PowerHeader> power;
  std::optional<WingsHeader> wings;
  std::optional<AttitudeHeader> attitude;
  std::optional<RigHeader> rig;  ///< the robot was clamped: rates of mocap and imu are 0
  /// Columns of policy.csv: "observation_" or "action_" and a name of contract.json. Empty: there is none.
  std::vector<std::string> policy;
  model::Changes changes;  ///< what was done to the robot on purpose before this flight
  std::optional<FlownHeader> flown;
  bool operator==(const FlightHeader&) const = default;
};

using Column = std::vector<double>;

/// The inputs of the wing beat from which the driver computed the voltages.
struct BeatInputs {
  Column amplitude_V, difference_V, bias_V, split_cycle;
  bool operator==(const BeatInputs&) const = default;
};

/// t_s is the time at which the driver applied a sample; it holds until the next sample.
struct CommandStream {
  Column t_s, left_voltage_V, right_voltage_V;
  std::optional<BeatInputs> inputs;
  std::optional<Column> phase_rad;    ///< phase of the beat, 2 pi per beat; wrapped or not
  std::vector<Column> declared = {};  ///< in the order of FlightHeader::inputs; then the voltages are empty
  bool operator==(const CommandStream&) const = default;
};

/// Position of the torso origin in W, and attitude; t_s is the time at which the sample arrived.
struct MocapStream {
  Column t_s, x_m, y_m, z_m, qw, qx, qy, qz;
  bool operator==(const MocapStream&) const = default;
};

/// Rate and specific force in B; t_s is the time of arrival. The rate is empty without a gyro, all without an IMU.
struct ImuStream {
  Column t_s, gyro_x_rad_s, gyro_y_rad_s, gyro_z_rad_s, accel_x_m_s2, accel_y_m_s2, accel_z_m_s2;
  bool operator==(const ImuStream&) const = default;
};

/// Instantaneous, signed values; currents are empty where they are not logged.
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

/// Force and moment of a clamped robot on its sensor, in the sensor's axes.
struct ForcesStream {
  Column t_s, force_x_N, force_y_N, force_z_N, moment_x_Nm, moment_y_Nm, moment_z_Nm;
  bool operator==(const ForcesStream&) const = default;
};

/// What an exported policy got and gave, before any limit; t_s is the time of the inference.
struct PolicyStream {
  Column t_s;
  std::vector<Column> numbers;  ///< in the order of FlightHeader::policy
  bool operator==(const PolicyStream&) const = default;
};

struct FlightLog {
  FlightHeader header;
  CommandStream command;
  MocapStream mocap;
  ImuStream imu;
  std::optional<PowerStream> power;  ///< this and the next three: only where the header declares them
  std::optional<WingsStream> wings;
  std::optional<AttitudeStream> attitude;
  std::optional<ForcesStream> forces;  ///< only of a clamped robot; then mocap and imu are empty
  std::optional<PolicyStream> policy;
  bool operator==(const FlightLog&) const = default;
};

namespace log_file {
inline const std::string kHeader = "flight.toml", kCommand = "command.csv", kMocap = "mocap.csv", kImu = "imu.csv",
                         kPower = "power.csv", kWings = "wings.csv", kAttitude = "attitude.csv", kForces = "forces.csv",
                         kPolicy = "policy.csv", kTruth = "truth.csv", kJoints = "joints.csv",
                         kWingLoads = "wing_loads.csv";
inline const std::vector<std::string> kAll = {kHeader,   kCommand, kMocap,  kImu,   kPower,  kWings,
                                              kAttitude, kForces,  kPolicy, kTruth, kJoints, kWingLoads};
}  // namespace log_file

/// Columns of wing_loads.csv: means over the control period before t_s.
inline const std::vector<std::string> kWingLoadNames = [] {
  std::vector<std::string> names = {"t_s"};
  for (const std::string side : {"left_", "right_"})
    for (const char* what : {"force_x_N", "force_y_N", "force_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm",
                             "lift_N", "drag_N", "aerodynamic_power_W", "mechanical_power_W"})
      names.push_back(side + what);
  return names;
}();

/// Columns of truth.csv: pose, motion and wings of the flapper, and the bias of its gyro.
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

/// Key vehicle: the name of a file, without folder.
std::string read_vehicle_name(const io::Table& root);
LogAmbient read_ambient(const io::Table& ambient);

/// Keys of flight.toml and of mappings: [command] inputs, [policy] numbers, flapping_Hz, [mocap] source, [imu] gyro, [power] currents.
std::vector<std::string> read_inputs(const io::Table& command);
/// Table [rig] without its rate.
RigHeader read_rig(const io::Table& rig);
std::vector<std::string> read_policy_numbers(const io::Table& policy);
double read_flapping(const io::Table& root, const std::vector<std::string>& inputs);
PoseSource read_pose_source(const io::Table& mocap, bool declared_inputs);
bool read_gyro(const io::Table& imu, bool declared_inputs);
bool read_currents(const io::Table& power, bool declared_inputs);

/// Texts of the files of a log by name, without truth.csv.
using LogFiles = std::map<std::string, std::string>;

/// InputError "folder/file:line: column: what is wrong; what is accepted" for a missing, unknown or faulty file or
/// column, for time that does not increase, for a quaternion whose length differs from 1 by more than 1e-3 (others are
/// normalised), and for streams that never overlap. Warns where the file of a declared optional stream is missing.
FlightLog read_flight_log(const std::filesystem::path& folder);

/// Reads a log from texts; `folder` is the place that error messages name.
FlightLog parse_flight_log(const LogFiles& files, const std::filesystem::path& folder);

/// InputError "place: ..." where the log has declared inputs. A log with voltages always has an IMU with a gyro.
void require_voltages(const FlightLog& log, const std::string& place);

/// InputError "place: ..." for the log of a clamped robot.
void require_flown(const FlightLog& log, const std::string& place);

/// The folder itself if it is a flight log, else the flight logs in it by name; none: empty.
std::vector<std::filesystem::path> flights_in(const std::filesystem::path& folder);

/// InputError where one folder is given twice, even under two names.
void check_each_once(const std::vector<std::string>& folders);

/// Texts that parse_flight_log() reads back exactly; quaternions only where their length is 1 to the last digits.
LogFiles flight_log_files(const FlightLog& log);

/// Writes a log whole or not at all, replacing a flight log with all its files, truth.csv and vehicle included.
/// InputError if the folder holds other files or cannot be written, or if read_flight_log() would refuse the log.
void write_flight_log(const std::filesystem::path& folder, const FlightLog& log);
/// InputError where `folder` exists and holds anything that does not belong to a flight log.
void require_replaceable(const std::filesystem::path& folder);

/// Adds truth.csv to a log; all `columns` have one length. InputError if the folder holds no flight log.
void write_truth(const std::filesystem::path& folder, const std::vector<std::string>& names,
                 const std::vector<Column>& columns);

/// Adds the vehicle file under the `name` that the header declares. InputError if the folder holds no flight log.
void write_vehicle(const std::filesystem::path& folder, const std::string& name, std::string_view text);

}  // namespace flappy::flightlog
