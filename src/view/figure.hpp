// A plot as data, drawn by Chart.js on a page (web/chart.js), by gnuplot as SVG or PDF for a paper.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace flappy::view {

/// band: area from low to high. interval: point with a bar from low to high. bars: horizontal, from the category axis.
enum class Draw { line, points, bars, band, interval };

enum class Colour { blue, vermillion, green, purple, black, grey };  ///< indices of kColours

/// A series of a figure; NaN means no value.
struct Series {
  std::string name;
  Draw draw = Draw::line;
  Colour colour = Colour::blue;
  std::vector<double> x, y;       ///< for bars, x is the value and y the place near its category (near_category())
  std::vector<double> low, high;  ///< bounds along y for a band, along x for an interval
  bool dashed = false;
  std::vector<std::string> labels;  ///< beside points; empty: none
};

struct Axis {
  std::string title;  ///< includes the unit
  bool log = false;
  std::optional<double> low, high;
};

struct Figure {
  std::string id;     ///< name of the file on paper, without extension
  std::string title;  ///< what the figure shows
  std::string note;   ///< how the figure was made
  Axis x, y;
  std::vector<std::string> categories;  ///< names along y, from the top down; empty: y is numeric
  std::vector<Series> series;
};

/// The y of bar `i` of `of` in category `k`, centred next to each other; each bar is kBarWidth / of high.
double near_category(std::size_t k, std::size_t i = 0, std::size_t of = 1);
inline constexpr double kBarWidth = 0.8;

/// Colours by Okabe and Ito, "Color Universal Design", 2008, which remain distinct in all forms of colour blindness;
/// only those with a contrast of at least 3 to 1 on white.
inline constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#767676"};

nlohmann::ordered_json json_of(const Figure& figure);  ///< as web/chart.js draws it

enum class Paper { svg, pdf };

/// Writes folder/id.svg or .pdf, a column of 88 mm wide, a PDF with its fonts. Throws InputError where that fails.
void draw_on_paper(const std::filesystem::path& folder, const Figure& figure, Paper paper);

}  // namespace flappy::view
