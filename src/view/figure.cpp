#include "view/figure.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "io/run_program.hpp"

namespace flappy::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kDraws[] = {"line", "points", "bars", "band", "interval"};
constexpr double kColumn_cm = 8.8, kHigh_cm = 5.6, kCategory_cm = 0.42, kFrame_cm = 1.6, kKey_cm = 0.35;

const char* colour_of(const Series& s) { return kColours[static_cast<std::size_t>(s.colour)]; }

/// A JSON list in which values that are not finite become null.
Json numbers(const std::vector<double>& list) {
  Json json = Json::array();
  for (const double x : list) json.push_back(std::isfinite(x) ? Json(x) : Json(nullptr));
  return json;
}

Json json_of(const Axis& axis) {
  const auto number = [](const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); };
  return {{"title", axis.title}, {"log", axis.log}, {"low", number(axis.low)}, {"high", number(axis.high)}};
}

/// A string in gnuplot's single quotes, within which gnuplot substitutes nothing.
std::string quoted(const std::string& text) {
  std::string q = "'";
  for (const char c : text)
    if (c == '\'') q += "''";
    else if (static_cast<unsigned char>(c) >= ' ') q += c;
  return q + "'";
}

/// A word of a row of data; gnuplot knows no escape for what ends it.
std::string in_double_quotes(const std::string& text) {
  std::string q = "\"";
  for (const char c : text)
    if (c != '"' && c != '\\' && static_cast<unsigned char>(c) >= ' ') q += c;
  return q + "\"";
}

constexpr std::size_t kLine = 40;  ///< letters

/// A name in lines of about kLine letters.
std::vector<std::string> lines_of(const std::string& name) {
  std::vector<std::string> lines = {""};
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t end = std::min(name.find(' ', at), name.size());
    const std::string word = name.substr(at, end - at);
    if (!lines.back().empty() && lines.back().size() + word.size() > kLine) lines.push_back(word);
    else lines.back() += (lines.back().empty() ? "" : " ") + word;
    at = end + 1;
  }
  return lines;
}

std::string range_of(const char* axis, const Axis& a) {
  const auto end = [](const std::optional<double>& x) { return x ? io::shortest_digits(*x) : std::string("*"); };
  return std::string(a.log ? "set logscale " + std::string(axis) + "\n" : "") + "set " + axis + "range [" + end(a.low) +
         ":" + end(a.high) + "]\nset " + axis + "label " + quoted(a.title) + "\n";
}

std::size_t bars_of(const Figure& f) {
  return static_cast<std::size_t>(std::ranges::count(f.series, Draw::bars, &Series::draw));
}

/// The rows of a series for gnuplot: x, y, low, high.
std::string rows_of(const Figure& f, const Series& s) {
  const auto digits = [](double x) { return std::isfinite(x) ? io::shortest_digits(x) : std::string("NaN"); };
  const double base = f.x.log ? f.x.low.value_or(1) : 0;
  const double half = 0.5 * kBarWidth / static_cast<double>(std::max<std::size_t>(1, bars_of(f)));
  std::string rows;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    rows += digits(s.x[i]);
    if (s.draw != Draw::band) rows += " " + digits(s.y[i]);
    if (s.draw == Draw::bars)
      rows += " " + digits(std::min(base, s.x[i])) + " " + digits(std::max(base, s.x[i])) + " " +
              digits(s.y[i] - half) + " " + digits(s.y[i] + half);
    if (!s.low.empty()) rows += " " + digits(s.low[i]) + " " + digits(s.high[i]);
    if (!s.labels.empty()) rows += " " + in_double_quotes(s.labels[i]);
    rows += "\n";
  }
  return rows;
}

std::string plot_of(const Series& s) {
  const std::string colour = " lc '" + std::string(colour_of(s)) + "'", dash = s.dashed ? " dt 2" : "";
  switch (s.draw) {
    case Draw::line:
      return "using 1:2 with lines lw 1.4" + colour + dash;
    case Draw::points:
      return "using 1:2 with points pt 7 ps 0.5" + colour;
    case Draw::bars:
      return "using 1:2:3:4:5:6 with boxxyerror fs solid 1 noborder" + colour;
    case Draw::band:
      return "using 1:2:3 with filledcurves fs transparent solid 0.18 noborder" + colour;
    case Draw::interval:
      return "using 1:2:3:4 with xerrorbars pt 7 ps 0.5 lw 1.4" + colour;
  }
  return "";
}

/// A name in lines, as an expression of gnuplot.
std::string in_lines(const std::string& name) {
  std::string text;
  for (const std::string& line : lines_of(name)) text += (text.empty() ? "" : ".\"\\n\".") + quoted(line);
  return text;
}

}  // namespace

double near_category(std::size_t k, std::size_t i, std::size_t of) {
  return static_cast<double>(k) + kBarWidth * ((static_cast<double>(i) + 0.5) / static_cast<double>(of) - 0.5);
}

Json json_of(const Figure& f) {
  Json series = Json::array();
  for (const Series& s : f.series) {
    Json one = {{"name", s.name},
                {"draw", kDraws[static_cast<std::size_t>(s.draw)]},
                {"colour", colour_of(s)},
                {"dashed", s.dashed},
                {"x", numbers(s.x)}};
    if (!s.y.empty()) one["y"] = numbers(s.y);
    if (!s.labels.empty()) one["labels"] = s.labels;
    if (!s.low.empty()) one["low"] = numbers(s.low), one["high"] = numbers(s.high);
    series.push_back(std::move(one));
  }
  return {{"kind", "figure"},
          {"id", f.id},
          {"title", f.title},
          {"note", f.note},
          {"x", json_of(f.x)},
          {"y", json_of(f.y)},
          {"categories", f.categories},
          {"bar", kBarWidth / static_cast<double>(std::max<std::size_t>(1, bars_of(f)))},
          {"series", series}};
}

void draw_on_paper(const std::filesystem::path& folder, const Figure& f, Paper paper) {
  const auto categories = static_cast<double>(f.categories.size());
  double lines = 1;
  for (const std::string& name : f.categories)
    lines = std::max(lines, 0.75 * static_cast<double>(lines_of(name).size()));
  const auto keys = static_cast<double>(
      std::ranges::count_if(f.series, [](const Series& s) { return !s.name.empty() && !s.x.empty(); }));
  const double high_cm =
      kKey_cm * keys + (f.categories.empty() ? kHigh_cm : kFrame_cm + kCategory_cm * lines * categories);
  char terminal[200];
  if (paper == Paper::pdf)
    std::snprintf(terminal, sizeof terminal, "set terminal pdfcairo noenhanced size %gcm,%gcm font 'DejaVu Sans,7'\n",
                  kColumn_cm, high_cm);
  else
    std::snprintf(
        terminal, sizeof terminal,
        "set terminal svg noenhanced size %.0f,%.0f background '#ffffff' font 'DejaVu Sans,9' name 'figure'\n",
        kColumn_cm / 2.54 * 96, high_cm / 2.54 * 96);
  std::string script = terminal;
  script +=
      "set encoding utf8\nset datafile missing 'NaN'\nset border 3 lc '#444444'\nset tics nomirror\n"
      "set grid lc '#dddddd' lt 1\nset key above maxcols 1 Left reverse samplen 1.5\n" +
      range_of("x", f.x) + range_of("y", f.y);
  if (!f.categories.empty()) {
    script += "set yrange [" + io::shortest_digits(categories - 0.5) + ":-0.5]\nset ytics (";
    for (std::size_t k = 0; k < f.categories.size(); ++k)
      script += (k == 0 ? "" : ", ") + in_lines(f.categories[k]) + " " + std::to_string(k);
    script += ")\n";
  }
  std::string plots;
  for (std::size_t k = 0; k < f.series.size(); ++k) {
    const Series& s = f.series[k];
    const std::string rows = rows_of(f, s);
    if (rows.empty()) continue;
    const std::string block = "$rows" + std::to_string(k);
    script += block + " << end_of_rows\n" + rows + "end_of_rows\n";
    plots += (plots.empty() ? "plot " : ", ") + block + " " + plot_of(s) +
             (s.name.empty() ? " notitle" : " title " + quoted(s.name));
    if (!s.labels.empty()) plots += ", " + block + " using 1:2:3 with labels left offset 0.6,0.3 notitle";
  }
  const auto path = folder / (f.id + (paper == Paper::pdf ? ".pdf" : ".svg"));
  if (plots.empty()) return;
  io::write_atomically(path, io::run_program({"gnuplot", "--default-settings"}, script + plots + "\n", path.string()));
}

}  // namespace flappy::view
