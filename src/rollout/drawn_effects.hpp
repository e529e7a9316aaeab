// Effects of the catalogue that each vehicle draws, so that one policy learns to fly robots that have them.
//
//   [drawn_effects]
//   none = 0.3              probability of a vehicle without any
//   most = 3                else 1 to this many different ones, each number as probable
//   magnitude = 2.0         largest magnitude, in units of an effect's typical one; uniform from 0
//   [drawn_effects.weights] how often an effect is drawn beside the others (default 1 each, 0: never)
//   command_delay = 10.0
//
// A magnitude that the effect's prior gives both signs takes either. Typical magnitudes of one kind of which some are 0,
// as of the left and the right wing, change places. Effects that a vehicle has already stay as they are.
#pragma once

#include <vector>

#include "model/effects/registry.hpp"
#include "sim/random.hpp"

namespace flappy::io {
class Table;
}

namespace flappy::rollout {

struct DrawnEffects {
  double none = 0;
  std::size_t most = 1;
  double magnitude = 1;
  struct Weighted {
    const model::CatalogueEffect* effect;
    double weight;  ///< above 0
  };
  std::vector<Weighted> of;

  /// Adds the effects of a key to `vehicle`: the same for the same key, whatever else is drawn.
  void add(sim::RandomKey key, model::Vehicle& vehicle) const;
  /// Gives `vehicle` those that it lacks, so that a batch of it has room for the memory of all: switched off, or hardly
  /// on if it is beat-averaged, for such a batch knows of no effect that never acted.
  void make_room(model::Vehicle& vehicle) const;
};

/// Reads the table `drawn_effects`. Without a ground the tether, which hangs down to it, is not drawn.
/// Throws io::InputError for an effect that the vehicle cannot have.
DrawnEffects read_drawn_effects(const io::Table& table, const model::Vehicle& vehicle, bool has_ground);

}  // namespace flappy::rollout
