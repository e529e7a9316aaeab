#include "io/toml_writer.hpp"

#include <algorithm>
#include <sstream>

#include "io/files.hpp"
#include "io/toml.hpp"

namespace flappy::io {
namespace {

/// A value as TOML, on one line.
std::string text_of(const toml::node& node);

std::string text_of(const toml::table& table) {
  std::string text;
  for (const auto& [key, node] : table) {
    text += (text.empty() ? "" : ", ") + toml_path("", key.str()) + " = " + text_of(node);
  }
  return "{" + text + "}";
}

std::string text_of(const toml::array& array) {
  std::string text;
  for (const auto& node : array) text += (text.empty() ? "" : ", ") + text_of(node);
  return "[" + text + "]";
}

std::string text_of(const toml::node& node) {
  if (const auto* table = node.as_table()) return text_of(*table);
  if (const auto* array = node.as_array()) return text_of(*array);
  if (const auto* string = node.as_string()) return toml_string(string->get());
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "true" : "false";
  if (const auto* number = node.as_floating_point()) return toml_number(number->get());
  std::ostringstream time;
  node.visit([&](const auto& value) { time << value; });
  return time.str();
}

void write_section(std::string& text, const std::string& header, const toml::table& table, const std::string& path) {
  if (!header.empty()) text += (text.empty() ? "" : "\n") + header + "\n";
  for (const auto& [key, node] : table) {
    if (node.is_table() || node.is_array_of_tables()) continue;
    text += toml_path("", key.str()) + " = " + text_of(node) + "\n";
  }
  for (const auto& [key, node] : table) {
    const std::string here = toml_path(path, key.str());
    if (const auto* below = node.as_table()) write_section(text, "[" + here + "]", *below, here);
    if (!node.is_array_of_tables()) continue;
    for (const auto& each : *node.as_array()) write_section(text, "[[" + here + "]]", *each.as_table(), here);
  }
}

}  // namespace

std::string toml_string(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      out += "\\u00";
      out += kDigits[byte >> 4];
      out += kDigits[byte & 15];
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string toml_number(double value) {
  const std::string digits = shortest_digits(value);
  return digits.find_first_of(".en") == std::string::npos ? digits + ".0" : digits;
}

bool is_bare(std::string_view key) {
  const auto in = [](char c, char low, char high) { return c >= low && c <= high; };
  return !key.empty() && std::ranges::all_of(key, [&](char c) {
    return in(c, 'a', 'z') || in(c, 'A', 'Z') || in(c, '0', '9') || c == '_' || c == '-';
  });
}

std::string toml_path(const std::string& path, std::string_view key) {
  const std::string name = is_bare(key) ? std::string(key) : toml_string(key);
  return path.empty() ? name : path + "." + name;
}

std::string toml_text(const toml::table& table) {
  std::string text;
  write_section(text, "", table, "");
  return text;
}

}  // namespace flappy::io
