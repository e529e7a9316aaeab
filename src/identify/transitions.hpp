// The open-loop test of the paper (Fei et al., ICRA 2019): from recorded states, the simulator flies the recorded voltages
// for one and two wing beats, and ends somewhere else than the robot did. By how much, in each of 12 states: absolute, and
// over the state's range within a beat.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flightlog/flight_log.hpp"

namespace flappy::identify {

/// Torso origin in W, roll, pitch and yaw of R = Rz Ry Rx, velocity in W, body rate in B as a gyro sees it: the mean over
/// the last interval of the IMU.
inline constexpr std::array<const char*, 12> kStateNames = {"x_m",       "y_m",      "z_m",      "roll_rad",
                                                            "pitch_rad", "yaw_rad",  "vx_m_s",   "vy_m_s",
                                                            "vz_m_s",    "wx_rad_s", "wy_rad_s", "wz_rad_s"};
using StateVector = std::array<double, 12>;

/// Where states and wings come from.
enum class Source {
  sensors,  ///< motion capture and IMU, smoothed; wings from wings.csv or brought into phase
  truth     ///< truth.csv of a simulated flight: what is left is the vehicle's error alone
};

struct TransitionOptions {
  Source source = Source::sensors;
  std::size_t samples = 2500;      ///< at most, evenly chosen
  std::size_t every = 0;           ///< in place of it, where above 0: every so many samples
  bool accept_innovation = false;  ///< also flights whose sensors disagree by more than their declared noise explains
  int threads = 0;                 ///< 0: one for each processor
};

struct TransitionReport {
  std::size_t samples = 0, recorded = 0, low = 0, not_covered = 0, diverged = 0;
  /// Length of the replays: one and two beats in whole intervals of the IMU, or between rows of truth.csv.
  std::array<double, 2> beats_s{};
  /// By how many times their declared noise the sensors disagree, in the worst of the flights.
  double normalised_innovation = 0;
  StateVector range{};  ///< within a beat, median over samples, never below the sensors' noise
  /// |simulated - recorded| of each sample, after one and two beats; infinite where the simulator diverged.
  std::array<std::vector<StateVector>, 2> errors;

  /// Quantile of the absolute errors; of errors over range where `of_range`. Infinite where it falls on samples that
  /// diverged.
  StateVector quantile(int beats, double share, bool of_range) const;
};

/// Collects samples of flights, then replays a choice of them.
class Transitions {
 public:
  explicit Transitions(const TransitionOptions& options);
  ~Transitions();

  /// io::InputError "folder: what is wrong; accepted" where a flight is too short, never higher than five chords, no
  /// consistent record, or has beats of another length than the flights before. `vehicle` flies in the air density of the
  /// log.
  void add(const std::filesystem::path& folder, const flightlog::FlightLog& log, const model::Vehicle& vehicle);
  /// Of all flights that were added.
  TransitionReport run() const;

 private:
  struct Flight;
  TransitionOptions options_;
  double normalised_innovation_ = 0;
  std::vector<std::unique_ptr<Flight>> flights_;
};

/// The distributions: beats, quantile, 12 absolute errors, 12 errors over range (`..._of_range`).
std::string distribution_csv(const TransitionReport& report);

}  // namespace flappy::identify
