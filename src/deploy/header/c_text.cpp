#include "deploy/header/c_text.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <stdexcept>

namespace flappy::deploy {

std::string c_number(float value) {
  if (!std::isfinite(value)) throw std::invalid_argument("a number that is not finite has no literal in C");
  char text[40];
  std::snprintf(text, sizeof text, "%aF", static_cast<double>(value));
  return text;
}

std::string c_number(std::int32_t value) { return std::to_string(value); }

template <class N>
std::string c_row(std::span<const N> numbers) {
  constexpr std::size_t kColumns = 120;
  std::string text, line = "    {";
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::string next = c_number(numbers[i]) + (i + 1 < numbers.size() ? ", " : "}");
    if (line.size() + next.size() > kColumns) {
      text += line + "\n";
      line = "     ";
    }
    line += next;
  }
  return text + line;
}

template std::string c_row(std::span<const float>);
template std::string c_row(std::span<const std::int32_t>);

std::string c_comment(const std::string& text) {
  std::string closed = text;  // `text` with every "*/" broken up, which would end the comment
  for (std::size_t at = 0; (at = closed.find("*/", at)) != std::string::npos;) closed.insert(at + 1, " ");
  std::istringstream lines(closed);
  std::string comment = "/* ";
  bool first = true;
  for (std::string line; std::getline(lines, line); first = false)
    comment += (first ? "" : line.empty() ? "\n" : "\n   ") + line;
  return comment + " */\n";
}

std::string end_of_header(const std::string& name, std::uint32_t crc) {
  return "#elif FLAPPY_" + name + "_CRC32 != " + std::to_string(crc) +
         "U\n#error \"another header of this prefix was included before: flappy-export --name gives one of its "
         "own\"\n#endif\n";
}

std::string c_string(const std::string& text) {
  std::string literal = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') literal += '\\';
    literal += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return literal + '"';
}

std::uint32_t crc32(std::uint32_t crc, std::span<const std::int32_t> numbers) {
  crc = ~crc;
  for (const std::int32_t number : numbers) {
    const auto bits = static_cast<std::uint32_t>(number);
    for (unsigned shift = 0; shift < 32; shift += 8) {
      crc ^= bits >> shift & 0xffU;
      for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xedb88320U & (0U - (crc & 1U)));
    }
  }
  return ~crc;
}

std::uint32_t crc32(std::uint32_t crc, std::span<const float> numbers) {
  for (const float number : numbers) crc = crc32(crc, std::array{std::bit_cast<std::int32_t>(number)});
  return crc;
}

}  // namespace flappy::deploy
