#include "gap/carry.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <random>

#include "gap/stream_rows.hpp"
#include "sim/storage.hpp"

namespace flappy::gap {
inline namespace scalar {
extern const CarryBlock carry_block_kernel;
}
inline namespace v2 {
extern const CarryBlock carry_block_kernel;
}
inline namespace v3 {
extern const CarryBlock carry_block_kernel;
}
inline namespace v4 {
extern const CarryBlock carry_block_kernel;
}

CarryBlock carry_kernel(const char* instruction_set) {
  const std::string name = *instruction_set ? instruction_set : sim::best_instruction_set();
  if (name == "x86-64-v4") return v4::carry_block_kernel;
  if (name == "x86-64-v3") return v3::carry_block_kernel;
  if (name == "x86-64-v2") return v2::carry_block_kernel;
  return scalar::carry_block_kernel;
}

namespace {

constexpr std::size_t kVehicles = sim::kLanes<double>;
/// Of these, a vehicle predicts.
constexpr std::size_t kSignals = kPathX;

/// What two good streams may disagree by for reasons that no entry knows, times the share that models get wrong.
constexpr double kStreamSignal_m_s2 = 1, kStreamSignal_rad_s = 1;

/// Voltages of steps, some steps later.
class ShiftedVoltage {
 public:
  explicit ShiftedVoltage(double steps)
      : whole_(static_cast<std::ptrdiff_t>(std::floor(steps))), share_(steps - std::floor(steps)) {}
  double of(const std::vector<double>& voltage_V, std::size_t step) const {
    const auto at = [&](std::ptrdiff_t i) {
      return voltage_V[static_cast<std::size_t>(
          std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(voltage_V.size()) - 1))];
    };
    const auto i = static_cast<std::ptrdiff_t>(step) - whole_;
    return share_ == 0 ? at(i) : (1 - share_) * at(i) + share_ * at(i - 1);
  }

 private:
  std::ptrdiff_t whole_;
  double share_;
};

}  // namespace

const char* channel_name(int channel) {
  static const char* const kNames[kChannels] = {
      "torque_x",    "torque_y",     "torque_z",     "force_x",       "force_y", "force_z",
      "stroke_left", "stroke_right", "current_left", "current_right", "battery", "path_x",
      "path_y",      "path_z",       "turn_x",       "turn_y",        "turn_z"};
  return kNames[channel];
}

CarriedFlight::CarriedFlight(Recording recording) : recording_(std::move(recording)) {
  const Recording& r = recording_;
  const auto first = static_cast<std::size_t>(std::ceil(kSpinUpBeats));
  imu_ = BeatProjection(r.beat, r.valid, r.beats, first);
  std::vector<double> samples(r.intervals() * kSignals, 0);
  std::vector<char> seen(r.valid), metered(r.valid);
  has_wings_ = r.log.wings.has_value();
  has_power_ = r.log.power.has_value();
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    double* s = &samples[k * kSignals];
    for (int i = 0; i < 3; ++i) s[kForceX + i] = r.force_m_s2[k][i];
    const auto put = [&](const auto& values, Channel first_channel, std::vector<char>& there) {
      if (std::isfinite(values[0])) std::ranges::copy(values, s + first_channel);
      else there[k] = 0;
    };
    if (has_wings_) put(flight::strokes_at(*r.log.wings, r.log.header.wings->rate_hz, r.end_s[k]), kStrokeLeft, seen);
    if (has_power_) put(flight::power_at(r.log, r.end_s[k]), kCurrentLeft, metered);
  }
  if (has_wings_) wings_ = BeatProjection(r.beat, seen, r.beats, first);
  if (has_power_) power_ = BeatProjection(r.beat, metered, r.beats, first);
  measured_ = rows_of(samples);
  for (std::size_t k = 0; k < r.intervals(); ++k)
    for (std::size_t i = 0; i < 3; ++i)
      samples[k * kSignals + kTorqueX + i] =
          (r.torso[k + 1].body_rate_rad_s[i] - r.torso[k].body_rate_rad_s[i]) / r.interval_s(k);
  signal_ = rows_of(samples);
  compare_streams();
}

namespace {

void put_streams(const std::vector<StreamRow>& streams, Rows& rows) {
  for (std::size_t j = 0; j < streams.size(); ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      rows[j * kRowsPerBeat + (kPathX + i) * kCoefficients] = streams[j].path_m_s2[static_cast<Eigen::Index>(i)];
      rows[j * kRowsPerBeat + (kTurnX + i) * kCoefficients] = streams[j].turn_rad_s[static_cast<Eigen::Index>(i)];
    }
}

}  // namespace

void CarriedFlight::compare_streams() {
  const std::vector<StreamRow> streams = stream_rows(recording_);
  put_streams(streams, measured_);
  for (std::size_t j = 0; j < streams.size(); ++j) compared_.push_back(streams[j].valid && imu_.covers(j) ? 1 : 0);
  // the size of what moved, for that of what models get wrong of it: as the torso's forces and rates
  for (std::size_t j = 0; j < recording_.beats; ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      signal_[j * kRowsPerBeat + (kPathX + i) * kCoefficients] = kStreamSignal_m_s2;
      signal_[j * kRowsPerBeat + (kTurnX + i) * kCoefficients] = kStreamSignal_rad_s;
    }
}

/// Of samples [interval][channel].
Rows CarriedFlight::rows_of(const std::vector<double>& samples) const {
  const Recording& r = recording_;
  Rows together(r.beats * kCoefficients * kSignals, 0), rows(r.beats * kRowsPerBeat, 0);
  imu_.project(samples.data(), kSignals, together.data());
  for (std::size_t j = 0; j < r.beats; ++j)
    for (std::size_t c = 0; c < kCoefficients; ++c)
      for (std::size_t s = 0; s < kSignals; ++s)
        rows[j * kRowsPerBeat + s * kCoefficients + c] = together[(j * kCoefficients + c) * kSignals + s];
  return rows;
}

Rows CarriedFlight::declared_noise(std::uint64_t seed) const {
  const flight::FlightHeader& h = recording_.log.header;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> samples(recording_.intervals() * kSignals, 0);
  double before[3] = {0, 0, 0};
  for (std::size_t k = 0; k < recording_.intervals(); ++k) {
    double* s = &samples[k * kSignals];
    for (int i = 0; i < 3; ++i) {
      // the carried rate holds the noise of the sample before
      const double rate = h.imu.gyro_noise_rad_s * normal(random);
      s[kTorqueX + i] = (rate - before[i]) / recording_.interval_s(k);
      before[i] = rate;
      s[kForceX + i] = h.imu.accel_noise_m_s2 * normal(random);
    }
    for (int i = 0; i < 2; ++i) s[kStrokeLeft + i] = h.wings ? h.wings->noise_rad * normal(random) : 0;
    for (int i = 0; i < 2; ++i) s[kCurrentLeft + i] = h.power ? h.power->current_noise_A * normal(random) : 0;
    s[kBattery] = h.power ? h.power->voltage_noise_V * normal(random) : 0;
  }
  Rows rows = rows_of(samples);
  put_streams(stream_noise(recording_, seed), rows);
  return rows;
}

bool CarriedFlight::covers(std::size_t beat, int channel) const {
  if (channel >= kPathX) return compared_[beat] != 0;
  if (channel >= kCurrentLeft) return has_power_ && imu_.covers(beat) && power_.covers(beat);
  if (channel >= kStrokeLeft) return has_wings_ && imu_.covers(beat) && wings_.covers(beat);
  return imu_.covers(beat);
}

/// Of all lanes, at the end of an interval. `meter`: what the motors had, where effects changed it; else the last step's
/// volts and the vehicle's ohms.
void CarriedFlight::read_power(const double* meter, const double* volts, const CarriedBlock& kept,
                               const std::vector<const Candidate*>& candidates, double* samples) const {
  const double nominal_V = recording_.log.header.power->battery_nominal_V;
  for (std::size_t lane = 0; lane < kVehicles; ++lane) {
    const model::Vehicle& v = candidates[std::min(lane, candidates.size() - 1)]->vehicle;
    const model::Motor* const motors[] = {&v.left.motor, &v.right.motor};
    for (std::size_t side = 0; side < 2; ++side) {
      const model::Motor& m = *motors[side];
      const double V = meter != nullptr ? meter[(1 + side) * kVehicles + lane] : volts[side * kVehicles + lane];
      const double ohm = meter != nullptr ? meter[(3 + side) * kVehicles + lane] : m.resistance_ohm;
      samples[(kCurrentLeft + side) * kVehicles + lane] =
          (V - m.torque_constant_Nm_A * m.gear_ratio * kept.rows[kStrokeRate + side][lane]) / ohm;
    }
    samples[kBattery * kVehicles + lane] = nominal_V * (meter != nullptr ? meter[lane] : 1);
  }
}

std::vector<Rows> CarriedFlight::predict(const std::vector<const Candidate*>& candidates) const {
  const Recording& r = recording_;
  const CarryBlock carry = carry_kernel("");
  sim::Batch<double> batch(kVehicles, candidates.front()->vehicle, {kStep_s, 1, r.world, {}});
  std::vector<ShiftedVoltage> shifted;
  for (std::size_t i = 0; i < kVehicles; ++i) {
    const Candidate& c = *candidates[std::min(i, candidates.size() - 1)];
    model::Vehicle vehicle = c.vehicle;
    vehicle.air_density_kg_m3 *= r.density_ratio;
    batch.set_vehicle(i, vehicle);
    batch.reset(i, {});
    shifted.emplace_back(c.lag_s / kStep_s);
  }
  auto& storage = batch.storage();
  sim::Block<double>& block = storage.blocks[0];
  sim::StepPlan plan = storage.plan();
  plan.steps_per_update = 1;
  CarriedBlock kept;
  const double* imu_m = r.log.header.imu.position_m.data();
  carry(block, nullptr, r.torso[0], 1, imu_m, r.world.gravity_m_s2, kept);

  const int longest = *std::ranges::max_element(r.steps);
  std::vector<double> voltages_V(static_cast<std::size_t>(longest) * 2 * kVehicles);
  std::vector<double> samples(r.intervals() * kSignals * kVehicles, 0);
  std::vector<double> meter(sim::kMeterRows * kVehicles);
  std::size_t step = 0;
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    for (int i = 0; i < r.steps[k]; ++i, ++step) {
      double* to = &voltages_V[static_cast<std::size_t>(i) * 2 * kVehicles];
      for (std::size_t lane = 0; lane < kVehicles; ++lane) {
        to[lane] = shifted[lane].of(r.left_V, step);
        to[kVehicles + lane] = shifted[lane].of(r.right_V, step);
      }
    }
    sim::BlockEffects<double> in_force = storage.effects_of(0);
    in_force.voltages_V = voltages_V.data();
    in_force.meter = meter.data();
    storage.kernel(block, in_force, plan, 0, r.steps[k], nullptr);
    carry(block, &r.torso[k], r.torso[k + 1], r.interval_s(k), imu_m, r.world.gravity_m_s2, kept);
    double* to = &samples[k * kSignals * kVehicles];
    const double per_interval = 1 / r.interval_s(k);
    for (std::size_t lane = 0; lane < kVehicles; ++lane) {
      for (std::size_t i = 0; i < 3; ++i) {
        to[(kTorqueX + i) * kVehicles + lane] = -per_interval * kept.rows[kTurnRate + i][lane];
        to[(kForceX + i) * kVehicles + lane] = kept.rows[kForce + i][lane];
      }
      to[kStrokeLeft * kVehicles + lane] = kept.rows[kStroke][lane];
      to[kStrokeRight * kVehicles + lane] = kept.rows[kStroke + 1][lane];
    }
    if (has_power_)
      read_power(in_force.set != 0 ? meter.data() : nullptr,
                 &voltages_V[static_cast<std::size_t>(r.steps[k] - 1) * 2 * kVehicles], kept, candidates, to);
  }

  Rows together(r.beats * kCoefficients * kSignals * kVehicles, 0);
  imu_.project(samples.data(), kSignals * kVehicles, together.data());
  std::vector<Rows> result(candidates.size());
  for (std::size_t lane = 0; lane < candidates.size(); ++lane) {
    if (batch.status(lane) & sim::kFrozen) continue;
    Rows& rows = result[lane];
    rows.resize(r.beats * kRowsPerBeat);
    for (std::size_t j = 0; j < r.beats; ++j)
      for (std::size_t c = 0; c < kCoefficients; ++c)
        for (std::size_t s = 0; s < kSignals; ++s)
          rows[j * kRowsPerBeat + s * kCoefficients + c] =
              together[((j * kCoefficients + c) * kSignals + s) * kVehicles + lane];
  }
  return result;
}

std::vector<std::vector<Rows>> predict_all(const std::vector<CarriedFlight>& flights,
                                           const std::vector<Candidate>& candidates, int threads) {
  const std::size_t blocks = (candidates.size() + kVehicles - 1) / kVehicles;
  std::vector<std::vector<Rows>> result(candidates.size(), std::vector<Rows>(flights.size()));
  std::exception_ptr failed;
  const auto jobs = static_cast<std::ptrdiff_t>(blocks * flights.size());
#pragma omp parallel for schedule(dynamic) num_threads(threads > 0 ? threads : omp_get_num_procs())
  for (std::ptrdiff_t job = 0; job < jobs; ++job) {
    try {
      const std::size_t flight = static_cast<std::size_t>(job) % flights.size();
      const std::size_t first = static_cast<std::size_t>(job) / flights.size() * kVehicles;
      std::vector<const Candidate*> group;
      for (std::size_t i = first; i < std::min(first + kVehicles, candidates.size()); ++i)
        group.push_back(&candidates[i]);
      std::vector<Rows> rows = flights[flight].predict(group);
      for (std::size_t i = 0; i < group.size(); ++i) result[first + i][flight] = std::move(rows[i]);
    } catch (...) {  // nothing may leave a parallel loop
#pragma omp critical
      failed = std::current_exception();
    }
  }
  if (failed) std::rethrow_exception(failed);
  return result;
}

}  // namespace flappy::gap
