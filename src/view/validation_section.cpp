#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "io/files.hpp"
#include "io/text.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

using io::format;

constexpr Colour kColourOf[] = {Colour::blue,   Colour::vermillion, Colour::green,
                                Colour::purple, Colour::black,      Colour::grey};
constexpr double kHalf90 = 1.645;    ///< half a 90 % interval of the normal distribution, in standard deviations
constexpr double kOneNumber = 0.01;  ///< p-value below which fits to single flights disagree

const char* unit_of(const std::string& channel) {
  return channel.starts_with("angular_acceleration") ? "rad/s²" : "m/s²";
}

class ValidationPart {
 public:
  ValidationPart(Section& section, const gap::Diagnosis& diagnosis)
      : section_(section), validation_(*diagnosis.validation), flights_(diagnosis.flights.size()) {
    for (const std::string& flight : diagnosis.flights) names_.push_back(io::folder_name(flight));
    for (std::size_t i = 0; i < validation_.ladder.size(); ++i) {
      const std::string& added = validation_.ladder[i].added;
      if (i > 1) effects_.push_back(added);
      rungs_.push_back(i == 0 ? "vehicle's file" : i == 1 ? "parameters refitted" : "+ " + spoken(added));
    }
    for (const gap::HeldOutError& e : validation_.ladder.front().errors) channels_.push_back(e.channel);
    for (const gap::RankedHypothesis& h : diagnosis.hypotheses)
      if (estimates_.empty() && !effects_.empty() && h.effects == effects_) estimates_ = h.parameters;
  }

  void add() {
    section_.add(Json{{"kind", "heading"}, {"text", "Would a laboratory believe it?"}});
    add_ladder();
    if (!validation_.controls.empty()) add_controls();
    if (flights_ > 1 && !validation_.agreements.empty()) add_agreements();
  }

 private:
  const gap::HeldOutError& error(std::size_t rung, const std::string& channel) const {
    return *std::ranges::find(validation_.ladder[rung].errors, channel, &gap::HeldOutError::channel);
  }

  void add_ladder() {
    const std::size_t last = rungs_.size() - 1;
    std::vector<std::string> falls;
    for (const std::string& c : channels_) {
      const gap::HeldOutError& e = error(last, c);
      falls.push_back(
          format("%s from %.3g to %.3g %s (90 %%: %.3g to %.3g; %.3g where all flights of a type are held "
                 "out)",
                 channel_words(c).c_str(), error(0, c).rms, e.rms, unit_of(c), e.low, e.high, e.by_type));
    }
    section_.say(std::string(flights_ > 1 ? "What is left in flights that the fit did not see goes, from the vehicle's "
                                            "file on to the last rung: "
                                          : "There is one flight, and nothing could be held out. What is left in it "
                                            "goes, from the vehicle's file on to the last rung: ") +
                 spoken_list(falls) + ".");
    // channels with the same unit share figures
    std::map<std::string, std::vector<std::string>> kinds;
    for (const std::string& c : channels_) kinds[c.substr(0, c.rfind('_'))].push_back(c);
    for (const auto& [kind, channels] : kinds) add_ladder(kind, channels);
    Json rows = Json::array();
    std::vector<std::string> head = {"rung"};
    for (const std::string& c : channels_) {
      const std::string name = channel_words(c);
      head.insert(head.end(), {name + " (" + unit_of(c) + ")", "90 % from", "to", "types held out"});
    }
    for (std::size_t i = 0; i < rungs_.size(); ++i) {
      Json row = {rungs_[i]};
      for (const std::string& c : channels_) {
        const gap::HeldOutError& e = error(i, c);
        const std::string at = "/validation/ladder/" + std::to_string(i) + "/held_out/" + c;
        row.insert(row.end(), {cell(e.rms, at + "/rms"), cell(e.low, at + "/low"), cell(e.high, at + "/high"),
                               cell(e.by_type, at + "/by_type")});
      }
      rows.push_back(std::move(row));
    }
    section_.add(table("What is left, rung by rung (rms)", head, std::move(rows)));
  }

  /// Adds two figures on the same scale: errors with each flight held out, and with each type of flight held out.
  void add_ladder(const std::string& kind, const std::vector<std::string>& channels) {
    double most = 0;
    Figure each{.id = "ladder_" + kind,
                .title = "What is left, one effect upon the other",
                .note = "Rms of what is left of the measured " + spoken(kind) +
                        ", each flight under the fit to the others; intervals hold 90 % of draws of blocks of the "
                        "flights. Every rung has what stands above it, too.",
                .x = {.title = std::string("rms of what is left (") + unit_of(channels.front()) + ")", .low = 0.0},
                .y = {},
                .categories = rungs_,
                .series = {}};
    Figure kinds = each;
    kinds.id = "ladder_kinds_" + kind;
    kinds.title = "The same with every type of flight held out";
    kinds.note =
        "All flights of a type (their names differ by a number), under the fit to the other types; "
        "where all are of one type, under the fit to all.";
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
        const gap::HeldOutError& e = error(i, channels[k]);
        const double y = near_category(i, k, channels.size());
        s.x.push_back(e.rms), s.y.push_back(y), s.low.push_back(e.low), s.high.push_back(e.high);
        of_kinds.x.push_back(e.by_type), of_kinds.y.push_back(y);
        most = std::max({most, s.high.back(), of_kinds.x.back()});
      }
      each.series.push_back(std::move(s));
      kinds.series.push_back(std::move(of_kinds));
    }
    each.x.high = kinds.x.high = 1.05 * most;
    section_.add(each);
    section_.add(kinds);
  }

  void add_controls() {
    const std::vector<gap::Validation::Control>& controls = validation_.controls;
    Figure f{.id = "controls",
             .title = "What each effect takes away, and copies of it at other times",
             .note =
                 "Share of the rms that an effect takes away, jointly with all others, in the channel where it takes "
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
      const double gain = controls[i].gain, shifted = controls[i].best_of_shifted;
      const std::string name = spoken(controls[i].effect);
      f.categories.push_back(name + ", " + channel_words(controls[i].channel));
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

  /// The estimate of a parameter by the fit to all flights; null where there is none.
  const gap::Estimate* estimate(const std::string& name) const {
    const auto at = std::ranges::find(estimates_, name, &gap::Estimate::name);
    return at == estimates_.end() ? nullptr : &*at;
  }
  std::string unit_of_magnitude(const std::string& name) const {
    return estimate(name) == nullptr ? "" : estimate(name)->unit;
  }

  void add_agreements() {
    const std::vector<gap::Validation::Agreement>& list = validation_.agreements;
    std::vector<std::string> differ;
    std::vector<std::pair<std::string, std::vector<const gap::Validation::Agreement*>>>
        groups;  // agreements with the same effect and unit
    Json rows = Json::array();
    for (std::size_t i = 0; i < list.size(); ++i) {
      const gap::Validation::Agreement& a = list[i];
      const std::string &name = a.name, unit = unit_of_magnitude(name);
      const std::string at = "/validation/agreements/" + std::to_string(i);
      const bool one = !(a.p_value < kOneNumber);  // NaN where a flight does not determine the magnitude
      if (!one) differ.push_back(magnitude_words(name, unit));
      const std::vector<double>& values = a.value;
      const auto [least, most] = std::ranges::minmax_element(values);
      const auto place = [&](auto found) { return at + "/value/" + std::to_string(found - values.begin()); };
      rows.push_back({magnitude_words(name, unit), cell(*least, place(least)), cell(*most, place(most)), in_print(unit),
                      std::isnan(a.p_value) ? Json("–") : cell(a.p_value, at + "/p_value", 2),
                      one ? "one number" : "differs"});
      const std::string group = name.substr(0, name.find('.')) + "|" + unit;
      if (groups.empty() || groups.back().first != group) groups.push_back({group, {}});
      groups.back().second.push_back(&a);
    }
    section_.say(
        differ.empty()
            ? format("From flight to flight all %zu magnitudes are one number, as far as their errors tell.",
                     list.size())
            : format("From flight to flight %zu of %zu magnitudes are one number, as far as their errors tell. By "
                     "more than that %s: there an equation holds by and large only.",
                     list.size() - differ.size(), list.size(),
                     (spoken_list(differ) + (differ.size() == 1 ? " differs" : " differ")).c_str()));
    for (std::size_t g = 0; g < groups.size(); ++g) add_agreement(g, groups[g].second);
    section_.add(table(
        "Magnitudes from flight to flight", {"magnitude", "least", "most", "unit", "p", "verdict"}, std::move(rows),
        format("p: that magnitudes which are one number differ so much; below %g they are taken to differ.",
               kOneNumber)));
  }

  void add_agreement(std::size_t g, const std::vector<const gap::Validation::Agreement*>& magnitudes) {
    const std::string &first = magnitudes.front()->name, unit = unit_of_magnitude(first);
    const std::string effect = spoken(first.substr(0, first.find('.')));
    Figure f{.id = "agreement_" + std::to_string(g + 1),
             .title = magnitudes.size() == 1 ? magnitude_words(first, unit) + ", flight by flight"
                                             : effect + ", flight by flight",
             .note = "What each flight alone says, with its 90 % interval; dashed: the fit to all flights.",
             .x = {.title = "magnitude (" + (unit.empty() ? "-" : in_print(unit)) + ")"},
             .y = {},
             .categories = names_,
             .series = {}};
    for (std::size_t k = 0; k < magnitudes.size(); ++k) {
      const std::string& name = magnitudes[k]->name;
      const std::string words = magnitude_words(name.substr(name.find('.') + 1), unit);
      const std::vector<double>&value = magnitudes[k]->value, &sd = magnitudes[k]->sd;
      Series s{.name = words,
               .draw = Draw::interval,
               .colour = kColourOf[k % std::size(kColourOf)],
               .x = value,
               .y = {},
               .low = {},
               .high = {}};
      for (std::size_t i = 0; i < value.size(); ++i) {
        s.y.push_back(near_category(i, k, magnitudes.size()));
        s.low.push_back(value[i] - kHalf90 * sd.at(i)), s.high.push_back(value[i] + kHalf90 * sd.at(i));
      }
      f.series.push_back(s);
      if (estimate(name) == nullptr) continue;
      const double all = estimate(name)->value;
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
  const gap::Validation& validation_;
  std::size_t flights_;
  std::vector<std::string> names_, rungs_, effects_, channels_;
  std::vector<gap::Estimate> estimates_;  ///< estimates by the fit to all flights
};

}  // namespace

void add_validation(Section& section, const gap::Diagnosis& diagnosis) { ValidationPart(section, diagnosis).add(); }

}  // namespace flappy::view
