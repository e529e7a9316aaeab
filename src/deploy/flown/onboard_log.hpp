// What reached a robot's processor in a flight, and what it told the motors. One clock; times in s.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace flappy::deploy {

struct OnboardLog {
  struct Imu {
    double arrived_s;
    std::array<double, 3> rate_rad_s, force_m_s2;  ///< in B
  };
  struct Pose {
    double arrived_s;
    std::array<double, 3> position_m;
    std::array<double, 4> attitude;  ///< w, x, y, z, B to W
  };
  /// Voltages that hold until the next.
  struct Command {
    double t_s, left_V, right_V;
  };
  /// An inference: numbers of observation and action, which `policy_numbers` names; raw.
  struct Inference {
    double t_s;
    std::vector<double> numbers;
  };
  std::vector<Imu> imu;
  std::vector<Pose> poses;
  std::vector<Command> commands;
  std::vector<Inference> inferences;
  std::vector<std::size_t> policy_numbers;  ///< indices in the observation, then in the action that follows it
  std::vector<double> policy_steps;         ///< [policy number] step that the log can tell apart
  double imu_latency_s = 0, pose_latency_s = 0;
  double imu_Hz = 0;  ///< rate at which samples reached the processor; 0: as in the contract

  double start_s = 0;                               ///< flappy_controller_start()
  std::optional<std::array<double, 7>> start_pose;  ///< none: of the pose that arrived last before it
  /// What estimator, estimate and feedback remembered then, as flappy_controller has it, and its phase of the beat; empty:
  /// they started anew.
  std::vector<float> start_memory;
  std::uint32_t start_phase = 0;
  /// What the controller does before the policy begins: it hovers where the task begins, stays where it is, or flies the
  /// task's path. None: not known.
  enum class Mode { hover, stay, task };
  std::optional<Mode> mode;
  std::optional<double> begin_s;      ///< flappy_controller_begin(); none: not known
  std::optional<double> hand_back_s;  ///< as the robot says; none: not known

  // Steps between the numbers that the log can tell apart; 0: all digits are there
  double time_noise_s = 0;  ///< by which arrivals may have been moved at random
  double time_step_s = 0, rate_step_rad_s = 0, force_step_m_s2 = 0, position_step_m = 0, attitude_step = 0,
         voltage_step_V = 0;
};

}  // namespace flappy::deploy
