#include <algorithm>
#include <cmath>

#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

/// Expected nats from which on cells are darkest.
constexpr double kDarkest_nats = 1000;
constexpr double kNamed = 0.5;

std::string magnitudes_of(const Json& effect) {
  std::vector<std::string> all;
  for (const auto& [name, m] : effect.at("magnitudes").items()) {
    const std::string unit = m.at("unit"), words = magnitude_words(name, unit);
    const std::size_t from = words.find('(') + 1;
    all.push_back(words.substr(from, words.size() - from - 1) + format(" %.3g ", m.at("value").get<double>()) +
                  in_print(unit));
  }
  return spoken_list(all);
}

/// A row for each effect that the robot may have, a column for each rival.
void add_matrix(Section& section, const Json& effects, const std::vector<std::string>& rivals) {
  Json rows = Json::array(), columns = Json::array(), values = Json::array(), texts = Json::array(),
       marked = Json::array();
  for (const std::string& r : rivals) columns.push_back(r == "parameters" ? "other parameters" : spoken(r));
  for (const Json& e : effects) {
    rows.push_back(spoken(e.at("effect")));
    Json v = Json::array(), t = Json::array(), m = Json::array();
    const auto alike = e.at("alike").get<std::vector<std::string>>();
    for (const std::string& r : rivals) {
      if (r == e.at("effect")) {
        v.push_back(nullptr), t.push_back(""), m.push_back(false);
        continue;
      }
      const double nats = e.at("nats").at(r);
      v.push_back(std::log10(std::max(1.0, nats)));
      t.push_back(format("%.0f", nats));
      m.push_back(std::ranges::count(alike, r) > 0);
    }
    values.push_back(v), texts.push_back(t), marked.push_back(m);
  }
  section.add(
      Json{{"kind", "matrix"},
           {"title", "Which effect can be told from which"},
           {"rows", rows},
           {"columns", columns},
           {"values", values},
           {"texts", texts},
           {"marked", marked},
           {"most", std::log10(kDarkest_nats)},
           {"tilted", true},
           {"note",
            "If the robot has the effect of the row: by how much, in nats, flights are expected to speak for it "
            "and against the column. The darker, the surer; ringed: they cannot be told apart."}});
}

void add_effects(Section& section, const Json& effects) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const Json& e = effects[i];
    const std::string at = "/effects/" + std::to_string(i);
    std::vector<std::string> alike;
    for (const std::string& r : e.at("alike").get<std::vector<std::string>>()) alike.push_back(spoken(r));
    rows.push_back({spoken(e.at("effect")), magnitudes_of(e), cell(e.at("probability"), at + "/probability", 2),
                    e.at("sure_from").is_null() ? Json("never") : cell(e.at("sure_from"), at + "/sure_from", 2),
                    alike.size() > 4 ? std::to_string(alike.size()) + " others" : spoken_list(alike)});
  }
  section.add(table("Each effect",
                    {"effect", "at", "probability that it is named", "surely from, times this", "could be taken for"},
                    std::move(rows),
                    "Surely: named with a probability of at least 0.9, if the robot has it so many times as large."));
}

void add_choices(Section& section, const Json& choices, double asked) {
  Figure f{.id = "choices",
           .title = "What would tell more",
           .note = "Mean over all effects of the probability that a diagnosis gives the effect that the robot has.",
           .x = {.title = "mean probability (-)", .low = 0.0, .high = 1.0},
           .y = {},
           .categories = {"as asked"},
           .series = {{.name = "probability",
                       .draw = Draw::bars,
                       .colour = Colour::blue,
                       .x = {asked},
                       .y = {near_category(0)},
                       .low = {},
                       .high = {}}}};
  Json rows = Json::array();
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const Json& c = choices[i];
    const std::string at = "/choices/" + std::to_string(i) + "/";
    std::vector<std::string> gained;
    for (const std::string& e : c.at("gained").get<std::vector<std::string>>()) gained.push_back(spoken(e));
    if (c.at("flies")) {
      f.series[0].x.push_back(c.at("probability"));
      f.series[0].y.push_back(near_category(f.categories.size()));
      f.categories.push_back(spoken(c.at("name")));
    }
    rows.push_back({spoken(c.at("name")), c.at("what"),
                    c.at("flies") ? cell(c.at("probability"), at + "probability", 2) : Json("cannot be flown"),
                    cell(c.at("hours"), at + "hours", 2), cell(c.at("gained_per_hour"), at + "gained_per_hour", 3),
                    spoken_list(gained)});
  }
  section.add(f);
  section.add(table("", {"choice", "what", "mean probability", "hours of work", "gained per hour", "names also"},
                    std::move(rows)));
}

}  // namespace

Section plan_section(const std::filesystem::path& file) {
  const Json json = read_results(file);
  return of_results(file, "flappy-gap plan", [&] {
    Section section("plan", "What flights could tell", file.string());
    const Json& effects = json.at("effects");
    std::size_t named = 0;
    double sum = 0;
    for (const Json& e : effects) {
      named += e.at("probability").get<double>() >= kNamed;
      sum += e.at("probability").get<double>();
    }
    const std::size_t all = effects.size() + json.at("unseen").size(), flights = json.at("flights");
    section.say(format("%zu flight%s of %s%s would name %zu of %zu effects.", flights, flights == 1 ? "" : "s",
                       spoken(json.at("manoeuvre")).c_str(),
                       json.at("reference").get<bool>() ? ", with as many reference flights," : "", named, all),
                "lead");
    std::vector<std::string> groups;
    for (const Json& g : json.at("groups")) {
      std::vector<std::string> members;
      for (const std::string& e : g.get<std::vector<std::string>>()) members.push_back(spoken(e));
      groups.push_back(spoken_list(members));
    }
    for (const std::string& g : groups) section.say("They cannot tell apart: " + g + ".");
    section.say(
        "A robot of your own making differs from its model in more than one effect; expect less than this page says.",
        "note");
    add_matrix(section, effects, json.at("rivals"));
    add_effects(section, effects);
    if (!json.at("choices").empty()) add_choices(section, json.at("choices"), sum / static_cast<double>(all));
    return section;
  });
}

}  // namespace flappy::view
