// Units as recordings spell them: "mm", "[deg/s]", "Millimeters".
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace flappy::flightlog {

struct RecordedUnit {
  std::string_view suffix;  ///< of a column with this quantity, as "_m"; "_s" is a time
  double factor;            ///< a number in SI is this times the recorded one
};

/// Nothing for a unit that is not known. Brackets around it, capitals and blanks do not count.
std::optional<RecordedUnit> recorded_unit(std::string_view text);

/// The suffix of `column` that names its quantity, as "_rad_s"; empty where it has none of those above.
std::string_view quantity_of(std::string_view column);

}  // namespace flappy::flightlog
