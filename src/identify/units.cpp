#include "identify/units.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "identify/fit_problem.hpp"
#include "identify/signs.hpp"
#include "model/derive.hpp"

namespace flappy::identify {
namespace {

constexpr double kOff = 3, kFarOff = 10;
constexpr double kSeen = 4;  // standard deviations of a slope
constexpr double kGravity_m_s2 = 9.81;

struct Unit {
  const char* name;
  double per_si;  ///< so many of it are one N, or one N m
};
constexpr std::array<Unit, 6> kForces{
    {{"mN", 1e3}, {"gf", 101.97}, {"kgf", 0.10197}, {"lbf", 0.22481}, {"ozf", 3.5969}, {"uN", 1e6}}};
constexpr std::array<Unit, 6> kTorques{{{"mN m or N mm", 1e3},
                                        {"gf cm", 10197},
                                        {"kgf m", 0.10197},
                                        {"lbf in", 8.8507},
                                        {"ozf in", 141.61},
                                        {"uN m", 1e6}}};

bool is_off(double ratio, double by) { return ratio >= by || ratio <= 1 / by; }

/// "likely in mN, not N", for the unit that is nearer to the ratio than a model's errors.
std::string likely(std::span<const Unit> units, double ratio, const char* si) {
  constexpr double kNear = 1.5;
  const auto apart = [&](const Unit& u) { return std::abs(std::log(ratio / u.per_si)); };
  const auto nearest = std::ranges::min_element(units, {}, apart);
  return apart(*nearest) < std::log(kNear) ? std::string("likely in ") + nearest->name + ", not " + si
                                           : std::string("another unit, or a wrong scale");
}

std::string times(double ratio) { return in_short(ratio) + " times the vehicle's"; }

/// Measured slope over the vehicle's; nothing where either is not seen.
std::optional<double> ratio_of(const Slope& is, const Slope& expected) {
  const auto seen = [](const Slope& s) { return std::abs(s.value) > kSeen * s.sd; };
  if (!seen(is) || !seen(expected)) return std::nullopt;
  return is.value / expected.value;
}

[[noreturn]] void refuse_unit(const MeasuredMap& map, const std::string& column, const std::string& what,
                              const std::string& accepted) {
  throw io::InputError(map.name + ":1: " + column + ": " + what + "; accepted: " + accepted);
}

void check_duty(const MeasuredMap& map, const std::vector<Wrench>& simulated, const model::Driver& driver) {
  double most = 0;
  for (const sim::Input& u : map.inputs) most = std::max(most, u.amplitude_V);
  if (most > 1 || driver.amplitude_limit_V < kOff) return;
  if (group_rms(map.wrenches)[0] > kOff * group_rms(simulated)[0])
    refuse_unit(map, kInputNames[0],
                "at most " + in_short(most) + " at forces of " +
                    times(group_rms(map.wrenches)[0] / group_rms(simulated)[0]) + "; likely duty cycles, not volts",
                "volts: a duty cycle times the battery's voltage");
}

void check_forces(const MeasuredMap& map, const std::vector<Wrench>& simulated) {
  const auto m = slopes(map.inputs, map.wrenches), s = slopes(map.inputs, simulated);
  const auto thrust = ratio_of(m[0][2], s[0][2]);
  if (!thrust) {
    const double all = group_rms(map.wrenches)[0] / group_rms(simulated)[0];
    if (is_off(all, kFarOff))
      refuse_unit(map, channel_names()[2], "forces are " + times(all) + "; " + likely(kForces, all, "N"), "N");
    return;
  }
  if (*thrust <= 0 || !is_off(*thrust, kOff)) return;
  // Side forces are less reliable: they have to be off the same way, by half as much in the logarithm.
  const auto alike = [&](std::size_t input, std::size_t channel) {
    const auto ratio = ratio_of(m[input][channel], s[input][channel]);
    return !ratio || (*ratio != 0 && std::log(std::abs(*ratio)) / std::log(*thrust) > 0.5);
  };
  if (alike(2, 0) && alike(1, 1))
    refuse_unit(map, channel_names()[2],
                "thrust against amplitude_V has slope " + in_short(m[0][2].value) + ", " + times(*thrust) + "; " +
                    likely(kForces, *thrust, "N"),
                "N");
}

void check_torques(const MeasuredMap& map, const std::vector<Wrench>& simulated) {
  const auto m = slopes(map.inputs, map.wrenches), s = slopes(map.inputs, simulated);
  std::vector<double> ratios;
  for (std::size_t k = 1; k < 4; ++k) {  // roll by difference, pitch by bias, yaw by split cycle
    const auto ratio = ratio_of(m[k][k + 2], s[k][k + 2]);
    if (!ratio || *ratio <= 0) return;
    ratios.push_back(*ratio);
  }
  std::ranges::sort(ratios);
  if (is_off(ratios[1], kFarOff) && ratios[2] < 2 * ratios[0])
    refuse_unit(
        map, channel_names()[3],
        "torques against their inputs have slopes of " + times(ratios[1]) + "; " + likely(kTorques, ratios[1], "N m"),
        "N m");
}

/// Fits measured thrust = a simulated + b, and compares b with the weight.
void check_tare(const MeasuredMap& map, const std::vector<Wrench>& simulated, const model::Vehicle& vehicle) {
  const double weight_N = kGravity_m_s2 * model::total_mass_kg(vehicle), n = static_cast<double>(map.size());
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double sim = simulated[i][2], is = map.wrenches[i][2];
    x += sim / n, y += is / n, xx += sim * sim / n, xy += sim * is / n, yy += is * is / n;
  }
  const double spread = xx - x * x;
  if (std::sqrt(std::max(spread, 0.0)) < 0.1 * weight_N) return;  // the thrust hardly changes
  const double a = (xy - x * y) / spread, b = y - a * x;
  const double left = std::sqrt(std::max(yy - y * y - a * a * spread, 0.0));
  if (a > 0.5 && a < 2 && std::abs(b + weight_N) < 0.2 * weight_N && left < 0.1 * weight_N)
    refuse_unit(map, channel_names()[2],
                "thrust is " + in_short(-b) + " N less than the vehicle's at every input, about its weight of " +
                    in_short(weight_N) + " N; likely a balance that was not tared",
                "forces of the air alone, 0 while the wings are at rest");
}

}  // namespace

void check_units(const MeasuredMap& measured, const std::vector<Wrench>& simulated, const model::Vehicle& vehicle) {
  check_duty(measured, simulated, vehicle.driver);
  check_forces(measured, simulated);
  check_torques(measured, simulated);
  check_tare(measured, simulated, vehicle);
}

}  // namespace flappy::identify
