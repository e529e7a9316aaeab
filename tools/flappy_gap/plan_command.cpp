#include "plan_command.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>

#include "gap/result/plan_json.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/text.hpp"

namespace flappy::gap {
namespace {

/// Choices that are printed.
constexpr std::size_t kShownChoices = 5;

std::map<std::string, double> factors_of(const std::vector<std::string>& given) {
  std::map<std::string, double> all;
  for (const std::string& g : given) {
    const std::size_t equals = std::min(g.find('='), g.size() - 1);
    double factor = 0;
    const auto [end, error] = std::from_chars(g.data() + equals + 1, g.data() + g.size(), factor);
    if (error != std::errc{} || end != g.data() + g.size())
      throw io::InputError("--magnitude " + g + ": no factor; accepted: EFFECT=FACTOR, as wind=2");
    all[g.substr(0, equals)] = factor;
  }
  return all;
}

void print(const Plan& plan) {
  std::printf("%zu flights of %s%s: how probable a diagnosis gives each effect, if the robot has it\n", plan.flights,
              plan.manoeuvre.c_str(), plan.reference ? ", and as many reference flights" : "");
  for (const PlannedEffect& e : plan.effects) {
    const std::string sure = e.sure_from ? io::format("sure from %.2g of the magnitude", *e.sure_from) : "never sure";
    std::printf("  %-26s %4.2f  %s%s\n", e.effect.c_str(), e.probability, sure.c_str(),
                e.alike.empty() ? "" : (", may be " + io::joined(e.alike)).c_str());
  }
  if (!plan.complete) std::printf("stopped: choices are missing\n");
  for (const std::vector<std::string>& g : plan.groups)
    std::printf("cannot be told apart: %s\n", io::joined(g).c_str());
  for (std::size_t i = 0; i < plan.choices.size() && i < kShownChoices; ++i) {
    const PlannedChoice& c = plan.choices[i];
    const std::string work = c.hours > 0 ? io::format(" for %.2g h of work", c.hours) : "";
    std::printf("%s%s: mean probability %.2f%s%s\n", i == 0 ? "instead: " : "         ", c.what.c_str(), c.probability,
                work.c_str(), c.gained.empty() ? "" : (", names also " + io::joined(c.gained)).c_str());
  }
  const auto most = std::ranges::max_element(plan.choices, {}, &PlannedChoice::gained_per_hour);
  if (most != plan.choices.end() && most->gained_per_hour > 0)
    std::printf("most for an hour of work: %s (%.3f)\n", most->what.c_str(), most->gained_per_hour);
}

}  // namespace

nlohmann::ordered_json run_plan(const PlanCommand& command) {
  PlanSettings settings = command.settings;
  settings.magnitudes = factors_of(command.magnitudes);
  const std::filesystem::path out = command.out;
  if (!out.empty()) {
    io::make_folder(out);
    for (const char* name : {kPlanFile, kMatrixFile}) io::check_output(out / name);
  }
  io::stop_on_interrupt();
  const Plan plan = make_plan(settings);
  print(plan);
  nlohmann::ordered_json json = to_json(plan);
  if (!out.empty()) {
    io::write_atomically(out / kPlanFile, json.dump(1) + "\n");
    io::write_atomically(out / kMatrixFile, matrix_csv(plan));
    std::printf("written to %s: %s, %s\n%s\n", command.out.c_str(), kPlanFile, kMatrixFile,
                io::shown_by(command.out).c_str());
  }
  return json;
}

}  // namespace flappy::gap
