#include "gap/replay/beat_averaged_prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "flightlog/readings.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Vector3d;
using Vec = model::Vec3<double>;

/// Rows in a period of the bandwidth. Choice: a little more than the two that the sampling theorem asks for.
constexpr double kRowsPerPeriod = 2.2;
/// Smallest number of rows of a flight in the air and seen. Choice.
constexpr std::size_t kMinRows = 12;
/// Moments are compared as means over this time. Choice: by then an autopilot has counteracted most of what disturbs
/// it.
constexpr double kTrim_s = 3;
/// Smallest thrust that moments are divided by, as a share of the weight. Choice.
constexpr double kMinThrust = 0.1;

Vec vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d eigen(const Vec& v) { return {v.x, v.y, v.z}; }
model::Matrix3<double> matrix(const Eigen::Matrix3d& m) {
  return {vec(m.row(0).transpose()), vec(m.row(1).transpose()), vec(m.row(2).transpose())};
}

Eigen::Matrix3d inertia_of(const model::Vehicle& v) {
  const model::InertiaTensor& i = v.torso.inertia_kg_m2;
  Eigen::Matrix3d inertia;
  inertia << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
  return inertia;
}

/// A column on the grid of the motion, `late_s` later, interpolated linearly.
std::vector<double> on_grid(const flightlog::Column& t_s, const flightlog::Column& x, double late_s,
                            const flightlog::BeatAveragedMotion& m) {
  std::vector<double> y(m.size());
  std::size_t k = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double t = m.t_s(i) + late_s;
    while (k + 2 < t_s.size() && t_s[k + 1] <= t) ++k;
    const double share = std::clamp((t - t_s[k]) / (t_s[k + 1] - t_s[k]), 0.0, 1.0);
    y[i] = x[k] + share * (x[k + 1] - x[k]);
  }
  return y;
}

/// Delay, then a first-order lag, both in samples; exact for an input held between samples.
std::vector<double> follow(std::vector<double> x, double late, double lag) {
  if (late != 0) {
    const std::vector<double> own = x;
    const auto at = [&](double place) {
      const double p = std::clamp(place, 0.0, static_cast<double>(own.size() - 1));
      const auto i = std::min(static_cast<std::size_t>(p), own.size() - 2);
      return own[i] + (p - static_cast<double>(i)) * (own[i + 1] - own[i]);
    };
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = at(static_cast<double>(i) - late);
  }
  if (lag > 0) {
    const double kept = std::exp(-1 / lag);
    double y = x.front(), before = x.front();
    for (double& v : x) {
      y = kept * y + (1 - kept) * before;
      before = v;
      v = y;
    }
  }
  return x;
}

}  // namespace

BeatAveragedPrediction::BeatAveragedPrediction(const std::filesystem::path& folder, flightlog::FlightLog log,
                                               const model::Vehicle& nominal, const std::vector<int>& channels)
    : name_(io::folder_name(folder)),
      log_(flightlog::on_its_clocks(std::move(log))),
      nominal_(nominal),
      motion_(flightlog::beat_averaged_motion(log_, nominal.beat_averaged->bandwidth_Hz, folder)) {
  const model::BeatAveraged& b = *nominal_.beat_averaged;
  if (b.predicted) {
    predicted_ =
        read_predicted_loads(folder / "predicted.csv", b, motion_, std::max(motion_.begin_s, log_.command.t_s.front()),
                             std::min(motion_.t_s(motion_.size() - 1), log_.command.t_s.back()));
  }
  const bool moments = wrench_of(b).has_moments();
  for (int channel = 0; channel <= kSpecificForceZ; ++channel)
    shown_[static_cast<std::size_t>(channel)] =
        (channel >= kSpecificForceX || moments) &&
        (channels.empty() ? channel >= kSpecificForceX || b.compares_moments
                          : std::ranges::count(channels, channel) > 0) &&
        (channel != kSpecificForceX || log_.header.mocap.source != flightlog::PoseSource::estimate_without_pitch);
  if (std::ranges::none_of(shown_, std::identity{}))
    throw io::InputError("--channels: none of them is compared in " + folder.string() +
                         "; accepted: one that vehicle and log have");
  for (const model::BeatAveraged::Input& i : b.inputs) {
    const auto at = std::ranges::find(log_.header.inputs, i.name);
    if (at == log_.header.inputs.end())
      throw io::InputError(
          (folder / "flight.toml").string() + ": command.inputs: has no \"" + i.name +
          "\", which the vehicle's file reads; accepted: a log of this vehicle, or a vehicle whose inputs are " +
          (log_.header.inputs.empty() ? "voltages" : io::joined(log_.header.inputs)));
    const flightlog::Column& column = log_.command.declared[static_cast<std::size_t>(at - log_.header.inputs.begin())];
    for (std::size_t k = 0; k < column.size(); ++k)
      if (column[k] < i.low || column[k] > i.high)
        throw io::InputError((folder / "command.csv").string() + ":" + std::to_string(k + 2) + ": " + i.name + ": " +
                             io::shortest_digits(column[k]) + " is outside what the vehicle takes; accepted: " +
                             io::shortest_digits(i.low) + " to " + io::shortest_digits(i.high));
    inputs_.push_back(on_grid(log_.command.t_s, column, 0, motion_));
  }
  for (PredictedColumn& c : predicted_) inputs_.push_back(std::move(c.values));
  battery_.assign(motion_.size(), 1);
  if (log_.power) {
    battery_ = on_grid(log_.power->t_s, log_.power->battery_V, log_.header.power->latency_s, motion_);
    for (double& v : battery_) v /= log_.header.power->battery_nominal_V;
  }
  const double least_z_m = log_.header.ambient.ground_z_m + nominal_.extent.below_m;
  for (std::size_t i = 0; i < motion_.size(); ++i) {
    const double t = motion_.t_s(i);
    if (motion_.position_m[i].z() < least_z_m || t < log_.command.t_s.front() || t > log_.command.t_s.back())
      motion_.seen[i] = 0;
  }
  stride_ = std::max<std::size_t>(1, static_cast<std::size_t>(1 / (kRowsPerPeriod * b.bandwidth_Hz * motion_.step_s)));
  std::size_t seen = 0;
  for (std::size_t i = stride_ / 2; i < motion_.size(); i += stride_) rows_.push_back(i), seen += motion_.seen[i] != 0;
  if (seen < kMinRows)
    throw flightlog::TooLittleSeen(folder.string() + ": only " + std::to_string(seen) +
                                   " instants are in the air and seen; accepted: " + std::to_string(kMinRows) +
                                   " or more, higher than " + io::shortest_digits(least_z_m) + " m");
  for (const std::vector<double> smooth = flightlog::low_pass(battery_, b.bandwidth_Hz * motion_.step_s);
       const std::size_t i : rows_)
    battery_rows_.push_back(smooth[i]);
  if (b.trims) find_trims();
  measured_ = signal_ = rows_of(motion_);
  if (!b.trims) return;
  const std::vector<Vector3d> single = turned_by_single_loads();
  for (std::size_t j = 0; j < rows_.size(); ++j)
    for (int k = 0; k < 3; ++k) signal_[row_of_mean(j, kAngularAccelerationX + k)] = single[j][k];
  take_means(signal_);
}

void BeatAveragedPrediction::find_trims() {
  const double row_s = motion_.step_s * static_cast<double>(stride_);
  const auto size = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(kTrim_s / row_s)));
  is_trim_.assign(rows_.size(), 0);
  for (std::size_t first = 0; first + size <= rows_.size(); first += size) {
    std::vector<std::size_t> seen;
    for (std::size_t j = first; j < first + size; ++j)
      if (motion_.seen[rows_[j]]) seen.push_back(j);
    if (2 * seen.size() < size) continue;
    trims_.push_back({seen[seen.size() / 2], first, first + size});
    is_trim_[trims_.back().row] = 1;
  }
}

void BeatAveragedPrediction::take_means(Rows& rows) const {
  const Rows own = rows;
  for (std::size_t j = 0; j < rows_.size(); ++j)
    for (int k = 0; k < 3; ++k) rows[row_of_mean(j, kAngularAccelerationX + k)] = 0;
  for (const Trim& t : trims_) {
    double n = 0;
    for (std::size_t j = t.first; j < t.end; ++j) n += motion_.seen[rows_[j]] != 0;
    for (std::size_t j = t.first; j < t.end; ++j)
      for (int k = 0; k < 3 && motion_.seen[rows_[j]]; ++k)
        rows[row_of_mean(t.row, kAngularAccelerationX + k)] += own[row_of_mean(j, kAngularAccelerationX + k)] / n;
  }
}

std::vector<Vector3d> BeatAveragedPrediction::turned_by_single_loads() const {
  const model::BeatAveraged& b = *nominal_.beat_averaged;
  const model::BeatAveragedWrench wrench = wrench_of(b);
  const Eigen::Matrix3d per_inertia = inertia_of(nominal_).inverse();
  std::vector<Vector3d> all(rows_.size(), Vector3d::Zero());
  std::vector<double> variables(b.actuators.size() + model::kMotionVariables + predicted_.size(), 0.0);
  for (std::size_t j = 0; j < rows_.size(); ++j) {
    for (std::size_t k = 0; k < b.actuators.size(); ++k) {
      const auto input = std::ranges::find(b.inputs, b.actuators[k].input, &model::BeatAveraged::Input::name);
      const auto column = static_cast<std::size_t>(input - b.inputs.begin());
      variables[k] = b.actuators[k].gain * driven(column, 0, 0).input[j] + b.actuators[k].offset;
    }
    variables[b.actuators.size() + model::kBatteryShare] = battery_rows_[j];
    for (std::size_t k = 0; k < predicted_.size(); ++k)
      variables[b.actuators.size() + model::kMotionVariables + k] = driven(b.inputs.size() + k, 0, 0).input[j];
    for (const model::BeatAveragedWrench::Product& p : wrench.products()) {
      if (p.component < 3) continue;
      double moment = p.factor;
      for (const std::size_t v : p.variables) moment *= variables[v];
      all[j] += (moment * per_inertia.col(static_cast<Eigen::Index>(p.component - 3))).cwiseAbs2();
    }
    all[j] = all[j].cwiseSqrt();
  }
  return all;
}

Rows BeatAveragedPrediction::rows_of(const flightlog::BeatAveragedMotion& motion) const {
  Rows rows(rows_.size() * kRowsPerBeat, 0);
  for (std::size_t j = 0; j < rows_.size(); ++j)
    for (int k = 0; k < 3; ++k) {
      rows[row_of_mean(j, kSpecificForceX + k)] = motion.force_m_s2[rows_[j]][k];
      rows[row_of_mean(j, kAngularAccelerationX + k)] = motion.turning_rad_s2[rows_[j]][k];
    }
  if (nominal_.beat_averaged->trims) take_means(rows);
  return rows;
}

model::BeatAveragedWrench BeatAveragedPrediction::wrench_of(const model::BeatAveraged& vehicle) const {
  if (!vehicle.predicted) return model::BeatAveragedWrench(vehicle);
  std::vector<model::BeatAveragedWrench::Product> products;
  for (const PredictedColumn& c : predicted_) {
    double factor = 1;
    if (c.coefficient) {
      const model::BeatAveraged::Coefficient& known = vehicle.coefficients[*c.coefficient];
      factor = known.value - known.predicted_at;
    }
    products.push_back({c.component, factor, {vehicle.actuators.size() + model::kMotionVariables + products.size()}});
  }
  return model::BeatAveragedWrench(std::move(products));
}

const BeatAveragedPrediction::Driven& BeatAveragedPrediction::driven(std::size_t input, double delay_s,
                                                                     double lag_s) const {
  const std::lock_guard lock(mutex_);
  const auto [at, fresh] = driven_.try_emplace({input, delay_s, lag_s});
  Driven& d = at->second;
  if (!fresh) return d;
  const double per_sample = nominal_.beat_averaged->bandwidth_Hz * motion_.step_s;
  std::vector<double> x = follow(inputs_[input], delay_s / motion_.step_s, lag_s / motion_.step_s), y = x;
  for (std::size_t i = 0; i < y.size(); ++i) y[i] *= battery_[i];
  const auto put = [&](const std::vector<double>& raw, std::vector<double>& value, std::vector<double>& rate) {
    const std::vector<double> smooth = flightlog::low_pass(raw, per_sample);
    for (const std::size_t i : rows_) {
      const std::size_t a = i == 0 ? 0 : i - 1, b = std::min(i + 1, smooth.size() - 1);
      value.push_back(smooth[i]);
      rate.push_back((smooth[b] - smooth[a]) / (motion_.step_s * static_cast<double>(b - a)));
    }
  };
  put(x, d.input, d.rate);
  put(y, d.times_battery, d.rate_times_battery);
  return d;
}

std::vector<Rows> BeatAveragedPrediction::predict(const std::vector<const VehicleHypothesis*>& vehicles) const {
  std::vector<Rows> all;
  for (const VehicleHypothesis* v : vehicles) all.push_back(predict(*v));
  return all;
}

Rows BeatAveragedPrediction::predict(const VehicleHypothesis& hypothesis) const {
  model::Vehicle v = hypothesis.vehicle;
  const model::BeatAveraged& b = *v.beat_averaged;
  struct Acting {
    const model::CatalogueEffect* effect;
    std::vector<double> values;
  };
  std::vector<Acting> acting;
  for (const auto& [id, values] : hypothesis.vehicle.effects) {
    const model::CatalogueEffect* e = model::find_effect(v, id);
    if (e == nullptr) continue;
    acting.push_back({e, e->values(values)});
    if (!e->acts(acting.back().values)) acting.pop_back();
  }
  model::BeatAveragedDrive<double> drive;
  for (const Acting& a : acting) {
    if (a.effect->change != nullptr) a.effect->change(a.values.data(), v);
    if (a.effect->averaged.drive != nullptr && !b.predicted) a.effect->averaged.drive(a.values.data(), drive);
  }
  const model::BeatAveragedWrench wrench = wrench_of(b);
  std::vector<const Driven*> driven_by;
  for (const model::BeatAveraged::Actuator& a : b.actuators) {
    const auto input = std::ranges::find(b.inputs, a.input, &model::BeatAveraged::Input::name) - b.inputs.begin();
    driven_by.push_back(
        &driven(static_cast<std::size_t>(input), drive.delay_s + hypothesis.lag_s, a.lag_s + drive.lag_s));
  }
  // predicted loads are computed from the inputs, so the lag shifts them as it shifts the inputs
  std::vector<const Driven*> loads;
  for (std::size_t k = 0; k < predicted_.size(); ++k)
    loads.push_back(&driven(b.inputs.size() + k, hypothesis.lag_s, 0));
  const Vec com{v.torso.com_m.x, v.torso.com_m.y, v.torso.com_m.z};
  const double nominal_N = nominal_.torso.mass_kg * log_.header.gravity_m_s2;
  const Eigen::Matrix3d nominal_turning = nominal_N * inertia_of(nominal_).inverse();
  const Eigen::Matrix3d inertia = inertia_of(v);
  const Eigen::Matrix3d per_inertia = inertia.inverse();
  const flightlog::LogAmbient& ambient = log_.header.ambient;

  const auto flown = [&](std::size_t k) {
    model::BeatAveragedState<double> s{};
    s.attitude = matrix(motion_.attitude[k]);
    s.position_m = vec(motion_.position_m[k]);
    s.velocity_B_m_s = vec(motion_.velocity_B_m_s[k]);
    s.rate_rad_s = vec(motion_.rate_rad_s[k]);
    s.force_m_s2 = vec(motion_.force_m_s2[k]);
    s.mass_kg = std::numeric_limits<double>::infinity();
    s.gravity_m_s2 = log_.header.gravity_m_s2;
    return s;
  };
  std::vector<model::Hanging<double>> weights;  // [grid] a weight on a line; empty: none
  for (const Acting& a : acting) {
    if (a.effect->averaged.swing == nullptr) continue;
    weights.resize(motion_.size());
    a.effect->averaged.hang(a.values.data(), flown(0), weights[0]);
    for (std::size_t k = 1; k < weights.size(); ++k) {
      weights[k] = weights[k - 1];
      a.effect->averaged.swing(a.values.data(), flown(k), motion_.step_s, weights[k]);
    }
  }

  Rows rows(rows_.size() * kRowsPerBeat, 0);
  std::vector<double> variables(b.actuators.size() + model::kMotionVariables + loads.size());
  for (std::size_t j = 0; j < rows_.size(); ++j) {
    const std::size_t at = rows_[j];
    if (!motion_.seen[at]) continue;
    model::BeatAveragedState<double> s{};
    s.attitude = matrix(motion_.attitude[at]);
    s.position_m = vec(motion_.position_m[at]);
    s.velocity_B_m_s = vec(motion_.velocity_B_m_s[at]);
    s.rate_rad_s = vec(motion_.rate_rad_s[at]);
    s.turning_rad_s2 = vec(motion_.turning_rad_s2[at]);
    s.com_m = com;
    s.mass_kg = v.torso.mass_kg;
    s.gravity_m_s2 = log_.header.gravity_m_s2;
    s.air_density_kg_m3 = ambient.air_density_kg_m3;
    s.ground_z_m = ambient.ground_z_m;
    if (!weights.empty()) s.weight = weights[at];
    double flapping = 0;
    for (std::size_t k = 0; k < b.actuators.size(); ++k) {
      const model::BeatAveraged::Actuator& a = b.actuators[k];
      const Driven& d = *driven_by[k];
      double value = a.gain * d.input[j] + a.offset, rate = a.gain * d.rate[j];
      if (a.role == model::BeatAveraged::Role::flapping) {
        value += drive.battery_gain * (a.gain * (d.times_battery[j] - d.input[j]) + a.offset * (battery_rows_[j] - 1));
        s.beat_share += value / b.nominal_Hz;
        flapping += 1;
      } else if (a.role == model::BeatAveraged::Role::stroke_plane) {
        s.stroke_plane += value;
        s.stroke_plane_1_s += rate;
      }
      variables[k] = value;
    }
    if (flapping > 0) s.beat_share /= flapping;
    for (const Acting& a : acting)
      if (a.effect->averaged.wind != nullptr) a.effect->averaged.wind(a.values.data(), s, s.wind_B_m_s);
    const Vec air = s.velocity_B_m_s - s.wind_B_m_s;
    double* motion = &variables[b.actuators.size()];
    motion[model::kVx] = air.x, motion[model::kVy] = air.y, motion[model::kVz] = air.z;
    motion[model::kSpeed] = std::sqrt(model::dot(air, air));
    motion[model::kWx] = s.rate_rad_s.x, motion[model::kWy] = s.rate_rad_s.y, motion[model::kWz] = s.rate_rad_s.z;
    motion[model::kBatteryShare] = battery_rows_[j];
    for (std::size_t k = 0; k < loads.size(); ++k) motion[model::kMotionVariables + k] = loads[k]->input[j];
    const model::BeatAveragedLoad own = wrench.at(variables);
    s.thrust_N = own.force_N[2];
    model::BeatAveragedLoads<double> load{{own.force_N[0], own.force_N[1], own.force_N[2]},
                                          {own.moment_Nm[0], own.moment_Nm[1], own.moment_Nm[2]}};
    load.moment_Nm = load.moment_Nm - model::cross(com, load.force_N);  // about the centre of mass
    for (const Acting& a : acting)
      if (a.effect->averaged.load != nullptr) a.effect->averaged.load(a.values.data(), s, load);
    const Vec d = Vec{-com.x, -com.y, -com.z};
    Vec force = (1 / s.mass_kg) * load.force_N +
                (model::cross(s.turning_rad_s2, d) + model::cross(s.rate_rad_s, model::cross(s.rate_rad_s, d)));
    for (const Acting& a : acting)
      if (a.effect->averaged.seen != nullptr && log_.header.mocap.source == flightlog::PoseSource::motion_capture)
        a.effect->averaged.seen(a.values.data(), s, force);
    const Vector3d f = eigen(force), w = motion_.rate_rad_s[at];
    for (int k = 0; k < 3; ++k) rows[row_of_mean(j, kSpecificForceX + k)] = f[k];
    Vector3d turning = per_inertia * (eigen(load.moment_Nm) - w.cross(inertia * w));
    // a trim is where the thrust acts: relative to the thrust, so that no fit makes the moments small to explain their
    // scatter
    if (b.trims) turning = nominal_turning * (eigen(load.moment_Nm) / std::max(load.force_N.z, kMinThrust * nominal_N));
    for (int k = 0; k < 3; ++k) rows[row_of_mean(j, kAngularAccelerationX + k)] = turning[k];
  }
  if (b.trims) take_means(rows);
  return rows;
}

Rows BeatAveragedPrediction::declared_noise(std::uint64_t seed) const {
  const flightlog::MocapHeader& h = log_.header.mocap;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  flightlog::FlightLog still = log_;
  flightlog::MocapStream& m = still.mocap;
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    m.x_m[i] = h.position_noise_m * normal(random);
    m.y_m[i] = h.position_noise_m * normal(random);
    m.z_m[i] = h.position_noise_m * normal(random);
    const double x = h.attitude_noise_rad / 2 * normal(random), y = h.attitude_noise_rad / 2 * normal(random),
                 z = h.attitude_noise_rad / 2 * normal(random);
    m.qx[i] = x, m.qy[i] = y, m.qz[i] = z;
    m.qw[i] = std::sqrt(1 - (x * x + y * y + z * z));
  }
  for (flightlog::Column* gyro : {&still.imu.gyro_x_rad_s, &still.imu.gyro_y_rad_s, &still.imu.gyro_z_rad_s})
    for (double& v : *gyro) v = still.header.imu.gyro_noise_rad_s * normal(random);
  const flightlog::BeatAveragedMotion noise =
      flightlog::beat_averaged_motion(still, nominal_.beat_averaged->bandwidth_Hz, name_);
  Rows rows = rows_of(noise);
  for (std::size_t j = 0; j < rows_.size(); ++j) rows[row_of_mean(j, kSpecificForceZ)] -= log_.header.gravity_m_s2;
  return rows;
}

template <class Value>
std::vector<double> BeatAveragedPrediction::each(const Value& value) const {
  std::vector<double> list;
  for (const std::size_t i : rows_) list.push_back(value(i));
  return list;
}

std::vector<RegimeFunction> BeatAveragedPrediction::functions() const {
  std::vector<RegimeFunction> list;
  // a product depends on the quantity of its second factor
  const auto quantity_of = [](const std::string& name, BasisFunction kind) -> std::string {
    const std::string last = kind == BasisFunction::product ? name.substr(name.find(' ') + 1) : name;
    if (kind == BasisFunction::rate) return "rate";
    const bool velocity = kind >= BasisFunction::velocity_x || last.starts_with("velocity");
    return velocity ? "velocity" : last;
  };
  const auto put = [&](const std::string& name, BasisFunction kind, const std::vector<double>& values) {
    list.push_back({name, quantity_of(name, kind), kind,
                    Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()))});
  };
  const auto add = [&](const std::string& name, BasisFunction kind, auto&& value) { put(name, kind, each(value)); };
  static const char* const kAxes[] = {"x", "y", "z"};
  const auto kind = [](BasisFunction first, int axis) {
    return static_cast<BasisFunction>(static_cast<int>(first) + axis);
  };
  const std::vector<Vector3d>&v = motion_.velocity_B_m_s, &w = motion_.rate_rad_s, &a = motion_.turning_rad_s2;
  const std::vector<model::BeatAveraged::Input>& inputs = nominal_.beat_averaged->inputs;
  std::vector<std::vector<double>> low;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const Driven& d = driven(k, 0, 0);
    low.push_back(d.input);
    put(inputs[k].name, BasisFunction::input, d.input);
    put(inputs[k].name + " rate", BasisFunction::input, d.rate);
    if (log_.power) put(inputs[k].name + " battery", BasisFunction::input, d.times_battery);
  }
  if (log_.power) put("battery", BasisFunction::input, battery_rows_);
  for (int k = 0; k < 3; ++k) {
    const std::string x = kAxes[k], y = kAxes[(k + 1) % 3];
    const int l = (k + 1) % 3;
    add("velocity_" + x, kind(BasisFunction::velocity_x, k), [&](std::size_t i) { return v[i][k]; });
    add("|velocity| velocity_" + x, kind(BasisFunction::drag_x, k),
        [&](std::size_t i) { return v[i].norm() * v[i][k]; });
    add("velocity_" + x + " velocity_" + x, kind(BasisFunction::drag_x, k),
        [&](std::size_t i) { return v[i][k] * v[i][k]; });
    add("velocity_" + x + " velocity_" + y, kind(BasisFunction::drag_x, k),
        [&](std::size_t i) { return v[i][k] * v[i][l]; });
    add("rate_" + x, BasisFunction::rate, [&](std::size_t i) { return w[i][k]; });
    add("rate_" + x + " rate_" + x, BasisFunction::rate, [&](std::size_t i) { return w[i][k] * w[i][k]; });
    add("rate_" + x + " rate_" + y, BasisFunction::rate, [&](std::size_t i) { return w[i][k] * w[i][l]; });
    add("turning_" + x, BasisFunction::rate, [&](std::size_t i) { return a[i][k]; });
    add("vertical_" + x, BasisFunction::place, [&](std::size_t i) { return motion_.attitude[i](2, k); });
    add("north_" + x, BasisFunction::place, [&](std::size_t i) { return motion_.attitude[i](0, k); });
    add("west_" + x, BasisFunction::place, [&](std::size_t i) { return motion_.attitude[i](1, k); });
    for (std::size_t n = 0; n < inputs.size(); ++n) {
      std::vector<double> product = low[n];
      for (std::size_t j = 0; j < rows_.size(); ++j) product[j] *= v[rows_[j]][k];
      put(inputs[n].name + " velocity_" + x, BasisFunction::product, product);
    }
  }
  add("height", BasisFunction::place, [&](std::size_t i) { return motion_.position_m[i].z(); });
  add("time", BasisFunction::place, [&](std::size_t i) { return motion_.step_s * static_cast<double>(i); });
  return list;
}

std::optional<double> BeatAveragedPrediction::log_input_noise() const {
  const flightlog::Column& t_s = log_.command.t_s;
  std::vector<char> in_air;
  for (const double t : t_s) {
    const auto k = static_cast<std::size_t>(std::max((t - motion_.t_s(0)) / motion_.step_s, 0.0));
    in_air.push_back(k < motion_.size() && motion_.seen[k] != 0);
  }
  double sum = 0, n = 0;
  for (const model::BeatAveraged::Input& i : nominal_.beat_averaged->inputs) {
    const auto at = std::ranges::find(log_.header.inputs, i.name) - log_.header.inputs.begin();
    const flightlog::Column& x = log_.command.declared[static_cast<std::size_t>(at)];
    for (std::size_t k = 1; k + 1 < x.size(); ++k)
      if (in_air[k]) sum += std::pow((x[k + 1] - 2 * x[k] + x[k - 1]) / (i.high - i.low), 2), n += 1;
  }
  if (!(sum > 0)) return {};
  return 0.5 * std::log(sum / n);
}

std::vector<RegimeQuantity> BeatAveragedPrediction::inputs() const {
  std::vector<RegimeQuantity> list;
  for (std::size_t k = 0; k < nominal_.beat_averaged->inputs.size(); ++k)
    list.push_back({nominal_.beat_averaged->inputs[k].name, "", driven(k, 0, 0).input});
  return list;
}

std::vector<RegimeQuantity> BeatAveragedPrediction::regimes() const {
  const double ground_z_m = log_.header.ambient.ground_z_m;
  std::vector<RegimeQuantity> list = {
      {"height", "m", each([&](std::size_t i) { return motion_.position_m[i].z() - ground_z_m; })},
      {"speed", "m/s", each([&](std::size_t i) { return motion_.velocity_B_m_s[i].norm(); })},
      {"body rate", "rad/s", each([&](std::size_t i) { return motion_.rate_rad_s[i].norm(); })},
      {"time", "s", each([&](std::size_t i) { return motion_.step_s * static_cast<double>(i); })}};
  if (log_.power) list.push_back({"battery", "", battery_rows_});
  return list;
}

}  // namespace flappy::gap
