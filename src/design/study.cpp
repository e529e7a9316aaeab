#include "design/study.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "flappy/vehicle_file.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/text.hpp"
#include "io/toml_writer.hpp"

namespace flappy::design {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr double kShare = 0.02;  // by which a variable is changed to either side, for its sensitivity
constexpr double kClose = 0.01;  // a value so close to an end of its range, or to a limit, is at it

double distance(const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& scale) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]) / (scale[i] * scale[i]);
  return sum;
}

std::vector<std::string> limits_of(const Judge& judge, const Values& values, const Figures& figures) {
  std::vector<std::string> list;
  for (const Variable& v : judge.config().space.variables) {
    if (!v.choices.empty()) continue;
    const double value = value_of(values, v.quantity), close = kClose * (v.high - v.low);
    const std::string name = info_of(v.quantity).name;
    if (value <= v.low + close) list.push_back(name + " is at its least, " + io::shortest_digits(v.low));
    if (value >= v.high - close) list.push_back(name + " is at its most, " + io::shortest_digits(v.high));
  }
  for (const Limit& l : judge.config().limits) {
    const double value = figure_of(figures, l.figure);
    const std::string name = info_of(l.figure).name;
    if (std::isfinite(l.at_least) && value <= l.at_least + kClose * std::abs(l.at_least))
      list.push_back(name + " is at its limit, at least " + io::shortest_digits(l.at_least));
    if (std::isfinite(l.at_most) && value >= l.at_most - kClose * std::abs(l.at_most))
      list.push_back(name + " is at its limit, at most " + io::shortest_digits(l.at_most));
  }
  return list;
}

/// Gains by flappy-tune, from the fitted ones; keeps those where tuning is not asked for or is interrupted at once.
void tune_gains(const Judge& judge, const DesignConfig& config, Verified& v) {
  rollout::TuneConfig tune = config.verify.tune;
  v.tuned_cost = v.fitted_cost = kMissing;
  if (tune.generations == 0) return;
  tune.start = v.tuned.controller;
  for (rollout::Trial& t : tune.trials) {
    t.fly = judge.flights(t.fly, v.tuned.robot, tune.start);
    t.fly.fleet.batch.threads = config.search.threads;
  }
  v.fitted_cost = rollout::cost_of(tune, tune.start);
  const rollout::TuneResult result = rollout::tune(tune, [](const rollout::TuneResult&) { return !io::interrupted(); });
  v.tuned.controller = result.best;
  v.tuned_cost = result.cost;
}

/// Hover and escape of a robot on vehicles that neither search nor tuning saw.
Figures fly_again(const Judge& judge, const DesignConfig& config, Judged& j, double step_s) {
  for (const auto& [which, stage] :
       {std::pair{&judge.config().hover, Stage::hover}, {&judge.config().escape, Stage::escape}}) {
    rollout::FlyConfig c = judge.flights(*which, j.robot, j.controller);
    c.fleet.batch.step_s = step_s;
    c.fleet.batch.threads = config.search.threads;
    judge.fly(c, config.verify.vehicles, rollout::kTestFlappers, stage, j);
  }
  return j.figures;
}

std::vector<std::vector<double>> sensitivity_of(const Judge& judge, const Search& search, const Values& at) {
  std::vector<std::vector<double>> list;
  const auto& variables = judge.config().space.variables;
  std::vector<Record> ends(2 * variables.size());
  io::parallel_for(ends.size(), search.config().threads, [&](std::size_t i) {
    const Variable& v = variables[i / 2];
    Values values = at;
    value_of(values, v.quantity) *= 1 + (i % 2 == 0 ? -kShare : kShare);
    if (v.choices.empty()) ends[i] = record_of(judge.judge(values, search.upto()));
  });
  for (std::size_t i = 0; i < variables.size(); ++i) {
    list.emplace_back(search.config().objectives.size(), kMissing);
    const Record &less = ends[2 * i], &more = ends[2 * i + 1];
    if (!variables[i].choices.empty() || value_of(at, variables[i].quantity) == 0) continue;
    if (!less.refused.empty() || !more.refused.empty()) continue;
    const std::vector<double> a = search.objectives(less), b = search.objectives(more);
    for (std::size_t k = 0; k < a.size(); ++k) list.back()[k] = (b[k] - a[k]) / (2 * kShare) * 0.01;
  }
  return list;
}

Json json_of(const Values& values, const Space& space) {
  Json json;
  for (std::size_t i = 0; i < kQuantities; ++i) {
    const auto q = static_cast<Quantity>(i);
    if (q == Quantity::motor) json[info_of(q).name] = space.workshop.motors[static_cast<std::size_t>(values[i])].name;
    else json[info_of(q).name] = values[i];
  }
  return json;
}

Json json_of(const Figures& figures) {
  Json json;
  for (std::size_t i = 0; i < kFigures; ++i)
    if (std::isfinite(figures[i])) json[info_of(static_cast<Figure>(i)).name] = figures[i];
    else json[info_of(static_cast<Figure>(i)).name] = nullptr;
  return json;
}

}  // namespace

std::vector<Record> choose(const Search& search, std::size_t count) {
  std::vector<Record> front = search.front();
  if (front.empty()) return {};
  const std::size_t n = search.config().objectives.size();
  std::vector<std::vector<double>> f;
  for (const Record& r : front) f.push_back(search.objectives(r));
  const auto better = static_cast<std::size_t>(std::ranges::count_if(f, beats_published));
  std::vector<double> scale(n, 1e-12);
  for (std::size_t k = 0; k < n; ++k) {
    const auto [low, high] = std::ranges::minmax(f, {}, [&](const auto& x) { return x[k]; });
    scale[k] += high[k] - low[k];
  }
  std::vector<std::size_t> chosen;
  const auto eligible = [&](std::size_t i) {
    return std::ranges::count(chosen, i) == 0 && (chosen.size() >= better || beats_published(f[i]));
  };
  while (chosen.size() < std::min(count, front.size())) {
    std::size_t best = front.size();
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < front.size(); ++i) {
      if (!eligible(i)) continue;
      double far = std::numeric_limits<double>::infinity();
      if (chosen.size() < n) far = 1e6 - f[i][chosen.size()] / scale[chosen.size()];  // the best in this objective
      else
        for (const std::size_t c : chosen) far = std::min(far, distance(f[i], f[c], scale));
      if (far > most) most = far, best = i;
    }
    chosen.push_back(best);
  }
  std::vector<Record> list;
  for (const std::size_t i : chosen) list.push_back(front[i]);
  return list;
}

Verified verify(const Judge& judge, const Search& search, const DesignConfig& config, const Record& record,
                const std::string& name) {
  Verified v{
      .name = name,
      .record = record,
      .tuned = name == kPublished ? judge.judge_published(Stage::effects) : judge.judge(record.values, Stage::effects),
      .fine = {},
      .limited_by = limits_of(judge, record.values, record.figures),
      .policy = {},
      .sensitivity = sensitivity_of(judge, search, record.values)};
  tune_gains(judge, config, v);
  Judged fine = v.tuned;
  fly_again(judge, config, v.tuned, judge.config().hover.fleet.batch.step_s);
  v.fine = fly_again(judge, config, fine, config.verify.step_s);
  return v;
}

std::vector<double> given_away(const Search& search) {
  std::vector<double> most(search.config().objectives.size(), kMissing);
  for (const Record& r : search.front()) {
    const std::vector<double> f = search.objectives(r);
    for (std::size_t k = 0; k < f.size(); ++k) {
      bool free = true;
      for (std::size_t other = 0; other < f.size(); ++other) free = free && (other == k || f[other] <= 0);
      const double share =
          std::isfinite(figure_of(search.published().figures, search.config().objectives[k])) ? -f[k] : 1;
      if (free && f[k] < 0 && !(share <= most[k])) most[k] = share;
    }
  }
  return most;
}

std::string why(const Record& record) {
  const std::size_t is = record.refused.find(" is "), bound = record.refused.find(", ");
  const std::string figure = record.refused.substr(0, is);
  if (is != std::string::npos && bound != std::string::npos && figure_named(figure))
    return figure + record.refused.substr(bound + 1);
  return record.reached == Stage::built ? "cannot be built" : record.refused;
}

std::vector<std::pair<std::string, std::size_t>> refusals(const std::vector<Record>& records) {
  std::map<std::string, std::size_t> counts;
  for (const Record& r : records)
    if (!r.refused.empty()) ++counts[why(r)];
  std::vector<std::pair<std::string, std::size_t>> list(counts.begin(), counts.end());
  std::ranges::stable_sort(list, std::ranges::greater(), &std::pair<std::string, std::size_t>::second);
  return list;
}

void write_records(const std::filesystem::path& folder, const Search& search, const std::vector<Generation>& history) {
  const auto write = [&](const char* name, const std::vector<Record>& records) {
    std::string text = record_head() + "\n";
    for (const Record& r : records) text += record_line(r) + "\n";
    io::write_atomically(folder / name, text);
  };
  write("designs.csv", search.records());
  write("front.csv", search.front());
  std::string text = "generation,designs,front,flown_s,hypervolume\n";
  for (const Generation& g : history)
    text += io::format("%u,%zu,%zu,%s,%s\n", g.number, g.designs, g.front, io::shortest_digits(g.flown_s).c_str(),
                       io::shortest_digits(g.hypervolume).c_str());
  io::write_atomically(folder / "search.csv", text);
}

void write_design(const std::filesystem::path& folder, const Judge& judge, const Verified& design) {
  io::make_folder(folder);
  model::Vehicle vehicle = design.tuned.robot.vehicle;
  if (design.name != kPublished) vehicle.name += "_" + design.name;
  io::write_atomically(folder / "vehicle.toml", model::vehicle_text(vehicle));
  io::write_atomically(folder / "controller.toml",
                       rollout::controller_text(design.tuned.controller, "Gains of design " + design.name + "."));
  for (const auto& [name, which] : {std::pair{"hover", &judge.config().hover}, {"escape", &judge.config().escape}}) {
    for (const auto& [file, text] : which->resolved)
      if (file != "fly.toml" && file != "vehicle.toml" && file != "controller.toml")
        io::write_atomically(folder / (file == "task.toml" ? std::string(name) + "_task.toml" : file), text);
    io::write_atomically(
        folder / (std::string(name) + ".toml"),
        io::Config::parse(which->resolved.at("fly.toml"), "fly.toml", {"task=" + std::string(name) + "_task.toml"})
            .resolved());
  }
}

void write_results(const std::filesystem::path& folder, const Judge& judge, const Search& search,
                   const std::vector<Generation>& history, const std::vector<Verified>& designs) {
  const Space& space = judge.config().space;
  Json json;
  json["schema"] = 1;
  json["commit"] = io::commit();
  for (const Figure f : search.config().objectives)
    json["objectives"].push_back({{"figure", info_of(f).name},
                                  {"words", info_of(f).words},
                                  {"unit", info_of(f).unit},
                                  {"more_is_better", info_of(f).more_is_better}});
  for (const Variable& v : space.variables)
    json["variables"].push_back(
        {{"name", info_of(v.quantity).name}, {"words", info_of(v.quantity).words}, {"low", v.low}, {"high", v.high}});
  for (std::size_t i = 0; i < kFigures; ++i) {
    const FigureInfo& info = info_of(static_cast<Figure>(i));
    json["figures"].push_back({{"name", info.name}, {"words", info.words}, {"unit", info.unit}});
  }
  json["published"] = json_of(search.published().figures);
  json["front"] = Json::array();
  for (const Record& r : search.front())
    json["front"].push_back({{"values", json_of(r.values, space)}, {"figures", json_of(r.figures)}});
  const Generation& last = history.back();
  json["search"] = {{"designs", last.designs}, {"flown_s", last.flown_s}, {"hypervolume", last.hypervolume}};
  json["given_away"] = given_away(search);
  json["designs"] = Json::array();
  for (const Verified& v : designs)
    json["designs"].push_back({{"name", v.name},
                               {"folder", "designs/" + v.name},
                               {"values", json_of(v.record.values, space)},
                               {"figures", json_of(v.record.figures)},
                               {"verified", json_of(v.tuned.figures)},
                               {"fine", json_of(v.fine)},
                               {"fitted_cost", v.fitted_cost},
                               {"tuned_cost", v.tuned_cost},
                               {"rod_m", v.tuned.robot.rod_m},
                               {"policy", {v.policy.success, v.policy.low, v.policy.high}},
                               {"limited_by", v.limited_by},
                               {"sensitivity", v.sensitivity}});
  io::write_atomically(folder / "design.json", json.dump(1) + "\n");
}

}  // namespace flappy::design
