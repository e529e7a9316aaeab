#include "gap/diagnose/summary.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "gap/result/sentences.hpp"
#include "io/config.hpp"
#include "io/text.hpp"

namespace flappy::gap {
namespace {

/// Rows of lists. Size: of what is printed.
constexpr std::size_t kParameters = 6, kBackground = 2, kRunnersUp = 3, kMoved = 3, kTerms = 3, kSensors = 3, kSeen = 5;

std::string estimate_line(const Estimate& s) {
  const bool grams = s.unit == "kg";
  const double factor = grams ? 1e3 : 1;
  const std::string unit = grams ? "g" : s.unit;
  return io::format("  %-36s %10.3g (%.3g to %.3g)%s%s", s.name.c_str(), factor * s.value, factor * s.low,
                    factor * s.high, unit.empty() ? "" : " ", unit.c_str());
}

std::string place_of(const UnexplainedTerm& u) { return u.channel + ", " + harmonic_words(u.harmonic); }

std::string verdict_line(const Diagnosis& diagnosis, bool contrast) {
  const Verdict& v = diagnosis.verdict;
  const std::string words = verdict_words(v, contrast, as_it_is, any_told(diagnosis.seen));
  if (v.kind == VerdictKind::data) return words;
  const bool together = v.kind == VerdictKind::group;
  return words + " (" + (together ? io::format("together %.2f", v.probability) : probability_words(v.probability)) +
         ")";
}

std::string proposal_line(const NextExperiment& n) {
  const std::string flight =
      "configs/gap/experiments/" + (n.change.empty() ? n.manoeuvre + ".toml" : std::string("interventions.toml"));
  const std::string what =
      n.change.empty() ? "fly " + flight : n.change + ", then fly " + n.manoeuvre + " of " + flight;
  return io::format("to tell %s from %s, %s (%.3g nats expected)",
                    hypothesis_words(n.separates.front(), as_it_is).c_str(),
                    hypothesis_words(n.separates.back(), as_it_is).c_str(), what.c_str(), n.expected_nats);
}

std::string next_line(const Diagnosis& r, const std::string& out) {
  const Verdict& c = r.verdict;
  const std::string folder = out.empty() ? "DIR" : std::filesystem::absolute(out).lexically_normal().string();
  switch (c.kind) {
    case VerdictKind::parameters:
      if (!r.reference.empty())
        return any_told(r.seen) ? "next: fly more reference sessions, to tell whether what is seen is a change"
                                : "next: nothing to correct; more reference sessions show smaller changes";
      [[fallthrough]];
    case VerdictKind::effect:
      return "next: train on what was found, with flappy-train --adapt " + folder + " --init RUN; or fly on with " +
             folder + "/vehicle_corrected.toml";
    case VerdictKind::group:
      return "next: fly so that these differ, and diagnose old and new flights together";
    case VerdictKind::none:
      return r.reference.empty() ? "next: nothing to correct; fly harder manoeuvres to look further"
                                 : "next: nothing to correct; fly both sessions harder to look further";
    case VerdictKind::unknown:
      return "next: see what the residuals depend on; where that is no help, fly harder manoeuvres there";
    case VerdictKind::data:
      return std::string("next: ") + kMendLogs;
  }
  return "";
}

/// The largest discovery of each test that says where: phase, regime and frequency.
std::vector<ResidualLocation> one_of_each_test(const Diagnosis& r) {
  std::vector<ResidualLocation> list;
  for (const ResidualTest test : {ResidualTest::phase, ResidualTest::regime, ResidualTest::frequency})
    for (const ResidualLocation& p : largest_discoveries(r, Fitted::refit, r.locations.size()))
      if (p.test == test) {
        list.push_back(p);
        break;
      }
  return list;
}

/// The quantity whose error the correction reduces most, as a share of the recorded value.
const ClosedLoop* most_corrected(const std::vector<ClosedLoop>& list) {
  const ClosedLoop* most = nullptr;
  double largest = 0;
  for (const ClosedLoop& c : list) {
    const double before = std::abs(c.nominal - c.recorded), after = std::abs(c.corrected - c.recorded);
    const double share = (before - after) / (std::abs(c.recorded) + 1e-9);
    if (share > largest) largest = share, most = &c;
  }
  return most;
}

std::string sensor_line(const Estimate& s) {
  const bool more = s.value > 0;
  const auto told = [&](const std::string& what, double factor, const char* unit, const std::string& how) {
    const double a = factor * (more ? s.low : -s.high), b = factor * (more ? s.high : -s.low);
    return io::format("  %s %.2g %s %s (%.2g to %.2g)", what.c_str(), factor * std::abs(s.value), unit, how.c_str(), a,
                      b);
  };
  const std::string axis = s.name.substr(s.name.rfind('.') + 1, 1), way = more ? "+" : "-";
  if (s.name == "imu.latency_s") return told("the IMU's samples are", 1e3, "ms", more ? "older" : "younger");
  if (s.name == "command.delay_s") return told("the inputs act", 1e3, "ms", more ? "later" : "earlier");
  if (s.name == "power_delay.delay_s") return told("those of currents are", 1e3, "ms", more ? "older" : "younger");
  if (const std::size_t delay = s.name.find("_delay"); delay != std::string::npos)
    return told("the samples of " + s.name.substr(0, delay) + ".csv are", 1e3, "ms", more ? "older" : "younger");
  if (const std::size_t clock = s.name.find("_clock"); clock != std::string::npos)
    return told("the clock of " + s.name.substr(0, clock) + ".csv is", 1e6, "ppm", more ? "fast" : "slow");
  if (s.name.starts_with("imu_mounting"))
    return told("the IMU is turned by", 180 / std::numbers::pi, "deg", "about " + way + axis);
  return told("the IMU sits", 1e3, "mm", "along " + way + axis);
}

/// The rungs of the ladder that the logs show.
std::vector<std::string> ladder_lines(const Diagnosis& diagnosis) {
  std::vector<std::string> lines;
  const auto times = [](const std::optional<double>& e) {
    return e ? io::format("%8.1f", *e) : std::string("       -");
  };
  for (const LadderRung& r : diagnosis.ladder) {
    if (!r.nominal && !r.refit) continue;
    if (lines.empty())
      lines.push_back(
          "error over noise: vehicle's file, refitted, with the best effect; probability of an effect there:");
    lines.push_back(io::format("  %-18s", r.rung.c_str()) + times(r.nominal) + times(r.refit) + times(r.effect) +
                    io::format("%8.2f", r.probability));
  }
  return lines;
}

/// Lines of what the flights show, which stand before the verdict.
std::vector<std::string> seen_lines(const Diagnosis& diagnosis) {
  std::vector<std::string> lines;
  if (diagnosis.seen.empty()) return lines;
  const std::vector<std::string> told = seen_words(diagnosis.seen, as_it_is);
  if (told.empty()) lines.push_back("Seen: nothing beyond what sessions of this robot differ by");
  else lines.push_back("Seen, compared with the reference:");
  for (std::size_t i = 0; i < told.size() && i < kSeen; ++i) lines.push_back("  " + told[i]);
  for (std::size_t i = 0; i < diagnosis.odd.size() && i < kSeen; ++i)
    lines.push_back("  " + odd_words(diagnosis.odd[i], as_it_is));
  return lines;
}

}  // namespace

std::vector<std::string> summary_of(const Diagnosis& diagnosis, const std::string& out) {
  std::vector<std::string> lines = seen_lines(diagnosis);
  lines.push_back(diagnosis.complete ? verdict_line(diagnosis, !diagnosis.reference.empty())
                                     : capitalised(kStopped) + ": " + kNoVerdict);
  if (diagnosis.verdict.kind == VerdictKind::data) {
    for (std::size_t i = 0; i < diagnosis.faults.size() && i + 3 < kSummaryLines; ++i)
      lines.push_back(io::format("  %s:%zu: %s", diagnosis.faults[i].file.c_str(), diagnosis.faults[i].line,
                                 diagnosis.faults[i].what.c_str()));
    lines.push_back(next_line(diagnosis, out));
    return lines;
  }
  for (const NamedDiagnosis& s : diagnosis.sets)
    lines.push_back(s.name + ": " + (s.diagnosis.complete ? verdict_line(s.diagnosis, true) : kStopped));
  for (const std::string& warning : diagnosis.warnings) lines.push_back("warning: " + warning);
  std::vector<const RankedHypothesis*> ranked;
  for (const RankedHypothesis& c : diagnosis.hypotheses) ranked.push_back(&c);
  std::ranges::stable_sort(ranked, std::greater{}, &RankedHypothesis::probability);
  const bool named = diagnosis.verdict.kind == VerdictKind::effect || diagnosis.verdict.kind == VerdictKind::group;
  const RankedHypothesis* concluded = nullptr;
  for (const RankedHypothesis* c : ranked)
    if (concluded == nullptr && named && c->kind == HypothesisKind::effect &&
        std::ranges::all_of(c->effects,
                            [&](const std::string& e) { return std::ranges::count(diagnosis.verdict.effects, e) > 0; }))
      concluded = c;
  if (concluded != nullptr) {
    lines.push_back("magnitude, with its 90 % interval:");
    for (std::size_t i = 0; i < concluded->parameters.size() && i < kParameters; ++i)
      lines.push_back(estimate_line(concluded->parameters[i]));
  }
  if (diagnosis.other_law)
    lines.push_back(io::format("by another law than the catalogue's, most so in %s, on %s (%s)",
                               place_of(*diagnosis.other_law).c_str(), diagnosis.other_law->regime.c_str(),
                               diagnosis.other_law->function.c_str()));
  if (!diagnosis.background.empty()) {
    lines.push_back("besides, in the corrected vehicle, not told from chance:");
    for (std::size_t i = 0; i < diagnosis.background.size() && i < kBackground; ++i)
      lines.push_back(estimate_line(diagnosis.background[i]));
  }
  if ((diagnosis.verdict.kind == VerdictKind::unknown || diagnosis.verdict.remainder) &&
      !diagnosis.unexplained.empty()) {
    lines.push_back(diagnosis.jointly_with.empty()
                        ? "what is left depends on:"
                        : "what is left, with " + spoken_list(diagnosis.jointly_with) + " in force, depends on:");
    for (std::size_t i = 0; i < diagnosis.unexplained.size() && i < kTerms; ++i)
      lines.push_back(io::format("  %s on %s (%s), %.1f times what models of this robot get wrong",
                                 place_of(diagnosis.unexplained[i]).c_str(), diagnosis.unexplained[i].regime.c_str(),
                                 diagnosis.unexplained[i].function.c_str(),
                                 diagnosis.unexplained[i].times_prior_scale));
  }
  std::string others;
  std::size_t shown = 0;
  for (const RankedHypothesis* c : ranked) {
    const bool is = named ? c == concluded : name_of(c->kind) == std::string(name_of(diagnosis.verdict.kind));
    if (is || shown == kRunnersUp) continue;
    others += io::format("%s%s %.2g", shown == 0 ? "" : ", ", hypothesis_words(*c, as_it_is).c_str(), c->probability);
    ++shown;
  }
  lines.push_back("runners-up: " + others);
  if (diagnosis.reference.empty() && diagnosis.verdict.kind != VerdictKind::effect && !diagnosis.suspects.empty()) {
    lines.push_back(suspects_words(diagnosis.suspects, as_it_is));
    lines.push_back(kReferenceDecides);
  }
  for (std::string& line : ladder_lines(diagnosis)) lines.push_back(std::move(line));
  const std::vector<ResidualLocation> locations = one_of_each_test(diagnosis);
  lines.push_back(locations.empty() ? kNothingStandsOut
                                    : "where the gap lies, with parameters refitted (rms, that of noise):");
  for (const ResidualLocation& p : locations)
    lines.push_back(io::format("  %-22s %-34s %8.3g, noise %.3g %s", p.channel.c_str(),
                               text_of(p.regime, p.test).c_str(), p.gap, p.noise_floor, p.unit.c_str()));
  const auto loss = [](const std::optional<double>& e) { return e ? io::format("%.3g", *e) : std::string("-"); };
  lines.push_back("mean loss in flights held out: vehicle's file " + loss(diagnosis.nominal_loss) +
                  ", parameters refitted " + loss(diagnosis.refit_loss) + ", with the best effect " +
                  loss(diagnosis.effect_loss) + ", noise alone " + loss(diagnosis.noise_floor));
  if (diagnosis.closure)
    lines.push_back(io::format("the best effect closes %.0f %% of what refitting leaves (90 %%: %.0f to %.0f %%)",
                               100 * diagnosis.closure->value, 100 * diagnosis.closure->low,
                               100 * diagnosis.closure->high));
  else lines.push_back(kClosureUnknown);
  // in a contrast by sessions, parameters are those of the references
  if (!diagnosis.moved_parameters.empty() && diagnosis.verdict.kind != VerdictKind::none && diagnosis.seen.empty()) {
    lines.push_back("parameters that moved most, in standard deviations of what was believed:");
    for (std::size_t i = 0; i < diagnosis.moved_parameters.size() && i < kMoved; ++i)
      lines.push_back(io::format("  %-36s %+10.2f", diagnosis.moved_parameters[i].first.c_str(),
                                 diagnosis.moved_parameters[i].second));
  }
  if (!diagnosis.sensors.empty()) {
    lines.push_back("in addition to what the headers declare (90 %):");
    for (std::size_t i = 0; i < diagnosis.sensors.size() && i < kSensors; ++i)
      lines.push_back(sensor_line(diagnosis.sensors[i]));
  }
  if (!diagnosis.untestable.empty())
    lines.push_back("cannot be tested on these logs: " + io::joined(diagnosis.untestable));
  if (diagnosis.validation) {
    std::string head = "rms in flights held out (in kinds of flights):";
    for (const HeldOutError& e : diagnosis.validation->ladder.front().errors)
      head += io::format(" %22s", e.channel.c_str());
    lines.push_back(head);
    for (const Validation::Rung& rung : diagnosis.validation->ladder) {
      std::string line = io::format(
          "  %-44s",
          ((&rung == &diagnosis.validation->ladder.front() || rung.added == "parameters" ? "" : "+ ") + rung.added)
              .c_str());
      for (const HeldOutError& e : rung.errors) line += io::format("  %12.3f (%6.3f)", e.rms, e.by_type);
      lines.push_back(line);
    }
    for (const Validation::Control& c : diagnosis.validation->controls)
      lines.push_back(io::format("  %-24s takes %4.1f %% off %s; shifted in time, at best %4.1f %%", c.effect.c_str(),
                                 100 * c.gain, c.channel.c_str(), 100 * c.best_of_shifted));
  }
  if (const ClosedLoop* c = most_corrected(diagnosis.closed_loop))
    lines.push_back(
        io::format("in closed loop, %s: %s recorded %.3g, by the vehicle's file %.3g, by the corrected one %.3g",
                   io::folder_name(c->flight).c_str(), c->quantity.c_str(), c->recorded, c->nominal, c->corrected));
  if (diagnosis.next) lines.push_back(proposal_line(*diagnosis.next));
  lines.push_back(diagnosis.complete ? next_line(diagnosis, out) : "next: the same command again, to its end");
  return lines;
}

}  // namespace flappy::gap
