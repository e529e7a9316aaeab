#include "view/results.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>

#include "io/files.hpp"

namespace flappy::view {

using Json = nlohmann::ordered_json;

namespace {

const std::map<std::string, std::string> kChannelNames = {{"angular_acceleration_x", "roll acceleration"},
                                                          {"angular_acceleration_y", "pitch acceleration"},
                                                          {"angular_acceleration_z", "yaw acceleration"},
                                                          {"specific_force_x", "forward specific force"},
                                                          {"specific_force_y", "sideways specific force"},
                                                          {"specific_force_z", "vertical specific force"},
                                                          {"stroke_left", "left stroke"},
                                                          {"stroke_right", "right stroke"},
                                                          {"rotation_left", "left wing's rotation"},
                                                          {"rotation_right", "right wing's rotation"},
                                                          {"battery", "battery voltage"},
                                                          {"current_left", "left motor's current"},
                                                          {"current_right", "right motor's current"},
                                                          {"path_x", "path along x, cameras against IMU"},
                                                          {"path_y", "path along y, cameras against IMU"},
                                                          {"path_z", "path along z, cameras against IMU"},
                                                          {"rotate_x", "turning about x, cameras against gyro"},
                                                          {"rotate_y", "turning about y, cameras against gyro"},
                                                          {"rotate_z", "turning about z, cameras against gyro"}};

}  // namespace

Json read_results(const std::filesystem::path& file) {
  const std::string text = io::read_text(file);
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& e) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(e.byte, text.size()));
    const auto line = std::count(text.begin(), end, '\n') + 1;
    const auto newline = std::find(std::make_reverse_iterator(end), text.rend(), '\n');
    throw io::InputError(file.string() + ":" + std::to_string(line) + ":" +
                         std::to_string(newline - std::make_reverse_iterator(end)) +
                         ": is no JSON; accepted: results of a program, as --json wrote them");
  }
}

void refuse_results(const std::filesystem::path& file, const char* writer, const std::string& what) {
  // `what` looks like "[json.exception.out_of_range.403] key 'where' not found"
  const std::size_t bracket = what.find("] ");
  throw io::InputError(file.string() + ": " + (bracket == std::string::npos ? what : what.substr(bracket + 2)) +
                       "; accepted: what " + writer + " wrote");
}

std::string TextTable::cell(const TextRow& row, const std::string& name) const {
  const auto at = std::ranges::find(names, name);
  const auto k = static_cast<std::size_t>(at - names.begin());
  return at == names.end() || k >= row.size() ? "" : row[k];
}

double TextTable::number(const TextRow& row, const std::string& name) const {
  const std::string text = cell(row, name);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? value : std::numeric_limits<double>::quiet_NaN();
}

TextTable read_text_table(const std::filesystem::path& file) {
  TextTable table;
  std::error_code none;
  if (!std::filesystem::is_regular_file(file, none)) return table;
  const std::string text = io::read_text(file);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    TextRow row;
    const std::size_t most = table.names.empty() ? std::string::npos : table.names.size();
    for (std::size_t begin = at;;) {
      const std::size_t comma = text.find(',', begin);
      if (comma >= end || row.size() + 1 == most) {
        row.push_back(text.substr(begin, end - begin));
        break;
      }
      row.push_back(text.substr(begin, comma - begin));
      begin = comma + 1;
    }
    if (!row.back().empty() && row.back().back() == '\r') row.back().pop_back();
    if (table.names.empty()) table.names = std::move(row);
    else table.rows.push_back(std::move(row));
    at = end + 1;
  }
  return table;
}

std::string spoken(std::string identifier) {
  std::ranges::replace(identifier, '_', ' ');
  return identifier;
}

std::string channel_words(const std::string& channel) {
  const auto found = kChannelNames.find(channel);
  return found == kChannelNames.end() ? spoken(channel) : found->second;
}

std::string in_print(std::string unit) {
  for (const auto& [power, sign] : {std::pair{"^2", "²"}, {"^3", "³"}})
    if (const std::size_t at = unit.find(power); at != std::string::npos) unit.replace(at, 2, sign);
  return unit;
}

std::string magnitude_words(const std::string& name, const std::string& unit) {
  // names write the unit "1/s" as "per_s", and "m/s^2" as "m_s2"
  std::string end = "_" + unit, words = spoken(name);
  if (end.starts_with("_1/")) end.replace(1, 1, "per");
  std::ranges::replace(end, '/', '_');
  std::erase(end, '^');
  if (!unit.empty() && name.ends_with(end)) words.resize(words.size() - end.size());
  if (const std::size_t dot = words.find('.'); dot != std::string::npos)
    words = words.substr(0, dot) + " (" + words.substr(dot + 1) + ")";
  return words;
}

}  // namespace flappy::view
