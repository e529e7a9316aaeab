#include "import_command.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "flightlog/import/assemble.hpp"
#include "flightlog/import/sources.hpp"
#include "io/log.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const flightlog::ImportReport& report) {
  Json streams = Json::array(), clocks = Json::array();
  for (const flightlog::StreamReport& s : report.streams)
    streams.push_back({{"name", s.stream},
                       {"channel", s.channel},
                       {"samples", s.samples},
                       {"rate_hz", s.rate_hz},
                       {"never", s.lost},
                       {"twice", s.twice},
                       {"late", s.late},
                       {"out_of_order", s.reordered},
                       {"unusable", s.unusable},
                       {"delay_median_s", s.delay_median_s},
                       {"delay_most_s", s.delay_most_s}});
  for (const flightlog::ClockReport& c : report.clocks)
    clocks.push_back({{"name", c.name},
                      {"offset_s", c.offset_s},
                      {"drift", c.drift},
                      {"measured", c.measured},
                      {"stamps", c.stamps},
                      {"span_s", c.span_s}});
  return {{"start_ns", report.start_ns}, {"streams", streams}, {"clocks", clocks}};
}

}  // namespace

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
  std::printf("%s: %s, %g Hz\n%s", command.out.c_str(), imported.log.header.vehicle.c_str(),
              imported.log.header.flapping_Hz, report_text(imported.report).c_str());
  Json json = to_json(imported.report);
  json["folder"] = command.out.string();
  json["warnings"] = warnings;
  return json;
}

}  // namespace flappy::gap
