#include <algorithm>
#include <map>
#include <sstream>
#include <utility>

#include "io/files.hpp"
#include "io/refuse.hpp"
#include "view/figure.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

struct Measured {
  std::string date, commit;
  double value;
};

/// [figure][machine] in the order of the file.
using Figures = std::map<std::string, std::map<std::string, std::vector<Measured>>>;

Figures read_figures(const std::filesystem::path& file) {
  Figures all;
  std::istringstream lines(io::read_text(file));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    try {
      const Json json = Json::parse(line);
      const std::string machine = json.at("machine").get<std::string>() + ", " + json.at("processors").dump() +
                                  " processors, " + json.at("instruction_set").get<std::string>();
      all[json.at("figure")][machine].push_back({json.at("date"), json.at("commit"), json.at("value")});
    } catch (const Json::exception&) {
      throw io::InputError(file.string() + ":" + std::to_string(number) +
                           ": is no figure of a benchmark; accepted: lines that flappy-bench --figures wrote");
    }
  }
  if (all.empty()) io::refuse(file, "has no figure", "lines that flappy-bench --figures wrote");
  return all;
}

constexpr Colour kMachines[] = {Colour::blue, Colour::vermillion, Colour::green, Colour::purple, Colour::black};

}  // namespace

Section speed_section(const std::filesystem::path& file) {
  const Figures all = read_figures(file);
  std::map<std::string, std::string> first;  // date of each commit's first figure
  for (const auto& [figure, machines] : all)
    for (const auto& [machine, values] : machines)
      for (const Measured& m : values)
        if (std::string& date = first[m.commit]; date.empty() || m.date < date) date = m.date;
  std::vector<std::string> commits;
  for (const auto& [commit, date] : first) commits.push_back(commit);
  std::ranges::stable_sort(commits, {}, [&](const std::string& c) { return first.at(c); });
  Section section("speed", "Figures of flappy-bench over commits", file.string());
  std::string list;
  for (std::size_t i = 0; i < commits.size(); ++i)
    list += (i > 0 ? ", " : "") + std::to_string(i) + ": " + commits[i].substr(0, 12);
  section.say("Commits, by the date of their first figure: " + list + ".", "note");
  std::size_t number = 0;
  for (const auto& [figure, machines] : all) {
    Figure f{.id = "figure_" + std::to_string(number++),
             .title = figure,
             .note = "",
             .x = {.title = "commit"},
             .y = {.title = figure.substr(figure.rfind('.') + 1)},
             .categories = {},
             .series = {}};
    for (const auto& [machine, values] : machines) {
      Series s{.name = machine,
               .draw = Draw::points,
               .colour = kMachines[f.series.size() % std::size(kMachines)],
               .x = {},
               .y = {},
               .low = {},
               .high = {}};
      for (const Measured& m : values) {
        s.x.push_back(static_cast<double>(std::ranges::find(commits, m.commit) - commits.begin()));
        s.y.push_back(m.value);
      }
      f.series.push_back(std::move(s));
    }
    section.add(f);
  }
  return section;
}

}  // namespace flappy::view
