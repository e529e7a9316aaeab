#include "gap/session/quantities.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "io/text.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Lines of a weight whose pull is looked for. Choice: a line between two of these shows in both.
constexpr double kLengths_m[] = {0.15, 0.25, 0.4, 0.63, 1.0};
/// Mass of that weight, as a share of the robot's, to which its pull is in proportion. Choice.
constexpr double kLoad = 0.01;
/// Step of the delay, for its derivative. Choice.
constexpr double kLagStep_s = 5e-3;

/// The battery as a line over time: its voltage falls with the current, so that its fast changes follow the thrust.
void smooth_battery(std::map<std::string, VectorXd>& functions) {
  const auto battery = functions.find("battery");
  if (battery == functions.end()) return;
  MatrixXd x(battery->second.size(), 2);
  x.col(0).setOnes();
  x.col(1) = functions.at("time");
  const VectorXd line = (x.transpose() * x).ldlt().solve(x.transpose() * battery->second);
  battery->second = x * line;
}

std::map<std::string, VectorXd> functions_of(const PredictedFlight& flight) {
  std::map<std::string, VectorXd> named;
  for (RegimeFunction& f : flight.functions()) named[f.name] = std::move(f.values);
  smooth_battery(named);
  return named;
}

std::vector<std::size_t> seen_beats(const PredictedFlight& flight, int channel) {
  std::vector<std::size_t> list;
  for (std::size_t j = 0; j < flight.beats(); ++j)
    if (flight.covers(j, channel)) list.push_back(j);
  return list;
}

VectorXd of(const VectorXd& values, const std::vector<std::size_t>& list) {
  VectorXd v(static_cast<Index>(list.size()));
  for (Index j = 0; j < v.size(); ++j) v[j] = values[static_cast<Index>(list[static_cast<std::size_t>(j)])];
  return v;
}

VectorXd of(const Rows& rows, const std::vector<std::size_t>& list, int channel) {
  VectorXd v(static_cast<Index>(list.size()));
  for (Index j = 0; j < v.size(); ++j) v[j] = rows[row_of_mean(list[static_cast<std::size_t>(j)], channel)];
  return v;
}

/// Regressors of the force along z besides the thrust.
struct Slope {
  SessionQuantity quantity;
  double prior_sd;
};
const Slope kSlopes[] = {{{"thrust with the battery", "share", "battery"}, 0.5},
                         {{"thrust with the height", "1/m", "height"}, 0.1},
                         {{"drag along z", "1/s", "climb"}, 0.3},
                         {{"force along z with the speed squared", "1/m", "speed"}, 0.1},
                         {{"delay", "s", "delay"}, 0.02}};

/// The force along z that is predicted, and the columns of kSlopes.
struct AlongZ {
  std::vector<std::size_t> beats;
  VectorXd thrust, residual;
  MatrixXd slopes;
};

/// `predicted`: as it is, then with a delay more and less.
AlongZ along_z(const PredictedFlight& flight, const std::map<std::string, VectorXd>& f,
               const std::vector<Rows>& predicted, const CommonTrend& trend) {
  AlongZ z{seen_beats(flight, kSpecificForceZ), {}, {}, {}};
  z.thrust = of(predicted[0], z.beats, kSpecificForceZ);
  z.residual = of(flight.measured(), z.beats, kSpecificForceZ) - z.thrust;
  z.slopes = MatrixXd::Zero(z.thrust.size(), static_cast<Index>(std::size(kSlopes)));
  if (const auto b = f.find("battery"); b != f.end())
    z.slopes.col(0) = z.thrust.cwiseProduct((of(b->second, z.beats).array() - trend.battery).matrix());
  z.slopes.col(1) = z.thrust.cwiseProduct((of(f.at("height"), z.beats).array() - trend.height_m).matrix());
  z.slopes.col(2) = of(f.at("velocity_z"), z.beats);
  z.slopes.col(3) = of(f.at("velocity_x"), z.beats).cwiseAbs2() + of(f.at("velocity_y"), z.beats).cwiseAbs2();
  z.slopes.col(4) =
      (of(predicted[1], z.beats, kSpecificForceZ) - of(predicted[2], z.beats, kSpecificForceZ)) / (2 * kLagStep_s);
  return z;
}

std::vector<VehicleHypothesis> delayed(const VehicleHypothesis& robot) {
  std::vector<VehicleHypothesis> v(3, robot);
  v[1].lag_s += kLagStep_s;
  v[2].lag_s -= kLagStep_s;
  return v;
}

std::vector<Rows> predicted_by(const PredictedFlight& flight, const std::vector<VehicleHypothesis>& vehicles) {
  std::vector<const VehicleHypothesis*> pointers;
  for (const VehicleHypothesis& v : vehicles) pointers.push_back(&v);
  return flight.predict(pointers);
}

}  // namespace

/// Moments are shown over the weight. Source: standard gravity.
constexpr double kGravity_m_s2 = 9.81;

static double weight_over_inertia(const VehicleHypothesis& robot, int axis) {
  const model::InertiaTensor& i = robot.vehicle.torso.inertia_kg_m2;
  const double inertia[] = {i.xx, i.yy, i.zz};
  return robot.vehicle.torso.mass_kg * kGravity_m_s2 / inertia[axis];
}

/// Standard deviation between flights of the thrust, as a share. Choice.
constexpr double kOwnThrust = 0.01;
/// Standard deviation of an instant, with what the model gets wrong. Choice.
constexpr double kNoise_m_s2 = 0.3;

/// Each flight has a thrust of its own, so that what is common to all is found within and between flights.
CommonTrend common_trend(const FlightList& references, const VehicleHypothesis& robot) {
  CommonTrend trend;
  double beats = 0;
  std::vector<std::map<std::string, VectorXd>> functions;
  for (const auto& flight : references) {
    functions.push_back(functions_of(*flight));
    const auto& f = functions.back();
    if (const auto b = f.find("battery"); b != f.end()) trend.battery += b->second.sum();
    trend.height_m += f.at("height").sum();
    beats += static_cast<double>(flight->beats());
  }
  trend.battery /= std::max(beats, 1.0), trend.height_m /= std::max(beats, 1.0);
  const auto k = static_cast<Index>(std::size(kSlopes)), n = static_cast<Index>(references.size());
  MatrixXd normal = MatrixXd::Zero(k + 1 + n, k + 1 + n);
  VectorXd right = VectorXd::Zero(k + 1 + n);
  for (Index i = 0; i < k; ++i) normal(i, i) = std::pow(kNoise_m_s2 / kSlopes[i].prior_sd, 2);
  for (Index i = k + 1; i < normal.rows(); ++i) normal(i, i) = std::pow(kNoise_m_s2 / kOwnThrust, 2);
  normal(k, k) = 1e-9;
  for (Index i = 0; i < n; ++i) {
    const PredictedFlight& flight = *references[static_cast<std::size_t>(i)];
    if (!flight.has_rows(kSpecificForceZ, 0)) return trend;
    const AlongZ z =
        along_z(flight, functions[static_cast<std::size_t>(i)], predicted_by(flight, delayed(robot)), trend);
    MatrixXd x = MatrixXd::Zero(z.thrust.size(), normal.rows());
    x.leftCols(k) = z.slopes;
    x.col(k) = z.thrust;
    x.col(k + 1 + i) = z.thrust;
    normal += x.transpose() * x;
    right += x.transpose() * z.residual;
  }
  trend.slopes = normal.ldlt().solve(right).head(k);
  return trend;
}

std::vector<FlightSeries> flight_series(const PredictedFlight& flight, const VehicleHypothesis& robot,
                                        const CommonTrend& trend) {
  const std::map<std::string, VectorXd> f = functions_of(flight);
  const std::vector<Rows> predicted = predicted_by(flight, delayed(robot));
  std::vector<FlightSeries> all;
  if (flight.has_rows(kSpecificForceZ, 0)) {
    const AlongZ z = along_z(flight, f, predicted, trend);
    all.push_back({"thrust", of(f.at("time"), z.beats),
                   (z.residual - z.slopes * trend.slopes).cwiseQuotient(z.thrust.cwiseMax(1))});
  }
  for (int k = 0; k < 3; ++k) {
    if (!flight.has_rows(kAngularAccelerationX + k, 0)) continue;
    const std::vector<std::size_t> list = seen_beats(flight, kAngularAccelerationX + k);
    all.push_back(
        {std::string("moment about ") + "xyz"[k], of(f.at("time"), list),
         (of(flight.measured(), list, kAngularAccelerationX + k) - of(predicted[0], list, kAngularAccelerationX + k)) /
             weight_over_inertia(robot, k)});
  }
  return all;
}

/// Least squares of rows on columns; those with a prior are held at 0 by it.
struct FlightQuantities::Regression {
  std::vector<std::size_t> rows;
  std::vector<VectorXd> columns;
  std::vector<double> prior_sd;             ///< 0: none
  std::vector<SessionQuantity> quantities;  ///< of the columns; without a name: not kept
  void add(VectorXd column, double sd, SessionQuantity quantity = {}) {
    columns.push_back(std::move(column));
    prior_sd.push_back(sd);
    quantities.push_back(std::move(quantity));
  }
};

void FlightQuantities::keep(const SessionQuantity& quantity, double value, double variance) {
  quantities_.push_back(quantity);
  values_.conservativeResize(values_.size() + 1);
  variances_.conservativeResize(values_.size());
  values_[values_.size() - 1] = value;
  variances_[values_.size() - 1] = variance;
}

void FlightQuantities::add(const Regression& r, const VectorXd& y) {
  const auto n = static_cast<Index>(r.rows.size()), k = static_cast<Index>(r.columns.size());
  if (n < 1 || (k > 1 && n <= k + 2)) {
    for (const SessionQuantity& q : r.quantities)
      if (!q.name.empty()) keep(q, 0, kUnseen);
    return;
  }
  MatrixXd x(n, k);
  for (Index i = 0; i < k; ++i) x.col(i) = r.columns[static_cast<std::size_t>(i)];
  const MatrixXd normal = x.transpose() * x;
  // the noise of a first fit, whose regressors are all free
  MatrixXd loose = normal;
  for (Index i = 0; i < k; ++i) loose(i, i) += 1e-9 * normal(i, i) + 1e-12;
  const VectorXd rest = y - x * loose.ldlt().solve(x.transpose() * y);
  // with a handful of rows the scatter of sessions says it all
  double variance = n > k + 2 ? rest.squaredNorm() / static_cast<double>(n - k) : 0, next = 0;
  for (Index j = 1; j < n; ++j) next += rest[j] * rest[j - 1];
  const double past = std::clamp(next / std::max(rest.squaredNorm(), 1e-30), 0.0, 0.95);
  variance = std::max(variance, 1e-12);
  MatrixXd held = normal / variance;
  for (Index i = 0; i < k; ++i) {
    const double sd = r.prior_sd[static_cast<std::size_t>(i)];
    held(i, i) += sd > 0 ? 1 / (sd * sd) : 1e-12;
  }
  const MatrixXd all = held.ldlt().solve(x.transpose()) / variance;
  Weights w{r.rows, {}, static_cast<Index>(quantities_.size())};
  std::vector<Index> kept;
  for (Index i = 0; i < k; ++i)
    if (!r.quantities[static_cast<std::size_t>(i)].name.empty()) kept.push_back(i);
  w.weights = all(kept, Eigen::all);
  const VectorXd values = w.weights * y;
  // an autoregressive noise has fewer independent samples
  const VectorXd variances = w.weights.rowwise().squaredNorm() * variance * (1 + past) / (1 - past);
  for (std::size_t i = 0; i < kept.size(); ++i)
    keep(r.quantities[static_cast<std::size_t>(kept[i])], values[static_cast<Index>(i)],
         variances[static_cast<Index>(i)]);
  regressions_.push_back(std::move(w));
}

VectorXd FlightQuantities::change(const Rows& rows) const {
  VectorXd sum = VectorXd::Zero(values_.size());
  for (const Weights& w : regressions_) {
    VectorXd y(static_cast<Index>(w.rows.size()));
    for (Index j = 0; j < y.size(); ++j) y[j] = rows[w.rows[static_cast<std::size_t>(j)]];
    sum.segment(w.first, w.weights.rows()) += w.weights * y;
  }
  return sum;
}

FlightQuantities::FlightQuantities(const PredictedFlight& flight, const VehicleHypothesis& robot,
                                   const CommonTrend& trend) {
  const std::map<std::string, VectorXd> f = functions_of(flight);
  // predictions: as it is, with a delay more and less, with a weight on a line of each length
  const double mass_kg = robot.vehicle.torso.mass_kg;
  std::vector<VehicleHypothesis> vehicles = delayed(robot);
  for (const double length_m : kLengths_m) {
    vehicles.push_back(robot);
    vehicles.back().vehicle.effects["slung_load"] = {
        {"mass_kg", kLoad * mass_kg}, {"moment_x_kg_m", 0}, {"moment_y_kg_m", 0}, {"length_m", length_m}, {"z_m", 0}};
  }
  const std::vector<Rows> predicted = predicted_by(flight, vehicles);
  Rows residual = flight.measured();
  for (std::size_t i = 0; i < residual.size(); ++i) residual[i] -= predicted[0][i];

  if (flight.has_rows(kSpecificForceZ, 0)) {
    const AlongZ z = along_z(flight, f, predicted, trend);
    Regression r;
    for (const std::size_t j : z.beats) r.rows.push_back(row_of_mean(j, kSpecificForceZ));
    Regression alone = r;
    alone.add(z.thrust, 0, {"thrust", "share", "thrust"});
    add(alone, z.residual - z.slopes * trend.slopes);
    r.add(z.thrust, 0);
    for (std::size_t i = 0; i < std::size(kSlopes); ++i)
      if (i > 0 || f.contains("battery"))
        r.add(z.slopes.col(static_cast<Index>(i)), kSlopes[i].prior_sd, kSlopes[i].quantity);
    add(r, z.residual);
  }
  const std::vector<std::size_t> x = seen_beats(flight, kSpecificForceX), y = seen_beats(flight, kSpecificForceY);
  const auto nx = static_cast<Index>(x.size()), ny = static_cast<Index>(y.size());
  const bool has_x = flight.has_rows(kSpecificForceX, 0), has_y = flight.has_rows(kSpecificForceY, 0);
  if (has_x || has_y) {
    std::vector<std::size_t> both;
    for (const std::size_t j : x) both.push_back(row_of_mean(j, kSpecificForceX));
    for (const std::size_t j : y) both.push_back(row_of_mean(j, kSpecificForceY));
    const auto stacked = [&](const VectorXd& first, const VectorXd& second) {
      VectorXd v(nx + ny);
      v << first, second;
      return v;
    };
    const auto in = [&](const Rows& rows) {
      return stacked(of(rows, x, kSpecificForceX), of(rows, y, kSpecificForceY));
    };
    const VectorXd zero_x = VectorXd::Zero(nx), zero_y = VectorXd::Zero(ny);
    Regression r;
    r.rows = both;
    if (has_x) r.add(stacked(VectorXd::Ones(nx), zero_y), 0, {"force along x", "m/s^2", "force"});
    if (has_y) r.add(stacked(zero_x, VectorXd::Ones(ny)), 0, {"force along y", "m/s^2", "force"});
    if (has_x) r.add(stacked(of(f.at("velocity_x"), x), zero_y), 0.3, {"drag along x", "1/s", "drag"});
    if (has_y) r.add(stacked(zero_x, of(f.at("velocity_y"), y)), 0.3, {"drag along y", "1/s", "drag"});
    const Regression without = r;
    const VectorXd sideways = in(residual);
    add(r, sideways);
    const VectorXd time = f.at("time");
    for (std::size_t l = 0; l < std::size(kLengths_m); ++l) {
      Regression s = without;
      for (SessionQuantity& q : s.quantities) q.name.clear();
      s.add((in(predicted[3 + l]) - in(predicted[0])) / kLoad, 0.15,
            {io::format("swing of %.2g m", kLengths_m[l]), "share", "swing"});
      // a weight that swings from the start on
      const double w = std::sqrt(kGravity_m_s2 / kLengths_m[l]);
      for (const char* axis : {"north", "west"})
        for (const bool cosine : {true, false}) {
          const auto phase = [&](const std::vector<std::size_t>& list) {
            VectorXd p = of(time, list);
            for (double& t : p) t = cosine ? std::cos(w * t) : std::sin(w * t);
            return p;
          };
          s.add(stacked(phase(x).cwiseProduct(of(f.at(std::string(axis) + "_x"), x)),
                        phase(y).cwiseProduct(of(f.at(std::string(axis) + "_y"), y))),
                1);
        }
      add(s, sideways);
    }
  }
  for (int k = 0; k < 3; ++k) {
    if (!flight.has_rows(kAngularAccelerationX + k, 0)) continue;
    const std::vector<std::size_t> list = seen_beats(flight, kAngularAccelerationX + k);
    Regression r;
    for (const std::size_t j : list) r.rows.push_back(row_of_mean(j, kAngularAccelerationX + k));
    r.add(VectorXd::Constant(static_cast<Index>(list.size()), weight_over_inertia(robot, k)), 0,
          {std::string("moment about ") + "xyz"[k], "m", k < 2 ? "moment" : "yaw"});
    add(r, of(residual, list, kAngularAccelerationX + k));
  }
  if (const std::optional<double> noise = flight.log_input_noise())
    keep({"noise of the inputs (log)", "", "noise"}, *noise, 0);
}

}  // namespace flappy::gap
