// flappy-record: records a robot's ROS 2 topics into a flight log, and the unchanged messages into an MCAP file next to it.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "flightlog/import/mapping.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "server/record/record.hpp"

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-record", "Records a robot's ROS 2 topics as a flight log, and as MCAP.", {});
  const io::Command& app = program.app();
  std::string mapping_name, out;
  std::vector<std::string> overrides;
  server::RecordOptions options;
  app.option("mapping", mapping_name, "which topics, and what they mean: configs/mapping/*.toml").required();
  app.option("--out", out, "folder for the log; the messages go to OUT.mcap").required();
  app.option("--duration", options.duration_s, "seconds; otherwise until Ctrl-C").range(0.0, 86400.0);
  app.option("--set", overrides, "override a key: mocap.channel=/vrpn/pose, dds.reach=network").one_at_a_time();
  return program.run(argc, argv, [&] {
    const flightlog::Mapping mapping = flightlog::read_mapping(mapping_name, overrides);
    options.out = out;
    io::ProgressLine progress("recorded");
    options.keep_going = [&](const std::map<std::string, std::uint64_t>& messages) {
      std::string text;
      for (const auto& [topic, count] : messages) text += " " + topic + " " + std::to_string(count);
      if (progress.due()) progress.show(0, text);
      return !io::interrupted();
    };
    io::stop_on_interrupt();
    const server::Recorded r = server::record(mapping.dds, mapping, options);
    progress.clear();
    std::printf("%s and %s\n%s", out.c_str(), r.mcap.c_str(), flightlog::report_text(r.report).c_str());
    if (r.refused > 0)
      std::printf("  refused, longer than any sample: %llu\n", static_cast<unsigned long long>(r.refused));
    program.write_json({{"log", out},
                        {"mcap", r.mcap.string()},
                        {"messages", r.messages},
                        {"refused", r.refused},
                        {"import", flightlog::json_of(r.report)}});
  });
}
