// Composes a report from paths: recognises what each path holds, and makes its section.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "view/flight_section.hpp"
#include "view/page.hpp"

namespace flappy::view {

enum class Kind { flight, run, evaluation, diagnosis, identification, benchmark };

/// What a path holds: a flight log; a run folder or a folder of runs; results of flappy-eval, flappy-gap diagnose (or its folder),
/// flappy-identify forces or flappy-blind score (its folder, or score.csv). Throws InputError where it is none of these.
Kind recognised(const std::filesystem::path& path);

/// The sections in the order of the paths; all flights share one section, at the place of the first. Of a folder of flight logs, the first
/// kMaxFlights are taken. Throws io::InputError for a path that is given twice, and for whatever a section refuses.
std::vector<Section> composed(const std::vector<std::filesystem::path>& given, const FlightOptions& options,
                              Packing& packing);

}  // namespace flappy::view
