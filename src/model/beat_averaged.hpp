// A beat-averaged robot: force and moment are means over its beats, computed from the state of its actuators and its
// motion. Its file:
//
//   model = "beat_averaged"
//   [beat]                     # nominal_Hz, bandwidth_Hz; compares_moments = false: moments are not compared,
//                              #   because the autopilot counteracts them in flights; trims = true: their means are
//   [torso]                    # the whole robot: mass_kg, com_m, inertia_kg_m2
//   [input.left_flap]          # a column of command.csv: low, high; in flight it is, within low and high,
//                              #   neutral + amplitude A + difference D + bias B + split_cycle S
//   [actuator.left_Hz]         # input, role ("flapping", "stroke_plane", "other"), gain, offset, lag_s:
//                              #   a' = (gain u + offset - a) / lag_s
//   [coefficients]             # thrust_N_Hz = 0.035, or { value = 0.035, sd = 0.005 } with its standard deviation
//   [wrench.wings]             # at_m, and any of force_x_N ... moment_z_Nm, in B:
//   force_z_N = "thrust_N_Hz * (left_Hz + right_Hz) - heave_N_s_m * v_z"
//
// An expression has + - * ( ) ^ (a whole power) over numbers, coefficients, actuators and
//   v_x v_y v_z   velocity of the torso's origin in the air, in B, m/s      speed   its length
//   w_x w_y w_z   body rates in B, rad/s              battery   voltage over the nominal one, 1 if unknown
// so every force is a sum of products.
//
// model = "predicted" replaces [wrench] by the predictions of an external simulator: force and moment of a flight, and
// their derivatives by the coefficients, stand in its folder (gap/replay/predicted_loads.hpp). Each coefficient may
// then have predicted_at (default: value), the value with which the forces were predicted, which a diagnosis that
// corrects value keeps. [input] and [actuator] are optional: beat frequency and stroke plane, for the effects that need
// them.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

/// Quantities of motion that an expression may name in addition to coefficients and actuators, in this order.
enum MotionVariable : int { kVx, kVy, kVz, kSpeed, kWx, kWy, kWz, kBatteryShare, kMotionVariables };

/// Largest number of actuators of a robot, and of inputs of a robot that flies: a controller has four outputs.
inline constexpr std::size_t kMaxActuators = 16, kMaxInputs = 4;

/// Force and moment about the torso's origin, N and N m, in B.
struct BeatAveragedLoad {
  std::array<double, 3> force_N{}, moment_Nm{};
};

class BeatAveragedWrench {
 public:
  /// Throws std::invalid_argument if an expression is invalid; read_any_vehicle() reports those by line and column.
  explicit BeatAveragedWrench(const BeatAveraged& vehicle);
  struct Product {
    std::size_t component;  ///< 0 to 2: force, 3 to 5: moment
    double factor;
    std::vector<std::size_t> variables;
  };
  explicit BeatAveragedWrench(std::vector<Product> products);

  /// `variables`: the actuators in their order, then the motion variables. The moment is about the torso's origin.
  BeatAveragedLoad at(std::span<const double> variables) const;
  bool has_moments() const { return has_moments_; }
  /// In the order of the file. Vehicles with the same expressions differ in the factors only.
  const std::vector<Product>& products() const { return products_; }

 private:
  std::vector<Product> products_;
  bool has_moments_ = false;
};

struct ExpressionFault {
  std::string what, accepted;
};
std::optional<ExpressionFault> expression_fault(std::string_view text, const BeatAveraged& vehicle);

inline constexpr std::array<const char*, 6> kLoadNames = {"force_x_N",   "force_y_N",   "force_z_N",
                                                          "moment_x_Nm", "moment_y_Nm", "moment_z_Nm"};

BeatAveraged::Input read_input(const std::string& name, const io::Table& table);
std::string input_text(const BeatAveraged::Input& input);

/// Reads the tables beat, input, actuator, coefficients and, unless the forces are `predicted`, wrench.
BeatAveraged read_beat_averaged(const io::Table& root, bool predicted);
/// Text that reads back as the same, together with parameters().
std::string beat_averaged_text(const BeatAveraged& vehicle);

}  // namespace flappy::model
