// Who flies: an observer on what the sensors send, a cascade of loops, and the programme of a flight.
//
// The observer carries position, velocity and attitude forward with the IMU, and corrects them where a frame of motion capture arrives, by
// what it thought at the time the frame was taken. The loops: position to velocity to acceleration to the direction of thrust; attitude to
// the inputs of the wing beat, with rates freed of the beat by a notch. Integrators find the trim of a robot.
#pragma once

#include <array>
#include <vector>

#include "blind/b/robot.hpp"
#include "blind/b/sensors.hpp"

namespace flappy::blind::b {

/// What the pilot knows.
struct View {
  Vector3d position_m = Vector3d::Zero(), velocity_m_s = Vector3d::Zero(), rate_rad_s = Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
};

class Observer {
 public:
  /// Starts where the robot is put: someone put it there.
  Observer(const flightlog::FlightHeader& header, const Vector3d& position_m, double heading_rad);
  /// Every tick, with what has arrived.
  void tick(Sensors& sensors, double now_s);
  const View& view() const { return view_; }

 private:
  void correct(const MocapSample& frame);

  View view_;
  ImuSample last_;
  Vector3d bias_ = Vector3d::Zero(), place_;
  std::array<View, 128> past_;
  std::size_t ticks_ = 0, late_ticks_;
  double period_s_;
  int refused_ = 0;
};

struct Target {
  Vector3d position_m = Vector3d::Zero(), velocity_m_s = Vector3d::Zero();
  double heading_rad = 0;
};

class Pilot {
 public:
  explicit Pilot(const Figures& figures) : figures_(figures) {}
  /// Every second tick.
  Beat steer(const View& view, const Target& target);
  /// What the integrators hold.
  Beat trim() const;
  /// The rates that the loops use.
  static constexpr double kPeriod_s = 2 * kTick_s;

 private:
  /// Takes the beat out of a signal: a notch of quality 1.
  struct Notch {
    double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
    bool begun = false;
    double operator()(double x, double frequency_hz);
  };
  Figures figures_;
  std::array<Notch, 3> rate_notch_, velocity_notch_;
  Vector3d held_acceleration_ = Vector3d::Zero();
  double roll_ = 0, pitch_ = 0, yaw_ = 0, lift_V_ = 10;
};

/// Where a flight goes, how it turns, and what is added to the pilot's inputs so that they are excited.
class Programme {
 public:
  /// Flight 0 is near the ground, 1 near the ceiling, 2 along the wall; all are in the free too. Hover stays where it is.
  Programme(const Assignment& a, std::uint64_t flight, const Figures& figures, const Surroundings& room);
  Vector3d start_m() const { return legs_.front().to; }
  double start_heading_rad() const { return legs_.front().heading; }
  Target target(double time_s) const;
  Beat excitation(double time_s) const;

 private:
  struct Leg {
    double begins_s, lasts_s;
    Vector3d to;
    double heading;
  };
  struct Tone {
    double amplitude, frequency_hz, phase_rad;
  };
  struct Pulse {
    double at_s, lasts_s;
    std::size_t input;
    double size;
  };
  const ProposedFlight* proposed_;  ///< or none
  std::vector<Leg> legs_;
  std::array<std::vector<Tone>, 4> tones_;
  std::vector<Pulse> pulses_;
};

double wrapped(double angle_rad);
double heading_of(const Eigen::Quaterniond& attitude);

}  // namespace flappy::blind::b
