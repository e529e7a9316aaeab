// A plot as data: drawn by Chart.js on a page (web/chart.js), by gnuplot as SVG or PDF for a paper. Both show the same numbers.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace flappy::view {

/// What a series looks like. band: between low and high. interval: a point with a bar from low to high. bars: from the axis of
/// the categories.
enum class Draw { line, points, bars, band, interval };

/// Of kColours, in this order.
enum class Colour { blue, vermillion, green, purple, black, grey };

/// NaN: no value there.
struct Series {
  std::string name;
  Draw draw = Draw::line;
  Colour colour = Colour::blue;
  std::vector<double> x, y;       ///< of bars x is the value, y the place of the category (as near_category() says)
  std::vector<double> low, high;  ///< of a band along y, of an interval along x
  bool dashed = false;
};

struct Axis {
  std::string title;  ///< with its unit
  bool log = false;
  std::optional<double> low, high;
};

struct Figure {
  std::string id;     ///< of the file that holds it
  std::string title;  ///< says what is to be seen
  std::string note;   ///< how it was made
  Axis x, y;
  std::vector<std::string> categories;  ///< of y, from the top down; none: y is a number
  std::vector<Series> series;
};

/// Where bars of category `k` lie, the `i`-th of `of` beside each other; each is kBarWidth / of high.
double near_category(std::size_t k, std::size_t i = 0, std::size_t of = 1);
inline constexpr double kBarWidth = 0.8;

/// Okabe and Ito, "Color Universal Design", 2008, as far as they have a contrast of 3 to 1 on white: all forms of colour blindness
/// tell them apart.
inline constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#767676"};

/// What web/chart.js draws.
nlohmann::ordered_json json_of(const Figure& figure);

enum class Paper { svg, pdf };

/// Writes folder/id.svg or .pdf: as wide as a column of 88 mm, fonts embedded in a PDF. InputError where gnuplot is missing or
/// fails, or the file cannot be written.
void draw_on_paper(const std::filesystem::path& folder, const Figure& figure, Paper paper);

}  // namespace flappy::view
