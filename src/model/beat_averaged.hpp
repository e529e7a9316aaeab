// A robot that is known by the beat: force and moment as means over its beats, at an instant, from what its actuators do and how it
// moves. Its file says how:
//
//   model = "beat_averaged"
//   [beat]                                   # nominal_Hz, bandwidth_Hz; compares_moments = false: moments are not held against flights, in
//                                            #   which they answer what the autopilot does against them
//   [torso]                                  # all of it: mass_kg, com_m, inertia_kg_m2
//   [input.left_flap]                        # a column of command.csv: low, high; and where it flies, what a controller makes of it:
//                                            #   neutral + amplitude A + difference D + bias B + split_cycle S, within low and high
//   [actuator.left_Hz]                       # input, role ("flapping", "stroke_plane", "other"), gain, offset, lag_s:
//                                            #   a' = (gain u + offset - a) / lag_s
//   [coefficients]                           # thrust_N_Hz = 0.035, or { value = 0.035, sd = 0.005 }: how well it is known
//   [wrench.wings]                           # at_m, and any of force_x_N ... moment_z_Nm, in B:
//   force_z_N = "thrust_N_Hz * (left_Hz + right_Hz) - heave_N_s_m * v_z"
//
// An expression is made of + - * ( ) ^ (a whole power) over numbers, coefficients, actuators and
//   v_x v_y v_z   velocity of the torso's origin in the air, in B, m/s      speed   its length
//   w_x w_y w_z   body rates in B, rad/s                                    battery  voltage over the nominal one, 1 where it is not known
// so every force is a sum of products.
//
// Where somebody's own simulator says what acts on it, model = "predicted" takes the place of all [wrench]: force and moment of a flight, and
// their derivatives by the coefficients, stand in its folder (gap/replay/predicted_loads.hpp). Then
//
//   [coefficients]                           # drag_N_s_m = { value = 0.02, sd = 0.01, predicted_at = 0.02 }: of predicted_at, value unless it
//                                            #   is there, are the forces; a diagnosis that corrects value leaves it
//   [input], [actuator]                      # may be left out: they say how fast wings flap and how their plane tilts, for effects that ask
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

/// What an expression may name besides coefficients and actuators, in this order.
enum MotionVariable : int { kVx, kVy, kVz, kSpeed, kWx, kWy, kWz, kBatteryShare, kMotionVariables };

/// Actuators of a robot, at most, and inputs of one that flies: a controller has four outputs.
inline constexpr std::size_t kMostActuators = 16, kMostInputs = 4;

/// Force and moment about the torso's origin, N and N m, in B.
struct MeanLoad {
  std::array<double, 3> force_N{}, moment_Nm{};
};

/// The expressions of a vehicle as sums of products.
class MeanWrench {
 public:
  /// std::invalid_argument for a vehicle whose expressions are none; read_vehicle() refuses those by line and column.
  explicit MeanWrench(const BeatAveraged& vehicle);
  struct Product {
    std::size_t component;  ///< of force, then moment
    double factor;
    std::vector<std::size_t> variables;
  };
  explicit MeanWrench(std::vector<Product> products);

  /// `variables`: the actuators in their order, then the motion variables.
  MeanLoad at(std::span<const double> variables) const;
  bool has_moments() const { return has_moments_; }
  /// In the order of the file: vehicles of the same expressions have the same but for factors.
  const std::vector<Product>& products() const { return products_; }

 private:
  std::vector<Product> products_;
  bool has_moments_ = false;
};

/// What is wrong with an expression over these names, and what is accepted; empty: nothing.
struct ExpressionFault {
  std::string what, accepted;
};
std::optional<ExpressionFault> expression_fault(std::string_view text, const BeatAveraged& vehicle);

/// force_x_N to moment_z_Nm: what the components of a load are called in files.
inline constexpr std::array<const char*, 6> kLoadNames = {"force_x_N",   "force_y_N",   "force_z_N",
                                                          "moment_x_Nm", "moment_y_Nm", "moment_z_Nm"};

/// An input as its table says, and as text that reads back to the same.
BeatAveraged::Input read_input(const std::string& name, const io::Table& table);
std::string input_text(const BeatAveraged::Input& input);

/// Reads the tables beat, input, actuator, coefficients and, unless it is `predicted`, wrench of a vehicle's file.
BeatAveraged read_beat_averaged(const io::Table& root, bool predicted);
/// Reads back the same.
std::string beat_averaged_text(const BeatAveraged& vehicle);

}  // namespace flappy::model
