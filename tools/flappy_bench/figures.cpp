#include "figures.hpp"

#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "flappy/batch.hpp"
#include "io/append_file.hpp"
#include "io/parallel.hpp"
#include "io/program.hpp"
#include "learn/trainer.hpp"

namespace flappy::bench {
namespace {

using Json = nlohmann::ordered_json;

/// Name of an element of a list: its texts, else its first member, else its place.
std::string name_of(const Json& element, std::size_t place) {
  std::string name;
  if (element.is_object())
    for (const auto& [key, value] : element.items())
      if (value.is_string()) name += (name.empty() ? "" : " ") + value.get<std::string>();
  if (!name.empty() || !element.is_object() || element.empty()) return name.empty() ? std::to_string(place) : name;
  return element.items().begin().key() + " " + element.front().dump();
}

void collect(const Json& json, const std::string& at, std::vector<std::pair<std::string, double>>& figures) {
  if (json.is_number()) figures.emplace_back(at, json.get<double>());
  if (json.is_object())
    for (const auto& [key, value] : json.items()) collect(value, at + "." + key, figures);
  if (json.is_array())
    for (std::size_t i = 0; i < json.size(); ++i) collect(json[i], at + "." + name_of(json[i], i), figures);
}

}  // namespace

void append_figures(const std::filesystem::path& file, const std::string& command, const Json& results) {
  std::vector<std::pair<std::string, double>> figures;
  collect(results, command, figures);
  const std::time_t now = std::time(nullptr);
  char date[32];
  std::strftime(date, sizeof date, "%FT%TZ", std::gmtime(&now));
  std::string lines;
  for (const auto& [name, value] : figures)
    lines += Json{{"figure", name},
                  {"value", value},
                  {"machine", learn::processor()},
                  {"processors", io::processors()},
                  {"instruction_set", sim::best_instruction_set()},
                  {"commit", io::commit()},
                  {"date", date}}
                 .dump() +
             "\n";
  std::error_code none;
  const auto size = std::filesystem::file_size(file, none);
  io::AppendFile(file, none ? 0 : size).write(lines);
}

}  // namespace flappy::bench
