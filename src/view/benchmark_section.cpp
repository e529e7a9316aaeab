#include <algorithm>
#include <cmath>
#include <map>

#include "gap/result/diagnosis_json.hpp"
#include "io/files.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;
using io::format;

constexpr std::size_t kBins = 10, kRivals = 8;

struct Case {
  std::string number, part, truth, verdict, named;
  double probability = 0;
  bool right = false;
};

std::vector<Case> cases_of(const TextTable& table) {
  std::vector<Case> cases;
  for (const TextRow& row : table.rows) {
    const std::string effects = table.cell(row, "effects");
    cases.push_back({table.cell(row, "case"), table.cell(row, "part"), effects, table.cell(row, "verdict"),
                     table.cell(row, "named"), table.number(row, "probability"), table.cell(row, "right") == "1"});
  }
  return cases;
}

std::string in_words(std::string effects) {
  for (char& c : effects)
    if (c == '_') c = ' ';
  for (std::size_t at = 0; (at = effects.find('+', at)) != std::string::npos; at += 3) effects.replace(at, 1, " + ");
  return effects;
}

void add_parts(Section& section, const std::vector<Case>& cases) {
  std::vector<std::string> parts;
  for (const Case& c : cases)
    if (std::ranges::find(parts, c.part) == parts.end()) parts.push_back(c.part);
  Figure f{.id = "right_by_part",
           .title = "Right verdicts by part",
           .note = "Share of cases whose verdict is what it should be, with its 95 % interval (Wilson).",
           .x = {.title = "right (%)", .low = 0.0, .high = 100.0},
           .y = {},
           .categories = {},
           .series = {
               {.name = "", .draw = Draw::interval, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
  for (const std::string& part : parts) {
    std::size_t n = 0, right = 0;
    for (const Case& c : cases)
      if (c.part == part) ++n, right += c.right;
    const io::Interval i = io::wilson_interval(right, n);
    Series& s = f.series[0];
    s.x.push_back(100 * static_cast<double>(right) / static_cast<double>(n));
    s.low.push_back(100 * i.low), s.high.push_back(100 * i.high);
    s.y.push_back(near_category(f.categories.size()));
    f.categories.push_back(spoken(part) + format(" (%zu)", n));
  }
  section.add(f);
}

/// Parts without a single effect of the catalogue as their truth.
constexpr const char* kOthers[] = {"withheld",         "outside",         "pairs",        "hover",
                                   "changed_withheld", "changed_outside", "changed_pairs"};

/// Adds the confusion matrix of the cases with one effect or none: true cause by verdict.
void add_confusion(Section& section, const std::vector<Case>& cases) {
  std::vector<std::string> rows, columns;
  std::map<std::pair<std::string, std::string>, int> counts;
  const auto add = [](std::vector<std::string>& list, const std::string& name) {
    if (std::ranges::find(list, name) == list.end()) list.push_back(name);
  };
  for (const Case& c : cases) {
    if (std::ranges::find(kOthers, c.part) != std::end(kOthers)) continue;
    const std::string truth = c.truth.empty() ? "(" + c.part + ")" : in_words(c.truth);
    const bool several = c.named.find('+') != std::string::npos;
    const bool names = c.verdict == "effect" || c.verdict == "remainder";
    const std::string said = !names ? "(" + c.verdict + ")" : several ? "(several)" : in_words(c.named);
    add(rows, truth), add(columns, said);
    ++counts[{truth, said}];
  }
  std::ranges::sort(rows), std::ranges::sort(columns);
  if (rows.empty()) return;
  Json values = Json::array(), texts = Json::array(), marked = Json::array();
  int most = 1;
  for (const std::string& row : rows) {
    Json v = Json::array(), t = Json::array(), m = Json::array();
    for (const std::string& column : columns) {
      const auto found = counts.find({row, column});
      const int n = found == counts.end() ? 0 : found->second;
      most = std::max(most, n);
      v.push_back(n == 0 ? Json(nullptr) : Json(n));
      t.push_back(n == 0 ? "" : std::to_string(n));
      m.push_back(row == column);
    }
    values.push_back(v), texts.push_back(t), marked.push_back(m);
  }
  section.add(Json{
      {"kind", "matrix"},
      {"title", "What was so (rows), by what was said (columns)"},
      {"rows", rows},
      {"columns", columns},
      {"values", values},
      {"texts", texts},
      {"marked", marked},
      {"most", most},
      {"tilted", true},
      {"note", "Cases with one effect or none. Outlined: the truth. In parentheses: verdicts without an effect."}});
}

/// Adds the reliability diagram: how often a claim is right over its probability, in bins with equally many cases.
void add_reliability(Section& section, std::vector<Case> cases) {
  std::ranges::stable_sort(cases, {}, &Case::probability);
  Figure f{.id = "reliability",
           .title = "Can the probabilities be believed?",
           .note =
               "Verdicts in about ten bins, claims of one probability together: how many were right by the probability "
               "that they claimed. On the "
               "dashed line they are "
               "believed rightly.",
           .x = {.title = "claimed probability", .low = 0.0, .high = 1.0},
           .y = {.title = "share that was right", .low = 0.0, .high = 1.0},
           .categories = {},
           .series = {{.name = "as claimed",
                       .colour = Colour::grey,
                       .x = {0, 1},
                       .y = {0, 1},
                       .low = {},
                       .high = {},
                       .dashed = true}}};
  Series band{
      .name = "95 % interval", .draw = Draw::band, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}};
  Series mean{
      .name = "verdicts", .draw = Draw::points, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}};
  for (std::size_t from = 0, to = 0; from < cases.size(); from = to) {
    to = std::min(cases.size(), from + std::max<std::size_t>(1, cases.size() / kBins));
    while (to < cases.size() && cases[to].probability == cases[to - 1].probability) ++to;
    double claimed = 0;
    std::size_t right = 0;
    for (std::size_t i = from; i < to; ++i) claimed += cases[i].probability, right += cases[i].right;
    const auto n = static_cast<double>(to - from);
    const io::Interval i = io::wilson_interval(right, to - from);
    band.x.push_back(claimed / n), band.low.push_back(i.low), band.high.push_back(i.high);
    mean.x.push_back(claimed / n), mean.y.push_back(static_cast<double>(right) / n);
  }
  f.series.push_back(band), f.series.push_back(mean);
  section.add(f);
}

/// The most probable hypotheses of a case, where its prediction lies in `folder`.
Json rivals_of(const fs::path& folder, const std::string& number) {
  Json rivals = Json::array();
  const fs::path file =
      folder / "predictions" / (std::string(number.size() < 4 ? 4 - number.size() : 0, '0') + number + ".json");
  if (!fs::exists(file)) return rivals;
  const Json json = read_results(file);
  if (!json.contains("diagnosis")) return rivals;  // the prediction is of an older benchmark
  std::map<std::string, double> by_name;           // sums hypotheses with and without a remainder
  for (const gap::RankedHypothesis& h : gap::diagnosis_from(json.at("diagnosis"), file).hypotheses) {
    gap::RankedHypothesis alike = h;
    alike.remainder = false;
    by_name[hypothesis_words(alike, spoken)] += h.probability;
  }
  std::vector<std::pair<double, std::string>> list;
  for (const auto& [name, probability] : by_name) list.emplace_back(probability, name);
  std::ranges::sort(list, std::greater{});
  for (std::size_t i = 0; i < list.size() && i < kRivals; ++i) rivals.push_back({list[i].second, list[i].first});
  return rivals;
}

void add_cases(Section& section, const TextTable& table, const std::vector<Case>& cases, const fs::path& folder) {
  Json list = Json::array();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& c = cases[i];
    Json details = Json::array();
    for (const std::string& name : table.names)
      if (const std::string text = table.cell(table.rows[i], name); !text.empty())

        details.push_back({spoken(name), name == "effects" || name == "named" ? in_words(text) : text});
    list.push_back({{"number", c.number},
                    {"part", spoken(c.part)},
                    {"truth", c.truth.empty() ? "no effect" : in_words(c.truth)},
                    {"verdict", c.verdict},
                    {"named", in_words(c.named)},
                    {"probability", std::isfinite(c.probability) ? Json(c.probability) : Json(nullptr)},
                    {"right", c.right},
                    {"details", details},
                    {"rivals", rivals_of(folder, c.number)}});
  }
  section.add(Json{{"kind", "cases"}, {"cases", list}});
}

}  // namespace

Section benchmark_section(const fs::path& path) {
  const fs::path file = fs::is_directory(path) ? path / "score.csv" : path;
  const TextTable table = read_text_table(file);
  const std::vector<Case> cases = cases_of(table);
  if (cases.empty()) throw io::InputError(file.string() + ": has no case; accepted: what flappy-blind score wrote");
  Section section("benchmark", "Blind benchmark of the diagnosis", path.string());
  std::size_t right = 0, single = 0, single_right = 0;
  for (const Case& c : cases) {
    right += c.right;
    if (c.part == "singles") ++single, single_right += c.right;
  }
  std::string lead = format("Of %zu blind cases %zu verdicts are right", cases.size(), right);
  if (single > 0) {
    const io::Interval i = io::wilson_interval(single_right, single);
    lead += format("; of robots with one effect, the right one is named first in %.3f (%.3f to %.3f of %zu)",
                   static_cast<double>(single_right) / static_cast<double>(single), i.low, i.high, single);
  }
  section.say(lead + ".", "lead");
  add_parts(section, cases);
  add_reliability(section, cases);
  add_confusion(section, cases);
  add_cases(section, table, cases, file.parent_path());
  return section;
}

}  // namespace flappy::view
