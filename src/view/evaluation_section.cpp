#include <cmath>

#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

struct Flown {
  std::string name;
  const Json& json;
  std::string at;  ///< JSON pointer
};

Series bars(const std::string& name, Colour colour) {
  return {.name = name, .draw = Draw::bars, .colour = colour, .x = {}, .y = {}, .low = {}, .high = {}};
}

double number(const Json& json, const std::string& key) {
  return json.at(key).is_null() ? NAN : json.at(key).get<double>();
}

constexpr Colour kColumnColours[] = {Colour::blue, Colour::vermillion, Colour::green};

void add_success(Section& section, const std::vector<Flown>& flown) {
  Figure f{.id = "success",
           .title = "Success",
           .note = "Share of flights that captured the goal in time and kept it, with its 95 % interval.",
           .x = {.title = "success (%)", .low = 0.0, .high = 100.0},
           .y = {},
           .categories = {},
           .series = {
               {.name = "", .draw = Draw::interval, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
  for (const Flown& c : flown) {
    f.series[0].x.push_back(100 * number(c.json, "success_rate"));
    f.series[0].low.push_back(100 * number(c.json, "success_low"));
    f.series[0].high.push_back(100 * number(c.json, "success_high"));
    f.series[0].y.push_back(near_category(f.categories.size()));
    f.categories.push_back(c.name);
  }
  section.add(f);
}

void add_failures(Section& section, const std::vector<Flown>& flown) {
  Figure f{.id = "failures",
           .title = "Failures by cause",
           .note = "Flights of those flown; what never captured the goal missed most of what stands below it.",
           .x = {.title = "flights (%)", .low = 0.0},
           .y = {},
           .categories = {},
           .series = {}};
  std::vector<std::pair<std::string, std::string>> causes;
  for (const char* group : {"failures", "never_captured_missing"})
    for (const auto& [cause, count] : flown[0].json.at(group).items()) {
      bool any = false;
      for (const Flown& c : flown) any |= c.json.at(group).at(cause).get<double>() > 0;
      if (any) causes.emplace_back(group, cause);
    }
  for (const auto& [group, cause] : causes)
    f.categories.push_back((group == "failures" ? "" : "  missing most: ") + spoken(cause));
  for (std::size_t k = 0; k < flown.size(); ++k) {
    Series s = bars(flown[k].name, kColumnColours[k]);
    for (std::size_t i = 0; i < causes.size(); ++i) {
      s.x.push_back(100 * flown[k].json.at(causes[i].first).at(causes[i].second).get<double>() /
                    flown[k].json.at("episodes").get<double>());
      s.y.push_back(near_category(i, k, flown.size()));
    }
    f.series.push_back(std::move(s));
  }
  if (!causes.empty()) section.add(f);
}

/// Adds the median of a quantity, with its 10 % and 90 % quantiles.
void add_quantity(Section& section, const std::vector<Flown>& flown, const std::string& id, const std::string& title,
                  const std::string& unit, const std::vector<std::pair<std::string, double>>& references) {
  Figure f{.id = id,
           .title = title,
           .note = "Median of all vehicles, and from the tenth to the ninetieth of a hundred.",
           .x = {.title = spoken(id) + " (" + unit + ")", .low = 0.0},
           .y = {},
           .categories = {},
           .series = {
               {.name = "", .draw = Draw::interval, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
  Series& s = f.series[0];
  for (const Flown& c : flown) {
    s.x.push_back(number(c.json, id + "_median_" + unit));
    s.low.push_back(number(c.json, id + "_p10_" + unit));
    s.high.push_back(number(c.json, id + "_p90_" + unit));
    s.y.push_back(near_category(f.categories.size()));
    f.categories.push_back(c.name);
  }
  for (const auto& [name, value] : references) {
    s.x.push_back(value), s.low.push_back(value), s.high.push_back(value);
    s.y.push_back(near_category(f.categories.size()));
    f.categories.push_back(name);
  }
  section.add(f);
}

void add_table(Section& section, const std::vector<Flown>& flown) {
  const std::pair<const char*, const char*> kRows[] = {{"success_rate", "success (share)"},
                                                       {"captured_rate", "captured the goal (share)"},
                                                       {"time_to_capture_median_s", "time to capture, median (s)"},
                                                       {"time_to_capture_p90_s", "time to capture, 90 % (s)"},
                                                       {"overshoot_median_mm", "overshoot, median (mm)"},
                                                       {"final_position_error_mm", "final position error, median (mm)"},
                                                       {"final_heading_error_deg", "final heading error, median (deg)"},
                                                       {"energy_median_J", "energy of the manoeuvre, median (J)"},
                                                       {"mean_power_median_W", "mean power, median (W)"}};
  std::vector<std::string> head = {""};
  Json rows = Json::array();
  for (const Flown& c : flown) head.push_back(c.name);
  for (const auto& [key, name] : kRows) {
    Json row = {name};
    for (const Flown& c : flown) row.push_back(cell(number(c.json, key), c.at + "/" + key));
    rows.push_back(std::move(row));
  }
  section.add(table("In numbers", head, std::move(rows)));
}

void add_flights(Section& section, const Json& json) {
  std::vector<Flown> flown = {{"policy", json, ""}};
  if (json.contains("pid")) flown.push_back({"PID alone", json.at("pid"), "/pid"});
  if (json.contains("arc")) flown.push_back({"ARC alone", json.at("arc"), "/arc"});
  section.say(format("The policy succeeds in %.1f %% of %.0f flights (95 %%: %.1f to %.1f %%), each with a vehicle, a "
                     "start and noise "
                     "of its own that training never saw.",
                     100 * number(json, "success_rate"), number(json, "episodes"), 100 * number(json, "success_low"),
                     100 * number(json, "success_high")),
              "lead");
  std::vector<std::pair<std::string, double>> references;
  if (json.contains("reference"))
    references = {{"the hummingbird", number(json.at("reference"), "hummingbird_s")},
                  {"the study's optimum", number(json.at("reference"), "study_optimum_s")}};
  add_success(section, flown);
  add_failures(section, flown);
  add_quantity(section, flown, "time_to_capture", "Time to capture the goal", "s", references);
  add_quantity(section, flown, "energy", "Energy of the manoeuvre", "J", {});
  add_table(section, flown);
}

void add_effects(Section& section, const Json& json) {
  section.say(format("Without any effect the policy succeeds in %.1f %% of %.0f flights; below, with each effect of "
                     "the catalogue at "
                     "0.5 to 2 times its typical magnitude.",
                     100 * number(json, "success_rate"), number(json, "episodes")),
              "lead");
  Json rows = Json::array(), values = Json::array(), texts = Json::array();
  std::vector<std::string> columns;
  for (const Json& e : json.at("effects")) {
    Json v = Json::array(), t = Json::array();
    columns.clear();
    for (const Json& s : e.at("success")) {
      columns.push_back(format("%g ×", s.at("magnitude").get<double>()));
      const double rate = number(s, "rate");
      // dark cells fail
      v.push_back(std::isfinite(rate) ? Json(1 - rate) : Json(nullptr));
      t.push_back(std::isfinite(rate) ? format("%.1f", 100 * rate) : "–");
    }
    rows.push_back(spoken(e.at("effect")));
    values.push_back(v), texts.push_back(t);
  }
  section.add(Json{{"kind", "matrix"},
                   {"title", "Success (%) by effect and magnitude"},
                   {"rows", rows},
                   {"columns", columns},
                   {"values", values},
                   {"texts", texts},
                   {"most", 1},
                   {"note", "The darker, the more flights fail."}});
}

}  // namespace

Section evaluation_section(const std::filesystem::path& file) {
  const Json json = read_results(file);
  return of_results(file, "flappy-eval", [&] {
    Section section("evaluation", "Evaluation of " + json.at("policy").get<std::string>(), file.string());
    if (json.contains("effects")) add_effects(section, json);
    else add_flights(section, json);
    return section;
  });
}

}  // namespace flappy::view
