#include "benchmark/robot_prediction.hpp"

#include <algorithm>
#include <cmath>

#include "blind/a/robot_controller.hpp"
#include "flightlog/rotation.hpp"
#include "io/parallel.hpp"

namespace flappy::benchmark {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;

constexpr int kSubsteps = 10;  // steps of the robot in a step of the record
static_assert(kSubsteps * blind::kRobotStep_s == gap::kPredictionStep_s);
/// Number of torque and force channels.
constexpr std::size_t kSignals = gap::kStrokeLeft;
/// Voltages before the record are unknown; so many beats at its start are repeated.
constexpr double kBeatsBefore = 10;

blind::Torso torso_of(const gap::TorsoAt& t) {
  return {Vector3d(t.position_m), Quaterniond(t.attitude[0], t.attitude[1], t.attitude[2], t.attitude[3]),
          Vector3d(t.velocity_m_s), Vector3d(t.body_rate_rad_s)};
}

blind::Room room_of(const sim::World& world) {
  blind::Room room{world.gravity_m_s2, world.ground_z_m, world.ceiling_z_m, {}};
  if (!world.walls.empty()) {
    const sim::Wall& w = world.walls.front();
    room.wall = {w.x_m, w.y_m, w.normal_x, w.normal_y};
  }
  return room;
}

/// Its state depends on time before the record: heat, charge, weather.
bool remembers(const blind::Magnitudes& magnitudes) {
  for (const blind::Effect e : {blind::Effect::wind, blind::Effect::winding_heating, blind::Effect::battery_sag,
                                blind::Effect::outside_vortex_shedding, blind::Effect::outside_brush_contact})
    if (magnitudes.has(e)) return true;
  return false;
}

class Carrier {
 public:
  Carrier(const gap::Recording& recording, const Perturbation& perturbation, std::uint64_t flight)
      : r_(recording),
        robot_(perturbation.vehicle, room_of(recording.world), perturbation.magnitudes, perturbation.seed, flight),
        imu_m_(recording.log.header.imu.position_m.data()) {
    if (remembers(perturbation.magnitudes)) live_until_start();
  }

  /// [interval][signal]; empty if the simulation diverges.
  std::vector<double> fly() {
    std::vector<double> samples(r_.intervals() * kSignals, 0);
    put(torso_of(r_.torso[0]));
    std::ptrdiff_t step = 0;
    for (std::size_t k = 0; k < r_.intervals(); ++k) {
      const Quaterniond begin = robot_.torso().attitude;
      const Vector3d began_m_s = imu_velocity_m_s();
      for (int i = 0; i < r_.steps[k]; ++i) advance(step++);
      const blind::Torso& flown = robot_.torso();
      blind::Torso to = torso_of(r_.torso[k + 1]);
      const double per_interval = 1 / r_.interval_s(k);
      const Quaterniond halfway =
          begin * flightlog::exponential(0.5 * flightlog::logarithm(begin.conjugate() * flown.attitude));
      Vector3d force = per_interval * (imu_velocity_m_s() - began_m_s);
      force.z() += r_.world.gravity_m_s2;
      force = halfway.conjugate() * force;
      const Vector3d missed = per_interval * flightlog::logarithm(flown.attitude.conjugate() * to.attitude);
      if (!(force.squaredNorm() < 1e12) || !(missed.squaredNorm() < 1e12)) return {};
      for (int i = 0; i < 3; ++i) {
        double* to_signal = &samples[k * kSignals + static_cast<std::size_t>(i)];
        to_signal[gap::kTorqueX] = -per_interval * missed[i];
        to_signal[gap::kForceX] = force[i];
      }
      to.rate_rad_s = flown.rate_rad_s + missed;
      put(to);
    }
    return samples;
  }

 private:
  void put(const blind::Torso& torso) { robot_.place_torso(torso); }
  Vector3d imu_velocity_m_s() const {
    const blind::Torso& t = robot_.torso();
    return t.velocity_m_s + t.attitude * t.rate_rad_s.cross(imu_m_);
  }
  void advance(std::ptrdiff_t step) {
    const std::size_t i = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(step, 0, static_cast<std::ptrdiff_t>(r_.left_V.size()) - 1));
    for (int n = 0; n < kSubsteps; ++n) robot_.step(r_.left_V[i], r_.right_V[i]);
  }
  /// Runs with a fixed torso from trimming to the record: clock and weather are the flight's, heat and charge nearly.
  void live_until_start() {
    robot_.hold_torso(true);
    put(torso_of(r_.torso[0]));
    const auto steps = static_cast<std::ptrdiff_t>(std::lround((blind::kTrim_s + r_.begin_s) / gap::kPredictionStep_s));
    const auto period =
        static_cast<std::ptrdiff_t>(std::lround(kBeatsBefore / r_.log.header.flapping_Hz / gap::kPredictionStep_s));
    for (std::ptrdiff_t i = -steps; i < 0; ++i) advance((i % period + period) % period);
    robot_.hold_torso(false);
  }

  const gap::Recording& r_;
  blind::Robot robot_;
  Vector3d imu_m_;
};

}  // namespace

gap::Rows predict_perturbed(const gap::PredictedFlight& recorded, const Perturbation& perturbation,
                            std::uint64_t flight) {
  const gap::Recording& r = *recorded.recording();
  const std::vector<double> samples = Carrier(r, perturbation, flight).fly();
  if (samples.empty()) return {};
  const gap::BeatProjection projection(r.beat, r.valid, r.beats,
                                       static_cast<std::size_t>(std::ceil(gap::kSpinUpBeats)));
  std::vector<double> together(r.beats * gap::kCoefficients * kSignals, 0);
  projection.project(samples.data(), kSignals, together.data());
  gap::Rows rows(r.beats * gap::kRowsPerBeat, 0);
  for (std::size_t j = 0; j < r.beats; ++j)
    for (std::size_t c = 0; c < gap::kCoefficients; ++c)
      for (std::size_t s = 0; s < kSignals; ++s)
        rows[j * gap::kRowsPerBeat + s * gap::kCoefficients + c] =
            together[(j * gap::kCoefficients + c) * kSignals + s];
  recorded.weigh(rows);
  return rows;
}

std::vector<gap::Residuals> predict_perturbed_flights(const gap::Flights& flights,
                                                      const std::vector<Perturbation>& perturbations, int threads) {
  std::vector<gap::Residuals> result(perturbations.size(), gap::Residuals(flights.size()));
  io::parallel_for(perturbations.size() * flights.size(), threads, [&](std::size_t job) {
    const std::size_t perturbation = job / flights.size(), flight = job % flights.size();
    result[perturbation][flight] = predict_perturbed(*flights[flight], perturbations[perturbation], flight);
  });
  for (gap::Residuals& s : result)
    if (std::ranges::any_of(s, [](const gap::Rows& rows) { return rows.empty(); })) s.clear();
  return result;
}

}  // namespace flappy::benchmark
