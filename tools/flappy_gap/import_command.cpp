#include "import_command.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "flightlog/import/assemble.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Json run_import(const ImportCommand& command) {
  const flightlog::Mapping mapping = flightlog::read_mapping(command.mapping, command.overrides);
  const flightlog::Imported imported = flightlog::import_recording(command.files, mapping, command.out);
  const flightlog::FlightHeader& h = imported.log.header;
  const std::string beat = h.flapping_Hz > 0 ? ", " + io::shortest_digits(h.flapping_Hz) + " Hz" : "";
  std::printf("%s: %s%s\n%s", command.out.c_str(), h.vehicle.c_str(), beat.c_str(),
              report_text(imported.report).c_str());
  Json json = json_of(imported.report);
  json["folder"] = command.out.string();
  return json;
}

}  // namespace flappy::gap
