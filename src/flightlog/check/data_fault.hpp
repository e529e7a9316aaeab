// A fault of the data, with its place.
#pragma once

#include <cstddef>
#include <string>

namespace flappy::flightlog {

struct DataFault {
  std::string file;  ///< of the log, in its folder
  std::size_t line;  ///< where it first shows
  std::string what;
};

}  // namespace flappy::flightlog
