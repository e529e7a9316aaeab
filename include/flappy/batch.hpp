// Many flappers at once. A flapper's bytes depend on its vehicle, its start, its inputs and the world: not on
// the number of threads, the size of the batch, its place in it, or the instruction set of the processor.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flappy/world.hpp"

namespace flappy::sim {

/// The wing-beat inputs of one flapper. Clipped to the limits of its driver. Of one that is known by the beat, what its own inputs mix, in their
/// units (model/beat_averaged.hpp).
struct Input {
  double amplitude_V = 0;   ///< thrust
  double difference_V = 0;  ///< left plus, right minus: roll
  double bias_V = 0;        ///< pitch
  double split_cycle = 0;   ///< yaw, fraction of a beat
};

enum class Start { flying, standing, welded };

/// One flapper as its user sees it. SI units; quaternion w, x, y, z, body to world; left is index 0.
struct FlapperState {
  double position_m[3] = {0, 0, 0};  ///< torso origin, in W
  double attitude[4] = {1, 0, 0, 0};
  double velocity_m_s[3] = {0, 0, 0};     ///< of the torso origin, in W
  double body_rate_rad_s[3] = {0, 0, 0};  ///< in B
  double stroke_rad[2] = {0, 0}, rotation_rad[2] = {0, 0};
  double stroke_rate_rad_s[2] = {0, 0}, rotation_rate_rad_s[2] = {0, 0};
  /// Means over the last step, from which the next takes rates of its middle; 0 where they are not known.
  double stroke_acceleration_rad_s2[2] = {0, 0}, rotation_acceleration_rad_s2[2] = {0, 0};
};

/// What the air did to the wings of a standing or welded flapper since its reset, in B about the torso
/// origin.
struct HeldImpulse {
  double force_N_s[3], moment_Nm_s[3];
};

/// At which errors are below those of the vehicle's own figures (docs/accuracy.md), in 4 steps of a driver's millisecond.
inline constexpr double kDefaultStep_s = 250e-6;

struct BatchOptions {
  double step_s = kDefaultStep_s;
  int threads = 0;  ///< 0: one for each processor
  World world;
  std::string instruction_set;  ///< "scalar", "x86-64-v2", "-v3", "-v4"; empty: the best this processor has
  bool meters_energy = false;   ///< for energy_J(), where there are motors
};

/// The best instruction set of this processor that the library was built for.
std::string best_instruction_set();
/// All that this processor can run, best last.
std::vector<std::string> instruction_sets();

/// The wings of a vehicle with four angles each (model/jointed.hpp), left and right: stroke plane, stroke, deviation, rotation.
struct WingJoints {
  double angle_rad[2][4], rate_rad_s[2][4];
  double torque_Nm
      [2]
      [4];  ///< in the last step: of the muscle of a driven angle, of the spring of a free one, of what holds a fixed one
  bool driven[2][4];  ///< or fixed, but for what inputs add: not free
  double work_J;      ///< of all muscles since the reset, what they take back subtracted
};

template <class T>
class Batch {
 public:
  /// `count` copies of `vehicle`, flying at the origin with wings at rest and no voltage.
  /// Throws std::invalid_argument where an option makes no sense or the driver's hold is no whole number of
  /// steps.
  Batch(std::size_t count, const model::Vehicle& vehicle, const BatchOptions& options = {});
  ~Batch();
  Batch(Batch&&) noexcept;
  Batch& operator=(Batch&&) noexcept;

  std::size_t size() const;

  /// Gives flapper `i` a vehicle of its own; its state stays.
  void set_vehicle(std::size_t i, const model::Vehicle& vehicle);
  /// Starts flapper `i` anew at beat phase 0, with no voltage, no input and no status.
  void reset(std::size_t i, const FlapperState& state, Start start = Start::flying);
  void set_input(std::size_t i, const Input& input);
  /// Puts these voltages on the motors of flapper `i` in place of the wing beat's, each clipped to what its motor takes (not a
  /// number: to the least, as an input), until they are set again, or set_input() or reset() give the motors back to the driver.
  /// The beat's clock runs on meanwhile.
  void set_voltages(std::size_t i, double left_V, double right_V);

  /// Advances every flapper by `steps` physics steps. Plausibility and contact are looked at once, at the
  /// end. std::invalid_argument for a number below 0.
  void step(int steps);

  FlapperState state(std::size_t i) const;
  std::uint32_t status(std::size_t i) const;
  HeldImpulse held_impulse(std::size_t i) const;
  /// What both motors drew since the reset, V i in every step; what they give back counts. std::logic_error unless it is metered,
  /// as it never is of robots that are known by the beat. Of driven angles the mechanical work of their muscles: of each wing, whose angles share
  /// what they have, while its power is positive; nothing is stored of what they take back.
  double energy_J(std::size_t i) const;
  /// std::logic_error for vehicles of another kind.
  WingJoints joints(std::size_t i) const;
  /// What holds flapper `i` now: a standing one flies once its wings have carried it.
  Start support(std::size_t i) const;
  std::size_t count_status(std::uint32_t bits) const;

  /// Hash of flapper `i`, and of flappers [first, last) in order: of every number that moves; what they drew is none.
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
