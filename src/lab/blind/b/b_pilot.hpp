// The pilot: an observer on the sensors' data, cascaded loops, and the programme of a flight. The observer integrates
// the IMU; a frame of motion capture corrects it by its difference from the estimate at the frame's time. Loops:
// position, velocity, acceleration, direction of thrust; attitude to inputs. Notches remove the beat; integrators find
// the trim.
#pragma once

#include <array>
#include <vector>

#include "lab/blind/b/b_robot.hpp"
#include "lab/blind/b/b_sensors.hpp"

namespace flappy::blind::b {

struct View {
  Vector3d position_m = Vector3d::Zero(), velocity_m_s = Vector3d::Zero(), rate_rad_s = Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
};

class Observer {
 public:
  /// Starts from the pose at which the robot is placed, which is known exactly.
  Observer(const flightlog::FlightHeader& header, const Vector3d& position_m, double heading_rad);
  /// Called every tick; takes arrived samples.
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

/// Session whose programmes are flown.
inline std::size_t programme_session(const Assignment& a) { return a.programme_of.value_or(a.session); }

class Pilot {
 public:
  explicit Pilot(const RobotParameters& parameters, const PilotGains& gains = {})
      : parameters_(parameters), gains_(gains) {}
  /// Called every second tick.
  Beat steer(const View& view, const Target& target);
  /// Inputs that the integrators hold.
  Beat trim() const;
  static constexpr double kPeriod_s = 2 * kTick_s;

 private:
  /// Notch filter of quality 1, which removes the beat from a signal.
  struct Notch {
    double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
    bool begun = false;
    double operator()(double x, double frequency_hz);
  };
  RobotParameters parameters_;
  PilotGains gains_;
  std::array<Notch, 3> rate_notch_, velocity_notch_;
  Vector3d held_acceleration_ = Vector3d::Zero();
  double roll_ = 0, pitch_ = 0, yaw_ = 0, lift_V_ = 10;
};

/// Path and heading of a flight, and the excitation added to the pilot's inputs.
class Programme {
 public:
  /// Flights 0 near the ground, 1 near the ceiling, 2 along the wall, with legs in free air. Hover stays. Calm flights:
  /// 0 hovers, 1 and 2 follow slow legs in free air, without excitation.
  Programme(const Assignment& a, std::uint64_t flight, const RobotParameters& parameters, const Surroundings& room);
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
  const ProposedFlight* proposed_;  ///< null if nothing is proposed
  std::vector<Leg> legs_;
  std::array<std::vector<Tone>, 4> tones_;
  std::vector<Pulse> pulses_;
};

double wrapped(double angle_rad);
double heading_of(const Eigen::Quaterniond& attitude);

}  // namespace flappy::blind::b
