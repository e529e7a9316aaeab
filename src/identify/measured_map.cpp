#include "identify/measured_map.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace flappy::identify {
namespace {

using Names = std::vector<std::string>;

std::array<double, 4> numbers_of(const sim::Input& u) {
  return {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
}

std::string in_short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string joined(const Names& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string at(const io::CsvTable& table, std::size_t row, const std::string& column) {
  return table.name + ":" + std::to_string(row + 2) + ": " + column + ": ";
}

std::vector<sim::Input> inputs_of(const io::CsvTable& table, const model::Driver& driver) {
  std::vector<sim::Input> inputs(table.columns.front().size());
  if (inputs.empty()) throw io::InputError(table.name + ":1: has no rows; accepted: a row for each input");
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::array<double, 4> u{};
    for (std::size_t k = 0; k < 4; ++k) u[k] = table.column(kInputNames[k])[i];
    inputs[i] = {u[0], u[1], u[2], u[3]};
    check_limits(inputs[i], driver, table.name + ":" + std::to_string(i + 2));
  }
  return inputs;
}

MeasuredMap map_of(const io::CsvTable& table, const model::Driver& driver) {
  Names required(kInputNames.begin(), kInputNames.end());
  required.insert(required.end(), channel_names().begin(), channel_names().end());
  const Names optional(sd_names().begin(), sd_names().end());
  check_columns(table, required, optional);
  MeasuredMap map{table.name, inputs_of(table, driver), {}, {}};
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
        throw io::InputError(at(table, i, sd_names()[k]) + io::shortest_digits(map.sd[i][k]) +
                             " is no standard deviation; accepted: a number above 0");
    }
  return map;
}

}  // namespace

void check_columns(const io::CsvTable& table, const Names& required, const Names& optional) {
  // unknown ones first: a column in a wrong unit is both unknown and missing, and the unit is what is wrong
  Names known = required;
  known.insert(known.end(), optional.begin(), optional.end());
  for (const std::string& name : table.names) {
    if (std::ranges::count(known, name) > 0) continue;
    const std::string unit = io::in_another_unit(name, known);
    throw io::InputError(table.name + ":1: " + name + ": " +
                         (unit.empty() ? "unknown column; accepted: " + joined(known) + io::did_you_mean(name, known)
                                       : "wrong unit; accepted: " + unit));
  }
  for (const std::string& name : required)
    if (std::ranges::count(table.names, name) == 0)
      throw io::InputError(table.name + ":1: " + name + ": column is missing; accepted: " + joined(required) +
                           (optional.empty() ? "" : ", optional " + joined(optional)));
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
  return map_of(io::read_csv(path), driver);
}

MeasuredMap parse_measured_map(std::string_view text, const std::string& name, const model::Driver& driver) {
  return map_of(io::parse_csv(text, name), driver);
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

std::array<std::array<Slope, kChannels>, 4> slopes(const std::vector<sim::Input>& inputs,
                                                   const std::vector<Wrench>& wrenches) {
  const auto n = static_cast<Eigen::Index>(inputs.size());
  std::vector<Eigen::Index> varied;
  Eigen::MatrixXd all(n, 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto u = numbers_of(inputs[static_cast<std::size_t>(i)]);
    for (Eigen::Index k = 0; k < 4; ++k) all(i, k) = u[static_cast<std::size_t>(k)];
  }
  for (Eigen::Index k = 0; k < 4; ++k)
    if (all.col(k).maxCoeff() > all.col(k).minCoeff()) varied.push_back(k);
  std::array<std::array<Slope, kChannels>, 4> result{};
  const auto columns = static_cast<Eigen::Index>(varied.size()) + 1;
  if (n <= columns) return result;
  Eigen::MatrixXd design(n, columns);
  design.col(0).setOnes();
  for (Eigen::Index k = 1; k < columns; ++k) design.col(k) = all.col(varied[static_cast<std::size_t>(k - 1)]);
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(design);
  if (solver.rank() < columns) return result;  // inputs that only ever move together
  const Eigen::MatrixXd inverse = (design.transpose() * design).inverse();
  for (std::size_t c = 0; c < kChannels; ++c) {
    Eigen::VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) y[i] = wrenches[static_cast<std::size_t>(i)][c];
    const Eigen::VectorXd x = solver.solve(y);
    const double variance = (y - design * x).squaredNorm() / static_cast<double>(n - columns);
    for (Eigen::Index k = 1; k < columns; ++k)
      result[static_cast<std::size_t>(varied[static_cast<std::size_t>(k - 1)])][c] = {
          x[k], std::sqrt(variance * inverse(k, k))};
  }
  return result;
}

void check_signs(const MeasuredMap& measured, const std::vector<Wrench>& simulated) {
  constexpr double kSignificant = 4;
  struct Answer {
    std::size_t input, channel;
    const char* what;
  };
  constexpr std::array<Answer, 4> kAnswers{{{0, 2, "thrust"}, {1, 3, "roll"}, {2, 4, "pitch"}, {3, 5, "yaw"}}};
  const auto m = slopes(measured.inputs, measured.wrenches), s = slopes(measured.inputs, simulated);
  const auto clear = [](const Slope& slope) { return std::abs(slope.value) > kSignificant * slope.sd; };
  for (const Answer& a : kAnswers) {
    const Slope &is = m[a.input][a.channel], &expected = s[a.input][a.channel];
    if (!clear(expected)) continue;
    // a torque that answers in another column's place, where the vehicle's does not answer at all
    std::string elsewhere;
    for (const Answer& b : kAnswers) {
      const double ratio = m[a.input][b.channel].value / expected.value;
      if (a.channel > 2 && b.channel > 2 && b.channel != a.channel && std::abs(ratio) > 0.5 && std::abs(ratio) < 2 &&
          clear(m[a.input][b.channel]) && std::abs(s[a.input][b.channel].value) < 0.1 * std::abs(expected.value))
        elsewhere = "columns " + channel_names()[a.channel] + " and " + channel_names()[b.channel] + " look swapped";
    }
    const bool opposite = clear(is) && is.value * expected.value < 0;
    const bool missing = !elsewhere.empty() && std::abs(is.value) < 0.1 * std::abs(expected.value);
    if (!opposite && !missing) continue;
    throw io::InputError(measured.name + ":1: " + channel_names()[a.channel] + ": " + a.what + " against " +
                         kInputNames[a.input] + " has slope " + in_short(is.value) + " +- " + in_short(is.sd) +
                         ", the vehicle's is " + in_short(expected.value) + "; " +
                         (elsewhere.empty() ? "likely a flipped axis" : elsewhere) +
                         "; accepted: frame B, x forward, y left, z up");
  }
}

MeasuredMap hold_out(MeasuredMap& map, std::size_t count) {
  MeasuredMap kept{map.name, {}, {}, {}}, held = kept;
  for (std::size_t i = 0; i < map.size(); ++i) {
    MeasuredMap& to = (i + 1) * count / map.size() > i * count / map.size() ? held : kept;
    to.inputs.push_back(map.inputs[i]);
    to.wrenches.push_back(map.wrenches[i]);
    if (!map.sd.empty()) to.sd.push_back(map.sd[i]);
  }
  map = std::move(kept);
  return held;
}

}  // namespace flappy::identify
