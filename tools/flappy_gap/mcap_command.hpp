// flappy-gap mcap: a diagnosed flight for Foxglove and PlotJuggler, with what the declared vehicle and the corrected one
// predict of it, and a layout for each viewer.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace flappy::gap {

struct McapCommand {
  std::filesystem::path flight;     ///< folder of its log
  std::filesystem::path vehicle;    ///< the vehicle file as it was diagnosed
  std::filesystem::path diagnosis;  ///< folder that flappy-gap diagnose wrote
  std::filesystem::path out;        ///< X.mcap; X.foxglove.json and X.plotjuggler.xml are written with it
};

/// Writes the three files, and prints what is left of the mean of a beat. io::InputError before anything is written for
/// a file that exists, a diagnosis without a corrected vehicle or of other flights or of another vehicle, and a flight
/// that is not driven by voltages.
nlohmann::ordered_json run_mcap(const McapCommand& command);

}  // namespace flappy::gap
