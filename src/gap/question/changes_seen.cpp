#include "gap/question/changes_seen.hpp"

#include <cmath>
#include <deque>

namespace flappy::gap {
namespace {

using Eigen::Index;

struct Looked {
  int channel;
  BasisFunction function;
  const char *of, *name, *unit;  ///< `of`: name of the function in the basis; "": the only one of its kind
};
constexpr Looked kLooked[] = {
    {kSpecificForceZ, BasisFunction::constant, "", "mean force along z", "m/s^2"},
    {kSpecificForceZ, BasisFunction::input, "amplitude", "force along z per amplitude", "m/s^2"},
    {kSpecificForceX, BasisFunction::constant, "", "mean force along x", "m/s^2"},
    {kSpecificForceY, BasisFunction::constant, "", "mean force along y", "m/s^2"},
    {kSpecificForceX, BasisFunction::velocity_x, "", "drag along x", "m/s^2"},
    {kSpecificForceY, BasisFunction::velocity_y, "", "drag along y", "m/s^2"},
    {kSpecificForceZ, BasisFunction::velocity_z, "", "drag along z", "m/s^2"},
    {kAngularAccelerationX, BasisFunction::constant, "", "mean roll acceleration", "rad/s^2"},
    {kAngularAccelerationY, BasisFunction::constant, "", "mean pitch acceleration", "rad/s^2"},
    {kAngularAccelerationZ, BasisFunction::constant, "", "mean yaw acceleration", "rad/s^2"},
    {kBattery, BasisFunction::constant, "", "battery", "V"},
    {kCurrentLeft, BasisFunction::constant, "", "left current", "A"},
    {kCurrentRight, BasisFunction::constant, "", "right current", "A"},
    {kPathX, BasisFunction::constant, "", "motion capture less IMU, along x", "m/s^2"},
    {kPathY, BasisFunction::constant, "", "motion capture less IMU, along y", "m/s^2"},
    {kPathZ, BasisFunction::constant, "", "motion capture less IMU, along z", "m/s^2"},
};

/// Prior of what is looked at and of what else changed, over what sessions differ by. Choice: so wide that it does not
/// count.
constexpr double kWide = 30;

int function_of(const RegimeBasis& basis, const Looked& looked) {
  for (int i = 0; i < basis.size(); ++i)
    if (basis.of_tests(i) && basis.kind(i) == looked.function && (*looked.of == '\0' || basis.name(i) == looked.of))
      return i;
  return -1;
}

}  // namespace

std::vector<SeenQuantity> changes_seen(const RobotFit& robot) {
  const Fitter& fitter = robot.fitter();
  const Evidence& evidence = fitter.evidence();
  const RegimeBasis& basis = evidence.basis();

  // variance between sessions: of smooth functions, and of parameters, sensors and magnitudes
  const BasisCoefficients smooth_sd = evidence.discrepancy_sd(fitter.scales());
  BasisCoefficients variance = smooth_sd.cwiseAbs2();
  const Regressors all = fitter.unscaled_regressors(robot.parameters());
  for (std::size_t k = 0; k < all.columns.size(); ++k)
    if (const int e = all.effects[k]; e >= 0 && fitter.effects()[static_cast<std::size_t>(e)].starts_with(kSessionOf))
      variance += (fitter.scales().effects[static_cast<std::size_t>(e)] * *all.columns[k]).cwiseAbs2();

  BasisCoefficients sd = smooth_sd;
  for (int i = 0; i < basis.size(); ++i)
    if (basis.of_tests(i)) sd.col(i) *= kWide;
  std::deque<BasisCoefficients> columns;
  Regressors regressors;
  std::vector<SeenQuantity> seen;
  std::vector<double> widths;
  const FlightList flights = fitter.flights().all();
  const bool on_bench = std::ranges::all_of(flights, [](const auto& f) { return f->clamped(); });
  for (const Looked& looked : kLooked) {
    const int group = first_group(on_bench, looked.channel), i = function_of(basis, looked);
    if (i < 0 || !(evidence.signal(group) > 0)) continue;
    const double scatter = std::sqrt(variance(group, i));
    columns.emplace_back(BasisCoefficients::Zero(kGroups, basis.size()))(group, i) = kWide * scatter;
    sd(group, i) = 0;
    regressors.add(columns.back(), 0);
    seen.push_back({looked.name, looked.unit, 0, 0, scatter});
    widths.push_back(kWide * scatter);
  }
  const Posterior p =
      Evidence::posterior(evidence.reduce(robot.parameters().statistics, regressors.columns, fitter.all_flights(), sd),
                          regressors.all, regressors.prior_mean());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const auto i = static_cast<Index>(k);
    seen[k].tests = widths[k] * p.mean[i];
    seen[k].scatter = std::hypot(seen[k].scatter, widths[k] * std::sqrt(p.covariance(i, i)));
  }
  return seen;
}

}  // namespace flappy::gap
