#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "flappy/vehicle.hpp"
#include "gap/result/diagnosis_json.hpp"
#include "gap/result/sentences.hpp"
#include "io/files.hpp"
#include "io/text.hpp"
#include "model/effects/registry.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

constexpr std::size_t kBars = 10, kShownRows = 6, kMaxWhere = 20;
constexpr double kMinShown = 5e-3, kMinListed = 0.05;  ///< smallest probabilities drawn, and listed
/// A difference of evidence that no flights bring: it means that a hypothesis was ruled out.
constexpr double kRuledOut_nats = 1e8;
constexpr std::size_t kLongName = 45;
constexpr double kDarkest = 10;  ///< residual over noise from which on the shade is the darkest

const char* place_of(const std::string& effect) {
  constexpr const char* kPlaces[] = {"the body",          "motors, gears and springs",
                                     "the wings' hinges", "the air at the wings",
                                     "loads on the body", "the sensors"};
  // look among the effects of vehicles with wings, then of beat-averaged vehicles
  model::Vehicle vehicle;
  const model::CatalogueEffect* entry = model::find_effect(vehicle, effect);
  vehicle.beat_averaged.emplace();
  if (entry == nullptr) entry = model::find_effect(vehicle, effect);
  return entry == nullptr ? "" : kPlaces[static_cast<std::size_t>(entry->info.stage)];
}

double over_noise(const gap::ResidualLocation& l) { return l.noise_floor > 0 ? l.gap / l.noise_floor : 0; }

struct Rival {
  std::string name;
  const gap::RankedHypothesis* hypothesis;
  std::string pointer;  ///< JSON pointer
  bool effect() const { return hypothesis->kind == gap::HypothesisKind::effect; }
};

std::vector<Rival> rivals_of(const gap::Diagnosis& d) {
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < d.hypotheses.size(); ++i) {
    const gap::RankedHypothesis& h = d.hypotheses[i];
    rivals.push_back({hypothesis_words(h, spoken), &h, "/hypotheses/" + std::to_string(i)});
  }
  std::ranges::stable_sort(rivals, std::greater{}, [](const Rival& r) { return r.hypothesis->probability; });
  return rivals;
}

/// A basis function in words: "right_flap velocity_y" -> "right flap × velocity y"; "cos heading" is one function.
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

/// "height, middle third"; no bounds, because they differ between channels with the beats that these have.
std::string third_words(const gap::Regime& r) {
  constexpr const char* kThirds[] = {"", ", low third", ", middle third", ", high third"};
  return r.quantity + kThirds[static_cast<int>(r.third)];
}

class DiagnosisSection {
 public:
  DiagnosisSection(const std::filesystem::path& file, const gap::Diagnosis& diagnosis)
      : diagnosis_(diagnosis), rivals_(rivals_of(diagnosis)), section_("diagnosis", "Diagnosis", file.string()) {
    // only vehicles with wings are tested by the harmonics of the beat
    beat_averaged_ = diagnosis.validation ||
                     (!diagnosis.locations.empty() && of(gap::Fitted::refit, gap::ResidualTest::phase).empty());
  }

  Section composed() {
    if (!diagnosis_.seen.empty()) add_seen();
    add_verdict();
    if (diagnosis_.verdict.kind == gap::VerdictKind::data) {
      add_faults();
      return std::move(section_);
    }
    add_where();
    add_which();
    add_how_far();
    if (diagnosis_.validation) add_validation(section_, diagnosis_);
    add_next();
    return std::move(section_);
  }

 private:
  using Location = gap::ResidualLocation;

  void ask(const std::string& question) { section_.add(Json{{"kind", "heading"}, {"text", question}}); }

  /// What changed, whatever the cause.
  void add_seen() {
    ask("What is seen?");
    const std::vector<std::string> told = seen_words(diagnosis_.seen, spoken);
    section_.say(
        told.empty() ? "Nothing beyond what sessions of this robot differ by." : "Most of all, " + told.front() + ".",
        "lead");
    for (const gap::OddFlight& o : diagnosis_.odd) section_.say(gap::capitalised(odd_words(o, spoken)) + ".");
    Figure f{
        .id = "seen",
        .title = "What differs from the reference",
        .note = "In standard deviations by which sessions of this robot differ while nothing is done to it.",
        .x = {.title = "times what sessions differ by"},
        .y = {},
        .categories = {},
        .series = {{.name = "", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
    Json rows = Json::array();
    for (const gap::SeenQuantity& s : diagnosis_.seen) {
      f.series[0].x.push_back(s.times());
      f.series[0].y.push_back(near_category(f.categories.size()));
      f.categories.push_back(spoken(s.name));
      const auto value = [&](double v) { return in_print(seen_value(s, v, false)); };
      rows.push_back(
          {spoken(s.name), value(s.reference), value(s.tests), value(s.scatter), format("%+.1f", s.times())});
    }
    section_.add(f);
    section_.add(table("What differs from the reference, in numbers",
                       {"quantity", "reference", "flights", "sessions differ by", "times"}, std::move(rows)));
  }

  void add_verdict() {
    const gap::Verdict& v = diagnosis_.verdict;
    const std::size_t references = diagnosis_.reference.size();
    section_.say(verdict_words(v, references > 0, spoken, any_told(diagnosis_.seen)) + ".", "lead");
    if (v.kind != gap::VerdictKind::data)
      section_.say(format("%s, from %zu flights%s.", gap::capitalised(gap::probability_words(v.probability)).c_str(),
                          diagnosis_.flights.size(),
                          references > 0 ? format(" and %zu of the reference", references).c_str() : ""));
    for (const gap::NamedDiagnosis& s : diagnosis_.sets)
      section_.say(s.name + ": " + verdict_words(s.diagnosis.verdict, true, spoken) + " (" +
                   gap::probability_words(s.diagnosis.verdict.probability) + ").");
    for (const std::string& w : diagnosis_.warnings) section_.say("Warning: " + w + ".");
    if (references == 0 && v.kind != gap::VerdictKind::effect && !diagnosis_.suspects.empty())
      section_.say(gap::capitalised(suspects_words(diagnosis_.suspects, spoken)) + ". " +
                   gap::capitalised(gap::kReferenceDecides) + ".");
    if (!diagnosis_.complete) section_.say(gap::capitalised(gap::kStopped) + ": " + gap::kNoVerdict + ".");
  }

  void add_faults() {
    Json rows = Json::array();
    for (const flightlog::DataFault& f : diagnosis_.faults)
      rows.push_back({f.what, f.file + ":" + std::to_string(f.line)});
    section_.add(table("What forbids a diagnosis", {"fault", "where"}, std::move(rows)));
    section_.say(gap::capitalised(gap::kMendLogs) + ".");
  }

  std::vector<const Location*> of(gap::Fitted fitted, gap::ResidualTest test) const {
    std::vector<const Location*> list;
    for (const Location& l : diagnosis_.locations)
      if (l.fitted == fitted && l.test == test) list.push_back(&l);
    return list;
  }
  std::vector<const Location*> refitted(gap::ResidualTest test) const { return of(gap::Fitted::refit, test); }

  void add_where() {
    ask("Where is the gap?");
    const std::vector<Location> where = largest_discoveries(diagnosis_, gap::Fitted::refit, kMaxWhere);
    if (where.empty()) {
      section_.say(gap::capitalised(gap::kNothingStandsOut) + ".");
    } else {
      const Location& first = where.front();
      section_.say(
          format("With the vehicle's parameters refitted, the %s is still off by %.3g %s where noise alone makes %.3g "
                 "(%.1f times): %s.",
                 channel_words(first.channel).c_str(), first.gap, in_print(first.unit).c_str(), first.noise_floor,
                 first.gap / first.noise_floor, text_of(first.regime, first.test).c_str()));
    }
    Json parts = Json::array();
    std::map<std::string, Json> strongest;
    for (const Location* l : refitted(gap::ResidualTest::channel))
      strongest[l->channel] = {{"ratio", over_noise(*l)}, {"text", "over all beats"}};
    for (const Location& l : where) {
      const double ratio = l.gap / l.noise_floor;
      Json& best = strongest[l.channel];
      if (best.is_null() || ratio > best.at("ratio").get<double>())
        best = {{"ratio", ratio},
                {"text", text_of(l.regime, l.test) + format(": %.3g against %.3g %s of noise", l.gap, l.noise_floor,
                                                            in_print(l.unit).c_str())}};
    }
    for (auto& [channel, part] : strongest) {
      part["channel"] = channel;
      part["name"] = channel_words(channel);
      const bool long_name =
          channel.starts_with("specific_force") || channel.starts_with("path") || channel.starts_with("rotate");
      part["short"] = long_name ? spoken(channel) : channel_words(channel);
      parts.push_back(part);
    }
    add_ladder();
    if (parts.empty()) return;
    section_.add(Json{
        {"kind", "anatomy"},
        {"parts", parts},
        {"wings", !beat_averaged_},
        {"note",
         std::string("What is left after refitting the parameters, over noise (1×: noise alone), where it stands out "
                     "most. Grey: within noise; orange and thick: ten times noise.") +
             (beat_averaged_
                  ? " The vehicle is known as means over its beats: its body is a sign, and no wings are drawn."
                  : "")}});
    add_heat(gap::ResidualTest::phase, "When in the beat", false,
             "Rms of residual over noise, parameters refitted. Shaded: more than chance (5 % false discoveries).");
    add_heat(gap::ResidualTest::regime, "While doing what", true,
             "The same in thirds of the beats, by what the robot did.");
    add_regimes();
  }

  /// Adds the table of the rungs at which the vehicle leaves the robot.
  void add_ladder() {
    if (diagnosis_.ladder.empty()) return;
    const auto times = [](const std::optional<double>& e) { return e ? format("%.1f", *e) : std::string("not seen"); };
    Json rows = Json::array();
    for (const gap::LadderRung& r : diagnosis_.ladder)
      rows.push_back({r.rung, times(r.nominal), times(r.refit), times(r.effect), format("%.2f", r.probability)});
    section_.add(table(
        "Where the vehicle leaves the robot: error over noise, from the cause down",
        {"rung", "vehicle's file", "parameters refitted", "with the best effect", "probability of an effect there"},
        std::move(rows)));
  }

  /// Adds a matrix of residual over noise: a row for each channel that exceeds noise, a column for each place.
  void add_heat(gap::ResidualTest test, const char* title, bool tilted, const char* note) {
    std::vector<std::string> channels, columns;
    std::set<std::string> off;
    const auto column_of = [&](const Location& l) { return tilted ? third_words(l.regime) : text_of(l.regime, test); };
    const std::vector<const Location*> all = refitted(test);
    for (const Location* l : all) {
      if (l->discovered) off.insert(l->channel);
      if (std::ranges::find(columns, column_of(*l)) == columns.end()) columns.push_back(column_of(*l));
    }
    for (const Location* l : all)
      if (off.contains(l->channel) && std::ranges::find(channels, l->channel) == channels.end())
        channels.push_back(l->channel);
    if (channels.empty()) return;
    Json values = Json::array(), texts = Json::array(), rows = Json::array(), names = Json::array();
    for (const std::string& column : columns) names.push_back(column.substr(0, column.find(" of the beat", 1)));
    if (!tilted) names[0] = "mean";
    for (const std::string& c : channels) {
      rows.push_back(channel_words(c));
      Json v = Json::array(), t = Json::array();
      for (const std::string& column : columns) {
        const Location* here = nullptr;
        for (const Location* l : all)
          if (l->channel == c && column_of(*l) == column) here = l;
        const bool stands_out = here != nullptr && here->discovered;
        v.push_back(stands_out ? Json(std::log10(std::max(1.0, over_noise(*here)))) : Json(nullptr));
        t.push_back(here == nullptr ? "" : format(over_noise(*here) < 9.95 ? "%.1f" : "%.0f", over_noise(*here)));
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

  /// Adds the figure of the channel whose residual depends most on the regime, next to its noise.
  void add_regimes() {
    const std::vector<const Location*> all = refitted(gap::ResidualTest::regime);
    std::map<std::string, std::map<std::string, std::pair<double, double>>> reach;  // [channel][quantity], over noise
    for (const Location* l : all) {
      auto [at, fresh] = reach[l->channel].try_emplace(l->regime.quantity, over_noise(*l), over_noise(*l));
      at->second = {std::min(at->second.first, over_noise(*l)), std::max(at->second.second, over_noise(*l))};
    }
    const Location* most = nullptr;
    double widest = 0;
    for (const Location* l : all)
      if (l->discovered)
        for (const auto& [quantity, ends] : reach[l->channel])
          if (ends.second - ends.first > widest) widest = ends.second - ends.first, most = l;
    if (most == nullptr) return;
    Figure f{.id = "regimes",
             .title = "The " + channel_words(most->channel) + " by what the robot did",
             .note = "Rms of the residual in thirds of the beats; the line is noise alone.",
             .x = {.title = "residual, rms (" + in_print(most->unit) + ")", .low = 0.0},
             .y = {},
             .categories = {},
             .series = {}};
    Series residual{.name = "parameters refitted",
                    .draw = Draw::bars,
                    .colour = Colour::blue,
                    .x = {},
                    .y = {},
                    .low = {},
                    .high = {}};
    Series noise{.name = "noise alone", .colour = Colour::black, .x = {}, .y = {}, .low = {}, .high = {}};
    for (const Location* l : all) {
      if (l->channel != most->channel) continue;
      const std::size_t k = f.categories.size();
      f.categories.push_back(text_of(l->regime, l->test));
      residual.x.push_back(l->gap), residual.y.push_back(near_category(k));
      noise.x.insert(noise.x.end(), {l->noise_floor, l->noise_floor});
      noise.y.insert(noise.y.end(), {static_cast<double>(k) - 0.5, static_cast<double>(k) + 0.5});
    }
    f.series = {residual, noise};
    section_.add(f);
  }

  const gap::RankedHypothesis* parameters_alone() const {
    const auto at =
        std::ranges::find(diagnosis_.hypotheses, gap::HypothesisKind::parameters, &gap::RankedHypothesis::kind);
    return at == diagnosis_.hypotheses.end() ? nullptr : &*at;
  }

  void add_which() {
    ask("Which effect causes it?");
    std::vector<std::string> listed;
    for (const Rival& r : rivals_)
      if (r.hypothesis->probability >= kMinListed)
        listed.push_back(format("%s (%.2f)", r.name.c_str(), r.hypothesis->probability));
    section_.say("Weighed against these flights: " + spoken_list(listed) + "; everything else has less than 0.05.");
    Figure f{
        .id = "probabilities",
        .title = "Probability of each explanation",
        .note = "All explanations sum to 1; what has less than 0.005 is left out.",
        .x = {.title = "probability", .low = 0.0, .high = 1.0},
        .y = {},
        .categories = {},
        .series = {{.name = "", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
    for (const Rival& r : rivals_) {
      if (f.categories.size() == kBars || r.hypothesis->probability < kMinShown) break;
      f.series[0].x.push_back(r.hypothesis->probability);
      f.series[0].y.push_back(near_category(f.categories.size()));
      f.categories.push_back(r.name);
    }
    section_.add(f);
    add_rivals();
    add_parameters();
  }

  /// Adds the table of what speaks for and against each hypothesis.
  void add_rivals() {
    const gap::RankedHypothesis* refit = parameters_alone();
    double best = -std::numeric_limits<double>::infinity();
    for (const Rival& r : rivals_) best = std::max(best, r.hypothesis->log_evidence);
    Json rows = Json::array();
    for (const Rival& r : rivals_) {
      const gap::RankedHypothesis& h = *r.hypothesis;
      if (rows.size() == kShownRows || (h.probability < kMinShown && rows.size() >= 3)) break;
      std::vector<std::string> pro, con;
      if (refit != nullptr && h.log_evidence > refit->log_evidence + kRuledOut_nats)
        pro.push_back("rules out parameters alone");
      else if (refit != nullptr && &h != refit && h.log_evidence > refit->log_evidence)
        pro.push_back(format("%.0f nats more than parameters alone", h.log_evidence - refit->log_evidence));
      if (h.closure && h.closure->value > 0)
        pro.push_back(format("closes %.0f %% of what refitting leaves", 100 * h.closure->value));
      if (h.log_evidence < best - kRuledOut_nats) con.push_back("ruled out");
      else if (h.log_evidence < best) con.push_back(format("%.0f nats less than the best", best - h.log_evidence));
      if (h.closure && h.closure->value <= 0)
        con.push_back(format("closes nothing of what refitting leaves (%.0f %%)", 100 * h.closure->value));
      for (const gap::Estimate& e : h.parameters)
        if (e.low <= 0 && e.high >= 0)
          con.push_back(magnitude_words(e.name.substr(e.name.find('.') + 1), e.unit) + " may be 0");
      std::set<std::string> at;
      for (const std::string& e : h.effects) at.insert(place_of(e));
      rows.push_back({r.name, cell(h.probability, r.pointer + "/probability"), spoken_list({at.begin(), at.end()}),
                      spoken_list(pro), spoken_list(con)});
    }
    section_.add(table("What speaks for and against", {"explanation", "probability", "acts on", "for", "against"},
                       std::move(rows), "A nat is a factor of 2.7 of evidence, before doubt in the model is counted."));
  }

  void add_parameters() {
    for (const Rival& r : rivals_) {
      if (!r.effect()) continue;
      Json rows = Json::array();
      for (const gap::Estimate& e : r.hypothesis->parameters) {
        const std::string at = r.pointer + "/parameters/" + e.name;
        rows.push_back({magnitude_words(e.name, e.unit), cell(e.value, at + "/value"), cell(e.low, at + "/low"),
                        cell(e.high, at + "/high"), in_print(e.unit)});
      }
      if (rows.empty()) return;
      section_.add(table("Magnitude of " + r.name, {"parameter", "value", "90 % from", "to", "unit"}, std::move(rows)));
      return;
    }
  }

  void add_how_far() {
    ask("How far does the gap shrink?");
    // only fitted hypotheses have a closure
    auto best = std::ranges::find_if(rivals_, [](const Rival& r) { return r.effect() && r.hypothesis->closure; });
    if (best == rivals_.end()) best = std::ranges::find_if(rivals_, &Rival::effect);
    const std::string with = best == rivals_.end() ? "best effect" : best->name;
    if (const std::optional<gap::Closure>& c = diagnosis_.closure; c && c->value <= 0)
      section_.say(format(
          "With %s the model closes nothing of what refitted parameters leave (%.0f %%, 90 %%: %.0f to %.0f %%).",
          with.c_str(), 100 * c->value, 100 * c->low, 100 * c->high));
    else if (c)
      section_.say(format(
          "With %s the model closes %.0f %% of what refitted parameters leave (90 %%: %.0f to %.0f %%), on flights "
          "that the fit did not see.",
          with.c_str(), 100 * c->value, 100 * c->low, 100 * c->high));
    else section_.say(gap::capitalised(gap::kClosureUnknown) + ".");
    const std::string brief = with.size() > kLongName ? "these effects" : with;
    const std::pair<std::string, std::optional<double>> losses[] = {{"vehicle's file", diagnosis_.nominal_loss},
                                                                    {"parameters refitted", diagnosis_.refit_loss},
                                                                    {"with " + brief, diagnosis_.effect_loss},
                                                                    {"noise alone", diagnosis_.noise_floor}};
    Figure f{
        .id = "loss",
        .title = "Loss on flights held out",
        .note = "Mean Huber loss of residual over noise, each flight under the fit to the others.",
        .x = {.title = "loss (-)", .low = 0.0},
        .y = {},
        .categories = {},
        .series = {{.name = "", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
    for (const auto& [name, loss] : losses) {
      if (!loss) continue;
      f.series[0].x.push_back(*loss);
      f.series[0].y.push_back(near_category(f.categories.size()));
      f.categories.push_back(name);
    }
    section_.add(f);
    add_channels(brief);
    add_closed_loop();
  }

  void add_channels(const std::string& with) {
    const std::pair<gap::Fitted, std::string> fits[] = {{gap::Fitted::nominal, "vehicle's file"},
                                                        {gap::Fitted::refit, "parameters refitted"},
                                                        {gap::Fitted::effect, "with " + with}};
    constexpr Colour kFitColours[] = {Colour::grey, Colour::vermillion, Colour::blue};
    Figure f{.id = "channels",
             .title = "Residual by channel, before and after",
             .note = "Rms of the residual over that of noise, all beats: 1 is noise alone.",
             .x = {.title = "residual over noise (-)", .log = true, .low = 0.5},
             .y = {},
             .categories = {},
             .series = {}};
    std::vector<std::string> channels;
    for (const Location* l : of(gap::Fitted::nominal, gap::ResidualTest::channel)) channels.push_back(l->channel);
    for (const std::string& c : channels) f.categories.push_back(channel_words(c));
    for (std::size_t s = 0; s < 3; ++s) {
      Series series{.name = fits[s].second,
                    .draw = Draw::bars,
                    .colour = kFitColours[s],
                    .x = {},
                    .y = {},
                    .low = {},
                    .high = {}};
      for (const Location* l : of(fits[s].first, gap::ResidualTest::channel)) {
        const auto k = static_cast<std::size_t>(std::ranges::find(channels, l->channel) - channels.begin());
        series.x.push_back(over_noise(*l));
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
    Json rows = Json::array();
    for (std::size_t i = 0; i < diagnosis_.closed_loop.size(); ++i) {
      const gap::ClosedLoop& c = diagnosis_.closed_loop[i];
      const auto at = [&](const char* key, double value) {
        return std::isfinite(value) ? cell(value, "/closed_loop/" + std::to_string(i) + "/" + key) : Json("–");
      };
      rows.push_back({c.flight, spoken(c.quantity), at("recorded", c.recorded), at("nominal", c.nominal),
                      at("corrected", c.corrected)});
    }
    if (!rows.empty())
      section_.add(table("In closed loop, predicted against recorded",
                         {"flight", "quantity", "recorded", "vehicle's file", "corrected"}, std::move(rows),
                         "The vehicle's file and the corrected one fly the recorded path under our controller."));
  }

  /// Adds figures of how two rivals would fly the next experiment, in the quantities that differ most.
  void add_courses(const gap::NextExperiment& next, const std::vector<std::string>& rivals) {
    for (std::size_t k = 0; k < std::min<std::size_t>(2, next.courses.size()); ++k) {
      const gap::Course& c = next.courses[k];
      const std::string& quantity = c.quantity;
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
      const std::pair<const std::vector<double>*, Colour> kSides[] = {{&c.first, Colour::blue},
                                                                      {&c.second, Colour::vermillion}};
      for (std::size_t i = 0; i < 2; ++i) {
        Series s{.name = "if it is " + rivals[i],
                 .colour = kSides[i].second,
                 .x = {},
                 .y = *kSides[i].first,
                 .low = {},
                 .high = {}};
        for (std::size_t n = 0; n < s.y.size(); ++n) s.x.push_back(next.course_step_s * (static_cast<double>(n) + 0.5));
        f.series.push_back(std::move(s));
      }
      section_.add(f);
    }
  }

  void add_next() {
    ask("What to fly next?");
    const gap::VerdictKind kind = diagnosis_.verdict.kind;
    const bool corrected = kind == gap::VerdictKind::effect || kind == gap::VerdictKind::parameters;
    if (diagnosis_.next) {
      const gap::NextExperiment& next = *diagnosis_.next;
      std::vector<std::string> rivals;
      for (const std::string& r : next.separates) rivals.push_back(gap::hypothesis_words(r, spoken));
      section_.say(format("Of the experiments that are ready, “%s” tells %s best apart: %.3g nats are expected of it.",
                          spoken(next.manoeuvre).c_str(), spoken_list(rivals).c_str(), next.expected_nats));
      add_courses(next, rivals);
      section_.say(next.change.empty()
                       ? "It is configs/gap/experiments/" + next.manoeuvre +
                             ".toml. Diagnose old and new flights together."
                       : "Before it: " + next.change + ". It costs " + next.cost +
                             ". Declare the change in flight.toml, as configs/gap/experiments/interventions.toml has "
                             "it. Diagnose old and new flights together.");
    } else if (beat_averaged_) {
      // the ready-made experiments are flown in simulation, which cannot fly a beat-averaged vehicle
      section_.say(corrected
                       ? "Predict with vehicle_corrected.toml, and see on new flights whether it holds: diagnose these "
                         "with the same --vehicle as now."
                       : "Fly harder manoeuvres, and diagnose old and new flights together.");
    } else if (corrected) {
      section_.say(
          "No rival is left to be told apart: train on with flappy-train --adapt DIR --init RUN, or fly on with "
          "vehicle_corrected.toml.");
    } else {
      section_.say("Nothing is left to be told apart: fly harder manoeuvres to look further.");
    }
    add_unexplained();
  }

  void add_unexplained() {
    if (diagnosis_.unexplained.empty()) return;
    Json rows = Json::array();
    for (std::size_t i = 0; i < diagnosis_.unexplained.size(); ++i) {
      const gap::UnexplainedTerm& t = diagnosis_.unexplained[i];
      const std::string at = "/unexplained/terms/" + std::to_string(i);
      Json row = {channel_words(t.channel)};
      if (!beat_averaged_) row.push_back(gap::harmonic_words(t.harmonic));
      row.insert(row.end(), {Json(function_words(t.function)), cell(t.times_prior_scale, at + "/times_prior_scale"),
                             cell(t.gain_nats, at + "/gain_nats")});
      rows.push_back(std::move(row));
    }
    std::vector<std::string> head = {"channel", "part of the beat", "grows with", "times the usual error",
                                     "gain (nats)"};
    if (beat_averaged_) head.erase(head.begin() + 1);
    std::vector<std::string> effects;
    for (const std::string& e : diagnosis_.jointly_with) effects.push_back(spoken(e));
    section_.add(table("On what the unexplained depends", head, std::move(rows),
                       effects.empty() ? "Of what is left with parameters alone refitted."
                                       : "Of what is left jointly with " + spoken_list(effects) + "."));
  }

  const gap::Diagnosis& diagnosis_;
  std::vector<Rival> rivals_;
  Section section_;
  bool beat_averaged_ = false;
};

}  // namespace

Section diagnosis_section(const std::filesystem::path& file) {
  const gap::Diagnosis diagnosis = gap::diagnosis_from(read_results(file), file);
  return DiagnosisSection(file, diagnosis).composed();
}

}  // namespace flappy::view
