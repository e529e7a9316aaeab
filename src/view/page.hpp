// A report as one HTML file that needs no other file: it contains data, three.js, Chart.js and our own modules (web/).
//
// A page is a list of sections, a section a list of blocks, which web/ draws by their "kind":
//   words      {"text", "style": "lead" | "plain" | "note"}
//   figure     figure.hpp
//   table      {"title", "head": [...], "rows": [[cell, ...]], "note"}   cell: a text, or {"text", "at": JSON pointer, "strong"}
//   flights    flight_section.hpp; anatomy, cases, robots: sections.hpp
//   matrix     {"title", "rows", "columns", "values": [[x|null]], "texts", "note"}, optional: "least", "most", "marked",
//              "tilted". Texts fill the cells; values shade them from least (0) to most; marked rings a cell.
//   heading    {"text"}
// Foreign text enters as JSON without any "<", and the page makes text nodes of it, so it is never read as markup.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "view/figure.hpp"
#include "view/packing.hpp"

namespace flappy::view {

using Json = nlohmann::ordered_json;

class Section {
 public:
  Section(std::string kind, std::string title, std::string source);

  void say(const std::string& text, const char* style = "plain");
  void add(const Figure& figure);  ///< does nothing where it has no point
  /// For paper only, because the page shows the same in another form.
  void add_on_paper(const Figure& figure) { figures_.push_back(figure); }
  void add(Json block) { blocks_.push_back(std::move(block)); }

  const std::string& kind() const { return kind_; }
  const std::string& title() const { return title_; }
  const std::vector<Figure>& figures() const { return figures_; }
  Json json() const;

 private:
  std::string kind_, title_, source_;
  Json blocks_ = Json::array();
  std::vector<Figure> figures_;
};

/// A cell of a table: a number with `digits` significant digits, and its JSON pointer `at` in the file of results.
Json cell(double value, const std::string& at, int digits = 3);
Json table(const std::string& title, const std::vector<std::string>& head, Json rows, const std::string& note = "");

std::string page_text(const std::string& title, const std::vector<Section>& sections, const Packing& packing);

/// JSON that is safe within <script>: "<", ">" and "&" become \u003c, \u003e, \u0026.
std::string json_in_html(const Json& json);
/// Text that is safe within an element or an attribute in double quotes; it leaves single quotes as they are.
std::string text_in_html(std::string_view text);
/// Our modules as one script: each after the modules that it imports, without import lines and the word export.
std::string joined_modules();

}  // namespace flappy::view
