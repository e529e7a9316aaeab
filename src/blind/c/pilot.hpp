// The pilot of family C: a cascade from place to tilt to the inputs of the wing beat, on a view of the state that is late, noisy and
// averaged over one beat.
#pragma once

#include "blind/c/robot.hpp"

namespace flappy::blind::c {

struct Target {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero(), acceleration_W = Eigen::Vector3d::Zero();
  double heading_rad = 0;
};

/// What the pilot takes for true.
struct View {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero(), velocity_W = Eigen::Vector3d::Zero(),
                  rate_B = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
};

class Pilot {
 public:
  Pilot(const Figures& figures, std::uint64_t seed, std::size_t flight);

  /// Once in a tick.
  void look(const Motion& now, double tick_s);
  /// Moves what is remembered, as if the robot had been elsewhere: turned about the world's z at `about`, then shifted.
  void carry(const Eigen::Vector3d& about_W, double turn_rad, const Eigen::Vector3d& shift_m);
  const View& view() const { return view_; }
  Inputs fly(const Target& target, double tick_s);
  /// What integrators and hover amount to, without feedback.
  Inputs trim() const { return trim_; }

 private:
  const Figures* figures_;
  Random random_;
  std::size_t beat_ticks_, late_ticks_;
  struct Sample {
    Eigen::Vector3d position_W, velocity_W, rate_B;
    Eigen::Matrix3d R_WB;
  };
  std::vector<Sample> past_;  ///< a ring
  std::size_t next_ = 0, filled_ = 0;
  View view_;
  Eigen::Vector3d drift_ = Eigen::Vector3d::Zero(), hold_acceleration_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d hold_turn_ = Eigen::Vector3d::Zero();
  double climb_V_ = 0;
  Inputs trim_;
};

/// Rotation vector, in the first's frame, from one attitude to another.
Eigen::Vector3d rotation_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);
double wrapped(double angle_rad);
/// Of the nose, over the ground.
double heading_of(const Eigen::Matrix3d& R_WB);

}  // namespace flappy::blind::c
