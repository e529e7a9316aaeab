#pragma once

#include <cstddef>
#include <string>

namespace flappy::flightlog {

struct DataFault {
  std::string file;  ///< a file of the log
  std::size_t line;  ///< the first line that shows the fault
  std::string what;
};

}  // namespace flappy::flightlog
