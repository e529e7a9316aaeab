// Figures, by gnuplot.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::io {

/// Draws what `script` plots, in the style that all figures share; the same bytes from the same gnuplot. `name`, which need
/// not be the file's, is the SVG's identifier. InputError when gnuplot is missing or fails, or the file cannot be written.
void draw_svg(const std::filesystem::path& path, const std::string& name, int width, int height,
              const std::string& script);

}  // namespace flappy::io
