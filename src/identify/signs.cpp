#include "identify/signs.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "identify/fit_problem.hpp"
#include "io/statistics.hpp"

namespace flappy::identify {
namespace {

constexpr double kSignificant = 4;  // standard deviations of a slope; twice as many for less reliable signs
constexpr double kNoise = 6;        // standard deviations of a value
constexpr const char* kFlipped = "likely a flipped axis";
constexpr const char* kAccepted = "; accepted: frame B, x forward, y left, z up";

struct Answer {
  std::size_t input, channel;
  const char* what;
  double least;  ///< least steepness of an opposite slope, relative to the vehicle's
};
constexpr std::array<Answer, 6> kAnswers{{{0, 2, "thrust", 0},
                                          {1, 3, "roll", 0},
                                          {2, 4, "pitch", 0},
                                          {3, 5, "yaw", 0},
                                          {2, 0, "force x", 0.5},
                                          {1, 1, "force y", 0.5}}};

bool clear(const Slope& slope, double times = 1) { return std::abs(slope.value) > times * kSignificant * slope.sd; }

/// Largest plausible noise: kNoise sd; an undeclared sd is 1/50 of the rms of all forces or all torques.
double noise(const MeasuredMap& map, std::size_t row, std::size_t channel) {
  constexpr double kUndeclared = 0.02;
  return kNoise * (map.sd.empty() ? kUndeclared * group_rms(map.wrenches)[is_force(static_cast<int>(channel)) ? 0 : 1]
                                  : map.sd[row][channel]);
}

[[noreturn]] void refuse(const MeasuredMap& map, std::size_t row, std::size_t channel, const std::string& what) {
  throw io::InputError(map.name + ":" + std::to_string(map.line(row)) + ": " + channel_names()[channel] + ": " + what +
                       "; " + kFlipped + kAccepted);
}

/// InputError where rows that differ in one input contradict the vehicle. Returns whether any pair could be tested.
bool check_pairs(const MeasuredMap& map, const std::vector<Wrench>& simulated, const Answer& a) {
  double most = 0;
  for (const Wrench& w : simulated) most = std::max(most, std::abs(w[a.channel]));
  bool any = false;
  for (std::size_t i = 0; i < map.size(); ++i)
    for (std::size_t k = i + 1; k < map.size(); ++k) {
      auto one = numbers_of(map.inputs[i]), other = numbers_of(map.inputs[k]);
      one[a.input] = other[a.input] = 0;
      const double expected = simulated[k][a.channel] - simulated[i][a.channel];
      const double unsure = noise(map, i, a.channel) + noise(map, k, a.channel);
      if (one != other || std::abs(expected) < std::max(0.25 * most, unsure)) continue;
      any = true;
      const double is = map.wrenches[k][a.channel] - map.wrenches[i][a.channel];
      if (is * expected > 0 || std::abs(is) < std::max(0.25, a.least) * std::abs(expected) || std::abs(is) < unsure)
        continue;
      refuse(map, k, a.channel,
             std::string(a.what) + " changes by " + in_short(is) + " from line " + std::to_string(map.line(i)) +
                 " on, the vehicle's by " + in_short(expected));
    }
  return any;
}

/// InputError for a row whose thrust points down although the vehicle's points up.
void check_thrust(const MeasuredMap& map, const std::vector<Wrench>& simulated) {
  double most = 0;
  for (const Wrench& w : simulated) most = std::max(most, w[2]);
  for (std::size_t i = 0; i < map.size(); ++i)
    if (const double is = map.wrenches[i][2], expected = simulated[i][2];
        expected > 0.15 * most && is < -std::max(0.5 * expected, noise(map, i, 2)))
      refuse(map, i, 2, "thrust is " + in_short(is) + ", the vehicle's " + in_short(expected));
}

/// InputError for a row whose torque is opposite to the vehicle's plus the map's offset and an outlier among the rows.
void check_rows(const MeasuredMap& map, const std::vector<Wrench>& simulated, const Answer& a) {
  constexpr std::size_t kFewest = 9;  // least number of rows for a robust offset and scatter
  constexpr double kScatter = 8 * 1.4826;
  if (map.size() < kFewest) return;
  std::vector<double> differences;
  double most = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    differences.push_back(map.wrenches[i][a.channel] - simulated[i][a.channel]);
    most = std::max(most, std::abs(simulated[i][a.channel]));
  }
  const double offset = io::median(differences);
  std::vector<double> apart = differences;
  for (double& d : apart) d = std::abs(d - offset);
  const double scatter = kScatter * io::median(apart);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double is = map.wrenches[i][a.channel], expected = simulated[i][a.channel] + offset;
    const bool opposite = is * expected < 0 && std::min(std::abs(is), std::abs(expected)) > 0.5 * most &&
                          std::abs(simulated[i][a.channel]) > std::abs(offset);
    if (opposite && std::abs(is - expected) > scatter + noise(map, i, a.channel))
      refuse(map, i, a.channel,
             std::string(a.what) + " is " + in_short(is) + ", the vehicle's with the offset of all rows " +
                 in_short(expected));
  }
}

}  // namespace

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
  if (solver.rank() < columns) return result;  // inputs that always change together
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

std::vector<std::string> check_signs(const MeasuredMap& measured, const std::vector<Wrench>& simulated) {
  const auto m = slopes(measured.inputs, measured.wrenches), s = slopes(measured.inputs, simulated);
  std::vector<std::string> unchecked;
  for (const Answer& a : kAnswers) {
    const Slope &is = m[a.input][a.channel], &expected = s[a.input][a.channel];
    if (!clear(expected)) {
      if (!check_pairs(measured, simulated, a) && a.channel != 2) unchecked.push_back(channel_names()[a.channel]);
      continue;
    }
    // Swapped columns: another torque responds to this input, although in the vehicle it does not.
    std::string elsewhere;
    for (const Answer& b : kAnswers) {
      const double ratio = m[a.input][b.channel].value / expected.value;
      if (a.channel > 2 && b.channel > 2 && b.channel != a.channel && std::abs(ratio) > 0.5 && std::abs(ratio) < 2 &&
          clear(m[a.input][b.channel]) && std::abs(s[a.input][b.channel].value) < 0.1 * std::abs(expected.value))
        elsewhere = "columns " + channel_names()[a.channel] + " and " + channel_names()[b.channel] + " look swapped";
    }
    const bool opposite = clear(is, a.least > 0 ? 2 : 1) && is.value * expected.value < 0 &&
                          std::abs(is.value) > a.least * std::abs(expected.value);
    const bool missing = !elsewhere.empty() && std::abs(is.value) < 0.1 * std::abs(expected.value);
    if (!opposite && !missing) continue;
    throw io::InputError(measured.name + ":1: " + channel_names()[a.channel] + ": " + a.what + " against " +
                         kInputNames[a.input] + " has slope " + in_short(is.value) + " +- " + in_short(is.sd) +
                         ", the vehicle's is " + in_short(expected.value) + "; " +
                         (elsewhere.empty() ? kFlipped : elsewhere) + kAccepted);
  }
  check_thrust(measured, simulated);
  for (const Answer& a : kAnswers)
    if (a.channel > 2) check_rows(measured, simulated, a);
  return unchecked;
}

}  // namespace flappy::identify
