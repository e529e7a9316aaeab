// Runs of a robot whose torso is clamped. Clamped, the torso keeps twist 0 and, relative to free fall, the acceleration
// a = (0, g) of rest; the plant solves for the hinges alone, and the stand's wrench is what is left of the equation of
// all bodies, moments about the torso's origin (Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 9: hybrid
// dynamics):
//   S = M a + F q'' - load      q hinges; M, F composite inertias; load: air, and what torso and wings need at q' alone
// so   S = weight - air + d/dt (momentum of wings and rotors),   and the sensor gets  S_rest - S.
// There is no second law of force. Wings, drives, air, battery and radio run as in flight.
//
// W is B. The torso stands 0.35 m above the plate of the stand, five lengths of a wing, where surfaces hardly act, in
// the middle of the room.
#pragma once

#include <vector>

#include "lab/blind/b/b_flight.hpp"
#include "lab/blind/b/b_rig.hpp"

namespace flappy::blind::b {

/// Above the plate, below the ceiling, before the wall; from the torso's origin.
inline constexpr double kPlate_m = 0.35, kBenchCeiling_m = 0.9, kBenchWall_m = 1;
inline constexpr double kBenchRest_s = 0.5;              ///< rest before the log, whose mean is made zero
inline constexpr double kAtRest_s = 0.3, kRamp_s = 0.5;  ///< in the log, before the first point
inline constexpr double kPoint_s = 2, kSweep_s = 2.5;
/// Points that are filmed in each of two runs: as many as a camera's memory holds.
inline constexpr std::size_t kFilmedPoints = 5;

/// Inputs of a run: points that are held, then a sweep. Points follow one published order; a session shifts each input
/// by up to 3 % of the safe part.
class BenchProgramme {
 public:
  BenchProgramme(const Assignment& a, std::size_t run, const RobotParameters& parameters);
  Beat inputs(double time_s) const;
  double lasts_s() const;
  std::size_t points() const { return points_.size(); }
  double point_begins_s(std::size_t point) const;
  /// First point of the film; points() if nothing is filmed.
  std::size_t filmed() const;

 private:
  using Shares = std::array<double, 4>;  ///< of the safe part: amplitude, difference, bias, split cycle
  Beat beat_of(const Shares& shares) const;
  Shares sweep(double time_s) const;

  std::size_t run_;
  Shares middle_{}, reach_{};
  std::vector<Shares> points_;
  std::vector<std::pair<double, double>> steps_;  ///< begin in the sweep, share of the amplitude
};

/// Shares of the safe part in their published order, without the shifts of a session.
std::vector<std::array<double, 4>> bench_points(std::size_t run);

/// `lasts_s`: tests cut runs short.
FamilyFlight run_on_bench(const Assignment& a, std::size_t run, double lasts_s = 1e9);

}  // namespace flappy::blind::b
