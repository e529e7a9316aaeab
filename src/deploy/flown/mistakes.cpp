#include "deploy/flown/mistakes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "io/text.hpp"

namespace flappy::deploy {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Parameters = std::vector<double>;

constexpr const char *kAxes[] = {"x", "y", "z"}, *kInputs[] = {"amplitude", "difference", "bias", "split cycle"};

/// Consecutive numbers of an observation that belong together: those of one vector, rotation matrix or signal.
struct Part {
  std::string name;
  std::size_t first, size;
};

std::vector<Part> parts_of(const std::vector<Contract::Signal>& observation) {
  const auto part_of = [](const std::string& name) -> std::string {
    for (const auto& [mark, part] :
         std::initializer_list<std::pair<const char*, const char*>>{{"_error", "position error"},
                                                                    {"_velocity", "velocity"},
                                                                    {"_rate", "body rate"},
                                                                    {"beat_", "beat phase"},
                                                                    {"heading_", "heading error"},
                                                                    {"added_", "previous action"},
                                                                    {"goal_R_", "goal rotation"},
                                                                    {"R_", "rotation matrix"},
                                                                    {"trim_", "trim"},
                                                                    {"time", "time"}})
      if (name.find(mark) != std::string::npos) return part;
    return name;
  };
  std::vector<Part> parts;
  for (std::size_t i = 0; i < observation.size(); ++i) {
    const std::string name = part_of(observation[i].name);
    if (parts.empty() || parts.back().name != name) parts.push_back({name, i, 0});
    ++parts.back().size;
  }
  return parts;
}

Matrix3d about(int axis, double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  Matrix3d m = Matrix3d::Identity();
  const int i = (axis + 1) % 3, k = (axis + 2) % 3;
  m(i, i) = m(k, k) = std::cos(a);
  m(i, k) = -std::sin(a), m(k, i) = std::sin(a);
  return m;
}

Vector4d quaternion_about(int axis, double degrees) {
  const double half = degrees * std::numbers::pi / 360;
  Vector4d q(std::cos(half), 0, 0, 0);
  q[1 + axis] = std::sin(half);
  return q;
}

Vector4d inverse(Vector4d q) {
  q.tail<3>() *= -1;
  return q;
}

/// Swaps two coordinates.
template <class Matrix>
Matrix swap(int a, int b) {
  Matrix m = Matrix::Identity();
  m.row(a).swap(m.row(b));
  return m;
}
template <class Matrix>
Matrix flip(int a) {
  Matrix m = Matrix::Identity();
  m(a, a) = -1;
  return m;
}

/// The world turned: position and attitude of motion capture in other axes.
void turn_world(Wiring& w, int axis, double degrees) {
  w.position = about(axis, degrees) * w.position;
  w.attitude_before = quaternion_about(axis, degrees);
}

class List {
 public:
  void add(Stage stage, std::string id, std::string words, std::function<void(Wiring&)> make) {
    all.push_back(
        {stage, std::move(id), std::move(words), [make = std::move(make)](Wiring& w, const Parameters&) { make(w); }});
  }
  void search(Stage stage, std::string id, std::string words, std::function<void(Wiring&, const Parameters&)> make,
              std::vector<Parameters> starts, Parameters scales) {
    all.push_back({stage, std::move(id), std::move(words), std::move(make), std::move(starts), std::move(scales)});
  }
  std::vector<Mistake> all;
};

void add_sensors(List& list) {
  constexpr auto kStage = Stage::sensor;
  list.add(kStage, "gyro_in_degrees", "the gyro's rates are in degrees",
           [](Wiring& w) { w.rate *= 180 / std::numbers::pi; });
  list.add(kStage, "accel_in_g", "the accelerometer's values are in g", [](Wiring& w) { w.force /= 9.80665; });
  list.add(kStage, "accel_sign", "the accelerometer has the other sign", [](Wiring& w) { w.force *= -1; });
  for (int a = 0; a < 3; ++a) {
    const std::string axis = kAxes[a];
    list.add(kStage, "gyro_sign_" + axis, "the gyro's " + axis + " has the other sign",
             [a](Wiring& w) { w.rate = flip<Matrix3d>(a) * w.rate; });
    list.add(kStage, "accel_sign_" + axis, "the accelerometer's " + axis + " has the other sign",
             [a](Wiring& w) { w.force = flip<Matrix3d>(a) * w.force; });
    const int b = (a + 1) % 3;
    const std::string two = std::string(kAxes[std::min(a, b)]) + kAxes[std::max(a, b)];
    list.add(kStage, "gyro_swap_" + two, "the gyro's " + two.substr(0, 1) + " and " + two.substr(1) + " are swapped",
             [a, b](Wiring& w) { w.rate = swap<Matrix3d>(a, b) * w.rate; });
    list.add(kStage, "accel_swap_" + two,
             "the accelerometer's " + two.substr(0, 1) + " and " + two.substr(1) + " are swapped",
             [a, b](Wiring& w) { w.force = swap<Matrix3d>(a, b) * w.force; });
    for (const double degrees : {90.0, 180.0, -90.0})
      list.add(kStage, "imu_turned_" + axis + io::format("_%g", degrees),
               "the IMU is turned by " + io::format("%g", degrees) + " degrees about " + axis, [a, degrees](Wiring& w) {
                 w.rate = about(a, degrees) * w.rate;
                 w.force = about(a, degrees) * w.force;
               });
    list.add(kStage, "position_sign_" + axis, "motion capture's " + axis + " has the other sign",
             [a](Wiring& w) { w.position = flip<Matrix3d>(a) * w.position; });
  }
  list.add(kStage, "position_in_mm", "motion capture's position is in mm", [](Wiring& w) { w.position *= 1000; });
  list.add(kStage, "quaternion_order", "the quaternion's elements are in the order x, y, z, w", [](Wiring& w) {
    w.attitude_order = {1, 2, 3, 0};
  });
  list.add(kStage, "quaternion_inverse", "the quaternion turns W into B", [](Wiring& w) { w.attitude_inverse = true; });
  list.add(kStage, "mocap_z_down", "motion capture has z down (and y to the right)", [](Wiring& w) {
    turn_world(w, 0, 180);
    w.attitude_after = inverse(quaternion_about(0, 180));
  });
  list.add(kStage, "mocap_world_z_down", "motion capture's world has z down", [](Wiring& w) { turn_world(w, 0, 180); });
  list.add(kStage, "mocap_y_up", "motion capture's world has y up", [](Wiring& w) { turn_world(w, 0, -90); });
  list.add(kStage, "mocap_y_up_position", "motion capture's position has y up",
           [](Wiring& w) { w.position = about(0, -90) * w.position; });
  list.search(kStage, "yaw_zero", "motion capture's world is turned by %g degrees about z",
              [](Wiring& w, const Parameters& p) { turn_world(w, 2, p[0]); },
              {{90}, {180}, {-90}, {45}, {-45}, {135}, {-135}, {10}, {-10}}, {5});
  list.search(kStage, "attitude_yaw_zero", "the heading of motion capture is %g degrees off",
              [](Wiring& w, const Parameters& p) { w.attitude_before = quaternion_about(2, p[0]); },
              {{90}, {180}, {-90}, {45}, {-45}, {135}, {-135}, {10}, {-10}}, {5});
}

void add_observations(List& list, const Contract& contract) {
  constexpr auto kStage = Stage::observation;
  const std::size_t n = contract.observation.size();
  const std::vector<Part> parts = parts_of(contract.observation);
  // the present parts alone: the controller keeps the earlier observations
  const std::size_t now = n / std::max<std::size_t>(contract.history, 1);
  for (std::size_t a = 0; a < parts.size() && parts[a].first < now; ++a) {
    for (std::size_t b = a + 1; b < parts.size() && parts[b].first < now; ++b) {
      std::vector<std::size_t> sequence(parts.size());
      std::iota(sequence.begin(), sequence.end(), 0);
      std::swap(sequence[a], sequence[b]);
      std::vector<int> order;
      for (const std::size_t k : sequence)
        for (std::size_t i = 0; i < parts[k].size; ++i) order.push_back(static_cast<int>(parts[k].first + i));
      list.add(kStage, io::format("parts_%zu_%zu_swapped", a, b),
               parts[a].name + " and " + parts[b].name + " are swapped in the observation",
               [order](Wiring& w) { w.order = order; });
    }
    const Part part = parts[a];
    list.add(kStage, io::format("part_%zu_zero", a), part.name + " stays 0 in the observation", [part, n](Wiring& w) {
      if (w.zero.empty()) w.zero.assign(n, 0);
      std::fill_n(w.zero.begin() + static_cast<std::ptrdiff_t>(part.first), part.size, char{1});
    });
    if (part.size != 9) continue;
    list.add(kStage, io::format("part_%zu_transposed", a), part.name + " is transposed in the observation",
             [part, n](Wiring& w) {
               if (w.order.empty()) {
                 w.order.resize(n);
                 std::iota(w.order.begin(), w.order.end(), 0);
               }
               for (std::size_t i = 0; i < 3; ++i)
                 for (std::size_t k = 0; k < 3; ++k)
                   w.order[part.first + 3 * i + k] = static_cast<int>(part.first + 3 * k + i);
             });
  }
  list.add(kStage, "mean_left_out", "the normalisation's mean is left out", [](Wiring& w) { w.mean = false; });
  list.add(kStage, "scale_left_out", "the normalisation's scale is left out", [](Wiring& w) { w.scale = false; });
  list.add(kStage, "normalisation_left_out", "the normalisation is left out",
           [](Wiring& w) { w.mean = w.scale = false; });
  if (contract.memory > 0)
    list.add(kStage, "memory_not_kept", "the policy's memory is reset before each inference",
             [](Wiring& w) { w.memory = false; });
  if (contract.history > 1)
    list.add(kStage, "history_not_kept", "earlier observations are not kept", [](Wiring& w) { w.history = false; });
  std::vector<Parameters> around;
  for (const double x : {-0.3, 0.0, 0.3})
    for (const double y : {-0.3, 0.0, 0.3})
      for (const double z : {-0.3, 0.0, 0.3}) around.push_back({x, y, z});
  list.search(kStage, "another_goal", "positions are relative to a goal that lies at (%g, %g, %g) m",
              [](Wiring& w, const Parameters& p) {
                w.goal_m = {-p[0], -p[1], -p[2]};
              },
              around, {0.05, 0.05, 0.05});
}

void add_times(List& list, const Contract& contract) {
  constexpr auto kStage = Stage::time;
  const int repeat = std::max(1, static_cast<int>(std::lround(contract.policy_s / contract.control_s)));
  for (const int every : {2, 3, 4, 5})
    list.add(kStage, io::format("every_%d", every), io::format("the policy acts every %d of its periods", every),
             [every](Wiring& w) { w.every = every; });
  for (const int late : {1, 2, repeat, 2 * repeat}) {
    if (std::ranges::any_of(list.all, [&](const Mistake& m) { return m.id == io::format("late_%d", late); })) continue;
    list.add(kStage, io::format("late_%d", late), io::format("actions act %d control periods late", late),
             [late](Wiring& w) { w.late = late; });
  }
  for (const int hold : {2, 3, 4, 5, 10}) {
    std::vector<Parameters> firsts;
    for (int first = 0; first < hold; ++first) firsts.push_back({static_cast<double>(first)});
    const auto which = [hold](const Parameters& p) { return std::clamp(static_cast<int>(p[0]), 0, hold - 1); };
    list.search(kStage, io::format("imu_held_%d", hold), io::format("one of %d samples of the IMU is read", hold),
                [hold, which](Wiring& w, const Parameters& p) { w.hold_imu = hold, w.first_imu = which(p); }, firsts,
                {1});
    list.search(kStage, io::format("pose_held_%d", hold), io::format("one of %d poses is read", hold),
                [hold, which](Wiring& w, const Parameters& p) { w.hold_pose = hold, w.first_pose = which(p); }, firsts,
                {1});
  }
  list.search(kStage, "clock_rate", "the loop's clock takes %g s for a second",
              [](Wiring& w, const Parameters& p) { w.loop_scale = std::clamp(p[0], 0.25, 4.0); },
              {{1.024}, {1 / 1.024}, {0.5}, {2}, {1.01}, {0.99}}, {0.002});
  list.search(kStage, "stamp_rate", "stamps of samples advance by %g s in a second",
              [](Wiring& w, const Parameters& p) { w.stamp_scale = std::clamp(p[0], 0.25, 4.0); },
              {{1.024}, {1 / 1.024}, {0.5}, {2}}, {0.002});
  list.add(kStage, "never_handed_back", "the policy never hands back",
           [](Wiring& w) { w.hand_back_s = std::numeric_limits<double>::infinity(); });
  list.search(kStage, "handed_back_early", "the policy hands back after %g s",
              [](Wiring& w, const Parameters& p) { w.hand_back_s = p[0]; },
              {{0.05}, {0.1}, {0.2}, {0.3}, {0.4}, {0.6}, {0.8}}, {0.02});
}

void add_outputs(List& list) {
  constexpr auto kStage = Stage::output;
  for (int a = 0; a < 4; ++a) {
    const std::string one = kInputs[a], id = io::format("_%d", a);
    list.add(kStage, "input_sign" + id, "the input " + one + " has the other sign",
             [a](Wiring& w) { w.input = flip<Matrix4d>(a) * w.input; });
    list.add(kStage, "action_sign" + id, "the policy's " + one + " has the other sign",
             [a](Wiring& w) { w.action = flip<Matrix4d>(a) * w.action; });
    list.add(kStage, "action_zero" + id, "the policy's " + one + " stays 0",
             [a](Wiring& w) { w.action.row(a).setZero(); });
    for (int b = a + 1; b < 4; ++b) {
      const std::string two = one + " and " + kInputs[b];
      list.add(kStage, "inputs_swapped" + id + io::format("_%d", b), "the inputs " + two + " are swapped",
               [a, b](Wiring& w) { w.input = swap<Matrix4d>(a, b) * w.input; });
      list.add(kStage, "actions_swapped" + id + io::format("_%d", b), "the policy's " + two + " are swapped",
               [a, b](Wiring& w) { w.action = swap<Matrix4d>(a, b) * w.action; });
    }
  }
  list.add(kStage, "wings_swapped", "each motor gets the other wing's voltage",
           [](Wiring& w) { w.voltage = swap<Matrix2d>(0, 1) * w.voltage; });
  list.add(kStage, "left_sign", "the left motor's voltage has the other sign",
           [](Wiring& w) { w.voltage = flip<Matrix2d>(0) * w.voltage; });
  list.add(kStage, "right_sign", "the right motor's voltage has the other sign",
           [](Wiring& w) { w.voltage = flip<Matrix2d>(1) * w.voltage; });
  list.add(kStage, "not_clipped", "inputs and voltages are not clipped", [](Wiring& w) { w.clipped = false; });
  list.search(kStage, "voltage_scale", "voltages are %g of what they should be",
              [](Wiring& w, const Parameters& p) { w.voltage *= p[0]; }, {{0.5}, {0.8}, {1.2}, {2}, {0.1}}, {0.02});
  list.search(kStage, "clipped_at", "voltages are clipped at %g V",
              [](Wiring& w, const Parameters& p) { w.clip_V = std::clamp(p[0], 0.0, 100.0); }, {{5}, {8}, {12}, {15}},
              {0.5});
  list.search(kStage, "action_scale", "the policy's action is %g of what it should be",
              [](Wiring& w, const Parameters& p) { w.action *= p[0]; }, {{0.1}, {0.5}, {2}}, {0.02});
}

void add_software(List& list, const ExportedC& c, bool int8) {
  constexpr auto kStage = Stage::software;
  if (int8)
    list.add(kStage, "int8", "the policy in 8 bits flies, not the one in floats",
             [](Wiring& w) { w.build = Build::int8; });
  list.add(kStage, "contracted", "products and sums are contracted (-ffp-contract=fast)",
           [](Wiring& w) { w.build = Build::contracted; });
  for (const auto& [name, numbers] : c.constants()) {
    // gains and limits of the feedback controller, and what sets its hover
    const bool of_feedback = std::ranges::none_of(
        std::array{"start_", "hand_back", "driver_", "_limit_V", "mocap_", "angle_noise", "gyro_bias", "velocity_noise",
                   "accel_bias", "gravity", "period", "imu_position", "_share"},
        [&name = name](const char* other) { return name.find(other) != std::string::npos; });
    if (!of_feedback) continue;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (*numbers[i] == 0) continue;
      const std::string key = numbers.size() > 1 ? name + io::format("[%zu]", i) : name;
      list.search(kStage, "gain_" + key, "the controller's " + key + " is %g of the exported one",
                  [key](Wiring& w, const Parameters& p) { w.constants[key] = p[0]; }, {{0.5}, {0.8}, {1.25}, {2}},
                  {0.05});
    }
  }
}

}  // namespace

const char* name_of(Stage stage) {
  constexpr const char* kNames[] = {"sensor", "observation", "time", "output", "software"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::string Mistake::said(const std::vector<double>& p) const {
  std::string text = words;
  for (const double x : p)
    if (const std::size_t at = text.find("%g"); at != std::string::npos) text.replace(at, 2, io::format("%.4g", x));
  return text;
}

std::vector<Mistake> mistakes_of(const Contract& contract, const ExportedC& c, bool int8) {
  List list;
  add_sensors(list);
  add_observations(list, contract);
  add_times(list, contract);
  add_outputs(list);
  add_software(list, c, int8);
  return std::move(list.all);
}

}  // namespace flappy::deploy
