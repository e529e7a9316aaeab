// How time and memory grow with the size of the work. Each size is one run of a program of its own, as a user starts it.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace flappy::bench {

struct ScaleRow {
  std::string what;  ///< unit of `size`: flappers, updates
  double size = 0;
  std::string command;  ///< without the names of temporary files
  double seconds = 0;   ///< wall time of the program
  double peak_bytes = 0;
};

/// Names of what grows.
std::vector<std::string> scales();

/// The rows of these, each at growing sizes up to `share` of the largest. Throws io::InputError if a program fails.
std::vector<ScaleRow> measure_scale(const std::vector<std::string>& of, double share,
                                    const std::function<void(double done, const std::string& now)>& tell);

/// Puts so many jobs through a queue that is new: submits, starts and ends each.
void pass_jobs(std::size_t jobs);

/// By which power of the size the time grows between two rows.
double growth(const ScaleRow& from, const ScaleRow& to);

}  // namespace flappy::bench
