#include "import_command.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "flightlog/import/assemble.hpp"
#include "flightlog/import/sources.hpp"
#include "io/log.hpp"

namespace flappy::gap {
using Json = nlohmann::ordered_json;

Json run_import(const ImportCommand& command) {
  const flightlog::Mapping mapping = flightlog::read_mapping(command.mapping, command.overrides);
  flightlog::Channels channels(mapping.wanted());
  std::vector<std::string> warnings;
  for (const std::filesystem::path& file : command.files) read_source(file, channels, warnings);
  const flightlog::Imported imported = assemble(channels, mapping);
  for (const std::string& warning : imported.report.warnings)
    warnings.push_back(command.mapping.string() + ": " + warning);
  for (const std::string& warning : warnings) io::log(io::LogLevel::warning, warning);
  write_flight_log(command.out, imported.log);
  const flightlog::FlightHeader& h = imported.log.header;
  const std::string beat = h.flapping_Hz > 0 ? ", " + io::shortest_digits(h.flapping_Hz) + " Hz" : "";
  std::printf("%s: %s%s\n%s", command.out.c_str(), h.vehicle.c_str(), beat.c_str(),
              report_text(imported.report).c_str());
  Json json = json_of(imported.report);
  json["folder"] = command.out.string();
  json["warnings"] = warnings;
  return json;
}

}  // namespace flappy::gap
