// The pilot: cascaded loops from position to tilt to inputs, on a delayed, noisy view averaged over one beat.
#pragma once

#include "lab/blind/c/c_robot.hpp"

namespace flappy::blind::c {

inline constexpr double kHover_V = 10.0;  ///< amplitude at which the nominal robot carries its weight

struct Target {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero(), acceleration_W = Eigen::Vector3d::Zero();
  double heading_rad = 0;
};

struct View {
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero(), velocity_W = Eigen::Vector3d::Zero(),
                  rate_B = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
};

class Pilot {
 public:
  /// Gains were tested on the nominal robot and on 40 drawn ones.
  struct Gains {
    double climb_V_s2_m = 0.75;  ///< V per m/s^2: mass over the slope of thrust by voltage
    double place_1_s = 3.2, speed_1_s = 6, speed_hold_1_s2 = 4, height_1_s = 5, climb_1_s = 8, climb_hold_1_s2 = 6;
    /// Roll, pitch, yaw: V or split cycle per rad, per rad/s, and per rad s.
    Eigen::Vector3d turn = {1.9, 2.6, 0.12}, turn_rate = {0.15, 0.2, 0.012}, turn_hold = {2.2, 3.0, 0.12};
  };

  /// The session of `a` may change its gains.
  Pilot(const RobotParameters& parameters, const Assignment& a, std::size_t flight);

  /// To be called once per tick, with the true motion.
  void look(const Motion& now, double tick_s);
  /// Moves the pilot's memory with a displaced robot: a turn about the world's z through `about_W`, then a shift.
  void carry(const Eigen::Vector3d& about_W, double turn_rad, const Eigen::Vector3d& shift_m);
  const View& view() const { return view_; }
  const Gains& gains() const { return gains_; }
  Inputs fly(const Target& target, double tick_s);
  /// Inputs in hover: nominal values plus integrators, without feedback.
  Inputs trim() const { return trim_; }

 private:
  const RobotParameters* parameters_;
  Gains gains_;
  Random random_;
  std::size_t beat_ticks_, late_ticks_;
  struct Sample {
    Eigen::Vector3d position_W, velocity_W, rate_B;
    Eigen::Matrix3d R_WB;
  };
  std::vector<Sample> past_;  ///< ring buffer
  std::size_t next_ = 0, filled_ = 0;
  View view_;
  Eigen::Vector3d drift_ = Eigen::Vector3d::Zero(), hold_acceleration_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d hold_turn_ = Eigen::Vector3d::Zero();
  double climb_V_ = 0;
  Inputs trim_;
};

/// Rotation vector from attitude `from` to attitude `to`, in the frame of `from`.
Eigen::Vector3d rotation_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);
double wrapped(double angle_rad);
/// Heading of the nose in the x-y plane of W.
double heading_of(const Eigen::Matrix3d& R_WB);

}  // namespace flappy::blind::c
