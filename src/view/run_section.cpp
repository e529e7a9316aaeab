#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include "io/installation.hpp"
#include "io/text.hpp"
#include "learn/metrics.hpp"
#include "learn/train_config.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;
using io::format;

struct Run {
  std::string name;
  fs::path folder;
  learn::MetricsTable metrics, timing;
  Json start, summary;  ///< run.json; summary.json, null while the run is not at its end
};

Run read_run(const fs::path& folder) {
  Run run{io::folder_name(folder),
          folder,
          learn::read_metrics(folder / "metrics.jsonl"),
          learn::read_metrics(folder / "timing.jsonl"),
          read_results(folder / "run.json"),
          nullptr};
  if (fs::exists(folder / "summary.json")) run.summary = read_results(folder / "summary.json");
  return run;
}

/// The folder itself if it is a run, else the runs in it, by the number of their seed.
std::vector<fs::path> runs_in(const fs::path& folder) {
  if (fs::exists(folder / "run.json")) return {folder};
  std::vector<fs::path> runs;
  for (const auto& entry : fs::directory_iterator(folder))
    if (fs::exists(entry.path() / "run.json")) runs.push_back(entry.path());
  std::ranges::sort(runs, {}, [](const fs::path& p) {
    const std::string name = p.filename().string();
    return std::pair(name.size(), name);
  });
  return runs;
}

/// An empty figure for one line per run.
Figure curves(const std::string& id, const std::string& title, const std::string& note, Axis x, Axis y) {
  return {.id = id, .title = title, .note = note, .x = std::move(x), .y = std::move(y), .categories = {}, .series = {}};
}

constexpr Colour kSeedColours[] = {Colour::blue, Colour::vermillion, Colour::green, Colour::purple, Colour::black};

Series line(const Run& run, std::size_t k, std::vector<double> x, std::vector<double> y, double factor = 1) {
  for (double& value : y) value *= factor;
  Series s{.name = run.name, .colour = kSeedColours[k % 5], .x = {}, .y = {}, .low = {}, .high = {}, .dashed = k >= 5};
  // there are fewer evaluations than records
  for (std::size_t i = 0; i < x.size() && i < y.size(); ++i)
    if (std::isfinite(y[i])) s.x.push_back(x[i]), s.y.push_back(y[i]);
  return s;
}

void add_curves(Section& section, const std::vector<Run>& runs) {
  const Axis update{.title = "updates"}, wall{.title = "wall-clock time (s)"};
  const Axis percent{.title = "success (%)", .low = 0.0, .high = 100.0};
  Figure success = curves("success", "Success on validation vehicles over updates",
                          "Each point flies vehicles that training does not see.", update, percent);
  Figure over_time = curves("success_time", "The same over wall-clock time", "", wall, percent);
  Figure capture = curves("capture_time", "Time to capture the goal", "Median of the flights that captured it.", update,
                          {.title = "time to capture (s)"});
  Figure reward =
      curves("return", "Return of the training's episodes",
             "Mean of the episodes since the record before, with exploration.", update, {.title = "return (-)"});
  Figure speed = curves("speed", "Speed", "Gradient steps a second, evaluation included.", update,
                        {.title = "updates per second", .low = 0.0});
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& r = runs[k];
    if (r.metrics.names.empty() || r.timing.names.empty()) continue;  // no evaluation yet
    const std::vector<double>&updates = r.metrics.column("update"), &rate = r.metrics.column("success_rate");
    success.series.push_back(line(r, k, updates, rate, 100));
    over_time.series.push_back(line(r, k, r.timing.column("wall_s"), rate, 100));
    capture.series.push_back(line(r, k, updates, r.metrics.column("time_to_capture_median_s")));
    reward.series.push_back(line(r, k, updates, r.metrics.column("return_mean")));
    speed.series.push_back(line(r, k, r.timing.column("update"), r.timing.column("updates_per_s")));
  }
  for (const Figure& f : {success, over_time, capture}) section.add(f);
  Figure ends = curves("ends", "How the training's episodes went (" + runs[0].name + ")",
                       "Shares of the episodes since the record before, with exploration.", update,
                       {.title = "episodes (%)", .low = 0.0, .high = 100.0});
  const std::pair<const char*, const char*> kEnds[] = {{"captured_share", "captured the goal"},
                                                       {"handed_back_share", "handed back"},
                                                       {"terminated_share", "ended early"}};
  for (std::size_t k = 0; k < 3 && !runs[0].metrics.names.empty(); ++k) {
    Series s = line(runs[0], k, runs[0].metrics.column("update"), runs[0].metrics.column(kEnds[k].first), 100);
    s.name = kEnds[k].second;
    ends.series.push_back(std::move(s));
  }
  section.add(ends);
  section.add(reward);
  section.add(speed);
}

void add_seeds(Section& section, const std::vector<Run>& runs) {
  Json rows = Json::array();
  const auto number = [](const Run& r, const char* key, int digits = 3) {
    return r.summary.is_null() || !r.summary.contains(key) || r.summary.at(key).is_null()
               ? Json("–")
               : cell(r.summary.at(key), "/" + r.name + "/" + key, digits);
  };
  for (const Run& r : runs)
    rows.push_back({r.name, number(r, "best_success_rate", 4), number(r, "time_to_50_s"), number(r, "time_to_80_s"),
                    number(r, "time_to_90_s"), number(r, "time_to_95_s"), number(r, "wall_s"), number(r, "updates", 7),
                    number(r, "share_simulation"), number(r, "share_learning")});
  section.add(table("Seeds",
                    {"run", "best success (share)", "to 50 % (s)", "to 80 % (s)", "to 90 % (s)", "to 95 % (s)",
                     "training (s)", "updates", "simulation (share of time)", "learning (share of time)"},
                    std::move(rows)));
}

/// "[table]" and "key = value" lines of a resolved configuration as "table.key" -> value.
std::map<std::string, std::string> flattened(const std::string& text) {
  std::map<std::string, std::string> keys;
  std::map<std::string, int> repeated;
  std::istringstream lines(text);
  std::string row, table;
  while (std::getline(lines, row)) {
    if (row.starts_with("[[")) {
      const std::string name = row.substr(2, row.find("]]") - 2);
      table = name + "." + std::to_string(repeated[name]++) + ".";
    } else if (row.starts_with('[')) {
      table = row.substr(1, row.find(']') - 1) + ".";
    } else if (const std::size_t equal = row.find(" = "); equal != std::string::npos && !row.starts_with(' ')) {
      keys[table + row.substr(0, equal)] = row.substr(equal + 3);
    }
  }
  return keys;
}

/// Adds the table of keys that differ from the shipped configuration of the same task.
void add_difference(Section& section, const Run& run) {
  const std::string task = run.start.at("task"), name = "train/" + task + ".toml";
  const fs::path shipped_file = io::config_path(name);
  if (!fs::exists(shipped_file)) {
    section.say("No configuration is shipped for the task " + task + ", so none is compared.", "note");
    return;
  }
  const std::map<std::string, std::string> shipped = learn::read_train_config(shipped_file).resolved;
  std::vector<std::array<std::string, 4>> rows;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(run.folder / "config", none)) {
    const std::string file = entry.path().filename().string();
    const auto other = shipped.find(file);
    std::map<std::string, std::string> own = flattened(io::read_text(entry.path()));
    std::map<std::string, std::string> theirs = flattened(other == shipped.end() ? "" : other->second);
    for (const auto& [key, value] : theirs) own.try_emplace(key, "");
    for (const auto& [key, value] : own)
      if (const std::string before = theirs.contains(key) ? theirs[key] : "";
          before != value && key != "threads" && key != "seed")
        rows.push_back({file, key, before.empty() ? "–" : before, value.empty() ? "–" : value});
  }
  if (rows.empty()) {
    section.say("The configuration is configs/" + name + " as shipped, but for seed and threads.");
    return;
  }
  std::ranges::sort(rows);
  section.add(table("Configuration, where it differs from configs/" + name, {"file", "key", "shipped", "here"},
                    std::move(rows)));
}

}  // namespace

Section run_section(const fs::path& folder) {
  std::vector<Run> runs;
  for (const fs::path& run : runs_in(folder)) runs.push_back(read_run(run));
  return of_results(folder, "flappy-train", [&] {
    Section section("run", "Training of " + spoken(runs[0].start.at("task")), folder.string());
    std::vector<double> best, to_90;
    for (const Run& r : runs) {
      if (r.summary.is_null()) continue;
      if (const Json& b = r.summary.at("best_success_rate"); !b.is_null()) best.push_back(b);
      if (const Json& t = r.summary.at("time_to_90_s"); !t.is_null()) to_90.push_back(t);
    }
    if (best.empty()) {
      section.say(std::to_string(runs.size()) + (runs.size() > 1 ? " runs" : " run") + ", not at the end yet.", "lead");
    } else {
      const auto [least, most] = std::ranges::minmax(best);
      std::string lead = runs.size() > 1
                             ? format("%zu seeds reach %.1f to %.1f %% success on validation vehicles", runs.size(),
                                      100 * least, 100 * most)
                             : format("The best policy has %.1f %% success on validation vehicles", 100 * most);
      if (!to_90.empty()) {
        std::ranges::sort(to_90);
        lead += format("; 90 %% was reached after %.3g s%s", to_90[(to_90.size() - 1) / 2],
                       runs.size() > 1 ? " (lower median)" : "");
      }
      section.say(lead + ".", "lead");
    }
    add_curves(section, runs);
    add_seeds(section, runs);
    add_difference(section, runs[0]);
    section.say(
        "To see what the policy does, give flappy-report a flight of it (flappy-fly CONFIG --set actor=RUN/best.json "
        "--log FLIGHT) "
        "and its evaluation (flappy-eval RUN --json EVALUATION.json), too.",
        "note");
    return section;
  });
}

}  // namespace flappy::view
