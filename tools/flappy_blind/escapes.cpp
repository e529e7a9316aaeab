#include "escapes.hpp"

#include <cstdio>
#include <mutex>

#include "escape_rules.hpp"
#include "io/parallel.hpp"
#include "io/progress.hpp"
#include "rollout/outcome.hpp"

namespace flappy::blind {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

}  // namespace

Json fly_escapes(const EscapeOptions& o) {
  const EscapeRules rules = read_escape_rules(o.policy, o.config);
  const Case robot = Robots(o.robot).robot(o.draw);
  if (!o.robot.out.empty()) io::make_folder(o.robot.out);
  std::vector<Escape> escapes(o.count);
  io::ProgressLine progress("escapes");
  io::stop_on_interrupt();
  std::size_t done = 0;
  std::mutex mutex;
  try {
    io::parallel_for(o.count, 0, [&](std::size_t i) {
      if (io::interrupted()) return;
      escapes[i] = escape(robot, i, EscapeRules(rules));  // a policy may remember
      const std::scoped_lock lock(mutex);
      progress.show(static_cast<double>(++done) / static_cast<double>(o.count));
    });
  } catch (const std::exception& e) {  // thrown by the policy
    throw io::InputError(o.policy + ": " + e.what() + "; accepted: a policy for every observation");
  }
  progress.clear();
  if (io::interrupted()) throw io::InputError("stopped: no escape was judged; accepted: all of them");
  std::vector<rollout::Outcome> outcomes;
  std::size_t crashed = 0, out_of_bounds = 0;
  for (std::size_t i = 0; i < o.count; ++i) {
    const Escape& e = escapes[i];
    outcomes.push_back(outcome_of(e));
    crashed += e.flight.crashed;
    out_of_bounds += (e.ended & flight::kOutOfBounds) != 0;
    if (!o.robot.out.empty() && !e.flight.log.mocap.t_s.empty())
      write(e.flight, fs::path(o.robot.out) / ("escape_" + std::to_string(i + 1)), !o.robot.no_truth);
  }
  const rollout::Summary s = rollout::summarise(outcomes);
  std::printf("%zu escapes: success %.1f %% (%.1f to %.1f), captured the goal %.1f %%\n", s.flights,
              100 * s.success.value, 100 * s.success.low, 100 * s.success.high, 100 * s.captured.value);
  if (s.capture_s.median)
    std::printf("  time to capture, 10 / 50 / 90 %%: %.3f %.3f %.3f s\n", *s.capture_s.p10, *s.capture_s.median,
                *s.capture_s.p90);
  std::printf("  out of bounds: %zu; crashed: %zu\n", out_of_bounds, crashed);
  const auto or_null = [](std::optional<double> x) { return x ? Json(*x) : Json(nullptr); };
  return {{"policy", o.policy},
          {"seed", o.robot.seed},
          {"draw", o.draw},
          {"escapes", s.flights},
          {"success_rate", s.success.value},
          {"success_low", s.success.low},
          {"success_high", s.success.high},
          {"captured_rate", s.captured.value},
          {"time_to_capture_p10_s", or_null(s.capture_s.p10)},
          {"time_to_capture_median_s", or_null(s.capture_s.median)},
          {"time_to_capture_p90_s", or_null(s.capture_s.p90)},
          {"out_of_bounds", out_of_bounds},
          {"crashed", crashed}};
}

}  // namespace flappy::blind
