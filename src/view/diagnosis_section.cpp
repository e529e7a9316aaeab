#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "flappy/vehicle.hpp"
#include "io/files.hpp"
#include "io/text.hpp"
#include "model/effects/registry.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

constexpr const char* kWriter = "flappy-gap diagnose";
constexpr std::size_t kBars = 10, kShownRows = 6;
constexpr double kLeastShown = 5e-3;
/// More than any flights bring: what it is beside was ruled out.
constexpr double kRuledOut_nats = 1e8;
constexpr std::size_t kLongName = 45;
/// Ratio of residual to noise from which on a shade is the darkest.
constexpr double kDarkest = 10;

const char* place_of(const std::string& effect) {
  constexpr const char* kPlaces[] = {"the body",          "motors, gears and springs",
                                     "the wings' hinges", "the air at the wings",
                                     "loads on the body", "the sensors"};
  // of one kind of vehicle or the other
  model::Vehicle vehicle;
  const model::EffectEntry* entry = model::find_effect(vehicle, effect);
  vehicle.beat_averaged.emplace();
  if (entry == nullptr) entry = model::find_effect(vehicle, effect);
  return entry == nullptr ? "" : kPlaces[static_cast<std::size_t>(entry->info.stage)];
}

/// One line of residuals.csv.
struct Place {
  std::string stage, test, channel, regime, unit;
  double gap = 0, noise = 0;
  bool discovered = false;
  double ratio() const { return noise > 0 ? gap / noise : 0; }
};

std::vector<Place> read_places(const std::filesystem::path& file) {
  const TextTable table = read_text_table(file);
  std::vector<Place> places;
  for (const TextRow& row : table.rows)
    places.push_back({table.cell(row, "stage"), table.cell(row, "test"), table.cell(row, "channel"),
                      table.cell(row, "regime"), in_print(table.cell(row, "unit")), table.number(row, "gap"),
                      table.number(row, "noise_floor"), table.cell(row, "discovered") == "1"});
  return places;
}

/// A hypothesis, from diagnosis.json and, where it is there, candidates.csv.
struct Rival {
  std::string name;  ///< in words
  bool effect = false;
  double probability = 0, log_evidence = 0;
  std::optional<double> closure, closure_low, closure_high;
  std::vector<std::string> effects;
  Json sizes;
  std::string at;  ///< JSON pointer
};

/// Effects joined by +, or a kind of hypothesis without one.
std::string rival_words(const std::string& name) {
  if (name == "none") return "no gap";
  if (name == "parameters") return "parameters alone";
  if (name == "unknown") return "something unknown";
  std::string words = spoken(name);
  for (std::size_t at = 0; (at = words.find('+', at)) != std::string::npos; at += 5) words.replace(at, 1, " and ");
  return words;
}

std::vector<Rival> read_rivals(const Json& json, const TextTable& table) {
  std::vector<Rival> rivals;
  const Json& list = json.at("candidates");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Json& c = list[i];
    Rival r;
    r.effects = c.at("effects").get<std::vector<std::string>>();
    r.effect = !r.effects.empty();
    std::vector<std::string> words;
    for (const std::string& e : r.effects) words.push_back(spoken(e));
    r.name = r.effect ? spoken_list(words) + (c.at("remainder").get<bool>() ? ", and more" : "")
                      : rival_words(c.at("group"));
    r.probability = c.at("probability");
    r.log_evidence = c.at("log_evidence");
    r.sizes = c.at("parameters");
    r.at = "/candidates/" + std::to_string(i);
    if (!c.at("closure").is_null()) r.closure = c.at("closure").get<double>();
    for (const TextRow& row : table.rows)
      if (table.cell(row, "rank") == std::to_string(i + 1)) {
        if (const double x = table.number(row, "closure_low"); std::isfinite(x)) r.closure_low = x;
        if (const double x = table.number(row, "closure_high"); std::isfinite(x)) r.closure_high = x;
        break;
      }
    rivals.push_back(std::move(r));
  }
  std::ranges::stable_sort(rivals, std::greater{}, &Rival::probability);
  return rivals;
}

/// "right_flap velocity_y", a product -> "right flap × velocity y"; "cos heading" is one function.
std::string function_words(const std::string& function) {
  std::string words;
  for (std::size_t at = 0; at < function.size();) {
    const std::size_t end = std::min(function.find(' ', at), function.size());
    const bool of_next = words.ends_with("cos") || words.ends_with("sin");
    words += (words.empty() ? "" : of_next ? " " : " × ") + spoken(function.substr(at, end - at));
    at = end + 1;
  }
  return words;
}

/// "height 0.5029 to 0.6074 m" -> "height, middle third": where the thirds lie differs with the beats that a channel has.
std::string third_of(const std::string& regime) {
  const std::size_t figure = regime.find_first_of("-0123456789");
  std::string quantity = regime.substr(0, figure);
  const char* which = ", middle third";
  for (const auto& [word, third] : {std::pair{" below ", ", low third"}, {" above ", ", high third"}})
    if (quantity.ends_with(word)) {
      quantity.resize(quantity.size() - std::string(word).size());
      which = third;
    }
  if (!quantity.empty() && quantity.back() == ' ') quantity.pop_back();
  return quantity + which;
}

class Story {
 public:
  Story(const std::filesystem::path& file, const Json& json)
      : json_(json),
        places_(read_places(file.parent_path() / "residuals.csv")),
        rivals_(read_rivals(json, read_text_table(file.parent_path() / "candidates.csv"))),
        section_("diagnosis", "Diagnosis", file.string()) {
    // those that have a beat are looked at by its harmonics
    by_the_beat_ = json.contains("validation") ||
                   (!places_.empty() && std::ranges::find(places_, "phase", &Place::test) == places_.end());
  }

  Section tell() {
    tell_verdict();
    if (json_.at("verdict").at("kind") == "data") {
      tell_faults();
      return std::move(section_);
    }
    tell_where();
    tell_which();
    tell_how_far();
    if (json_.contains("validation")) tell_validation(section_, json_);
    tell_next();
    return std::move(section_);
  }

 private:
  void ask(const std::string& question) { section_.add(Json{{"kind", "heading"}, {"text", question}}); }

  std::string concluded() const {
    std::vector<std::string> names;
    for (const Json& e : json_.at("verdict").at("effects")) names.push_back(spoken(e.get<std::string>()));
    return spoken_list(names, json_.at("verdict").at("kind") == "group" ? "or" : "and");
  }

  void tell_verdict() {
    const Json& v = json_.at("verdict");
    const std::string kind = v.at("kind");
    const double p = v.at("probability");
    std::string text;
    if (kind == "effect") {
      text = "The model lacks " + concluded() + (v.at("remainder").get<bool>() ? ", and something more" : "") + ".";
    } else if (kind == "group") {
      text = "The model lacks one of " + concluded() + ": these flights cannot tell them apart.";
    } else if (kind == "parameters") {
      text = "The model lacks nothing, but its parameters are off.";
    } else if (kind == "none") {
      text = "There is no gap beyond noise: the vehicle's file explains the flights.";
    } else if (kind == "unknown") {
      text = "The model lacks something that no entry of the catalogue explains.";
    } else {
      text = "The recordings are at fault, so nothing was diagnosed.";
    }
    section_.say(text, "lead");
    if (kind != "data")
      section_.say(format("Probability %.2f%s, from %zu flights.", p, p < 0.5 ? ", no more than a guess" : "",
                          json_.at("flights").size()));
    if (json_.contains("complete"))
      section_.say(
          "It was stopped before every effect was weighed: this is no verdict, only what was weighed until then.");
  }

  void tell_faults() {
    Json rows = Json::array();
    for (const Json& f : json_.at("data_faults"))
      rows.push_back({f.at("what"), f.at("file").get<std::string>() + ":" + std::to_string(f.at("line").get<int>())});
    section_.add(table("What forbids a diagnosis", {"fault", "where"}, std::move(rows)));
    section_.say("Next: mend the logs, until flappy-gap check finds no fault.");
  }

  std::vector<const Place*> of(const std::string& stage, const std::string& test) const {
    std::vector<const Place*> list;
    for (const Place& p : places_)
      if (p.stage == stage && p.test == test) list.push_back(&p);
    return list;
  }

  void tell_where() {
    ask("Where is the gap?");
    const Json& where = json_.at("where");
    if (where.empty()) {
      section_.say("With parameters refitted nothing stands out of the noise.");
    } else {
      const Json& first = where[0];
      const double gap = first.at("gap"), noise = first.at("noise_floor");
      section_.say(
          format("With the vehicle's parameters refitted, the %s is still off by %.3g where noise alone makes %.3g "
                 "(%.1f times): %s.",
                 channel_words(first.at("channel")).c_str(), gap, noise, gap / noise,
                 first.at("regime").get<std::string>().c_str()));
    }
    Json parts = Json::array();
    std::map<std::string, Json> strongest;
    for (const Place* p : of("refit", "channel"))
      strongest[p->channel] = {{"ratio", p->ratio()}, {"text", "over all beats"}};
    for (std::size_t i = 0; i < where.size(); ++i) {
      const Json& w = where[i];
      const double ratio = w.at("gap").get<double>() / w.at("noise_floor").get<double>();
      Json& best = strongest[w.at("channel")];
      if (best.is_null() || ratio > best.at("ratio").get<double>())
        best = {{"ratio", ratio},
                {"text",
                 w.at("regime").get<std::string>() + format(": %.3g against %.3g of noise", w.at("gap").get<double>(),
                                                            w.at("noise_floor").get<double>())}};
    }
    for (auto& [channel, part] : strongest) {
      part["channel"] = channel;
      part["name"] = channel_words(channel);
      part["short"] =
          channel.starts_with("path") || channel.starts_with("rotate") ? spoken(channel) : channel_words(channel);
      parts.push_back(part);
    }
    if (parts.empty()) return;
    section_.add(Json{
        {"kind", "anatomy"},
        {"parts", parts},
        {"wings", !by_the_beat_},
        {"note",
         std::string("What is left after refitting the parameters, over noise (1×: noise alone), where it stands out "
                     "most. Grey: within noise; orange and thick: ten times noise.") +
             (by_the_beat_
                  ? " The vehicle is known as means over its beats: its body is a sign, and no wings are drawn."
                  : "")}});
    add_heat("phase", "When in the beat", false,
             "Rms of residual over noise, parameters refitted. Shaded: more than chance (5 % false discoveries).");
    add_heat("regime", "While doing what", true, "The same in thirds of the beats, by what the robot did.");
    add_regimes();
  }

  /// Residual over noise: a row for each channel that stands out, a column for each place.
  void add_heat(const char* test, const char* title, bool tilted, const char* note) {
    std::vector<std::string> channels, columns;
    std::set<std::string> off;
    const auto column_of = [&](const Place& p) { return tilted ? third_of(p.regime) : p.regime; };
    for (const Place* p : of("refit", test)) {
      if (p->discovered) off.insert(p->channel);
      if (std::ranges::find(columns, column_of(*p)) == columns.end()) columns.push_back(column_of(*p));
    }
    for (const Place* p : of("refit", test))
      if (off.contains(p->channel) && std::ranges::find(channels, p->channel) == channels.end())
        channels.push_back(p->channel);
    if (channels.empty()) return;
    Json values = Json::array(), texts = Json::array(), rows = Json::array(), names = Json::array();
    for (const std::string& column : columns) names.push_back(column.substr(0, column.find(" of the beat", 1)));
    if (!tilted) names[0] = "mean";
    for (const std::string& c : channels) {
      rows.push_back(channel_words(c));
      Json v = Json::array(), t = Json::array();
      for (const std::string& column : columns) {
        const Place* here = nullptr;
        for (const Place* p : of("refit", test))
          if (p->channel == c && column_of(*p) == column) here = p;
        const bool stands_out = here != nullptr && here->discovered;
        v.push_back(stands_out ? Json(std::log10(std::max(1.0, here->ratio()))) : Json(nullptr));
        t.push_back(here == nullptr ? "" : format(here->ratio() < 9.95 ? "%.1f" : "%.0f", here->ratio()));
      }
      values.push_back(v), texts.push_back(t);
    }
    section_.add(Json{{"kind", "matrix"},
                      {"title", title},
                      {"rows", rows},
                      {"columns", names},
                      {"values", values},
                      {"texts", texts},
                      {"most", std::log10(kDarkest)},
                      {"tilted", tilted},
                      {"note", note}});
  }

  /// The channel that depends most on what the robot did, beside its noise.
  void add_regimes() {
    std::map<std::string, std::map<std::string, std::pair<double, double>>> reach;  // [channel][quantity], over noise
    for (const Place* p : of("refit", "regime")) {
      const std::string third = third_of(p->regime);
      auto [at, fresh] = reach[p->channel].try_emplace(third.substr(0, third.find(',')), p->ratio(), p->ratio());
      at->second = {std::min(at->second.first, p->ratio()), std::max(at->second.second, p->ratio())};
    }
    const Place* most = nullptr;
    double widest = 0;
    for (const Place* p : of("refit", "regime"))
      if (p->discovered)
        for (const auto& [quantity, ends] : reach[p->channel])
          if (ends.second - ends.first > widest) widest = ends.second - ends.first, most = p;
    if (most == nullptr) return;
    Figure f{.id = "regimes",
             .title = "The " + channel_words(most->channel) + " by what the robot did",
             .note = "Rms of the residual in thirds of the beats; the line is noise alone.",
             .x = {.title = "residual, rms (" + most->unit + ")", .low = 0.0},
             .y = {},
             .categories = {},
             .series = {}};
    Series gap{.name = "parameters refitted",
               .draw = Draw::bars,
               .colour = Colour::blue,
               .x = {},
               .y = {},
               .low = {},
               .high = {}};
    Series noise{.name = "noise alone", .colour = Colour::black, .x = {}, .y = {}, .low = {}, .high = {}};
    for (const Place* p : of("refit", "regime")) {
      if (p->channel != most->channel) continue;
      const std::size_t k = f.categories.size();
      f.categories.push_back(p->regime);
      gap.x.push_back(p->gap), gap.y.push_back(near_category(k));
      noise.x.insert(noise.x.end(), {p->noise, p->noise});
      noise.y.insert(noise.y.end(), {static_cast<double>(k) - 0.5, static_cast<double>(k) + 0.5});
    }
    f.series = {gap, noise};
    section_.add(f);
  }

  const Rival* named(const std::string& name) const {
    for (const Rival& r : rivals_)
      if (r.name == name) return &r;
    return nullptr;
  }

  void tell_which() {
    ask("Which effect causes it?");
    std::vector<std::string> told;
    for (const Rival& r : rivals_)
      if (r.probability >= 0.05) told.push_back(format("%s (%.2f)", r.name.c_str(), r.probability));
    section_.say("Weighed against these flights: " + spoken_list(told) + "; everything else has less than 0.05.");
    Figure f{
        .id = "probabilities",
        .title = "Probability of each explanation",
        .note = "All explanations sum to 1; what has less than 0.005 is left out.",
        .x = {.title = "probability", .low = 0.0, .high = 1.0},
        .y = {},
        .categories = {},
        .series = {{.name = "", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
    for (const Rival& r : rivals_) {
      if (f.categories.size() == kBars || r.probability < kLeastShown) break;
      f.series[0].x.push_back(r.probability);
      f.series[0].y.push_back(near_category(f.categories.size()));
      f.categories.push_back(r.name);
    }
    section_.add(f);
    add_rivals();
    add_sizes();
  }

  /// What speaks for and against each.
  void add_rivals() {
    const Rival* refit = named("parameters alone");
    double best = -std::numeric_limits<double>::infinity();
    for (const Rival& r : rivals_) best = std::max(best, r.log_evidence);
    Json rows = Json::array();
    for (const Rival& r : rivals_) {
      if (rows.size() == kShownRows || (r.probability < kLeastShown && rows.size() >= 3)) break;
      std::vector<std::string> pro, con;
      if (refit != nullptr && r.log_evidence > refit->log_evidence + kRuledOut_nats)
        pro.push_back("rules out parameters alone");
      else if (refit != nullptr && &r != refit && r.log_evidence > refit->log_evidence)
        pro.push_back(format("%.0f nats more than parameters alone", r.log_evidence - refit->log_evidence));
      if (r.closure && *r.closure > 0)
        pro.push_back(format("closes %.0f %% of what refitting leaves", 100 * *r.closure));
      if (r.log_evidence < best - kRuledOut_nats) con.push_back("ruled out");
      else if (r.log_evidence < best) con.push_back(format("%.0f nats less than the best", best - r.log_evidence));
      if (r.closure && *r.closure <= 0)
        con.push_back(format("closes nothing of what refitting leaves (%.0f %%)", 100 * *r.closure));
      for (const auto& [name, size] : r.sizes.items())
        if (size.at("low").get<double>() <= 0 && size.at("high").get<double>() >= 0)
          con.push_back(size_words(name.substr(name.find('.') + 1), size.at("unit")) + " may be 0");
      std::set<std::string> at;
      for (const std::string& e : r.effects) at.insert(place_of(e));
      rows.push_back({r.name, cell(r.probability, r.at + "/probability"), spoken_list({at.begin(), at.end()}),
                      spoken_list(pro), spoken_list(con)});
    }
    section_.add(table("What speaks for and against", {"explanation", "probability", "acts on", "for", "against"},
                       std::move(rows), "A nat is a factor of 2.7 of evidence, before doubt in the model is counted."));
  }

  void add_sizes() {
    for (const Rival& r : rivals_) {
      if (!r.effect) continue;
      Json rows = Json::array();
      for (const auto& [name, s] : r.sizes.items()) {
        const std::string at = r.at + "/parameters/" + name;
        rows.push_back({size_words(name, s.at("unit")), cell(s.at("value"), at + "/value"),
                        cell(s.at("low"), at + "/low"), cell(s.at("high"), at + "/high"), in_print(s.at("unit"))});
      }
      if (rows.empty()) return;
      section_.add(table("Size of " + r.name, {"parameter", "value", "90 % from", "to", "unit"}, std::move(rows)));
      return;
    }
  }

  void tell_how_far() {
    ask("How far does the gap shrink?");
    const Json& gap = json_.at("gap");
    const auto number = [&](const char* key) {
      return gap.at(key).is_null() ? std::numeric_limits<double>::quiet_NaN() : gap.at(key).get<double>();
    };
    // only what was fitted has a closure
    auto best = std::ranges::find_if(rivals_, [](const Rival& r) { return r.effect && r.closure; });
    if (best == rivals_.end()) best = std::ranges::find(rivals_, true, &Rival::effect);
    const std::string with = best == rivals_.end() ? "best effect" : best->name;
    if (!gap.at("closure").is_null() && number("closure") <= 0)
      section_.say(format(
          "With %s the model closes nothing of what refitted parameters leave (%.0f %%, 90 %%: %.0f to %.0f %%).",
          with.c_str(), 100 * number("closure"), 100 * number("closure_low"), 100 * number("closure_high")));
    else if (!gap.at("closure").is_null())
      section_.say(format(
          "With %s the model closes %.0f %% of what refitted parameters leave (90 %%: %.0f to %.0f %%), on flights "
          "that the fit did not see.",
          with.c_str(), 100 * number("closure"), 100 * number("closure_low"), 100 * number("closure_high")));
    else section_.say("How much of the gap an effect closes cannot be told from noise.");
    const std::string brief = with.size() > kLongName ? "these effects" : with;
    const std::vector<std::pair<std::string, const char*>> stages = {{"vehicle's file", "nominal"},
                                                                     {"parameters refitted", "refit"},
                                                                     {"with " + brief, "effect"},
                                                                     {"noise alone", "noise_floor"}};
    Figure f{
        .id = "loss",
        .title = "Loss on flights held out",
        .note = "Mean Huber loss of residual over noise, each flight under the fit to the others.",
        .x = {.title = "loss (-)", .low = 0.0},
        .y = {},
        .categories = {},
        .series = {{.name = "", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
    for (const auto& [name, key] : stages) {
      if (!std::isfinite(number(key))) continue;
      f.series[0].x.push_back(number(key));
      f.series[0].y.push_back(near_category(f.categories.size()));
      f.categories.push_back(name);
    }
    section_.add(f);
    add_channels(brief);
    add_closed_loop();
  }

  void add_channels(const std::string& with) {
    const std::pair<const char*, std::string> stages[] = {
        {"nominal", "vehicle's file"}, {"refit", "parameters refitted"}, {"effect", "with " + with}};
    constexpr Colour kStageColours[] = {Colour::grey, Colour::vermillion, Colour::blue};
    Figure f{.id = "channels",
             .title = "Residual by channel, before and after",
             .note = "Rms of the residual over that of noise, all beats: 1 is noise alone.",
             .x = {.title = "residual over noise (-)", .log = true, .low = 0.5},
             .y = {},
             .categories = {},
             .series = {}};
    std::vector<std::string> channels;
    for (const Place* p : of("nominal", "channel")) channels.push_back(p->channel);
    for (const std::string& c : channels) f.categories.push_back(channel_words(c));
    for (std::size_t s = 0; s < 3; ++s) {
      Series series{.name = stages[s].second,
                    .draw = Draw::bars,
                    .colour = kStageColours[s],
                    .x = {},
                    .y = {},
                    .low = {},
                    .high = {}};
      for (const Place* p : of(stages[s].first, "channel")) {
        const auto k = static_cast<std::size_t>(std::ranges::find(channels, p->channel) - channels.begin());
        series.x.push_back(p->ratio());
        series.y.push_back(near_category(k, s, 3));
      }
      if (!series.x.empty()) f.series.push_back(std::move(series));
    }
    if (channels.empty()) return;
    const auto n = static_cast<double>(channels.size());
    f.series.push_back(
        {.name = "noise alone", .colour = Colour::black, .x = {1, 1}, .y = {-0.5, n - 0.5}, .low = {}, .high = {}});
    section_.add(f);
  }

  void add_closed_loop() {
    const Json& list = json_.at("closed_loop");
    Json rows = Json::array();
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Json& c = list[i];
      const auto at = [&](const char* key) {
        const std::string pointer = "/closed_loop/" + std::to_string(i) + "/" + key;
        return c.at(key).is_null() ? Json("–") : cell(c.at(key), pointer);
      };
      rows.push_back({c.at("flight"), spoken(c.at("quantity").get<std::string>()), at("recorded"), at("nominal"),
                      at("corrected")});
    }
    if (!rows.empty())
      section_.add(table("In closed loop, predicted against recorded",
                         {"flight", "quantity", "recorded", "vehicle's file", "corrected"}, std::move(rows),
                         "The vehicle's file and the corrected one fly the recorded path under our controller."));
  }

  /// How two rivals would fly the next experiment, in what differs most.
  void add_courses(const Json& next, const std::vector<std::string>& rivals) {
    if (!next.contains("courses")) return;  // of a diagnosis of old
    const double step_s = next.at("course_step_s");
    for (std::size_t k = 0; k < std::min<std::size_t>(2, next.at("courses").size()); ++k) {
      const Json& c = next.at("courses")[k];
      const std::string quantity = c.at("quantity");
      const std::size_t cut = quantity.find_last_of('_');
      const std::string unit = quantity.ends_with("_V") ? "V" : quantity.ends_with("_m") ? "m" : "share of a beat";
      const std::string name = spoken(unit.size() > 1 ? quantity : quantity.substr(0, cut));
      Figure f{.id = "next_" + quantity,
               .title = "What the next flight would show: " + name,
               .note = "As each rival would fly it under our controller; means over a tenth of a second.",
               .x = {.title = "time (s)"},
               .y = {.title = name + " (" + unit + ")"},
               .categories = {},
               .series = {}};
      const std::pair<const char*, Colour> kSides[] = {{"first", Colour::blue}, {"second", Colour::vermillion}};
      for (std::size_t i = 0; i < 2; ++i) {
        Series s{.name = "if it is " + rivals[i],
                 .colour = kSides[i].second,
                 .x = {},
                 .y = c.at(kSides[i].first).get<std::vector<double>>(),
                 .low = {},
                 .high = {}};
        for (std::size_t n = 0; n < s.y.size(); ++n) s.x.push_back(step_s * (static_cast<double>(n) + 0.5));
        f.series.push_back(std::move(s));
      }
      section_.add(f);
    }
  }

  void tell_next() {
    ask("What to fly next?");
    const std::string kind = json_.at("verdict").at("kind");
    const Json& next = json_.at("next_experiment");
    if (!next.is_null()) {
      std::vector<std::string> rivals;
      for (const Json& r : next.at("separates")) rivals.push_back(rival_words(r));
      const std::string name = next.at("manoeuvre");
      section_.say(format("Of the experiments that are ready, “%s” tells %s best apart: %.3g nats are expected of it.",
                          spoken(name).c_str(), spoken_list(rivals).c_str(), next.at("expected_nats").get<double>()));
      add_courses(next, rivals);
      section_.say("It is configs/gap/experiments/" + name + ".toml. Diagnose old and new flights together.");
    } else if (by_the_beat_) {
      // the experiments that are ready are flown in simulation, and nothing flies such a vehicle there
      section_.say(kind == "effect" || kind == "parameters"
                       ? "Predict with vehicle_corrected.toml, and see on new flights whether it holds: diagnose these "
                         "with the same --vehicle as now."
                       : "Fly harder manoeuvres, and diagnose old and new flights together.");
    } else if (kind == "effect" || kind == "parameters") {
      section_.say(
          "No rival is left to be told apart: train or fly on with vehicle_corrected.toml, as with flappy-train CONFIG "
          "--set vehicle=DIR/vehicle_corrected.toml.");
    } else {
      section_.say("Nothing is left to be told apart: fly harder manoeuvres to look further.");
    }
    const Json& terms = json_.at("unexplained").at("terms");
    if (terms.empty()) return;
    Json rows = Json::array();
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const Json& t = terms[i];
      const std::string harmonic = t.at("harmonic"), at = "/unexplained/terms/" + std::to_string(i);
      Json row = {channel_words(t.at("channel"))};
      if (!by_the_beat_) row.push_back(harmonic == "0" ? "mean of the beat" : "harmonic " + harmonic);
      row.insert(row.end(), {Json(function_words(t.at("function"))), cell(t.at("times_usual"), at + "/times_usual"),
                             cell(t.at("gain_nats"), at + "/gain_nats")});
      rows.push_back(std::move(row));
    }
    std::vector<std::string> head = {"channel", "part of the beat", "grows with", "times the usual error",
                                     "gain (nats)"};
    if (by_the_beat_) head.erase(head.begin() + 1);
    std::vector<std::string> beside;
    for (const Json& e : json_.at("unexplained").at("jointly_with")) beside.push_back(spoken(e.get<std::string>()));
    section_.add(table("On what the unexplained depends", head, std::move(rows),
                       beside.empty() ? "Of what is left with parameters alone refitted."
                                      : "Of what is left beside " + spoken_list(beside) + "."));
  }

  const Json& json_;
  std::vector<Place> places_;
  std::vector<Rival> rivals_;
  Section section_;
  bool by_the_beat_ = false;  ///< the robot is known as means over its beats, without wings
};

}  // namespace

Section diagnosis_section(const std::filesystem::path& file) {
  const Json json = read_results(file);
  return of_results(file, kWriter, [&] { return Story(file, json).tell(); });
}

}  // namespace flappy::view
