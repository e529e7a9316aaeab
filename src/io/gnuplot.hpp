// Figures drawn by gnuplot.
#pragma once

#include <filesystem>
#include <string>

namespace flappy::io {

/// Runs `script` in the style that all figures share; the same gnuplot writes the same bytes. `name` is the SVG's
/// identifier. Throws InputError where gnuplot is missing or fails, or the file cannot be written.
void draw_svg(const std::filesystem::path& path, const std::string& name, int width, int height,
              const std::string& script);

}  // namespace flappy::io
