// What was done to a robot on purpose before a flight: table [changes] of flight.toml and of a configuration of
// flappy-fly. Two hypotheses that predict different outcomes of it are told apart by flying it.
//   swapped_wings = true          the left wing, with its leading edge and hinge, flies on the right, and vice versa
//   added_mass_kg, added_at_m     a weight at a point of the torso, in B
//   without = ["tether"]          effects that are taken away: a cable unplugged, markers glued on anew
#pragma once

#include <array>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::io {
class Table;
}

namespace flappy::model {

struct Changes {
  bool swapped_wings = false;
  double added_mass_kg = 0;
  std::array<double, 3> added_at_m{};
  std::vector<std::string> without;
  bool any() const { return swapped_wings || added_mass_kg > 0 || !without.empty(); }
  bool operator==(const Changes&) const = default;
};

/// Table [changes] of `root`; nothing where there is none. io::InputError for an unknown effect or an impossible weight.
Changes read_changes(const io::Table& root);
/// The same table as text; empty where nothing was done.
std::string changes_text(const Changes& changes);

/// For example "swap the wings; add 0.5 g at (20, 0, 0) mm; take off tether"; empty where nothing was done.
std::string in_words(const Changes& changes);

/// Makes the changes to a vehicle.
void apply(const Changes& changes, Vehicle& vehicle);

}  // namespace flappy::model
