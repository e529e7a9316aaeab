#include "view/page.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "io/program.hpp"
#include "view/page_files.hpp"

namespace flappy::view {
namespace {

/// Content-Security-Policy of a page: it loads nothing from the network.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";
constexpr const char* kLibraries[] = {"three.min.js", "chart.min.js"};
constexpr std::string_view kEntry = "main.js", kStyle = "report.css";

/// A script element. Its text cannot end it: JSON and base64 have no "<", our files no "</script" (page_test checks).
std::string script(const std::string& attributes, std::string_view text) {
  return "<script" + attributes + ">\n" + std::string(text) + "\n</script>\n";
}

}  // namespace

Section::Section(std::string kind, std::string title, std::string source)
    : kind_(std::move(kind)), title_(std::move(title)), source_(std::move(source)) {}

void Section::say(const std::string& text, const char* style) {
  blocks_.push_back({{"kind", "words"}, {"style", style}, {"text", text}});
}

void Section::add(const Figure& figure) {
  if (std::ranges::all_of(figure.series, [](const Series& s) { return s.x.empty(); })) return;
  blocks_.push_back(json_of(figure));
  figures_.push_back(figure);
}

Json Section::json() const { return {{"kind", kind_}, {"title", title_}, {"source", source_}, {"blocks", blocks_}}; }

Json cell(double value, const std::string& at, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return {{"text", std::isfinite(value) ? text : "–"}, {"at", at}};
}

Json table(const std::string& title, const std::vector<std::string>& head, Json rows, const std::string& note) {
  return {{"kind", "table"}, {"title", title}, {"head", head}, {"rows", std::move(rows)}, {"note", note}};
}

std::string json_in_html(const Json& json) {
  std::string safe;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') safe += "\\u003c";
    else if (c == '>') safe += "\\u003e";
    else if (c == '&') safe += "\\u0026";
    else safe += c;
  }
  return safe;
}

std::string text_in_html(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '<') safe += "&lt;";
    else if (c == '>') safe += "&gt;";
    else if (c == '&') safe += "&amp;";
    else if (c == '"') safe += "&quot;";
    else safe += c;
  }
  return safe;
}

std::string joined_modules() {
  std::string joined;
  std::set<std::string, std::less<>> done;
  const std::function<void(std::string_view)> put = [&](std::string_view name) {
    if (!done.emplace(name).second) return;
    const std::string_view text = kPageFiles.at(name);
    std::string own;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      std::string_view line = text.substr(at, end - at);
      at = end + 1;
      if (line.starts_with("import ")) {
        const std::size_t from = line.find("\"./") + 3;
        put(line.substr(from, line.find('"', from) - from));
        continue;
      }
      if (line.starts_with("export ")) line.remove_prefix(7);
      own += std::string(line) + "\n";
    }
    joined += own;
  };
  put(kEntry);
  return joined;
}

std::string page_text(const std::string& title, const std::vector<Section>& sections, const Packing& packing) {
  Json list = Json::array();
  for (const Section& s : sections) list.push_back(s.json());
  const Json report = {{"title", title}, {"commit", io::commit()}, {"sections", list}};
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  html += std::string("<meta http-equiv=\"Content-Security-Policy\" content=\"") + kPolicy + "\">\n";
  html += "<title>" + text_in_html(title) + "</title>\n<style>\n" + std::string(kPageFiles.at(kStyle)) +
          "</style>\n</head>\n<body>\n<noscript>This report is drawn by JavaScript.</noscript>\n";
  html += script(" type=\"application/json\" id=\"report\"", json_in_html(report));
  html += script(" type=\"text/plain\" id=\"packed\"", packing.text());
  for (const char* library : kLibraries) html += script("", kPageFiles.at(library));
  html += script(" type=\"module\"", joined_modules());
  return html + "</body>\n</html>\n";
}

}  // namespace flappy::view
