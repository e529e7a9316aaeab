// The pilot follows waypoints on an imperfect view; excitation is added to its inputs. It tracks on SE(3): Lee, Leok and
// McClamroch, "Geometric tracking control of a quadrotor UAV on SE(3)", IEEE CDC 2010, with integrals.
//   F = m (a_ref + g e_z - k_x e_x - k_v e_v - k_i integral of (k_x / k_v e_x + e_v))       thrust: F . R e_z
//   R_d: third axis along F, heading as asked      e_R = vee(R_d^T R - R^T R_d) / 2      e_w = w - R^T w_d
//   angular acceleration = -k_R e_R - k_w e_w - k_I integral of (k_R / k_w e_R + e_w)
// Moments and thrust become inputs by the slopes of the nominal robot on a stand at 10 V. Velocity and yaw
// rate are means over a beat, the other rates of now and half a beat ago: within a beat the torso shakes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

enum class Programme { rich, hover, calm };
inline constexpr std::size_t kFlights = 3;
inline constexpr double kFlight_s = 10, kTrim_s = 5, kControl_s = 2e-3;

struct Inputs {
  double amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
};

Inputs clipped(const Inputs& u, const model::Driver& d);

struct Waypoint {
  double t_s = 0;
  Vector3d position_m = Vector3d::Zero();
  double heading_rad = 0;
};

struct Aim {
  Vector3d position_m, velocity_m_s, acceleration_m_s2;
  double heading_rad, heading_rad_s;
};

/// Target and excitation of a flight, on the clock of its log; before t = 0 the target is the first waypoint.
class Plan {
 public:
  /// `number`: the flight's in random streams (flight_number).
  Plan(Programme programme, std::size_t flight, const Room& room, std::uint64_t seed, std::uint64_t number);
  Aim at(double t_s) const;
  /// Inputs that are added to the controller's output; none before t = 0.
  Inputs excitation(double t_s) const;
  const Waypoint& start() const { return waypoints_.front(); }

 private:
  struct Sine {
    int input;
    double amplitude, Hz, phase_turns;
  };
  struct Step {
    int input;
    double begin_s, end_s, height;
  };
  std::vector<Waypoint> waypoints_;
  std::vector<Sine> sines_;
  std::vector<Step> steps_;
};

/// In W: x, y, z; in B: about x, y, z. The undamped loops have 4 rad/s (level), 6.4 (height), and 25, 18 and 11 (attitude).
struct PilotGains {
  std::array<double, 3> place_1_s2 = {16, 16, 41}, speed_1_s = {5.7, 5.7, 9.1}, place_sum_1_s = {1.7, 1.7, 3.1};
  std::array<double, 3> turn_1_s2 = {640, 340, 118}, rate_1_s = {47, 29, 11.3}, turn_sum_1_s = {1.9, 2.1, 1.2};
  /// Each once, in a fixed order.
  template <class Use>
  void each(const Use& use) {
    for (auto* three : {&place_1_s2, &speed_1_s, &place_sum_1_s, &turn_1_s2, &rate_1_s, &turn_sum_1_s})
      for (double& gain : *three) use(gain);
  }
};

class RobotController {
 public:
  RobotController(const model::Driver& driver, std::uint64_t seed, std::uint64_t flight, const PilotGains& gains = {});
  ~RobotController();
  Inputs steer(const Torso& torso, const Aim& aim, const Inputs& excitation);
  /// Voltage of one motor at the fraction `beat` of the beat, in [0, 1).
  static double voltage(const Inputs& inputs, std::size_t side, double beat, double limit_V);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flappy::blind
