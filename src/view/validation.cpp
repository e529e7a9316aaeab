// What a laboratory asks before it believes an effect, as words and figures.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

constexpr Colour kColourOf[] = {Colour::blue,   Colour::vermillion, Colour::green,
                                Colour::purple, Colour::black,      Colour::grey};
/// Nine in ten of a normal distribution lie within so many standard deviations.
constexpr double kHalf90 = 1.645;
/// Sizes of flights that are one number differ by more than this in one comparison of a hundred.
constexpr double kOneNumber = 0.01;

const char* unit_of(const std::string& channel) { return channel.starts_with("torque") ? "rad/s²" : "m/s²"; }

class Belief {
 public:
  Belief(Section& section, const Json& diagnosis)
      : section_(section), json_(diagnosis.at("validation")), flights_(diagnosis.at("flights").size()) {
    for (const Json& flight : diagnosis.at("flights"))
      names_.push_back(std::filesystem::path(flight.get<std::string>()).filename().string());
    for (std::size_t i = 0; i < json_.at("ladder").size(); ++i) {
      const std::string added = json_.at("ladder")[i].at("added");
      if (i > 1) effects_.push_back(added);
      rungs_.push_back(i == 0 ? "vehicle's file" : i == 1 ? "parameters refitted" : "+ " + spoken(added));
    }
    for (const auto& [channel, error] : json_.at("ladder").at(0).at("held_out").items()) channels_.push_back(channel);
    for (const Json& c : diagnosis.at("candidates"))
      if (sizes_.is_null() && !effects_.empty() && c.at("effects") == Json(effects_)) sizes_ = c.at("parameters");
  }

  void tell() {
    section_.add(Json{{"kind", "heading"}, {"text", "Would a laboratory believe it?"}});
    tell_ladder();
    if (!json_.at("controls").empty()) tell_controls();
    if (flights_ > 1 && !json_.at("agreements").empty()) tell_agreements();
  }

 private:
  const Json& error(std::size_t rung, const std::string& channel) const {
    return json_.at("ladder").at(rung).at("held_out").at(channel);
  }

  void tell_ladder() {
    const std::size_t last = rungs_.size() - 1;
    std::vector<std::string> falls;
    for (const std::string& c : channels_) {
      const Json& e = error(last, c);
      falls.push_back(
          format("%s from %.3g to %.3g %s (90 %%: %.3g to %.3g; %.3g where all flights of a kind are held "
                 "out)",
                 channel_words(c).c_str(), error(0, c).at("rms").get<double>(), e.at("rms").get<double>(), unit_of(c),
                 e.at("low").get<double>(), e.at("high").get<double>(), e.at("by_type").get<double>()));
    }
    section_.say(std::string(flights_ > 1 ? "What is left in flights that the fit did not see goes, from the vehicle's "
                                            "file on to the last rung: "
                                          : "There is one flight, and nothing could be held out. What is left in it "
                                            "goes, from the vehicle's file on to the last rung: ") +
                 spoken_list(falls) + ".");
    // channels of one unit share their figures
    std::map<std::string, std::vector<std::string>> kinds;
    for (const std::string& c : channels_) kinds[c.substr(0, c.find('_'))].push_back(c);
    for (const auto& [kind, channels] : kinds) add_ladder(kind, channels);
    Json rows = Json::array();
    std::vector<std::string> head = {"rung"};
    for (const std::string& c : channels_) {
      const std::string name = channel_words(c);
      head.insert(head.end(), {name + " (" + unit_of(c) + ")", "90 % from", "to", "kinds held out"});
    }
    for (std::size_t i = 0; i < rungs_.size(); ++i) {
      Json row = {rungs_[i]};
      for (const std::string& c : channels_)
        for (const char* key : {"rms", "low", "high", "by_type"})
          row.push_back(
              cell(error(i, c).at(key), "/validation/ladder/" + std::to_string(i) + "/held_out/" + c + "/" + key));
      rows.push_back(std::move(row));
    }
    section_.add(table("What is left, rung by rung (rms)", head, std::move(rows)));
  }

  /// Each flight held out, and beside it each kind of flight, to the same scale.
  void add_ladder(const std::string& kind, const std::vector<std::string>& channels) {
    double most = 0;
    Figure each{.id = "ladder_" + kind,
                .title = "What is left, one effect upon the other",
                .note = "Rms of what is left of the measured " + kind +
                        ", each flight under the fit to the others; intervals hold 90 % of draws of blocks of the "
                        "flights. Every rung has what stands above it, too.",
                .x = {.title = std::string("rms of what is left (") + unit_of(channels.front()) + ")", .low = 0.0},
                .y = {},
                .categories = rungs_,
                .series = {}};
    Figure kinds = each;
    kinds.id = "ladder_kinds_" + kind;
    kinds.title = "The same with every kind of flight held out";
    kinds.note =
        "All flights of a kind, those whose names differ by a number, under the fit to the other kinds; "
        "where all are of one kind, under the fit to all.";
    for (std::size_t k = 0; k < channels.size(); ++k) {
      Series s{.name = channel_words(channels[k]),
               .draw = Draw::interval,
               .colour = kColourOf[k % std::size(kColourOf)],
               .x = {},
               .y = {},
               .low = {},
               .high = {}};
      Series of_kinds = s;
      of_kinds.draw = Draw::points;
      for (std::size_t i = 0; i < rungs_.size(); ++i) {
        const Json& e = error(i, channels[k]);
        const double y = near_category(i, k, channels.size());
        s.x.push_back(e.at("rms")), s.y.push_back(y), s.low.push_back(e.at("low")), s.high.push_back(e.at("high"));
        of_kinds.x.push_back(e.at("by_type")), of_kinds.y.push_back(y);
        most = std::max({most, s.high.back(), of_kinds.x.back()});
      }
      each.series.push_back(std::move(s));
      kinds.series.push_back(std::move(of_kinds));
    }
    each.x.high = kinds.x.high = 1.05 * most;
    section_.add(each);
    section_.add(kinds);
  }

  void tell_controls() {
    const Json& controls = json_.at("controls");
    Figure f{.id = "controls",
             .title = "What each effect takes away, and copies of it at other times",
             .note =
                 "Share of the rms that an effect takes away beside all others, in the channel where it takes "
                 "most, in flights held out. The grey bar is the best of the copies of its part that were shifted "
                 "in time, and should be 0.",
             .x = {.title = "taken off the rms (%)"},
             .y = {},
             .categories = {},
             .series = {}};
    Series own{
        .name = "the effect", .draw = Draw::bars, .colour = Colour::blue, .x = {}, .y = {}, .low = {}, .high = {}};
    Series copy = own;
    copy.name = "best copy shifted in time", copy.colour = Colour::grey;
    std::vector<std::string> beaten;
    double least = INFINITY, most = 0;
    for (std::size_t i = 0; i < controls.size(); ++i) {
      const Json& c = controls[i];
      const double gain = c.at("gain"), shifted = c.at("best_of_shifted");
      const std::string name = spoken(c.at("effect"));
      f.categories.push_back(name + ", " + channel_words(c.at("channel")));
      own.x.push_back(100 * gain), own.y.push_back(near_category(i, 0, 2));
      copy.x.push_back(100 * shifted), copy.y.push_back(near_category(i, 1, 2));
      if (gain <= shifted) beaten.push_back(name);
      least = std::min(least, 100 * gain), most = std::max(most, 100 * shifted);
    }
    f.series = {own, copy};
    section_.say(
        beaten.empty()
            ? format("Shifted in time no effect explains as much: each takes %.0f %% or more off the rms where it "
                     "takes most, its shifted copies %.0f %% at best.",
                     least, most)
            : "Shifted in time " + spoken_list(beaten) +
                  (beaten.size() == 1 ? " explains as much as at its own: do not believe it."
                                      : " explain as much as at their own: do not believe them."));
    section_.add(f);
  }

  std::string unit_of_size(const std::string& name) const {
    return sizes_.is_object() && sizes_.contains(name) ? sizes_.at(name).at("unit").get<std::string>() : "";
  }

  void tell_agreements() {
    const Json& list = json_.at("agreements");
    std::vector<std::string> differ;
    std::vector<std::pair<std::string, std::vector<const Json*>>> groups;  // sizes of one effect in one unit
    Json rows = Json::array();
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Json& a = list[i];
      const std::string name = a.at("name"), unit = unit_of_size(name);
      const std::string at = "/validation/agreements/" + std::to_string(i);
      const Json& p = a.at("p_value");  // null where a flight says nothing of the size
      const bool one = p.is_null() || p.get<double>() >= kOneNumber;
      if (!one) differ.push_back(size_words(name, unit));
      const std::vector<double> values = a.at("value");
      const auto [least, most] = std::ranges::minmax_element(values);
      const auto place = [&](auto found) { return at + "/value/" + std::to_string(found - values.begin()); };
      rows.push_back({size_words(name, unit), cell(*least, place(least)), cell(*most, place(most)), in_print(unit),
                      p.is_null() ? Json("–") : cell(p, at + "/p_value", 2), one ? "one number" : "differs"});
      const std::string group = name.substr(0, name.find('.')) + "|" + unit;
      if (groups.empty() || groups.back().first != group) groups.push_back({group, {}});
      groups.back().second.push_back(&a);
    }
    section_.say(
        differ.empty()
            ? format("From flight to flight all %zu sizes are one number, as far as their errors tell.", list.size())
            : format("From flight to flight %zu of %zu sizes are one number, as far as their errors tell. By "
                     "more than that %s: there an equation holds by and large only.",
                     list.size() - differ.size(), list.size(),
                     (spoken_list(differ) + (differ.size() == 1 ? " differs" : " differ")).c_str()));
    for (std::size_t g = 0; g < groups.size(); ++g) add_agreement(g, groups[g].second);
    section_.add(table(
        "Sizes from flight to flight", {"size", "least", "most", "unit", "p", "verdict"}, std::move(rows),
        format("p: that sizes which are one number differ so much; below %g they are taken to differ.", kOneNumber)));
  }

  void add_agreement(std::size_t g, const std::vector<const Json*>& sizes) {
    const std::string first = sizes.front()->at("name"), unit = unit_of_size(first);
    const std::string effect = spoken(first.substr(0, first.find('.')));
    Figure f{
        .id = "agreement_" + std::to_string(g + 1),
        .title = sizes.size() == 1 ? size_words(first, unit) + ", flight by flight" : effect + ", flight by flight",
        .note = "What each flight alone says, with its 90 % interval; dashed: the fit to all flights.",
        .x = {.title = "size (" + (unit.empty() ? "-" : in_print(unit)) + ")"},
        .y = {},
        .categories = names_,
        .series = {}};
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const std::string name = sizes[k]->at("name");
      const std::string words = size_words(name.substr(name.find('.') + 1), unit);
      const std::vector<double> value = sizes[k]->at("value"), sd = sizes[k]->at("sd");
      Series s{.name = words,
               .draw = Draw::interval,
               .colour = kColourOf[k % std::size(kColourOf)],
               .x = value,
               .y = {},
               .low = {},
               .high = {}};
      for (std::size_t i = 0; i < value.size(); ++i) {
        s.y.push_back(near_category(i, k, sizes.size()));
        s.low.push_back(value[i] - kHalf90 * sd.at(i)), s.high.push_back(value[i] + kHalf90 * sd.at(i));
      }
      f.series.push_back(s);
      if (!sizes_.is_object() || !sizes_.contains(name)) continue;
      const double all = sizes_.at(name).at("value");
      f.series.push_back({.name = words + ", all flights",
                          .colour = s.colour,
                          .x = {all, all},
                          .y = {-0.5, static_cast<double>(flights_) - 0.5},
                          .low = {},
                          .high = {},
                          .dashed = true});
    }
    section_.add(f);
  }

  Section& section_;
  const Json& json_;
  std::size_t flights_;
  std::vector<std::string> names_, rungs_, effects_, channels_;
  Json sizes_;  ///< of the fit to all flights
};

}  // namespace

void tell_validation(Section& section, const Json& diagnosis) { Belief(section, diagnosis).tell(); }

}  // namespace flappy::view
