#include "view/compose.hpp"

#include <algorithm>
#include <utility>

#include "io/files.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAccepted =
    "a flight log or a folder of them, a run folder or a folder of runs of flappy-train, JSON of flappy-eval, "
    "flappy-gap diagnose or plan (or its folder) or flappy-identify forces, a folder or score.csv of flappy-blind "
    "score, figures of flappy-bench (.jsonl), the folder or design.json of flappy-design";

[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw io::InputError(path.string() + ": " + what + "; accepted: " + kAccepted);
}

Kind recognised_folder(const fs::path& path) {
  const auto has = [&](const char* name) {
    std::error_code none;
    return fs::exists(path / name, none);
  };
  if (has("flight.toml")) return Kind::flight;
  if (has("diagnosis.json")) return Kind::diagnosis;
  if (has("plan.json")) return Kind::plan;
  if (has("run.json")) return Kind::run;
  if (has("design.json")) return Kind::design;
  if (has("score.csv")) return Kind::benchmark;
  if (has("manifest.json")) refuse(path, "is a blind benchmark that is not scored yet");
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path, error))
    if (fs::exists(entry.path() / "run.json", error)) return Kind::run;
  refuse(path, "is no folder of results");
}

Kind recognised_json(const fs::path& path) {
  const Json json = read_results(path);
  const auto has = [&](const char* key) { return json.is_object() && json.contains(key); };
  if (has("verdict") && has("hypotheses") && has("locations")) return Kind::diagnosis;
  if (has("effects") && has("choices")) return Kind::plan;
  if (has("policy") && has("success_rate")) return Kind::evaluation;
  if (has("parameters") && has("total_error_after")) return Kind::identification;
  if (has("designs") && has("given_away")) return Kind::design;
  refuse(path, "is JSON of something else");
}

/// Replaces a folder of flight logs (flappy-fly --log) by its first kMaxFlights by name; `notes` tells of the others.
std::vector<fs::path> expanded(const std::vector<fs::path>& paths, std::string& notes) {
  std::vector<fs::path> all;
  for (const fs::path& path : paths) {
    std::vector<fs::path> flights = flightlog::flights_in(path);
    if (flights.size() > kMaxFlights) {
      notes += "Of " + std::to_string(flights.size()) + " flights in " + path.string() + " the first " +
               std::to_string(kMaxFlights) + " are shown. ";
      flights.resize(kMaxFlights);
    }
    if (flights.empty()) flights.push_back(path);
    all.insert(all.end(), flights.begin(), flights.end());
  }
  return all;
}

}  // namespace

Kind recognised(const fs::path& path) {
  std::error_code none;
  if (!fs::exists(path, none)) throw io::InputError(path.string() + ": there is no such file or folder");
  if (fs::is_directory(path, none)) return recognised_folder(path);
  if (path.extension() == ".json") return recognised_json(path);
  if (path.extension() == ".csv" && io::read_text(path).starts_with("case,part,effects,")) return Kind::benchmark;
  if (path.extension() == ".jsonl") return Kind::speed;
  refuse(path, "is no result");
}

std::vector<Section> composed(const std::vector<fs::path>& given, const FlightOptions& options, Packing& packing) {
  std::string left_out;
  const std::vector<fs::path> paths = expanded(given, left_out);
  std::vector<Kind> kinds;
  std::vector<fs::path> flights;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    kinds.push_back(recognised(paths[i]));
    if (kinds.back() == Kind::flight) flights.push_back(paths[i]);
    for (std::size_t k = 0; k < i; ++k)
      if (std::error_code none; fs::equivalent(paths[i], paths[k], none))
        throw io::InputError(paths[i].string() + ": is given twice; accepted: each path once");
  }
  if (flights.empty() && (options.goal_m || !options.vehicle.empty()))
    throw io::InputError("--goal and --vehicle describe flights, and no flight is given; accepted: a flight log, too");
  std::vector<Section> sections;
  bool flown = false;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const fs::path& path = paths[i];
    switch (kinds[i]) {
      case Kind::flight:
        if (std::exchange(flown, true)) break;
        sections.push_back(flight_section(flights, options, packing));
        if (!left_out.empty()) sections.back().say(left_out, "note");
        break;
      case Kind::run:
        sections.push_back(run_section(path));
        break;
      case Kind::evaluation:
        sections.push_back(evaluation_section(path));
        break;
      case Kind::diagnosis:
        sections.push_back(diagnosis_section(fs::is_directory(path) ? path / "diagnosis.json" : path));
        break;
      case Kind::plan:
        sections.push_back(plan_section(fs::is_directory(path) ? path / "plan.json" : path));
        break;
      case Kind::identification:
        sections.push_back(identification_section(path));
        break;
      case Kind::benchmark:
        sections.push_back(benchmark_section(path));
        break;
      case Kind::design:
        sections.push_back(design_section(fs::is_directory(path) ? path / "design.json" : path));
        break;
      case Kind::speed:
        sections.push_back(speed_section(path));
        break;
    }
  }
  return sections;
}

}  // namespace flappy::view
