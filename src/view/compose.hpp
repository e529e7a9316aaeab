// Composes a report from paths: recognises what each path holds, and makes its section.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "view/flight_section.hpp"
#include "view/page.hpp"

namespace flappy::view {

enum class Kind { flight, run, evaluation, diagnosis, plan, identification, benchmark, speed, design };

/// A flight log; a run folder or a folder of runs; results of flappy-eval, flappy-gap diagnose or plan (or its folder),
/// flappy-identify forces, flappy-blind score (its folder, or score.csv), flappy-bench --figures or flappy-design (its
/// folder, or design.json). Throws InputError else, also for a folder of flight logs, which composed() expands.
Kind recognised(const std::filesystem::path& path);

/// Sections in the order of the paths; all flights share one, at the place of the first. A folder of flight logs gives
/// its first kMaxFlights. Throws io::InputError for a path that is given twice, for options of flights without a flight,
/// and for whatever a section refuses.
std::vector<Section> composed(const std::vector<std::filesystem::path>& given, const FlightOptions& options,
                              Packing& packing);

}  // namespace flappy::view
