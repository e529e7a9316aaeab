// How a firmware joins sensors, exported C and motors. The default is as flappy-export asks for; each other value is a
// mistake that a firmware may make.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "deploy/flown/exported_c.hpp"

namespace flappy::deploy {

struct Wiring {
  // Sensors
  Eigen::Matrix3d rate = Eigen::Matrix3d::Identity();  ///< the controller gets this times the vector
  Eigen::Matrix3d force = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d position = Eigen::Matrix3d::Identity();
  Eigen::Vector4d attitude_before = {1, 0, 0, 0}, attitude_after = {1, 0, 0, 0};  ///< q becomes before q after
  std::array<int, 4> attitude_order = {0, 1, 2, 3};                               ///< elements of w, x, y, z
  bool attitude_inverse = false;
  int hold_imu = 1, hold_pose = 1;    ///< only every so many samples are read
  int first_imu = 0, first_pose = 0;  ///< index of the first sample that is read
  double stamp_scale = 1;             ///< of the clock that stamps samples, over that of the loop

  // Observation: the numbers that the policy gets
  std::vector<int> order;          ///< index of the right observation for each; empty: in order
  std::vector<char> zero;          ///< which stay 0; empty: none
  bool mean = true, scale = true;  ///< of the normalisation, applied
  bool history = true, memory = true;
  std::array<double, 3> goal_m = {0, 0, 0};  ///< is added to the position's error

  // Time
  double loop_scale = 1;              ///< duration of a control period over that of the contract
  int every = 1;                      ///< policy periods from one inference to the next
  int late = 0;                       ///< control periods by which an action acts late
  std::optional<double> hand_back_s;  ///< since begin; infinite: never

  // Inputs of the wing beat, and voltages
  Eigen::Matrix4d action = Eigen::Matrix4d::Identity();  ///< what is added, of the policy's action
  Eigen::Matrix4d input = Eigen::Matrix4d::Identity();   ///< what the driver gets
  Eigen::Matrix2d voltage = Eigen::Matrix2d::Identity();
  bool clipped = true;
  double clip_V = std::numeric_limits<double>::infinity();  ///< a further limit of the voltages

  // What flies
  Build build = Build::exact;
  /// Factors of numbers of the controller: "name", or "name[i]" for one of several.
  std::map<std::string, double> constants;
};

}  // namespace flappy::deploy
