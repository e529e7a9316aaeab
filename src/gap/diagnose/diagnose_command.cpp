#include "gap/diagnose/diagnose_command.hpp"

#include <array>
#include <cstdio>
#include <utility>

#include "flappy/vehicle_file.hpp"
#include "gap/diagnose/summary.hpp"
#include "gap/result/diagnosis_json.hpp"
#include "gap/result/sentences.hpp"
#include "io/files.hpp"
#include "io/log.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

/// All effects in the groups of the withheld ones: another effect of a group would stand in for the withheld one.
std::vector<std::string> whole_groups(const DiagnosisSettings& settings) {
  const model::Vehicle vehicle = model::read_any_vehicle(settings.vehicle);
  std::vector<std::string> all;
  for (const std::string& id : settings.withheld) {
    if (model::find_effect(vehicle, id) == nullptr) return settings.withheld;  // read_request refuses it
    for (std::string& member : model::whole_group(model::catalogue_of(vehicle), id)) all.push_back(std::move(member));
  }
  return all;
}

Diagnosed diagnose_visibly(const DiagnosisRequest& request) {
  io::ProgressLine line("diagnosing");
  std::string noted;
  return diagnose(request, [&](double share, const std::string& what) {
    if (std::exchange(noted, what) != what) io::log(io::LogLevel::info, what);
    line.show(share, what);
    return !io::interrupted();
  });
}

void look_ahead(const DiagnosisRequest& request, Diagnosed& d) {
  io::ProgressLine line("looking ahead");
  if (io::interrupted()) return;
  line.show(0, "flying in closed loop");
  fly_closed_loop(request, d);
  if (io::interrupted()) return;
  line.show(0.5, "weighing what to fly next");
  propose_experiment(request, d);
}

constexpr std::array kWritten = {kDiagnosisFile, kVehicleFile};

/// Removes the files of an earlier diagnosis first.
void write_files(const std::filesystem::path& out, const Diagnosed& d) {
  for (const char* name : kWritten)
    if (std::error_code error; true) std::filesystem::remove(out / name, error);
  if (d.corrected)
    io::write_atomically(
        out / kVehicleFile,
        "# Corrected by flappy-gap diagnose. Effects that its report does not name make up for errors of the model.\n" +
            model::vehicle_text(*d.corrected));
  write_diagnosis(out, d.result);
}

}  // namespace

nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command) {
  DiagnosisSettings settings = command.settings;
  settings.withheld = whole_groups(settings);
  const DiagnosisRequest request = read_request(settings);
  const std::filesystem::path out = command.out;
  if (!out.empty()) {
    io::make_folder(out);
    for (const char* name : kWritten) io::check_output(out / name);
    io::log_into(out);
  }
  io::stop_on_interrupt();
  Diagnosed d = diagnose_visibly(request);
  if (!out.empty()) write_files(out, d);
  if (d.corrected) {
    look_ahead(request, d);
    if (!out.empty()) write_diagnosis(out, d.result);
  }
  const auto print = [&](const std::string& line) {
    if (!command.quiet) std::printf("%s\n", line.c_str());
  };
  const bool faulty = !d.result.faults.empty();
  for (const std::string& line : summary_of(d.result, command.out)) print(line);
  io::log(io::LogLevel::info, faulty              ? "the flights' data have faults: no diagnosis"
                              : d.result.complete ? "diagnosed"
                                                  : kStopped);
  if (!out.empty()) {
    std::string written = kDiagnosisFile;
    if (d.corrected) written += std::string(", ") + kVehicleFile;
    print("written to " + command.out + ": " + written);
    print(io::shown_by(command.out));
  }
  return to_json(d.result);
}

}  // namespace flappy::gap
