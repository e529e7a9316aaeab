#include "benchmark/detectability_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>

#include "benchmark/detectability.hpp"
#include "blind/sampled_robot.hpp"
#include "flappy/vehicle_file.hpp"
#include "gap/evidence/hypothesis.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/statistics.hpp"
#include "io/toml_writer.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

using Json = nlohmann::ordered_json;

/// What counts as found, and the most an effect may be of its typical size.
constexpr double kNats = 10, kMostSize = 4;

struct Development {
  std::unique_ptr<Subject> subject;
  std::unique_ptr<DetectabilityAnalysis> analysis;
};

/// The robot of a seed as `fly` draws it, without effects.
Development develop(const blind::Case& declared, const sim::Randomisation& robots, const sim::Randomisation& uncertain,
                    std::uint64_t seed, int threads) {
  for (std::uint64_t draw = 0; draw < blind::kTries; ++draw) {
    const blind::Case c = blind::sampled_case(declared, robots, seed, draw);
    std::vector<blind::RobotFlight> flights = fly_all(c, threads);
    if (std::ranges::any_of(flights, &blind::RobotFlight::crashed)) continue;
    Development d{std::make_unique<Subject>(c, std::move(flights), threads), nullptr};
    d.analysis = std::make_unique<DetectabilityAnalysis>(*d.subject, uncertain);
    return d;
  }
  throw io::InputError("--seed " + std::to_string(seed) + ": " + std::to_string(blind::kTries) +
                       " robots in a row crashed; accepted: less randomisation");
}

struct EffectDetectability {
  double detectable = 0, low = 0, high = 0;  ///< median and extremes of the vehicles; infinite beyond size 4
  double gain_at_typical = 0;
  bool undetectable = false;
  TrueValue value;  ///< at twice the detectable size, of the first vehicle
  std::vector<std::string> inseparable, inseparable_at_typical;
};

/// Whether an entry's figures are beyond what is plausible.
bool beyond_prior(const TrueValue& value) {
  for (const model::EffectEntry& e : model::effects())
    for (const model::EffectParameter& p : e.parameters)
      if (const auto at = value.values.find(std::string(e.info.id) + "." + p.name); at != value.values.end())
        if (at->second > p.prior_high || at->second < std::min(p.prior_low, 0.0)) return true;
  return false;
}

std::vector<EffectDetectability> weigh(const std::vector<Development>& vehicles, const sim::Randomisation& uncertain) {
  const std::vector<gap::BasisCoefficients> parameters = vehicles[0].subject->simulated_parameters(uncertain);
  const auto over_vehicles = [&](const std::function<double(const DetectabilityAnalysis&)>& value) {
    std::vector<double> values;
    for (const Development& d : vehicles) values.push_back(value(*d.analysis));
    return values;
  };
  std::vector<EffectDetectability> findings(blind::kBlindEffects);
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const auto effect = static_cast<blind::Effect>(e);
    EffectDetectability& f = findings[e];
    const auto sizes = over_vehicles([&](const DetectabilityAnalysis& o) { return o.detectable(effect, kNats); });
    f.detectable = io::median(sizes);
    f.low = *std::ranges::min_element(sizes);
    f.high = *std::ranges::max_element(sizes);
    f.gain_at_typical = io::median(over_vehicles([&](const DetectabilityAnalysis& o) { return o.gain(effect, 1); }));
    f.undetectable = !(2 * f.detectable <= kMostSize);
    const double size = std::min(2 * f.detectable, kMostSize);
    if (in_catalogue(effect)) f.value = true_value(*vehicles[0].subject, parameters, effect, size);
    if (!f.undetectable && in_catalogue(effect) && f.value.misfit < kMostMisfit) f.undetectable = beyond_prior(f.value);
    const auto find_rivals = [&](double at, std::vector<std::string>& rivals) {
      for (std::size_t r = 0; r < blind::kBlindEffects; ++r) {
        const auto rival = static_cast<blind::Effect>(r);
        if (r == e || !in_catalogue(rival)) continue;
        if (io::median(over_vehicles([&](const DetectabilityAnalysis& o) { return o.gain_over(effect, at, rival); })) <
            kNats)
          rivals.push_back(blind::effect_names()[r]);
      }
    };
    find_rivals(size, f.inseparable);
    find_rivals(1, f.inseparable_at_typical);
  }
  return findings;
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(':') + 2, line.size()));
  return "an unnamed processor";
}

std::string rounded(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g", x);
  return io::toml_number(std::strtod(text, nullptr));
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& n : names) text += (text.empty() ? "" : ", ") + io::toml_string(n);
  return text;
}

std::string to_toml(const DetectabilityCommand& o, std::size_t vehicles,
                    const std::vector<EffectDetectability>& findings) {
  char date[20];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y-%m-%d", std::gmtime(&now));
  std::string text =
      "# How large the effects of the blind robot have to be (docs/blind.md), in its own unit: 1 is typical. "
      "Written by\n"
      "#   flappy-blind detectability --vehicle " +
      o.vehicle + " --randomise " + o.randomise + " --vehicles " + std::to_string(vehicles) + " --seed " +
      std::to_string(o.seed) + " --out " + o.out + "\n# " + date + ", commit " + io::commit() + ", " + processor() +
      "\n#\n"
      "# detectable       10 nats over parameters alone on each third of 30 s, median; missing: more than 4\n"
      "# undetectable     twice that is more than 4, or more than the catalogue finds plausible\n"
      "# gain_at_typical  nats on a third at size 1, median\n"
      "# inseparable      rivals over which the truth gains less than 10 nats at twice the detectable size, or at 4;\n"
      "#                  inseparable_at_typical at size 1; missing: all, as it gains less over parameters alone\n"
      "# misfit           what the catalogue's entry leaves of the effect at that size, and its figures there; one "
      "vehicle\n"
      "schema = 1\n";
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const EffectDetectability& f = findings[e];
    text += "\n[" + blind::effect_names()[e] + "]\n";
    if (std::isfinite(f.detectable)) text += "detectable = " + rounded(f.detectable) + "\n";
    text += std::string("undetectable = ") + (f.undetectable ? "true" : "false") + "\n";
    text += "gain_at_typical = " + rounded(f.gain_at_typical) + "\n";
    text += "inseparable = [" + listed(f.inseparable) + "]\n";
    if (f.gain_at_typical >= kNats) text += "inseparable_at_typical = [" + listed(f.inseparable_at_typical) + "]\n";
    if (!in_catalogue(static_cast<blind::Effect>(e))) continue;
    text += "misfit = " + rounded(f.value.misfit) + "\n";
    if (f.value.misfit >= kMostMisfit) continue;
    text += "catalogue = { ";
    for (const auto& [name, value] : f.value.values)
      text += (name == f.value.values.begin()->first ? "" : ", ") + name.substr(name.find('.') + 1) + " = " +
              rounded(value);
    text += " }\n";
  }
  return text;
}

void print(const std::vector<EffectDetectability>& findings) {
  std::printf("%-28s %10s %17s %9s %7s  %s\n", "effect", "detectable", "least, most", "at size 1", "misfit", "rivals");
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const EffectDetectability& f = findings[e];
    std::printf("%-28s %10.3g %8.3g %8.3g %9.1f %7.2f %s", blind::effect_names()[e].c_str(), f.detectable, f.low,
                f.high, f.gain_at_typical, f.value.misfit, f.undetectable ? " undetectable;" : "");
    for (const std::string& r : f.inseparable) std::printf(" %s", r.c_str());
    std::printf("\n");
  }
}

}  // namespace

Json run_detectability(const DetectabilityCommand& command) {
  const blind::Case declared = blind::declared_case(command.vehicle);
  io::check_output(command.out, {command.vehicle, command.randomise, command.priors});
  const auto draws = [&](const std::string& file) {
    return sim::read_randomisation(declared.vehicle, io::Config::load(file).root());
  };
  const sim::Randomisation robots = draws(command.randomise), uncertain = draws(command.priors);
  std::vector<Development> vehicles;
  {
    io::ProgressLine line("robots", 60);
    io::stop_on_interrupt();  // with those that are done
    for (int i = 0; i < command.vehicles && !(io::interrupted() && i > 0); ++i) {
      line.show(static_cast<double>(i) / command.vehicles);
      const std::uint64_t seed = command.seed + static_cast<std::uint64_t>(i);
      vehicles.push_back(develop(declared, robots, uncertain, seed, command.threads));
      line.clear();
      std::printf("robot %llu, draw %llu: noise %.2f of the declared\n", static_cast<unsigned long long>(seed),
                  static_cast<unsigned long long>(vehicles.back().subject->flown().seed % blind::kTries),
                  vehicles.back().subject->noise_ratio());
      std::fflush(stdout);
    }
  }
  const std::vector<EffectDetectability> findings = weigh(vehicles, uncertain);
  print(findings);
  io::write_atomically(command.out, to_toml(command, vehicles.size(), findings));
  Json effects = Json::object();
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const EffectDetectability& f = findings[e];
    const auto finite = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
    effects[blind::effect_names()[e]] = {{"detectable", finite(f.detectable)},
                                         {"detectable_low", finite(f.low)},
                                         {"detectable_high", finite(f.high)},
                                         {"undetectable", f.undetectable},
                                         {"gain_at_typical", f.gain_at_typical},
                                         {"inseparable", f.inseparable},
                                         {"inseparable_at_typical", f.inseparable_at_typical},
                                         {"misfit", f.value.misfit},
                                         {"catalogue", f.value.values}};
  }
  return {{"vehicles", vehicles.size()}, {"effects", effects}};
}

}  // namespace flappy::benchmark
