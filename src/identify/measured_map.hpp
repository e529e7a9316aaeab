// A measured force map, from a laboratory or from simulate-forces.
//
//   amplitude_V,difference_V,bias_V,split_cycle,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm
//   optional, all six: force_x_sd_N, ... torque_z_sd_Nm      standard deviation of each value
//
// Aerodynamic wrench in B, averaged over whole beats; torques about a point that the user declares.
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
  std::vector<Wrench> wrenches;      ///< one for each input
  std::vector<Wrench> sd{};          ///< standard deviations, one for each input; empty where none are declared
  std::vector<std::size_t> lines{};  ///< line in the file for each input; empty: consecutive from line 2

  std::size_t size() const { return inputs.size(); }
  std::size_t line(std::size_t row) const { return lines.empty() ? row + 2 : lines[row]; }
};

std::array<double, 4> numbers_of(const sim::Input& input);
/// "10 V, 0 V, 0 V, 0.03"
std::string text_of(const sim::Input& input);
/// InputError "where: the vehicle comes apart at (...); ...": at an input, wings leave the plausible range.
[[noreturn]] void refuse_apart(const std::string& where, const sim::Input& input);
/// The force map of one vehicle; refuse_apart() with the vehicle's name where a wrench is NaN.
std::vector<Wrench> whole_map(const model::Vehicle& vehicle, const std::vector<sim::Input>& inputs,
                              const MapOptions& options);
inline const std::array<std::string, 4> kInputNames = {"amplitude_V", "difference_V", "bias_V", "split_cycle"};
/// InputError "file:1: column: what is wrong; what is accepted" for a missing or unknown column or another unit.
void check_columns(const io::CsvTable& table, const std::vector<std::string>& required,
                   const std::vector<std::string>& optional);

/// InputError "where: column: ..." for an input that exceeds the driver's limits or is not finite.
void check_limits(const sim::Input& input, const model::Driver& driver, const std::string& where);

/// "force_x_N", ...; "force_x_sd_N", ...
const std::array<std::string, kChannels>& channel_names();
const std::array<std::string, kChannels>& sd_names();
inline bool is_force(int channel) { return channel < 3; }

/// Rows that lack a number, and columns of other names, are left out with a warning. InputError "file:line: column: what
/// is wrong; what is accepted" for a missing column or another unit, a standard deviation that is not above 0, and an
/// input beyond the driver's limits.
MeasuredMap read_measured_map(const std::filesystem::path& path, const model::Driver& driver);
MeasuredMap parse_measured_map(std::string_view text, const std::string& name, const model::Driver& driver);

/// Reads a table with the columns of inputs only, by the same rules; other columns are refused.
std::vector<sim::Input> read_inputs(const std::filesystem::path& path, const model::Driver& driver);

void write_measured_map(const std::filesystem::path& path, const MeasuredMap& map);

std::size_t distinct_inputs(const std::vector<sim::Input>& inputs);

MeasuredMap selected(const MeasuredMap& map, const std::vector<std::size_t>& rows);

/// Moves `count` rows, evenly spread, from `map` to the map returned.
MeasuredMap hold_out(MeasuredMap& map, std::size_t count);

/// InputError where a row of `held` is also in `fitted`, because such a row does not test the fit.
void check_held_out(const MeasuredMap& fitted, const MeasuredMap& held);

/// InputError where forces or torques are zero in every row.
void check_scales(const MeasuredMap& map);

/// The value with three significant digits, without trailing zeros.
std::string in_short(double value);

}  // namespace flappy::identify
