#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "flappy/vehicle_file.hpp"
#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"
#include "view/shape.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;
using io::format;

constexpr const char* kWriter = "flappy-design";
constexpr const char* kPublished = "00";  // the published robot among the designs
constexpr std::size_t kMaxDesigns = 8;    // designs that are drawn beside the published one
constexpr std::pair<const char*, const char*> kJudgements[] = {
    {"figures", "as searched"}, {"verified", "verified"}, {"fine", "short steps"}};

double number(const Json& json) { return json.is_null() ? NAN : json.get<double>(); }

/// Numbers next to each other that a reader can compare: identifiers end in their unit, which is scaled here.
struct Print {
  const char *end, *unit;
  double scale;
};
constexpr Print kPrints[] = {{"_Nm_rad", " mNm/rad", 1e3},
                             {"_Nm", " mNm", 1e3},
                             {"_rad", "°", 180 / std::numbers::pi},
                             {"_Hz", " Hz", 1},
                             {"_kg", " g", 1e3},
                             {"_J", " mJ", 1e3},
                             {"_m", " mm", 1e3},
                             {"_W", " W", 1},
                             {"_A", " A", 1},
                             {"_C", " °C", 1},
                             {"_s", " s", 1},
                             {"_success", " %", 100}};

std::string printed(const std::string& identifier, double value) {
  if (!std::isfinite(value)) return "–";
  for (const Print& p : kPrints)
    if (identifier.ends_with(p.end)) return format("%.3g%s", value * p.scale, p.unit);
  return format("%.3g", value);
}

struct Objective {
  std::string figure, words, unit;
  bool more_is_better;
  double published;
  std::string axis() const { return words + (unit == "1" ? " (-)" : " (" + in_print(unit) + ")"); }
  /// Changes of a share of vehicles are in points, of a quantity that the published robot has none of in its unit.
  bool in_points() const { return figure.ends_with("_success"); }
  bool in_percent() const { return !in_points() && std::isfinite(published) && published != 0; }
  double scaled(double change) const { return in_points() || in_percent() ? 100 * change : change; }
  std::string change_unit() const {
    return in_points() ? "percentage points" : in_percent() ? "%" : unit == "1" ? "" : in_print(unit);
  }
};

struct Design {
  const Json& json;
  std::string name, at;  ///< what the page calls it; JSON pointer
};

struct Study {
  const Json& json;
  std::vector<Objective> objectives;
  std::vector<Design> designs;               ///< the first is the published robot
  std::map<std::string, std::string> words;  ///< of variables and figures, by identifier
};

std::string capital(std::string words) {
  if (!words.empty()) words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return words;
}

Study study_of(const fs::path& file, const Json& json) {
  Study s{json, {}, {}, {}};
  for (const char* list : {"variables", "figures"})
    for (const Json& one : json.at(list)) s.words[one.at("name")] = one.at("words");
  for (const Json& o : json.at("objectives")) {
    const std::string figure = o.at("figure");
    s.objectives.push_back(
        {figure, o.at("words"), o.at("unit"), o.at("more_is_better"), number(json.at("published").at(figure))});
  }
  const Json& designs = json.at("designs");
  if (designs.empty()) refuse_results(file, kWriter, "has no verified design yet");
  for (std::size_t i = 0; i < designs.size() && s.designs.size() <= kMaxDesigns; ++i) {
    const bool published = designs[i].at("name") == kPublished;
    s.designs.push_back({designs[i], published ? "published" : "design " + designs[i].at("name").get<std::string>(),
                         "/designs/" + std::to_string(i)});
    if (published != (i == 0)) break;
  }
  if (s.designs[0].name != "published" || std::ranges::count(s.designs, "published", &Design::name) != 1)
    refuse_results(file, kWriter, "its designs do not begin with 00, the published robot");
  return s;
}

/// "root_chord is at its least, 0.6" -> "chord at the root over the mean chord is at its least, 0.6"
std::string limit_words(const Study& s, const std::string& limit) {
  const std::string name = limit.substr(0, limit.find(' '));
  const auto known = s.words.find(name);
  const std::size_t last = limit.rfind(' ');
  if (known == s.words.end() || last == std::string::npos) return spoken(limit);
  try {
    return known->second + limit.substr(name.size(), last + 1 - name.size()) +
           printed(name, std::stod(limit.substr(last + 1)));
  } catch (const std::exception&) {  // no number at the end
    return known->second + limit.substr(name.size());
  }
}

void say_lead(Section& section, const Study& s) {
  const std::size_t judged = s.json.at("search").at("designs"), front = s.json.at("front").size();
  std::vector<std::string> gains;
  for (std::size_t k = 0; k < s.objectives.size(); ++k) {
    const Objective& o = s.objectives[k];
    const double gain = number(s.json.at("given_away").at(k));
    if (std::isfinite(gain))
      gains.push_back(o.words + (o.more_is_better ? " higher by " : " lower by ") + format("%.3g ", o.scaled(gain)) +
                      o.change_unit());
  }
  section.say(
      format("%zu design%s judged; nothing beats %zu of them. ", judged, judged == 1 ? " was" : "s were", front) +
          (gains.empty() ? "The published robot gives away nothing: each gain in one objective costs another."
                         : "Without loss elsewhere the published robot could have: " + spoken_list(gains, "or") + "."),
      "lead");
  section.say(
      "An objective is what the search makes as low or as high as it can. Nothing beats a design if each other one is "
      "worse "
      "in an objective, or equal in all. What the published robot gives away is what such a design gains in one "
      "objective "
      "without loss in another; each such gain is that of another design.");
  section.say(
      "Drawn vehicles are copies of a design whose parameters differ by chance, as those of built robots do. Figures "
      "as "
      "searched are those of the vehicles on which the search chose, and flatter the designs: trust the verified ones.",
      "note");
}

Series points(const char* name, Colour colour) {
  return {.name = name, .draw = Draw::points, .colour = colour, .x = {}, .y = {}, .low = {}, .high = {}, .labels = {}};
}

void add_pair(Section& section, const Study& s, const Objective& across, const Objective& up) {
  Figure f{.id = "pair_" + across.figure + "_" + up.figure,
           .title = capital(up.words) + " over " + across.words,
           .note = std::string("Better: to the ") + (across.more_is_better ? "right" : "left") + ", and " +
                   (up.more_is_better ? "up" : "down") + ". As searched.",
           .x = {.title = across.axis()},
           .y = {.title = up.axis()},
           .categories = {},
           .series = {points("published", Colour::vermillion), points("chosen designs", Colour::blue),
                      points("others that nothing beats", Colour::grey)}};
  const auto put = [&](Series& series, const Json& figures, const std::string& label) {
    const double x = number(figures.at(across.figure)), y = number(figures.at(up.figure));
    if (!std::isfinite(x) || !std::isfinite(y)) return;
    series.x.push_back(x), series.y.push_back(y);
    if (!label.empty()) series.labels.push_back(label);
  };
  put(f.series[0], s.json.at("published"), "");
  for (std::size_t i = 1; i < s.designs.size(); ++i)
    put(f.series[1], s.designs[i].json.at("figures"), s.designs[i].json.at("name"));
  for (const Json& other : s.json.at("front")) {
    const auto is_other = [&](const Design& d) { return d.json.at("values") == other.at("values"); };
    if (std::ranges::none_of(s.designs, is_other)) put(f.series[2], other.at("figures"), "");
  }
  section.add(f);
}

Json robot_of(const Study& s, const Design& d, const fs::path& folder) {
  Json limits = Json::array(), worth = Json::array(), built = Json::array();
  for (const std::string& limit : d.json.at("limited_by").get<std::vector<std::string>>())
    limits.push_back(limit_words(s, limit));
  const Json& figures = d.json.at("verified");
  for (const Objective& o : s.objectives) worth.push_back({o.words, printed(o.figure, number(figures.at(o.figure)))});
  worth.push_back({"mass", printed("mass_kg", number(figures.at("mass_kg")))});
  for (const Json& v : s.json.at("variables")) {
    const std::string name = v.at("name");
    const Json& value = d.json.at("values").at(name);
    built.push_back({v.at("words"), value.is_string() ? value.get<std::string>() : printed(name, number(value))});
  }
  built.push_back({"rod of the leading edge, diameter", printed("rod_m", number(d.json.at("rod_m")))});
  const fs::path vehicle = folder / d.json.at("folder").get<std::string>() / "vehicle.toml";
  return {{"name", d.name},
          {"shape", shape_of(model::read_any_vehicle(vehicle))},
          {"limits", std::move(limits)},
          {"worth", std::move(worth)},
          {"built", std::move(built)}};
}

void add_robots(Section& section, const Study& s, const fs::path& folder) {
  Json robots = Json::array();
  for (const Design& d : s.designs) robots.push_back(robot_of(s, d, folder));
  section.add(
      Json{{"kind", "robots"},
           {"robots", std::move(robots)},
           {"note",
            "All to one scale; drag, or W A S D, turns them, + and − zoom. Below, each wing from the shoulder outward, "
            "its leading edge above: "
            "blue the design's, dashed the published one's. A design is limited by a variable at the end of the range "
            "that was searched, or by a figure at its limit: beyond it may lie a better one. Figures are verified."}});
}

/// A row for each figure; three where the judgements differ.
void add_figures(Section& section, const Study& s) {
  struct Row {
    std::string name, title;
    bool strong;
  };
  std::vector<Row> order;
  const auto is_objective = [&](const std::string& name) {
    return std::ranges::count(s.objectives, name, &Objective::figure) > 0;
  };
  for (const bool strong : {true, false})
    for (const Json& f : s.json.at("figures")) {
      const std::string unit = f.at("unit"),
                        title = f.at("words").get<std::string>() + (unit == "1" ? " (-)" : " (" + in_print(unit) + ")");
      if (is_objective(f.at("name")) == strong) order.push_back({f.at("name"), title, strong});
    }
  std::vector<std::string> head = {"", ""};
  for (const Design& d : s.designs) head.push_back(d.name);
  Json rows = Json::array();
  const auto has = [&](const char* judgement, const std::string& name, const auto& fits) {
    return std::ranges::any_of(s.designs, [&](const Design& d) { return fits(d.json.at(judgement).at(name)); });
  };
  for (const Row& r : order) {
    bool same = true, flies = false;
    for (const Design& d : s.designs)
      for (const auto& [judgement, words] : kJudgements) {
        same &= d.json.at(judgement).at(r.name) == d.json.at("figures").at(r.name);
        flies |= number(d.json.at(judgement).at(r.name)) != 0;
      }
    if (r.name == "endurance_s" && !flies) continue;                                    // nothing has a battery
    Json title = r.strong ? Json{{"text", r.title}, {"strong", true}} : Json(r.title);  // of the first row
    for (const auto& [judgement, words] : kJudgements) {
      if (!has(judgement, r.name, [](const Json& x) { return !x.is_null(); })) continue;
      Json row = {std::exchange(title, ""), same ? "" : words};
      for (const Design& d : s.designs)
        row.push_back(cell(number(d.json.at(judgement).at(r.name)), d.at + "/" + judgement + "/" + r.name));
      rows.push_back(std::move(row));
      if (same) break;
    }
  }
  const bool tuned = std::ranges::any_of(s.designs, [](const Design& d) { return !d.json.at("tuned_cost").is_null(); });
  section.add(table("", head, std::move(rows),
                    std::string("Objectives are bold. Verified: flown on other vehicles than those of the search, ") +
                        (tuned ? "with tuned gains" : "gains as searched") +
                        ". Short steps: the same flights, computed with shorter steps of time; what then changes is an "
                        "error of the computation. One row: a figure that no flight changes. –: there is none."));
}

void add_sensitivities(Section& section, const Study& s) {
  Json rows = Json::array(), columns = Json::array();
  for (const Json& v : s.json.at("variables")) rows.push_back(v.at("words"));
  for (const Objective& o : s.objectives)
    columns.push_back(o.words + (o.change_unit().empty() ? "" : " (" + o.change_unit() + ")"));
  double most = 0;
  const auto change = [&](const Design& d, std::size_t variable, std::size_t k) {
    return s.objectives[k].scaled(number(d.json.at("sensitivity").at(variable).at(k)));
  };
  for (const Design& d : s.designs)
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t k = 0; k < s.objectives.size(); ++k) most = std::fmax(most, std::abs(change(d, i, k)));
  section.say(
      "One per cent more of the variable of the row makes the objective of the column so much worse (+) or better (−), "
      "in per "
      "cent of the published robot's; a share of vehicles in percentage points. The darker, the more. –: a choice, or "
      "zero, "
      "or a neighbour that cannot be built.");
  for (const Design& d : s.designs) {
    Json values = Json::array(), texts = Json::array();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      values.push_back(Json::array()), texts.push_back(Json::array());
      for (std::size_t k = 0; k < s.objectives.size(); ++k) {
        const double x = change(d, i, k);
        values.back().push_back(std::isfinite(x) ? Json(std::abs(x)) : Json(nullptr));
        const std::string text = format("%+.2f", x);
        texts.back().push_back(!std::isfinite(x)     ? "–"
                               : std::abs(x) < 0.005 ? "0"
                               : text[0] == '-'      ? "−" + text.substr(1)
                                                     : text);
      }
    }
    section.add(Json{{"kind", "matrix"},
                     {"title", capital(d.name)},
                     {"rows", rows},
                     {"columns", columns},
                     {"values", std::move(values)},
                     {"texts", std::move(texts)},
                     {"most", most > 0 ? most : 1}});
  }
}

void add_given_away(Section& section, const Study& s) {
  Json rows = Json::array();
  for (std::size_t k = 0; k < s.objectives.size(); ++k) {
    const Objective& o = s.objectives[k];
    const double gain = number(s.json.at("given_away").at(k));
    const double scale = o.in_percent() ? std::abs(o.published) : 1;
    const double best = o.published + (o.more_is_better ? gain : -gain) * scale;
    rows.push_back({o.axis(), cell(o.published, "/published/" + o.figure),
                    std::isfinite(gain) ? format("%.3g", best) : std::string("–"),
                    std::isfinite(gain) ? format("%.3g ", o.scaled(gain)) + o.change_unit() : std::string("nothing")});
  }
  section.add(
      table("What the published robot gives away",
            {"objective", "published", "best without another loss", "gives away"}, std::move(rows),
            "As searched: in each row, the best design that is at least as good as the published robot in all other "
            "objectives."));
}

}  // namespace

Section design_section(const fs::path& file) {
  const Json json = read_results(file);
  return of_results(file, kWriter, [&] {
    Section section("design", "A search for robots", file.string());
    const Study s = study_of(file, json);
    const auto ask = [&](const char* question) { section.add(Json{{"kind", "heading"}, {"text", question}}); };
    say_lead(section, s);
    ask("Which designs does nothing beat?");
    add_given_away(section, s);
    for (std::size_t i = 0; i < s.objectives.size(); ++i)
      for (std::size_t k = i + 1; k < s.objectives.size(); ++k) add_pair(section, s, s.objectives[i], s.objectives[k]);
    ask("What do the designs look like?");
    if (const std::size_t all = json.at("designs").size(); all > s.designs.size())
      section.say(format("Of %zu chosen designs the first %zu are shown.", all - 1, s.designs.size() - 1), "note");
    add_robots(section, s, file.parent_path());
    ask("Do the figures hold?");
    add_figures(section, s);
    ask("What does each variable change?");
    add_sensitivities(section, s);
    return section;
  });
}

}  // namespace flappy::view
