// Many flappers at once. The state of a flapper depends, to the bit, on its vehicle, its start, its inputs and the world alone: not on the number of
// threads, the size of the batch, its place in it, or the instruction set of the processor.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flappy/world.hpp"

namespace flappy::sim {

/// The wing-beat inputs of one flapper, clipped to the limits of its driver. A beat-averaged or articulated vehicle has
/// inputs of its own: for it these four numbers are controller outputs, which its inputs mix
/// (model::BeatAveraged::Input::mix).
struct Input {
  double amplitude_V = 0;   ///< thrust
  double difference_V = 0;  ///< left plus, right minus: roll
  double bias_V = 0;        ///< pitch
  double split_cycle = 0;   ///< yaw, fraction of a beat
};

enum class Start { flying, standing, welded };

/// State of one flapper. SI units; quaternion w, x, y, z, body to world; left is index 0.
struct FlapperState {
  double position_m[3] = {0, 0, 0};  ///< torso origin, in W
  double attitude[4] = {1, 0, 0, 0};
  double velocity_m_s[3] = {0, 0, 0};     ///< of the torso origin, in W
  double body_rate_rad_s[3] = {0, 0, 0};  ///< in B
  double stroke_rad[2] = {0, 0}, rotation_rad[2] = {0, 0};
  double stroke_rate_rad_s[2] = {0, 0}, rotation_rate_rad_s[2] = {0, 0};
  /// Means over the last step, which the next step extrapolates to rates in its middle; 0 where they are unknown.
  double stroke_acceleration_rad_s2[2] = {0, 0}, rotation_acceleration_rad_s2[2] = {0, 0};
};

/// Impulse of the air on the wings of a standing or welded flapper since its reset, in B, about the torso origin.
struct HeldImpulse {
  double force_N_s[3], moment_Nm_s[3];
};

/// Step at which integration errors are smaller than those of the vehicle's parameters (docs/results/accuracy.md); a quarter of
/// the driver's hold of 1 ms.
inline constexpr double kDefaultStep_s = 250e-6;

struct BatchOptions {
  double step_s = kDefaultStep_s;
  int threads = 0;  ///< 0: one for each processor
  World world;
  std::string instruction_set;  ///< "scalar", "x86-64-v2", "-v3", "-v4"; empty: the best that this processor has
  bool meters_energy = false;   ///< needed for energy_J() of vehicles with motors
};

/// The best instruction set of this processor among those that the library was built for.
std::string best_instruction_set();
/// All instruction sets that this processor can run, best last.
std::vector<std::string> instruction_sets();

/// Articulated wings, [left, right][stroke plane, stroke, deviation, rotation] (model/jointed.hpp).
struct WingJoints {
  double angle_rad[2][4], rate_rad_s[2][4];
  /// In the last step: of the muscle (driven), of spring, damper and stops (free), of the constraint (fixed).
  double torque_Nm[2][4];
  bool driven[2][4];  ///< true: driven or fixed; false: free
  double work_J;      ///< of all muscles since the reset, negative work subtracted
};

template <class T>
class Batch {
 public:
  /// `count` copies of `vehicle`, flying at the origin with wings at rest and no voltage.
  /// Throws std::invalid_argument if an option is out of range or the driver's hold is not a whole number of steps.
  Batch(std::size_t count, const model::Vehicle& vehicle, const BatchOptions& options = {});
  ~Batch();
  /// A copy flies on from the same state, to the same bytes.
  Batch(const Batch&);
  Batch& operator=(const Batch&);
  Batch(Batch&&) noexcept;
  Batch& operator=(Batch&&) noexcept;

  std::size_t size() const;

  /// Gives flapper `i` another vehicle and keeps its state.
  void set_vehicle(std::size_t i, const model::Vehicle& vehicle);
  /// Restarts flapper `i` at beat phase 0, with no voltage, no input and no status.
  void reset(std::size_t i, const FlapperState& state, Start start = Start::flying);
  void set_input(std::size_t i, const Input& input);
  /// Sets the motor voltages of flapper `i` in place of those of the wing beat, until they are set again or set_input()
  /// or reset() return the motors to the driver. Each is clipped to the limit of its motor; NaN becomes the lower
  /// limit, as for an input. The clock of the beat continues to run.
  void set_voltages(std::size_t i, double left_V, double right_V);

  /// Advances every flapper by `steps` physics steps. Plausibility and contact are checked once, at the end.
  /// Throws std::invalid_argument for a negative number.
  void step(int steps);

  FlapperState state(std::size_t i) const;
  std::uint32_t status(std::size_t i) const;
  HeldImpulse held_impulse(std::size_t i) const;
  /// Impulse of a welded vehicle with motors on its stand since its reset, as HeldImpulse: the air gave held_impulse() to
  /// the wings, which keep their momentum. Weights excluded.
  HeldImpulse stand_impulse(std::size_t i) const;
  /// Energy drawn since the reset, J. With motors: V i of both, summed over the steps, returned energy subtracted. With
  /// articulated wings: mechanical work of the muscles of each wing while their total power is positive, because
  /// muscles store no returned energy. Throws std::logic_error without a meter: for motors unless
  /// BatchOptions::meters_energy, for beat-averaged robots always.
  double energy_J(std::size_t i) const;
  /// Throws std::logic_error unless the vehicle has articulated wings.
  WingJoints joints(std::size_t i) const;
  /// How flapper `i` is held now: a standing flapper becomes a flying one once its wings carry it.
  Start support(std::size_t i) const;
  std::size_t count_status(std::uint32_t bits) const;

  /// Hash of flappers [first, last) in order, over every number that influences their motion; metered energy is
  /// excluded.
  std::uint64_t hash(std::size_t first, std::size_t last) const;
  std::uint64_t hash() const { return hash(0, size()); }

  /// Parameters and state of one flapper.
  static std::size_t bytes_per_flapper();

 private:
  struct Storage;
  friend struct StorageAccess;
  std::unique_ptr<Storage> storage_;
};

extern template class Batch<float>;
extern template class Batch<double>;

}  // namespace flappy::sim
