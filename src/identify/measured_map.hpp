// A measured force map: what a laboratory hands in, or what simulate-forces writes.
//
//   amplitude_V,difference_V,bias_V,split_cycle,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm
//   optional, all six: force_x_sd_N, ... torque_z_sd_Nm      standard deviation of each value
//
// Aerodynamic wrench in B, averaged over whole beats; torques about a point the user declares.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "identify/force_map.hpp"
#include "io/csv.hpp"

namespace flappy::identify {

struct MeasuredMap {
  std::string name;  ///< the file, for messages
  std::vector<sim::Input> inputs;
  std::vector<Wrench> wrenches;  ///< one for each input
  std::vector<Wrench> sd;        ///< the same, or empty where none is declared

  std::size_t size() const { return inputs.size(); }
};

/// The columns of an input.
inline const std::array<std::string, 4> kInputNames = {"amplitude_V", "difference_V", "bias_V", "split_cycle"};
/// InputError "file:1: column: what is wrong; what is accepted" for a column that is missing, unknown or in another unit.
void check_columns(const io::CsvTable& table, const std::vector<std::string>& required,
                   const std::vector<std::string>& optional);

/// InputError "where: column: ..." for an input beyond the driver's limits, or no number.
void check_limits(const sim::Input& input, const model::Driver& driver, const std::string& where);

/// "force_x_N", ...; "force_x_sd_N", ...
const std::array<std::string, kChannels>& channel_names();
const std::array<std::string, kChannels>& sd_names();
inline bool is_force(int channel) { return channel < 3; }

/// InputError "file:line: column: what is wrong; what is accepted" for a column that is missing, unknown or in another
/// unit, a value that is no finite number, a standard deviation that is not above 0, an input beyond the driver's limits.
MeasuredMap read_measured_map(const std::filesystem::path& path, const model::Driver& driver);
MeasuredMap parse_measured_map(std::string_view text, const std::string& name, const model::Driver& driver);

/// The columns of inputs alone, by the same rules; further columns are refused.
std::vector<sim::Input> read_inputs(const std::filesystem::path& path, const model::Driver& driver);

void write_measured_map(const std::filesystem::path& path, const MeasuredMap& map);

/// Slope of a channel against an input, the other inputs held.
struct Slope {
  double value = 0, sd = 0;
};
/// Least squares of each channel on the four inputs and a constant: [input][channel]. Inputs that do not vary have slope
/// 0, sd 0.
std::array<std::array<Slope, kChannels>, 4> slopes(const std::vector<sim::Input>& inputs,
                                                   const std::vector<Wrench>& wrenches);

/// InputError where thrust, roll, pitch or yaw answers its input with the sign opposite to the simulated map's, by more
/// than 4 standard deviations on both sides, or where another torque answers in its place.
void check_signs(const MeasuredMap& measured, const std::vector<Wrench>& simulated);

/// `count` of the rows, evenly spread, leave `map` for the map returned.
MeasuredMap hold_out(MeasuredMap& map, std::size_t count);

}  // namespace flappy::identify
