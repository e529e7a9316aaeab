#include "gap/replay/reset_prediction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "gap/replay/stream_rows.hpp"
#include "io/parallel.hpp"
#include "sim/kernels.hpp"
#include "sim/storage.hpp"

namespace flappy::gap {
FLAPPY_KERNELS(ResetBlock, reset_block_kernel);
FLAPPY_KERNELS(ClampedBlock, clamped_block_kernel);
FLAPPY_KERNELS(ProjectBlock<Flown>, project_block_kernel);
FLAPPY_KERNELS(ProjectBlock<double>, project_meter_kernel);

namespace {

/// Channels predicted at every interval of the IMU, and those that the power meter samples.
constexpr std::size_t kSignals = kBattery, kMetered = sim::kMeterRows;
static_assert(kPathX == kSignals + kMetered);
static_assert(kAngularAccelerationX == int{kAngularAcceleration} && kSpecificForceX == int{kSpecificForce} &&
              kStrokeLeft == int{kStroke} && kRotationLeft == int{kRotation} && kSignals == kResetRows);

/// Samples of all lanes.
constexpr std::size_t kSample = kSignals * kVehicles, kMeter = kMetered * kVehicles;

/// Rounding error of a time, in steps. Choice.
constexpr double kSameStep = 1e-3;
/// Signals of path and rotate; times the shares of the discrepancy, how much both sensors may disagree without an
/// effect. Choice: so the shares are in these units.
constexpr double kStreamSignal_m_s2 = 1, kStreamSignal_rad_s = 1;

/// Beats to either side that a second difference of positions over three beats reaches. Derived: from kKernel.
constexpr std::size_t kHalfKernel = 2;
/// Weights that a second difference of positions over three beats gives to accelerations around. Derived: the hat of a
/// difference over three beats.
constexpr double kKernel[] = {1.0 / 9, 2.0 / 9, 3.0 / 9, 2.0 / 9, 1.0 / 9};

/// Voltages delayed by a number of steps, linearly interpolated between steps.
class ShiftedVoltage {
 public:
  explicit ShiftedVoltage(double steps)
      : whole_(static_cast<std::ptrdiff_t>(std::floor(steps))), share_(steps - std::floor(steps)) {}
  /// Writes `count` steps from `step` on to every `stride`-th element of `to`.
  void put(const std::vector<double>& voltage_V, std::size_t step, int count, std::size_t stride, Flown* to) const {
    const auto size = static_cast<std::ptrdiff_t>(voltage_V.size()), first = static_cast<std::ptrdiff_t>(step) - whole_;
    const bool inside = first >= 1 && first + count <= size;
    for (std::ptrdiff_t i = first; i < first + count; ++i, to += stride) {
      const auto now = static_cast<std::size_t>(inside ? i : std::clamp<std::ptrdiff_t>(i, 0, size - 1));
      const auto before = static_cast<std::size_t>(inside ? i - 1 : std::clamp<std::ptrdiff_t>(i - 1, 0, size - 1));
      *to = static_cast<Flown>((1 - share_) * voltage_V[now] + share_ * voltage_V[before]);
    }
  }

 private:
  std::ptrdiff_t whole_;
  double share_;
};

}  // namespace

ResetPrediction::ResetPrediction(Recording recording) : recording_(std::move(recording)) {
  const Recording& r = recording_;
  const auto first = static_cast<std::size_t>(std::ceil(kSpinUpBeats));
  imu_ = BeatProjection(r.beat, r.valid, r.beats, first);
  std::vector<double> samples(r.intervals() * kSignals, 0);
  std::vector<char> seen(r.valid);
  has_wings_ = r.log.wings.has_value();
  // films of strokes alone leave rotations at one value
  has_rotations_ = has_wings_ && std::ranges::any_of(r.log.wings->left_rotation_rad, [&](double angle) {
                     return angle != r.log.wings->left_rotation_rad.front();
                   });
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    double* s = &samples[k * kSignals];
    for (int i = 0; i < 3; ++i) s[kSpecificForceX + i] = r.force_m_s2[k][i];
    for (int i = 0; r.clamped() && i < 3; ++i) s[kAngularAccelerationX + i] = r.turn_rad_s2[k][i];
    if (!has_wings_) continue;
    const auto angles = flightlog::wing_angles_at(*r.log.wings, r.log.header.wings->rate_hz, r.end_s[k]);
    if (std::isfinite(angles[0])) std::ranges::copy(angles, s + kStrokeLeft);
    else seen[k] = 0;
  }
  if (has_wings_) wings_ = BeatProjection(r.beat, seen, r.beats, first);
  lay_power(first);
  measured_ = rows_of(samples);
  for (std::size_t k = 0; !r.clamped() && k < r.intervals(); ++k)
    for (std::size_t i = 0; i < 3; ++i)
      samples[k * kSignals + kAngularAccelerationX + i] =
          (r.torso[k + 1].body_rate_rad_s[i] - r.torso[k].body_rate_rad_s[i]) / r.interval_s(k);
  signal_ = rows_of(samples);
  if (r.log.power) {
    const flightlog::PowerStream& p = *r.log.power;
    std::vector<double> power;
    for (const std::size_t i : power_sample_)
      power.insert(power.end(), {p.battery_V[i], p.left_current_A[i], p.right_current_A[i]});
    put_power(power, measured_);
    for (std::size_t i = 0; i < power.size(); i += kMetered) power[i] -= r.full * r.log.header.power->battery_nominal_V;
    put_power(power, signal_);
  }
  if (r.clamped()) {
    compared_.assign(r.beats, 0);
    for (std::size_t j = 0; j < r.beats; ++j) smoothed_.push_back(imu_.covers(j) ? 1 : 0);
  } else {
    compare_streams();
  }
}

/// Places power.csv on the grid. A sample at the time of a new voltage shows the new one, so it is predicted from the
/// first step that does not begin before it and the next, never from the one before.
void ResetPrediction::lay_power(std::size_t first_beat) {
  const Recording& r = recording_;
  if (!r.log.power) return;
  std::vector<double> beat;
  std::vector<char> valid;
  std::size_t step = 0, k = 0;  // first step of interval k
  for (std::size_t i = 0; i < r.log.power->t_s.size(); ++i) {
    const double t_s = r.log.power->t_s[i] - r.log.header.power->latency_s;
    const double begins = (t_s - r.begin_s) / kPredictionStep_s, at = std::ceil(begins - kSameStep);
    if (at < 0) continue;
    while (k < r.intervals() && at + 1 >= static_cast<double>(step) + r.steps[k])
      step += static_cast<std::size_t>(r.steps[k++]);
    if (k == r.intervals()) break;
    power_sample_.push_back(i);
    power_step_.push_back(static_cast<std::size_t>(at));
    power_late_.push_back(at - begins);
    beat.push_back(r.beat_at(t_s));
    valid.push_back(r.valid[k]);
  }
  power_ = BeatProjection(beat, valid, r.beats, first_beat);
}

namespace {

/// From one lane of `together`, [beat][coefficient][signal][stride], to the channels from `first_channel` on.
template <class Value>
void put_channels(const std::vector<Value>& together, std::size_t beats, std::size_t signals, std::size_t stride,
                  std::size_t lane, std::size_t first_channel, Rows& rows) {
  for (std::size_t j = 0; j < beats; ++j)
    for (std::size_t c = 0; c < kCoefficients; ++c)
      for (std::size_t s = 0; s < signals; ++s)
        rows[j * kRowsPerBeat + (first_channel + s) * kCoefficients + c] =
            together[((j * kCoefficients + c) * signals + s) * stride + lane];
}

void put_streams(const std::vector<StreamRow>& streams, Rows& rows) {
  for (std::size_t j = 0; j < streams.size(); ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      rows[j * kRowsPerBeat + (kPathX + i) * kCoefficients] = streams[j].path_m_s2[static_cast<Eigen::Index>(i)];
      rows[j * kRowsPerBeat + (kRotateX + i) * kCoefficients] = streams[j].rotate_rad_s[static_cast<Eigen::Index>(i)];
    }
}

}  // namespace

void ResetPrediction::compare_streams() {
  const std::vector<StreamRow> streams = stream_rows(recording_);
  put_streams(streams, measured_);
  for (std::size_t j = 0; j < streams.size(); ++j) compared_.push_back(streams[j].valid && imu_.covers(j) ? 1 : 0);
  path_m_s2_ = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(streams.size()));
  for (std::size_t j = 0; j < streams.size(); ++j) {
    bool whole = compared_[j] != 0 && j >= kHalfKernel && j + kHalfKernel < streams.size();
    for (std::size_t i = 0; whole && i <= 2 * kHalfKernel; ++i) whole = imu_.covers(j + i - kHalfKernel);
    smoothed_.push_back(whole ? 1 : 0);
    path_m_s2_.col(static_cast<Eigen::Index>(j)) = streams[j].path_m_s2;
    attitude_.emplace_back(imu_.covers(j)
                               ? recording_.smoother->at(recording_.regimes[j].t_s).attitude.toRotationMatrix()
                               : Eigen::Matrix3d::Identity());
  }
  smooth_forces(measured_, path_m_s2_);
  for (std::size_t j = 0; j < recording_.beats; ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      signal_[j * kRowsPerBeat + (kPathX + i) * kCoefficients] = kStreamSignal_m_s2;
      signal_[j * kRowsPerBeat + (kRotateX + i) * kCoefficients] = kStreamSignal_rad_s;
    }
}

/// Weighs mean forces over beats like a second difference of positions, in W; result in B. `more_m_s2`: added in W,
/// [axis][beat]: for measured forces, what motion capture says beyond the IMU.
void ResetPrediction::smooth_forces(Rows& rows, const Eigen::Matrix3Xd& more_m_s2) const {
  const auto row = [&](std::size_t j, std::size_t i) {
    return j * kRowsPerBeat + (kSpecificForceX + i) * kCoefficients;
  };
  std::vector<Eigen::Vector3d> force(recording_.beats);
  for (std::size_t j = 0; j < recording_.beats; ++j)
    force[j] = attitude_[j] * Eigen::Vector3d(rows[row(j, 0)], rows[row(j, 1)], rows[row(j, 2)]);
  for (std::size_t j = 0; j < recording_.beats; ++j) {
    if (!smoothed_[j]) continue;
    Eigen::Vector3d sum = more_m_s2.col(static_cast<Eigen::Index>(j));
    for (std::size_t i = 0; i <= 2 * kHalfKernel; ++i) sum += kKernel[i] * force[j + i - kHalfKernel];
    const Eigen::Vector3d body = attitude_[j].transpose() * sum;
    for (std::size_t i = 0; i < 3; ++i) rows[row(j, i)] = body[static_cast<Eigen::Index>(i)];
  }
}

/// `samples`: [interval][channel].
Rows ResetPrediction::rows_of(const std::vector<double>& samples) const {
  Rows together(recording_.beats * kCoefficients * kSignals, 0), rows(recording_.beats * kRowsPerBeat, 0);
  imu_.project(samples.data(), kSignals, together.data());
  put_channels(together, recording_.beats, kSignals, 1, 0, 0, rows);
  return rows;
}

/// `samples`: [sample][battery, left, right].
void ResetPrediction::put_power(const std::vector<double>& samples, Rows& rows) const {
  Rows together(recording_.beats * kCoefficients * kMetered, 0);
  power_.project(samples.data(), kMetered, together.data());
  put_channels(together, recording_.beats, kMetered, 1, 0, kBattery, rows);
}

Rows ResetPrediction::declared_noise(std::uint64_t seed) const {
  const flightlog::FlightHeader& h = recording_.log.header;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> samples(recording_.intervals() * kSignals, 0);
  double before[3] = {0, 0, 0};
  const double of_mean = 1 / std::sqrt(static_cast<double>(recording_.samples_per_interval));
  for (std::size_t k = 0; k < recording_.intervals(); ++k) {
    double* s = &samples[k * kSignals];
    for (int i = 0; i < 3; ++i) {
      if (h.rig) {
        s[kSpecificForceX + i] = of_mean * h.rig->force_noise_N * normal(random) / recording_.mass_kg;
        s[kAngularAccelerationX + i] = of_mean * h.rig->moment_noise_Nm * normal(random) / recording_.inertia_kg_m2[i];
        continue;
      }
      // the simulation was reset to a rate that has the noise of the sample before
      const double rate = h.imu.gyro_noise_rad_s * normal(random);
      s[kAngularAccelerationX + i] = (rate - before[i]) / recording_.interval_s(k);
      before[i] = rate;
      s[kSpecificForceX + i] = h.imu.accel_noise_m_s2 * normal(random);
    }
    for (int i = 0; i < 4 && recording_.log.wings; ++i) s[kStrokeLeft + i] = h.wings->noise_rad * normal(random);
  }
  Rows rows = rows_of(samples);
  if (recording_.log.power) {
    std::vector<double> power;
    for (std::size_t i = 0; i < power_sample_.size(); ++i)
      power.insert(power.end(), {h.power->voltage_noise_V * normal(random), h.power->current_noise_A * normal(random),
                                 h.power->current_noise_A * normal(random)});
    put_power(power, rows);
  }
  if (h.rig) return rows;
  put_streams(stream_noise(recording_, seed, false), rows);
  const std::vector<StreamRow> streams = stream_noise(recording_, seed, true);
  for (std::size_t j = 0; j < recording_.beats; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      rows[j * kRowsPerBeat + (kSpecificForceX + i) * kCoefficients] =
          streams[j].path_m_s2[static_cast<Eigen::Index>(i)];
  return rows;
}

bool ResetPrediction::covers(std::size_t beat, int channel) const {
  if (channel >= kPathX) return compared_[beat] != 0;
  if (channel >= kBattery) return imu_.covers(beat) && beat < power_.beats() && power_.covers(beat);
  if (channel >= kSpecificForceX && channel <= kSpecificForceZ) return smoothed_[beat] != 0;
  if (channel >= kRotationLeft && !has_rotations_) return false;
  if (channel >= kStrokeLeft) return has_wings_ && imu_.covers(beat) && wings_.covers(beat);
  return imu_.covers(beat);
}

/// A vehicle, and the flight whose recorded motion it replays: this one, or a copy of it with errors undone.
struct ResetPrediction::Lane {
  const VehicleHypothesis* vehicle;
  const ResetPrediction* seen;
};

struct ResetPrediction::Replay {
  std::vector<Flown> samples;  ///< [interval][signal][lane]
  std::vector<double> power;   ///< [sample of power.csv][metered][lane]
  std::array<bool, kVehicles> diverged{};
};

namespace {

/// Recorded motion at a bound of intervals. `recordings`: [lane].
void put_torso(const std::vector<const Recording*>& recordings, std::size_t bound, TorsoRows& rows) {
  const bool one = std::ranges::all_of(recordings, [&](const Recording* r) { return r == recordings.front(); });
  for (std::size_t lane = 0; lane < kVehicles; ++lane) {
    const TorsoAt& t = recordings[lane]->torso[bound];
    const auto put = [&](const auto& values, auto& to) {
      for (std::size_t i = 0; i < std::size(values); ++i) {
        if (one) std::fill_n(to[i], kVehicles, static_cast<Flown>(values[i]));
        else to[i][lane] = static_cast<Flown>(values[i]);
      }
    };
    put(t.position_m, rows.position_m);
    put(t.attitude, rows.attitude);
    put(t.velocity_m_s, rows.velocity_m_s);
    put(t.body_rate_rad_s, rows.body_rate_rad_s);
    if (one) return;
  }
}

}  // namespace

/// Lanes beyond the given ones repeat the last one.
ResetPrediction::Replay ResetPrediction::replay(const std::vector<Lane>& lanes) const {
  const Recording& r = recording_;
  const ResetBlock reset = *reset_block_kernels[sim::place_of("")];
  const ClampedBlock held = *clamped_block_kernels[sim::place_of("")];
  const auto lane_of = [&](std::size_t i) -> const Lane& { return lanes[std::min(i, lanes.size() - 1)]; };
  const auto driven = [&](std::size_t i) {
    model::Vehicle vehicle = lane_of(i).vehicle->vehicle;
    // they do not act in a simulation, but would have the block step as slowly as one with effects
    for (const auto& [id, values] : sensor_effects(vehicle.effects)) vehicle.effects.erase(id);
    apply(r.log.header.changes, vehicle);
    vehicle.air_density_kg_m3 *= r.density_ratio;
    vehicle.driver.hold_s = kPredictionStep_s;
    return vehicle;
  };
  sim::Batch<Flown> batch(kVehicles, driven(0), {kPredictionStep_s, 1, r.world, {}});
  if (r.log.power) sim::storage_of(batch).keep_effects(0);  // the meter needs their rows
  std::vector<ShiftedVoltage> shifted;
  std::vector<const Recording*> recordings;
  alignas(64) Flown imu_m[3][kVehicles];
  for (std::size_t i = 0; i < kVehicles; ++i) {
    batch.set_vehicle(i, driven(i));
    batch.reset(i, {}, r.clamped() ? sim::Start::welded : sim::Start::flying);
    // the lag is that of the sensors of a flight
    shifted.emplace_back(r.clamped() ? 0 : lane_of(i).vehicle->lag_s / kPredictionStep_s);
    recordings.push_back(&lane_of(i).seen->recording_);
    for (std::size_t axis = 0; axis < 3; ++axis)
      imu_m[axis][i] = static_cast<Flown>(recordings[i]->log.header.imu.position_m[axis]);
  }
  auto& storage = sim::storage_of(batch);
  sim::Block<Flown>& block = storage.blocks[0];
  sim::StepPlan plan = storage.plan();
  plan.steps_per_update = 1;
  ResetBlockState kept;
  TorsoRows torso[2];
  ClampedBlockState momenta;
  put_torso(recordings, 0, torso[0]);
  if (r.clamped()) held(block, 0, momenta, kept);
  else reset(block, nullptr, torso[0], 1, imu_m, r.world.gravity_m_s2, kept);

  const int longest = *std::ranges::max_element(r.steps);
  std::vector<Flown> voltages_V(static_cast<std::size_t>(longest) * 2 * kVehicles);
  Replay result;
  result.samples.resize(r.intervals() * kSample);
  result.power.resize(power_step_.size() * kMeter);
  // readings of the last step before an interval, then of each step of the interval
  std::vector<Flown> meter(r.log.power ? (static_cast<std::size_t>(longest) + 1) * kMeter : 0);
  std::size_t step = 0, metered = 0;
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    for (std::size_t lane = 0; lane < kVehicles; ++lane) {
      shifted[lane].put(r.left_V, step, r.steps[k], 2 * kVehicles, &voltages_V[lane]);
      shifted[lane].put(r.right_V, step, r.steps[k], 2 * kVehicles, &voltages_V[kVehicles + lane]);
    }
    step += static_cast<std::size_t>(r.steps[k]);
    sim::BlockEffects<Flown> in_force = storage.effects_of(0);
    in_force.voltages_V = voltages_V.data();
    if (r.log.power) in_force.meter = meter.data() + kMeter;
    storage.kernel(block, in_force, plan, 0, r.steps[k], {});
    if (r.clamped()) {
      held(block, r.interval_s(k), momenta, kept);
      for (int i = 0; i < 3; ++i)
        for (std::size_t lane = 0; lane < kVehicles; ++lane) {
          kept.rows[kSpecificForce + i][lane] /= static_cast<Flown>(r.mass_kg);
          kept.rows[kAngularAcceleration + i][lane] /= static_cast<Flown>(r.inertia_kg_m2[i]);
        }
    } else {
      put_torso(recordings, k + 1, torso[(k + 1) % 2]);
      reset(block, &torso[k % 2], torso[(k + 1) % 2], r.interval_s(k), imu_m, r.world.gravity_m_s2, kept);
    }
    std::copy_n(&kept.rows[0][0], kSample, &result.samples[k * kSample]);
    for (; metered < power_step_.size() && power_step_[metered] + 1 < step; ++metered) {
      const double late = power_late_[metered];
      const Flown* now = &meter[(power_step_[metered] + 1 + static_cast<std::size_t>(r.steps[k]) - step) * kMeter];
      double* const readings = &result.power[metered * kMeter];
      for (std::size_t i = 0; i < kMeter; ++i) {
        const double here = now[i];
        readings[i] = here + late * (here - double{now[i + kMeter]});
      }
      for (std::size_t i = 0; i < kVehicles; ++i)
        readings[i] = r.full * r.log.header.power->battery_nominal_V * readings[i];
    }
    if (r.log.power) std::copy_n(&meter[static_cast<std::size_t>(r.steps[k]) * kMeter], kMeter, meter.data());
  }
  for (std::size_t lane = 0; lane < kVehicles; ++lane) result.diverged[lane] = (batch.status(lane) & sim::kFrozen) != 0;
  return result;
}

std::vector<Rows> ResetPrediction::fly(const std::vector<Lane>& lanes) const {
  const Recording& r = recording_;
  const ProjectBlock<Flown> project = *project_block_kernels[sim::place_of("")];
  const ProjectBlock<double> project_meter = *project_meter_kernels[sim::place_of("")];
  const Replay seen = replay(lanes);
  std::vector<Flown> together(r.beats * kCoefficients * kSample, 0);
  imu_.for_each([&](std::size_t sample, std::size_t beat, const double(&weights)[kCoefficients]) {
    project(&seen.samples[sample * kSample], weights, kCoefficients, kSignals,
            &together[beat * kCoefficients * kSample]);
  });
  Rows metered_together(r.log.power ? r.beats * kCoefficients * kMetered * kVehicles : 0, 0);
  power_.for_each([&](std::size_t sample, std::size_t beat, const double(&weights)[kCoefficients]) {
    project_meter(&seen.power[sample * kMeter], weights, kCoefficients, kMetered,
                  &metered_together[beat * kCoefficients * kMeter]);
  });
  const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(r.beats));
  std::vector<Rows> result(lanes.size());
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    if (seen.diverged[lane]) continue;
    Rows& rows = result[lane];
    rows.resize(r.beats * kRowsPerBeat);
    put_channels(together, r.beats, kSignals, kVehicles, lane, 0, rows);
    if (!r.clamped()) lanes[lane].seen->smooth_forces(rows, none);
    if (r.log.power) put_channels(metered_together, r.beats, kMetered, kVehicles, lane, kBattery, rows);
  }
  return result;
}

std::vector<Rows> ResetPrediction::predict(const std::vector<const VehicleHypothesis*>& vehicles) const {
  std::vector<Lane> lanes;
  for (const VehicleHypothesis* v : vehicles) lanes.push_back({v, this});
  return fly(lanes);
}

bool ResetPrediction::shares_grid(const ResetPrediction& other) const {
  return recording_.steps == other.recording_.steps && recording_.left_V == other.recording_.left_V &&
         recording_.right_V == other.recording_.right_V && imu_ == other.imu_ && power_ == other.power_ &&
         power_step_ == other.power_step_ && power_late_ == other.power_late_;
}

std::vector<Rows> ResetPrediction::compare(const std::vector<ComparedVehicle>& vehicles) const {
  std::vector<std::shared_ptr<const ResetPrediction>> seen;
  for (std::size_t i = 0; i < vehicles.size(); ++i)
    seen.push_back(i > 0 && vehicles[i].undone == vehicles[i - 1].undone ? seen.back()
                                                                         : without_errors(vehicles[i].undone));
  std::vector<Rows> result(vehicles.size());
  std::vector<char> flown(vehicles.size(), 0);
  for (std::size_t first = 0; first < vehicles.size(); ++first) {
    if (flown[first]) continue;
    std::vector<Lane> lanes;
    std::vector<std::size_t> of;
    for (std::size_t i = first; i < vehicles.size(); ++i) {
      if (flown[i] || (seen[i] != seen[first] && !seen[first]->shares_grid(*seen[i]))) continue;
      lanes.push_back({vehicles[i].vehicle, seen[i].get()});
      of.push_back(i);
      flown[i] = 1;
    }
    std::vector<Rows> rows = seen[first]->fly(lanes);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const Rows& measured = seen[of[k]]->measured_;
      for (std::size_t i = 0; i < rows[k].size(); ++i) rows[k][i] = measured[i] - rows[k][i];
      result[of[k]] = std::move(rows[k]);
    }
  }
  return result;
}

std::vector<ImuResidual> ResetPrediction::imu_residuals(const VehicleHypothesis& vehicle) const {
  const Recording& r = recording_;
  const Replay seen = replay(std::vector<Lane>{{&vehicle, this}});
  std::vector<ImuResidual> list;
  for (std::size_t k = 0; !seen.diverged[0] && k < r.intervals(); ++k) {
    const auto sample = r.smoother->imu_sample(r.end_s[k] - r.interval_s(k) / 2);
    if (!sample || !r.valid[k] || r.beat[k] < kSpinUpBeats) continue;
    if (!list.empty() && list.back().sample == *sample) continue;  // a gap of the IMU, cut into pieces
    ImuResidual rest{*sample, r.force_m_s2[k], Eigen::Vector3d::Zero()};
    for (int i = 0; i < 3; ++i) {
      const auto predicted = [&](int row) {
        return double{seen.samples[k * kSample + static_cast<std::size_t>(row + i) * kVehicles]};
      };
      rest.force_m_s2[i] -= predicted(kSpecificForceX);
      rest.rate_rad_s[i] = -r.interval_s(k) * predicted(kAngularAccelerationX);
    }
    list.push_back(rest);
  }
  return list;
}

template <class Value>
std::vector<double> ResetPrediction::each(const Value& value) const {
  std::vector<double> list;
  for (const BeatMotion& r : recording_.regimes) list.push_back(value(recording_, r));
  return list;
}

namespace {

using R = const Recording&;
using S = const BeatMotion&;

/// Distance over which the influence of a surface decays. Choice: about the length of a wing.
constexpr double kReach_m = 0.07;

double near_wall(R r, S s) {
  double near = 0;
  for (const sim::Wall& w : r.world.walls)
    near += std::exp(-std::max(0.0, w.normal_x * (s.position_m.x() - w.x_m) + w.normal_y * (s.position_m.y() - w.y_m)) /
                     kReach_m);
  return near;
}

/// Mean over the beat, or the nearest sample where the beat has none.
double battery_V(R r, S s) {
  const flightlog::PowerStream& p = *r.log.power;
  const double late_s = r.log.header.power->latency_s, half_s = 0.5 / r.log.header.flapping_Hz;
  const auto index = [&](double t_s) { return std::ranges::lower_bound(p.t_s, t_s + late_s) - p.t_s.begin(); };
  const auto last = static_cast<std::ptrdiff_t>(p.t_s.size());
  const auto first = std::min(index(s.t_s - half_s), last - 1);
  const auto end = std::max(index(s.t_s + half_s), first + 1);
  double sum = 0;
  for (auto i = first; i < end; ++i) sum += p.battery_V[static_cast<std::size_t>(i)];
  return sum / static_cast<double>(end - first);
}

}  // namespace

std::vector<RegimeFunction> ResetPrediction::functions() const {
  std::vector<RegimeFunction> list;
  const auto add = [&](const char* name, const char* quantity, BasisFunction kind, auto&& value) {
    const std::vector<double> values = each(value);
    list.push_back({name, quantity, kind,
                    Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()))});
  };
  add("amplitude", "amplitude", BasisFunction::input, [](R, S s) { return s.amplitude_V; });
  add("difference", "difference", BasisFunction::input, [](R, S s) { return s.difference_V; });
  add("bias", "bias", BasisFunction::input, [](R, S s) { return s.bias_V; });
  add("split_cycle", "split_cycle", BasisFunction::input, [](R, S s) { return s.split_cycle; });
  add("velocity_x", "velocity", BasisFunction::velocity_x, [](R, S s) { return s.velocity_B_m_s.x(); });
  add("velocity_y", "velocity", BasisFunction::velocity_y, [](R, S s) { return s.velocity_B_m_s.y(); });
  add("velocity_z", "velocity", BasisFunction::velocity_z, [](R, S s) { return s.velocity_B_m_s.z(); });
  add("rate_x", "rate", BasisFunction::rate, [](R, S s) { return s.rate_rad_s.x(); });
  add("rate_y", "rate", BasisFunction::rate, [](R, S s) { return s.rate_rad_s.y(); });
  add("rate_z", "rate", BasisFunction::rate, [](R, S s) { return s.rate_rad_s.z(); });
  add("|velocity| velocity_x", "velocity", BasisFunction::drag_x,
      [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.x(); });
  add("|velocity| velocity_y", "velocity", BasisFunction::drag_y,
      [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.y(); });
  add("|velocity| velocity_z", "velocity", BasisFunction::drag_z,
      [](R, S s) { return s.velocity_B_m_s.norm() * s.velocity_B_m_s.z(); });
  add("near ground", "height", BasisFunction::place,
      [](R r, S s) { return std::exp(-std::max(0.0, s.position_m.z() - r.world.ground_z_m) / kReach_m); });
  add("near ceiling", "ceiling", BasisFunction::place,
      [](R r, S s) { return std::exp(-std::max(0.0, r.world.ceiling_z_m - s.position_m.z()) / kReach_m); });
  add("near wall", "wall", BasisFunction::place, near_wall);
  add("height", "height", BasisFunction::place, [](R, S s) { return s.position_m.z(); });
  add("cos heading", "heading", BasisFunction::place, [](R, S s) { return std::cos(s.heading_rad); });
  add("sin heading", "heading", BasisFunction::place, [](R, S s) { return std::sin(s.heading_rad); });
  add("time", "time", BasisFunction::place, [](R r, S s) { return s.t_s - r.begin_s; });
  return list;
}

std::vector<std::pair<std::string, std::string>> ResetPrediction::products() const {
  // a bench holds points far apart, and no wing meets the wind of flight there
  if (recording_.clamped())
    return {{"amplitude", "amplitude"},     {"amplitude", "difference"},  {"amplitude", "bias"},
            {"amplitude", "split_cycle"},   {"difference", "difference"}, {"bias", "bias"},
            {"split_cycle", "split_cycle"}, {"difference", "bias"},       {"bias", "split_cycle"}};
  std::vector<std::pair<std::string, std::string>> list;
  for (const char* other : {"amplitude", "difference", "bias", "split_cycle", "velocity_x", "velocity_z"})
    list.emplace_back("amplitude", other);
  return list;
}

std::vector<RegimeQuantity> ResetPrediction::inputs() const {
  return {{"amplitude", "V", each([](R, S s) { return s.amplitude_V; })},
          {"difference", "V", each([](R, S s) { return s.difference_V; })},
          {"bias", "V", each([](R, S s) { return s.bias_V; })},
          {"split cycle", "", each([](R, S s) { return s.split_cycle; })}};
}

std::vector<RegimeQuantity> ResetPrediction::regimes() const {
  std::vector<RegimeQuantity> list = {
      {"height", "m", each([](R r, S s) { return s.position_m.z() - r.world.ground_z_m; })},
      {"speed", "m/s", each([](R, S s) { return s.velocity_B_m_s.norm(); })},
      {"amplitude", "V", each([](R, S s) { return s.amplitude_V; })},
      {"body rate", "rad/s", each([](R, S s) { return s.rate_rad_s.norm(); })},
      {"time", "s", each([](R r, S s) { return s.t_s - r.begin_s; })},
      {"heading", "rad", each([](R, S s) { return s.heading_rad; })}};
  if (recording_.log.power) list.push_back({"battery", "V", each(battery_V)});
  return list;
}

std::shared_ptr<const PredictedFlight> ResetPrediction::with_log(const flightlog::FlightLog& log) const {
  return std::make_shared<ResetPrediction>(Recording(recording_, log));
}

void ResetPrediction::forget() const {
  PredictedFlight::forget();
  const std::scoped_lock lock(mutex_);
  undone_.clear();
}

EffectValues ResetPrediction::undone_of(EffectValues given) const {
  if (recording_.clamped()) return {};  // it has none of these sensors
  for (const std::string& id : recording_.log.header.changes.without) given.erase(id);
  return given;
}

std::shared_ptr<const PredictedFlight> ResetPrediction::corrected(const EffectValues& given) const {
  const EffectValues undone = undone_of(given);
  if (undone.empty()) return {std::shared_ptr<const PredictedFlight>(), this};
  return with_log(without(undone, recording_.log));
}

/// For compare(): this flight, or a copy that can be replayed.
std::shared_ptr<const ResetPrediction> ResetPrediction::without_errors(const EffectValues& given) const {
  const EffectValues undone = undone_of(given);
  if (undone.empty()) return {std::shared_ptr<const ResetPrediction>(), this};
  {
    const std::scoped_lock lock(mutex_);
    for (const auto& [effects, flight] : undone_)
      if (effects == undone) return flight;
  }
  const auto flight = std::make_shared<ResetPrediction>(Recording(recording_, without(undone, recording_.log)));
  flight->recording_.drop_streams();
  flight->signal_ = {};
  const std::scoped_lock lock(mutex_);
  undone_.emplace_front(undone, flight);
  if (undone_.size() > kMaxUndone) undone_.pop_back();
  return flight;
}

}  // namespace flappy::gap
