#include "identify/measured_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "io/log.hpp"
#include "io/text.hpp"

namespace flappy::identify {
namespace {

using Names = std::vector<std::string>;

std::string unit_of(const std::string& name) { return name.substr(name.rfind('_') + 1); }

/// The known column that differs from `wrong` in its unit only; empty when there is none.
std::string but_for_its_unit(const std::string& wrong, const Names& known) {
  static const std::set<std::string> kUnits = {"V", "N", "Nm", "rad", "s"};
  const std::string stem = wrong.substr(0, wrong.size() - unit_of(wrong).size());
  if (std::ranges::any_of(known, [&](const std::string& name) { return name.starts_with(wrong + "_"); })) return "";
  for (const std::string& name : known)
    if (kUnits.contains(unit_of(name)) && name == stem + unit_of(name)) return name;
  return "";
}

/// Leaves out rows that lack a number, with a warning; `lines` become those of the rows that are left.
void leave_out_incomplete(io::CsvTable& table, std::vector<std::size_t>& lines) {
  std::vector<std::size_t> whole;
  std::string first;
  const std::size_t rows = table.columns.front().size();
  for (std::size_t i = 0; i < rows; ++i) {
    const auto lacking = std::ranges::find_if(table.columns, [&](const auto& c) { return std::isnan(c[i]); });
    if (lacking == table.columns.end()) whole.push_back(i);
    else if (whole.size() == i)
      first = "; " + table.names[static_cast<std::size_t>(lacking - table.columns.begin())] + " is no number in line " +
              std::to_string(i + 2);
  }
  for (const std::size_t i : whole) lines.push_back(i + 2);
  if (whole.size() == rows) return;
  for (std::vector<double>& column : table.columns) {
    std::vector<double> kept;
    for (const std::size_t i : whole) kept.push_back(column[i]);
    column = std::move(kept);
  }
  io::log(io::LogLevel::warning, table.name + ": " + std::to_string(rows - whole.size()) + " of " +
                                     std::to_string(rows) + " rows left out" + first);
}

std::vector<sim::Input> inputs_of(const io::CsvTable& table, const model::Driver& driver,
                                  const std::vector<std::size_t>& lines = {}) {
  std::vector<sim::Input> inputs(table.columns.front().size());
  if (inputs.empty()) throw io::InputError(table.name + ":1: has no rows; accepted: a row for each input");
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::array<double, 4> u{};
    for (std::size_t k = 0; k < 4; ++k) u[k] = table.column(kInputNames[k])[i];
    inputs[i] = {u[0], u[1], u[2], u[3]};
    check_limits(inputs[i], driver, table.name + ":" + std::to_string(lines.empty() ? i + 2 : lines[i]));
  }
  return inputs;
}

/// InputError for a column that is probably meant for one that is missing; else a warning of those that are not read.
void check_others(const io::CsvTable& table, const Names& others, const Names& known) {
  Names missing = known;
  std::erase_if(missing, [&](const std::string& name) { return std::ranges::count(table.names, name) > 0; });
  io::CsvTable meant{table.name, {}, {}};
  for (const std::string& name : others)
    if (meant.names.empty() && (!but_for_its_unit(name, missing).empty() || !io::nearest_name(name, missing).empty()))
      meant.names = {name};
  check_columns(meant, {}, known);
  if (!others.empty())
    io::log(io::LogLevel::warning, table.name + ": columns that are not read: " + io::joined(others));
}

MeasuredMap map_of(std::string_view text, const std::string& name, const model::Driver& driver) {
  Names required(kInputNames.begin(), kInputNames.end()), known, others;
  required.insert(required.end(), channel_names().begin(), channel_names().end());
  const Names optional(sd_names().begin(), sd_names().end());
  known = required;
  known.insert(known.end(), optional.begin(), optional.end());
  io::CsvTable table = io::parse_csv(text, name, known, others);
  check_others(table, others, known);
  check_columns(table, required, optional);
  std::vector<std::size_t> lines;
  leave_out_incomplete(table, lines);
  MeasuredMap map{table.name, inputs_of(table, driver, lines), {}};
  if (lines.size() != lines.back() - 1) map.lines = lines;
  map.wrenches.resize(map.size());
  const bool declared =
      std::ranges::any_of(optional, [&](const auto& n) { return std::ranges::count(table.names, n); });
  if (declared) {
    check_columns(table, optional, required);
    map.sd.resize(map.size());
  }
  for (std::size_t i = 0; i < map.size(); ++i)
    for (std::size_t k = 0; k < kChannels; ++k) {
      map.wrenches[i][k] = table.column(channel_names()[k])[i];
      if (!declared) continue;
      map.sd[i][k] = table.column(sd_names()[k])[i];
      if (!(map.sd[i][k] > 0))
        throw io::InputError(table.name + ":" + std::to_string(map.line(i)) + ": " + sd_names()[k] + ": " +
                             io::shortest_digits(map.sd[i][k]) +
                             " is no standard deviation; accepted: a number above 0");
    }
  return map;
}

}  // namespace

void check_columns(const io::CsvTable& table, const Names& required, const Names& optional) {
  // Unknown columns first: one in a wrong unit is both unknown and missing, and the message must name the unit.
  Names known = required;
  known.insert(known.end(), optional.begin(), optional.end());
  for (const std::string& name : table.names) {
    if (std::ranges::count(known, name) > 0) continue;
    const std::string meant = but_for_its_unit(name, known);
    throw io::InputError(
        table.name + ":1: " + name + ": " +
        (meant.empty() ? "unknown column; accepted: " + io::joined(known) + io::did_you_mean(name, known)
                       : "wrong unit " + unit_of(name) + ", expected " + unit_of(meant) + "; accepted: " + meant));
  }
  for (const std::string& name : required)
    if (std::ranges::count(table.names, name) == 0)
      throw io::InputError(table.name + ":1: " + name + ": column is missing; accepted: " + io::joined(required) +
                           (optional.empty() ? "" : ", optional " + io::joined(optional)));
}

void check_limits(const sim::Input& input, const model::Driver& driver, const std::string& where) {
  const std::array<double, 4> limits = {driver.amplitude_limit_V, driver.difference_limit_V, driver.bias_limit_V,
                                        driver.split_cycle_limit};
  const std::array<double, 4> u = numbers_of(input);
  for (std::size_t k = 0; k < 4; ++k) {
    const double low = k == 0 ? 0 : -limits[k];
    if (!(u[k] >= low && u[k] <= limits[k]))
      throw io::InputError(where + ": " + kInputNames[k] + ": " + io::shortest_digits(u[k]) +
                           " is beyond the vehicle's limits; accepted: " + io::shortest_digits(low) + " to " +
                           io::shortest_digits(limits[k]));
  }
}

const std::array<std::string, kChannels>& channel_names() {
  static const std::array<std::string, kChannels> names = {"force_x_N",   "force_y_N",   "force_z_N",
                                                           "torque_x_Nm", "torque_y_Nm", "torque_z_Nm"};
  return names;
}

const std::array<std::string, kChannels>& sd_names() {
  static const std::array<std::string, kChannels> names = {"force_x_sd_N",   "force_y_sd_N",   "force_z_sd_N",
                                                           "torque_x_sd_Nm", "torque_y_sd_Nm", "torque_z_sd_Nm"};
  return names;
}

MeasuredMap read_measured_map(const std::filesystem::path& path, const model::Driver& driver) {
  return map_of(io::read_text(path), path.string(), driver);
}

MeasuredMap parse_measured_map(std::string_view text, const std::string& name, const model::Driver& driver) {
  return map_of(text, name, driver);
}

std::vector<sim::Input> read_inputs(const std::filesystem::path& path, const model::Driver& driver) {
  const io::CsvTable table = io::read_csv(path);
  check_columns(table, {kInputNames.begin(), kInputNames.end()}, {});
  return inputs_of(table, driver);
}

void write_measured_map(const std::filesystem::path& path, const MeasuredMap& map) {
  Names names(kInputNames.begin(), kInputNames.end());
  names.insert(names.end(), channel_names().begin(), channel_names().end());
  if (!map.sd.empty()) names.insert(names.end(), sd_names().begin(), sd_names().end());
  io::CsvWriter file(path, names);
  for (std::size_t i = 0; i < map.size(); ++i) {
    std::vector<double> row;
    for (const double value : numbers_of(map.inputs[i])) row.push_back(value);
    row.insert(row.end(), map.wrenches[i].begin(), map.wrenches[i].end());
    if (!map.sd.empty()) row.insert(row.end(), map.sd[i].begin(), map.sd[i].end());
    file.row(row);
  }
  file.close();
}

std::array<double, 4> numbers_of(const sim::Input& input) {
  return {input.amplitude_V, input.difference_V, input.bias_V, input.split_cycle};
}

std::string text_of(const sim::Input& input) {
  return io::format("%g V, %g V, %g V, %g", input.amplitude_V, input.difference_V, input.bias_V, input.split_cycle);
}

void refuse_apart(const std::string& where, const sim::Input& input) {
  throw io::InputError(where + ": the vehicle comes apart at (" + text_of(input) +
                       "); accepted: a vehicle that flaps at every input");
}

std::vector<Wrench> whole_map(const model::Vehicle& vehicle, const std::vector<sim::Input>& inputs,
                              const MapOptions& options) {
  std::vector<Wrench> map = force_map<double>(std::span(&vehicle, 1), inputs, options);
  for (std::size_t i = 0; i < map.size(); ++i)
    if (std::isnan(map[i][0])) refuse_apart(vehicle.name, inputs[i]);
  return map;
}

std::size_t distinct_inputs(const std::vector<sim::Input>& inputs) {
  std::set<std::array<double, 4>> all;
  for (const sim::Input& u : inputs) all.insert(numbers_of(u));
  return all.size();
}

MeasuredMap selected(const MeasuredMap& map, const std::vector<std::size_t>& rows) {
  MeasuredMap some{map.name, {}, {}};
  for (const std::size_t i : rows) {
    some.inputs.push_back(map.inputs[i]);
    some.wrenches.push_back(map.wrenches[i]);
    if (!map.sd.empty()) some.sd.push_back(map.sd[i]);
    some.lines.push_back(map.line(i));
  }
  return some;
}

MeasuredMap hold_out(MeasuredMap& map, std::size_t count) {
  std::vector<std::size_t> kept, held;
  for (std::size_t i = 0; i < map.size(); ++i)
    ((i + 1) * count / map.size() > i * count / map.size() ? held : kept).push_back(i);
  MeasuredMap out = selected(map, held);
  map = selected(map, kept);
  return out;
}

void check_held_out(const MeasuredMap& fitted, const MeasuredMap& held) {
  for (std::size_t i = 0; i < held.size(); ++i)
    for (std::size_t k = 0; k < fitted.size(); ++k)
      if (numbers_of(held.inputs[i]) == numbers_of(fitted.inputs[k]) && held.wrenches[i] == fitted.wrenches[k])
        throw io::InputError(held.name + ":" + std::to_string(held.line(i)) + ": is line " +
                             std::to_string(fitted.line(k)) + " of " + fitted.name +
                             "; accepted: measurements that are not fitted");
}

void check_scales(const MeasuredMap& map) {
  for (const std::size_t group : {std::size_t{0}, std::size_t{3}})
    if (std::ranges::all_of(map.wrenches,
                            [&](const Wrench& w) { return w[group] == 0 && w[group + 1] == 0 && w[group + 2] == 0; }))
      throw io::InputError(map.name + ": all " + (group == 0 ? "forces" : "torques") +
                           " are zero; accepted: measured forces and torques");
}

std::string in_short(double value) { return io::format("%.3g", value); }

}  // namespace flappy::identify
