// The part of reading MATLAB files that needs libmatio and HDF5. It is a plugin, because HDF5 brings forty libraries.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

/// An array of numbers: "mocap.position", "trial[1].t" in a struct; its sizes as MATLAB has them.
struct MatlabArray {
  std::string name;
  std::vector<std::size_t> sizes;
};

class MatlabSink {
 public:
  virtual ~MatlabSink() = default;
  virtual bool wants(const MatlabArray& array) = 0;
  /// Numbers in MATLAB's order, the first index quickest; none where the array is not wanted.
  virtual void take(const MatlabArray& array, const std::vector<double>& values) = 0;
  virtual void leave_out(const std::string& name, const std::string& kind) = 0;
  virtual void warn(const std::string& what) = 0;
};

/// The functions of the plugin.
struct MatlabFunctions {
  /// Reads a file of version 5 to 7.3 that has these bytes. InputError, beginning with the path. May crash on damaged
  /// files: call it in a child process.
  void (*read)(const std::string& path, std::string_view bytes, MatlabSink& sink);
};
extern "C" const MatlabFunctions flappy_matlab_functions;  ///< the only symbol that the plugin exports

}  // namespace flappy::flightlog
