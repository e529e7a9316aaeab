// From paths of results to a report: what each is, and its section.
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
/// flappy-identify forces or flappy-blind score (its folder, or score.csv). InputError where it is none of these.
Kind recognised(const std::filesystem::path& path);

/// A folder of flight logs stands for the first kMostFlights of them. Sections in the order of the paths; flights share the place of the first. A path that is given twice is refused, as whatever
/// a section refuses.
std::vector<Section> composed(const std::vector<std::filesystem::path>& given, const FlightOptions& options,
                              Packing& packing);

}  // namespace flappy::view
