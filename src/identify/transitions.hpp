// The open-loop test of the paper (Fei et al., ICRA 2019): from recorded states, the simulator flies the recorded
// voltages for one and two beats. Error: simulated less recorded, for 12 states, absolute and relative to the state's
// range in a beat.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flightlog/flight_log.hpp"

namespace flappy::identify {

/// Torso origin and velocity in W; roll, pitch, yaw of R = Rz Ry Rx; mean body rate in B over the last IMU interval.
inline constexpr std::array<const char*, 12> kStateNames = {"x_m",       "y_m",      "z_m",      "roll_rad",
                                                            "pitch_rad", "yaw_rad",  "vx_m_s",   "vy_m_s",
                                                            "vz_m_s",    "wx_rad_s", "wy_rad_s", "wz_rad_s"};
using StateVector = std::array<double, 12>;

/// Source of the recorded states and wing angles.
enum class Source {
  sensors,  ///< smoothed motion capture and IMU; wings by a spin-up from rest, corrected by wings.csv if it exists
  truth     ///< truth.csv of a simulated flight: the errors then come from the vehicle alone
};

struct TransitionOptions {
  Source source = Source::sensors;
  std::size_t samples = 2500;      ///< largest number of samples, evenly spread
  std::size_t every = 0;           ///< where above 0: take every n-th sample instead
  bool accept_innovation = false;  ///< accept flights whose sensors disagree beyond their declared noise
  int threads = 0;                 ///< 0: one for each processor
};

struct TransitionReport {
  std::size_t samples = 0, recorded = 0, low = 0, not_covered = 0, diverged = 0;
  /// Length of the replays: one and two beats, rounded to whole intervals of the IMU or of the rows of truth.csv.
  std::array<double, 2> beats_s{};
  /// Largest rms innovation, or bias, of the smoother among the flights, in units of the declared noise.
  double normalised_innovation = 0;
  StateVector range{};  ///< range of each state within a beat: median over samples, at least the sensors' noise
  /// |simulated - recorded| of each sample, after one and two beats; infinite where the simulator diverged.
  std::array<std::vector<StateVector>, 2> errors;

  /// Quantile `share` of absolute errors, or over range if `of_range`. Infinite where it falls on diverged samples.
  StateVector quantile(int beats, double share, bool of_range) const;
};

/// Collects samples of flights and replays a selection of them.
class Transitions {
 public:
  explicit Transitions(const TransitionOptions& options);
  ~Transitions();

  /// `vehicle` is simulated in the log's air density. io::InputError "folder: what is wrong; accepted" for a flight
  /// that is too short, never above five chords, contradicts itself in its sensors, or has beats of another length than
  /// those before.
  void add(const std::filesystem::path& folder, const flightlog::FlightLog& log, const model::Vehicle& vehicle);
  TransitionReport run() const;

 private:
  struct Flight;
  TransitionOptions options_;
  double normalised_innovation_ = 0;
  std::vector<std::unique_ptr<Flight>> flights_;
};

/// Error distributions as CSV: beats, quantile, 12 absolute errors, 12 errors over range (`..._of_range`).
std::string distribution_csv(const TransitionReport& report);

}  // namespace flappy::identify
