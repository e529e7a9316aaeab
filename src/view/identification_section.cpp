#include <algorithm>
#include <cmath>

#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

void add_parameters(Section& section, const Json& parameters) {
  Figure f{
      .id = "parameters",
      .title = "Fitted parameters",
      .note =
          "Over the value of the file that the fit began with, with 95 % intervals; those that the map cannot see stay "
          "there.",
      .x = {.title = "fitted over before (-)"},
      .y = {},
      .categories = {},
      .series = {
          {.name = "fitted", .draw = Draw::interval, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
  Json rows = Json::array();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Json& p = parameters[i];
    const std::string at = "/parameters/" + std::to_string(i);
    const double nominal = p.at("nominal"), value = p.at("value"), low = p.at("low"), high = p.at("high");
    const bool seen = p.at("seen"), ratio = nominal != 0;
    if (ratio) {
      Series& s = f.series[0];
      s.x.push_back(value / nominal);
      s.low.push_back(seen ? std::min(low / nominal, high / nominal) : NAN);
      s.high.push_back(seen ? std::max(low / nominal, high / nominal) : NAN);
      s.y.push_back(near_category(f.categories.size()));
      f.categories.push_back(p.at("name"));
    }
    rows.push_back({p.at("name"), cell(nominal, at + "/nominal"), cell(value, at + "/value"), cell(low, at + "/low"),
                    cell(high, at + "/high"), seen ? "yes" : "no", p.at("at_bound").get<bool>() ? "yes" : ""});
  }
  const auto n = static_cast<double>(f.categories.size());
  f.series.push_back(
      {.name = "as before", .colour = Colour::black, .x = {1, 1}, .y = {-0.5, n - 0.5}, .low = {}, .high = {}});
  if (n > 0) section.add(f);
  section.add(table("In numbers", {"parameter", "before", "fitted", "95 % from", "to", "seen", "at its bound"},
                    std::move(rows)));
}

void add_channels(Section& section, const Json& channels) {
  Json rows = Json::array();
  Figure f{.id = "channels",
           .title = "Error of the simulated map by channel",
           .note = "Rms over all inputs, before and after the fit, of what it was before.",
           .x = {.title = "rms error over that before (-)", .log = true},
           .y = {},
           .categories = {},
           .series = {
               {.name = "before", .draw = Draw::bars, .colour = Colour::grey, .x = {}, .y = {}, .low = {}, .high = {}},
               {.name = "after", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}}}};
  double least = 1;
  for (const auto& [name, c] : channels.items()) {
    const double before = c.at("rms_before"), after = c.at("rms_after"), of[] = {1, after / before};
    for (std::size_t k = 0; k < 2; ++k) {
      f.series[k].x.push_back(of[k]);
      f.series[k].y.push_back(near_category(f.categories.size(), k, 2));
    }
    if (of[1] > 0) least = std::min(least, of[1]);
    f.categories.push_back(spoken(name.substr(0, name.rfind('_'))));
    rows.push_back({spoken(name), cell(before, "/channels/" + name + "/rms_before"),
                    cell(after, "/channels/" + name + "/rms_after")});
  }
  f.x.low = std::pow(10.0, std::floor(std::log10(0.9 * least)));
  section.add(f);
  section.add(table("", {"channel", "rms before", "rms after"}, std::move(rows)));
}

/// A figure for each channel: simulated forces, before and after the fit, over measured ones.
void add_map(Section& section, const Json& map) {
  const Json &measured = map.at("measured"), &after = map.at("after"), &before = map.at("before");
  for (const auto& [channel, values] : measured.items()) {
    Figure f{.id = "map_" + channel,
             .title = spoken(channel.substr(0, channel.rfind('_'))),
             .note = "Simulated over measured, one point for each input; on the line they agree.",
             .x = {.title = "measured (" + map.at("units").at(channel).get<std::string>() + ")"},
             .y = {.title = "simulated (" + map.at("units").at(channel).get<std::string>() + ")"},
             .categories = {},
             .series = {}};
    const auto x = values.get<std::vector<double>>();
    const std::vector<double> first = before.at(channel), last = after.at(channel);
    if (x.empty() || first.size() != x.size() || last.size() != x.size())
      throw Json::other_error::create(600, "map: " + channel + " has different numbers of points, or none", &map);
    const auto [low, high] = std::ranges::minmax(x);
    f.series.push_back({.name = "equal",
                        .colour = Colour::black,
                        .x = {low, high},
                        .y = {low, high},
                        .low = {},
                        .high = {},
                        .dashed = true});
    f.series.push_back(
        {.name = "before", .draw = Draw::points, .colour = Colour::grey, .x = x, .y = first, .low = {}, .high = {}});
    f.series.push_back(
        {.name = "fitted", .draw = Draw::points, .colour = Colour::blue, .x = x, .y = last, .low = {}, .high = {}});
    section.add(f);
  }
}

}  // namespace

Section identification_section(const std::filesystem::path& file) {
  const Json json = read_results(file);
  return of_results(file, "flappy-identify forces", [&] {
    Section section("identification", "Fit to a measured force map", file.string());
    std::string lead = format("The fit takes the total error of the map from %.3g %% to %.3g %%",
                              json.at("total_error_before").get<double>(), json.at("total_error_after").get<double>());
    if (!json.at("heldout_error").is_null())
      lead += format("; on inputs that it did not see it is %.3g %%", json.at("heldout_error").get<double>());
    section.say(lead + ".", "lead");
    const double misfit = std::sqrt(json.at("misfit").get<double>());
    section.say(format("What is left is %.2g times the %s noise%s.", misfit,
                       json.at("noise").get<std::string>().c_str(),
                       misfit > std::sqrt(2.0) ? ": the model lacks something, and intervals are widened" : ""));
    if (json.contains("map")) add_map(section, json.at("map"));
    add_channels(section, json.at("channels"));
    add_parameters(section, json.at("parameters"));
    return section;
  });
}

}  // namespace flappy::view
