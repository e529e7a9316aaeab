#include "io/gnuplot.hpp"

#include "io/files.hpp"
#include "io/run_program.hpp"

namespace flappy::io {

void draw_svg(const std::filesystem::path& path, const std::string& name, int width, int height,
              const std::string& script) {
  const std::string style = "set terminal svg size " + std::to_string(width) + "," + std::to_string(height) +
                            " dynamic noenhanced background '#ffffff' font 'sans-serif,14' name '" + name +
                            "'\nset encoding utf8\nset border 3 lc '#444444'\nset tics nomirror\n";
  write_atomically(path, run_program({"gnuplot", "--default-settings"}, style + script, path.string()));
}

}  // namespace flappy::io
