// flappy-bench: speed compared with DART, MuJoCo and LibTorch, accuracy against step size, and the flight of a batch.
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "accuracy.hpp"
#include "bench_closed_loop.hpp"
#include "bench_learner.hpp"
#include "bench_telemetry.hpp"
#include "busy.hpp"
#include "engines.hpp"
#include "figures.hpp"
#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"
#include "hover.hpp"
#include "io/installation.hpp"
#include "io/parallel.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/text.hpp"
#include "many_flights.hpp"
#include "model/effects/registry.hpp"
#include "roof.hpp"
#include "scale.hpp"
#include "speed.hpp"
#ifdef FLAPPY_HAVE_PEERS
#include <mujoco/mujoco.h>

#include <dart/config.hpp>
#endif
#ifdef FLAPPY_HAVE_TORCH
#include "torch_peer.hpp"
#endif

namespace flappy::bench {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> facts() {
  std::vector<std::string> list = {"instruction set " + sim::best_instruction_set()};
#ifdef FLAPPY_HAVE_PEERS
  list.push_back(std::string("MuJoCo ") + mj_versionString());
  list.push_back("DART " DART_VERSION);
#endif
#ifdef FLAPPY_HAVE_TORCH
  list.push_back("LibTorch " + reference::TorchLearner::version());
#endif
  return list;
}

Json speed(const model::Vehicle& vehicle, const SpeedOptions& options) {
  io::ProgressLine progress("measured");
  const SpeedReport report =
      measure_speed(vehicle, options, [&](int done, int total) { progress.show(static_cast<double>(done) / total); });
  progress.clear();
  const double best = *report.median("float");
  std::printf("one core, median of %d [range], whole step, %s\n", options.rounds, sim::best_instruction_set().c_str());
  std::printf("  %-20s %12s %20s %14s\n", "", "M steps/s", "", "float is x");
  for (const auto& row : report.rows)
    std::printf("  %-20s %12.3f  [%7.3f .. %7.3f] %12.2f\n", row.name.c_str(), row.steps_per_s.median / 1e6,
                row.steps_per_s.low / 1e6, row.steps_per_s.high / 1e6, best / row.steps_per_s.median);
  std::printf("two threads are %.2f [%.2f .. %.2f] x one\n", report.two_thread_scaling.median,
              report.two_thread_scaling.low, report.two_thread_scaling.high);
  for (const auto& size : report.sizes)
    std::printf("  %6zu flappers: %.2f ns per flapper and step [%.2f .. %.2f]\n", size.flappers,
                size.ns_per_step.median, size.ns_per_step.low, size.ns_per_step.high);
  if (report.frozen > 0) std::printf("  %zu flappers froze: do not trust these results\n", report.frozen);

  const Operations ops = count_operations();
  const double peak = peak_multiply_adds_per_s(), roof = peak / static_cast<double>(ops.on_multiply_pipes());
  std::printf(
      "a step is %ld flops: %ld multiplies, %ld fused multiply-adds, %ld adds, %ld divisions and roots, %ld "
      "others\n",
      ops.flops(), ops.multiply, ops.fused, ops.add, ops.divide + ops.root, ops.other);
  std::printf("this core does %.0f G multiply-adds/s: roof %.0f M steps/s in float, reached %.0f %%\n", peak / 1e9,
              roof / 1e6, 100 * best / roof);

  const double thrust_error = mean_thrust_N(vehicle, sim::kDefaultStep_s) / kConvergedThrust_N - 1;
  const double position_error = distance_m(free_flight(vehicle, sim::kDefaultStep_s), free_flight(vehicle, 5e-6));
  const std::size_t bytes = sim::Batch<float>::bytes_per_flapper();
  std::printf("at %.0f us: mean thrust at 10 V %+.3f %% from converged, %.2f mm from the 5 us run after 0.3 s\n",
              sim::kDefaultStep_s * 1e6, 100 * thrust_error, 1e3 * position_error);
  std::printf("%zu bytes per float flapper\n", bytes);

  const LoopReport loop = measure_closed_loop(vehicle, io::configs_folder(), options);
  std::printf(
      "closed loop, one core, float: 2 ms of physics, sensors, estimator, controller, reward and observation\n");
  for (const LoopRow& row : loop.rows)
    std::printf("  %-24s %8.2f M control steps/s  [%5.2f .. %5.2f]\n", row.name.c_str(),
                row.control_steps_per_s.median / 1e6, row.control_steps_per_s.low / 1e6,
                row.control_steps_per_s.high / 1e6);
  std::printf("  of the first row's time:");
  for (const auto& [name, share] : loop.shares)
    std::printf(" %s %.1f %%%s", name.c_str(), 100 * share, name == loop.shares.back().first ? "\n" : ",");
  std::printf("  %zu bytes per float flapper beyond its body\n", loop.bytes_per_flapper);

  const auto or_null = [&](const char* name) {
    return report.median(name) ? Json(*report.median(name)) : Json(nullptr);
  };
  return {{"float_steps_per_s", best},
          {"double_steps_per_s", *report.median("double")},
          {"two_thread_scaling", report.two_thread_scaling.median},
          {"dart_steps_per_s", or_null("DART")},
          {"mujoco_steps_per_s", or_null("MuJoCo")},
          {"thrust_error", thrust_error},
          {"position_error_m", position_error},
          {"bytes_per_flapper", bytes},
          {"ns_per_step_1000", report.sizes.front().ns_per_step.median},
          {"ns_per_step_100000", report.sizes.back().ns_per_step.median},
          {"closed_loop_control_steps_per_s", loop.rows[0].control_steps_per_s.median},
          {"bytes_per_flapper_closed_loop", loop.bytes_per_flapper},
          {"closed_loop_shares", Json(std::map<std::string, double>(loop.shares.begin(), loop.shares.end()))},
          {"flops_per_step", ops.flops()},
          {"roof_steps_per_s", roof},
          {"roof_share", best / roof},
          {"instruction_set", sim::best_instruction_set()}};
}

constexpr double kDegrees = 180 / std::numbers::pi;

Json convergence(const model::Vehicle& vehicle) {
  Json steps = Json::array(), integrators = Json::array();
  std::printf("our step, 10 V: 0.3 s of free flight against the 5 us run, mean thrust welded\n");
  std::printf("  torso: error at the end; wings: rms of both over the flight\n");
  std::printf("  %8s %10s %13s %11s %13s %12s %16s\n", "step us", "torso mm", "attitude deg", "stroke deg",
              "rotation deg", "thrust N", "from converged");
  for (const StepRow& r : step_study(vehicle)) {
    const double error = r.thrust_N / kConvergedThrust_N - 1;
    std::printf("  %8.0f %10.3f %13.3f %11.3f %13.3f %12.6f %+14.3f %%\n", r.step_s * 1e6, r.position_error_m * 1e3,
                r.attitude_error_rad * kDegrees, r.stroke_error_rad * kDegrees, r.rotation_error_rad * kDegrees,
                r.thrust_N, 100 * error);
    steps.push_back({{"step_s", r.step_s},
                     {"position_error_m", r.position_error_m},
                     {"attitude_error_rad", r.attitude_error_rad},
                     {"stroke_error_rad", r.stroke_error_rad},
                     {"rotation_error_rad", r.rotation_error_rad},
                     {"thrust_N", r.thrust_N}});
  }
  Json many = Json::array();
  std::printf("256 randomised vehicles, rms: 0.3 s of free flight against the 1 us run, mean thrust welded\n");
  std::printf("  %10s %8s %10s %13s %10s\n", "volts", "step us", "torso mm", "attitude deg", "thrust");
  const std::vector<double> steps_s = {500e-6, 250e-6, 200e-6, 125e-6, 100e-6, 50e-6, 20e-6};
  for (const auto& [low_V, high_V] : {std::pair{6.0, 18.0}, {6.0, 8.0}, {8.0, 12.0}, {12.0, 15.0}, {15.0, 18.0}}) {
    const std::vector<Errors> errors = errors_of(vehicle, {.low_V = low_V, .high_V = high_V}, steps_s);
    for (std::size_t i = 0; i < steps_s.size(); ++i) {
      const double step_s = steps_s[i];
      const Errors& e = errors[i];
      std::printf("  %4.0f to %2.0f %9.0f %10.3f %13.3f %8.3f %%\n", low_V, high_V, step_s * 1e6, e.position_m * 1e3,
                  e.attitude_rad * kDegrees, 100 * e.thrust);
      many.push_back({{"low_V", low_V},
                      {"high_V", high_V},
                      {"step_s", step_s},
                      {"position_error_m", e.position_m},
                      {"attitude_error_rad", e.attitude_rad},
                      {"thrust_error", e.thrust}});
    }
  }
  Json effects = Json::array();
  std::printf("the same at 6 to 12 V with an effect of typical magnitude, 64 vehicles\n");
  std::printf("  %-24s %8s %10s %13s %10s\n", "", "step us", "torso mm", "attitude deg", "thrust");
  for (const model::CatalogueEffect& effect : model::effects()) {
    const std::vector<double> at = {sim::kDefaultStep_s, 100e-6};
    // the memory of a delay has a fixed number of steps, too few for a finer step
    const double exact_step_s = effect.info.id == std::string("command_delay") ? 40e-6 : 5e-6;
    const std::vector<Errors> errors =
        errors_of(vehicle, {.flights = 64, .high_V = 12, .effect = effect.info.id, .exact_step_s = exact_step_s}, at);
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Errors& e = errors[i];
      std::printf("  %-24s %8.0f %10.3f %13.3f %8.3f %%\n", effect.info.id, at[i] * 1e6, e.position_m * 1e3,
                  e.attitude_rad * kDegrees, 100 * e.thrust);
      effects.push_back({{"effect", effect.info.id},
                         {"step_s", at[i]},
                         {"position_error_m", e.position_m},
                         {"attitude_error_rad", e.attitude_rad},
                         {"thrust_error", e.thrust}});
    }
  }
  std::printf("integrators on the same equations, free flight against our 1 us run\n");
  std::printf("  %-10s %8s %14s %14s %14s\n", "", "step us", "evaluations", "torso mm", "attitude deg");
  for (const IntegratorRow& r : integrator_study(vehicle)) {
    std::printf("  %-10s %8.0f %14d %14.3f %14.3f\n", r.integrator.c_str(), r.step_s * 1e6, r.evaluations,
                r.position_error_m * 1e3, r.attitude_error_rad * kDegrees);
    integrators.push_back({{"integrator", r.integrator},
                           {"step_s", r.step_s},
                           {"evaluations", r.evaluations},
                           {"position_error_m", r.position_error_m},
                           {"attitude_error_rad", r.attitude_error_rad}});
  }
  return {{"steps", steps}, {"many_flights", many}, {"effects", effects}, {"integrators", integrators}};
}

/// The fastest row of an engine with an error of at most `enough_m`.
std::optional<WorkPrecisionRow> fastest(const std::vector<WorkPrecisionRow>& rows, const std::string& engine,
                                        double enough_m) {
  std::optional<WorkPrecisionRow> best;
  for (const WorkPrecisionRow& r : rows)
    if (r.engine == engine && r.position_error_m <= enough_m &&
        (!best || r.flapper_s_per_cpu_s > best->flapper_s_per_cpu_s))
      best = r;
  return best;
}

Json error_against_work(const model::Vehicle& vehicle, const SpeedOptions& options) {
  constexpr double kEnough_m = 3e-3;
  io::ProgressLine progress("measured");
  const std::vector<WorkPrecisionRow> rows = work_precision(
      vehicle, kEnough_m, options.peers, [&](double done, const std::string& what) { progress.show(done, what); });
  progress.clear();
  std::printf("256 randomised vehicles at 8 to 12 V, 0.3 s of free flight against our 1 us run, one core, %s\n",
              sim::best_instruction_set().c_str());
  std::printf("  %-18s %-26s %8s %10s %13s %22s\n", "", "", "step us", "torso mm", "attitude deg",
              "flapper s per CPU s");
  Json list = Json::array();
  for (const WorkPrecisionRow& r : rows) {
    std::printf("  %-18s %-26s %8.0f %10.3f %13.3f %22.4g\n", r.engine.c_str(), r.settings.c_str(), r.step_s * 1e6,
                r.position_error_m * 1e3, r.attitude_error_rad * kDegrees, r.flapper_s_per_cpu_s);
    list.push_back({{"engine", r.engine},
                    {"settings", r.settings},
                    {"step_s", r.step_s},
                    {"position_error_m", r.position_error_m},
                    {"attitude_error_rad", r.attitude_error_rad},
                    {"flapper_s_per_cpu_s", r.flapper_s_per_cpu_s}});
  }
  const auto speed_at = [&](const std::string& engine, double step_s) {
    for (const WorkPrecisionRow& r : rows)
      if (r.engine == engine && std::abs(r.step_s - step_s) < 1e-9) return Json(r.flapper_s_per_cpu_s);
    return Json(nullptr);
  };
  const auto ours = fastest(rows, "flappy", kEnough_m);
  const auto ratio = [&](const char* engine) {
    const auto theirs = fastest(rows, engine, kEnough_m);
    if (!ours || !theirs) return Json(nullptr);
    std::printf("within %.0f mm: ours at %.0f us gives %.0f x the flight of %s (%s) at %.0f us\n", kEnough_m * 1e3,
                ours->step_s * 1e6, ours->flapper_s_per_cpu_s / theirs->flapper_s_per_cpu_s, engine,
                theirs->settings.c_str(), theirs->step_s * 1e6);
    return Json(ours->flapper_s_per_cpu_s / theirs->flapper_s_per_cpu_s);
  };
  Json result = {{"rows", list},
                 {"flapper_s_per_cpu_s", speed_at("flappy", sim::kDefaultStep_s)},
                 {"mujoco_ratio_equal_error", ratio("MuJoCo")},
                 {"dart_ratio_equal_error", ratio("DART")}};
  const Errors e = errors_of(vehicle, {}, {sim::kDefaultStep_s}).front();
  std::printf("6 to 18 V, default step: %.2f mm, %.2f deg, thrust %.3f %%\n", e.position_m * 1e3,
              e.attitude_rad * kDegrees, 100 * e.thrust);
  result["position_error_m"] = e.position_m;
  result["attitude_error_rad"] = e.attitude_rad;
  result["thrust_error"] = e.thrust;
  return result;
}

Json learner(const SpeedOptions& options) {
  io::ProgressLine progress("measured");
  const std::vector<LearnerRow> rows =
      measure_learner(options, [&](int done, int total) { progress.show(static_cast<double>(done) / total); });
  progress.clear();
  const double peak = peak_multiply_adds_per_s();
  std::printf("updates/s, actor 32-32, one core, median of %d [range], %s\n", options.rounds,
              sim::best_instruction_set().c_str());
  std::printf("  %-24s %10s %22s %8s %10s %10s %10s %12s\n", "", "", "", "of peak", "LibTorch", "we are x",
              "its engine", "two threads");
  Json list = Json::array();
  for (const LearnerRow& r : rows) {
    const double share = r.multiply_adds * r.updates_per_s.median / peak;
    std::printf("  %-24s %10.0f  [%8.0f .. %8.0f] %6.0f %%", r.name.c_str(), r.updates_per_s.median,
                r.updates_per_s.low, r.updates_per_s.high, 100 * share);
    if (r.torch_per_s)
      std::printf(" %10.0f %10.1f %8.0f %%", r.torch_per_s->median, r.times_torch->median,
                  100 * r.engine_share->median);
    else std::printf(" %10s %10s %10s", "-", "-", "-");
    std::printf(" %10.2f x\n", r.two_thread_scaling.median);
    list.push_back({{"name", r.name},
                    {"batch", r.options.batch},
                    {"multiply_adds", r.multiply_adds},
                    {"updates_per_s", r.updates_per_s.median},
                    {"updates_per_s_low", r.updates_per_s.low},
                    {"updates_per_s_high", r.updates_per_s.high},
                    {"share_of_peak", share},
                    {"torch_updates_per_s", r.torch_per_s ? Json(r.torch_per_s->median) : Json(nullptr)},
                    {"times_torch", r.times_torch ? Json(r.times_torch->median) : Json(nullptr)},
                    {"engine_share", r.engine_share ? Json(r.engine_share->median) : Json(nullptr)},
                    {"two_thread_scaling", r.two_thread_scaling.median}});
  }
  std::printf("this core does %.0f G multiply-adds/s\n", peak / 1e9);
#ifdef FLAPPY_HAVE_TORCH
  if (options.peers) std::printf("LibTorch %s\n", reference::TorchLearner::version().c_str());
#endif
  return {{"learner", list}, {"peak_multiply_adds_per_s", peak}, {"instruction_set", sim::best_instruction_set()}};
}

Json busy(const model::Vehicle& vehicle, const SpeedOptions& options) {
  io::ProgressLine progress("measured");
  const std::vector<BusyRow> rows = measure_busy(vehicle, io::configs_folder(), options, [&](int done, int total) {
    progress.show(static_cast<double>(done) / total);
  });
  progress.clear();
  std::printf("work per second of processor time with a busy loop on each of %d processors, median of %d [range], %s\n",
              io::processors(), options.rounds, sim::best_instruction_set().c_str());
  std::printf("  %-12s %-14s %10s %12s %12s %24s %14s\n", "", "", "threads", "quiet", "busy", "busy / quiet",
              "in wall time");
  Json list = Json::array();
  for (const BusyRow& r : rows) {
    std::printf("  %-12s %-14s %10s %12.4g %12.4g %8.2f  [%4.2f .. %4.2f] %14.2f\n", r.part.c_str(), r.unit.c_str(),
                r.threads == 0 ? "automatic" : std::to_string(r.threads).c_str(), r.quiet_per_s.median,
                r.busy_per_s.median, r.processor_ratio.median, r.processor_ratio.low, r.processor_ratio.high,
                r.wall_ratio.median);
    list.push_back({{"part", r.part},
                    {"unit", r.unit},
                    {"threads", r.threads},
                    {"quiet_per_processor_s", r.quiet_per_s.median},
                    {"busy_per_processor_s", r.busy_per_s.median},
                    {"ratio", r.processor_ratio.median},
                    {"wall_ratio", r.wall_ratio.median}});
  }
  return {{"busy", list}, {"processors", io::processors()}, {"instruction_set", sim::best_instruction_set()}};
}

Json engines(int seeds, const std::string& beside) {
  const std::vector<EngineRow> rows = measure_engines(seeds, beside);
  std::printf("configs/train/escape.toml, seeds 0 to %d, %d processors, %s\n", seeds - 1, io::processors(),
              sim::best_instruction_set().c_str());
  std::printf("  %-10s %8s %10s %12s %24s %10s\n", "", "start", "memory", "updates/s", "to 90 %: median [range]",
              "best");
  Json list = Json::array();
  for (const EngineRow& r : rows) {
    std::printf("  %-10s %6.2f s %7.0f MB %12.0f %8.1f s [%5.1f .. %5.1f] %8.2f %%  reached by %d of %d\n",
                r.name.c_str(), r.start_s, r.peak_bytes / 1e6, r.updates_per_s.median, r.to_90_s.median, r.to_90_s.low,
                r.to_90_s.high, 100 * r.best_success.median, r.reached, seeds);
    list.push_back({{"engine", r.name},
                    {"start_s", r.start_s},
                    {"peak_bytes", r.peak_bytes},
                    {"updates_per_s", r.updates_per_s.median},
                    {"time_to_90_s", r.reached > 0 ? Json(r.to_90_s.median) : Json(nullptr)},
                    {"time_to_90_s_low", r.to_90_s.low},
                    {"time_to_90_s_high", r.to_90_s.high},
                    {"best_success", r.best_success.median},
                    {"reached", r.reached}});
  }
  if (rows.size() > 1 && rows[1].times_lanes.median > 0)
    std::printf("%s takes %.2f x [%.2f .. %.2f] the time of lanes to 90 %%\n", rows[1].name.c_str(),
                rows[1].times_lanes.median, rows[1].times_lanes.low, rows[1].times_lanes.high);
  return {{"engines", list}, {"processors", io::processors()}, {"instruction_set", sim::best_instruction_set()}};
}

Json scale(const std::vector<std::string>& of, double share) {
  io::ProgressLine progress("measured");
  const std::vector<ScaleRow> rows =
      measure_scale(of, share, [&](double done, const std::string& what) { progress.show(done, what); });
  progress.clear();
  std::printf("%-32s %10s %10s %10s %8s   %s\n", "", "size", "s", "MB", "power", "command");
  Json list = Json::array();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ScaleRow& r = rows[i];
    const bool first = i == 0 || rows[i - 1].what != r.what;
    const double power = first ? std::nan("") : growth(rows[i - 1], r);
    std::printf("%-32s %10.0f %10.2f %10.0f %8s   %s\n", r.what.c_str(), r.size, r.seconds, r.peak_bytes / 1e6,
                first ? "" : io::format("%.2f", power).c_str(), r.command.c_str());
    list.push_back({{"what", r.what},
                    {"size", r.size},
                    {"seconds", r.seconds},
                    {"peak_bytes", r.peak_bytes},
                    {"power", first ? Json(nullptr) : Json(power)},
                    {"command", r.command}});
  }
  return {{"rows", list}, {"processors", io::processors()}};
}

Json telemetry(double duration_s) {
  std::printf("shown to another process at 500 Hz for %g s, five topics each\n", duration_s);
  std::printf("  %8s %10s %8s %28s %10s %20s\n", "flappers", "shown", "dropped", "late: median, 99 %, most", "heard",
              "of a core, each");
  Json list = Json::array();
  for (const std::size_t flappers : {std::size_t{1}, std::size_t{16}}) {
    const TelemetryCost c = measure_telemetry(flappers, duration_s);
    std::printf("  %8zu %10zu %8zu %7.0f us %7.0f us %7.0f us %10zu %18.2f %%\n", c.flappers, c.shown, c.dropped,
                1e6 * c.latency_median_s, 1e6 * c.latency_p99_s, 1e6 * c.latency_most_s, c.heard, 100 * c.cpu_share);
    list.push_back({{"flappers", c.flappers},
                    {"shown", c.shown},
                    {"dropped", c.dropped},
                    {"heard", c.heard},
                    {"late_median_s", c.latency_median_s},
                    {"late_p99_s", c.latency_p99_s},
                    {"late_most_s", c.latency_most_s},
                    {"cpu_share", c.cpu_share}});
  }
  return {{"telemetry", list}};
}

}  // namespace
}  // namespace flappy::bench

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program(
      "flappy-bench",
      "Speed and accuracy of the simulator and the learner, side by side with DART, MuJoCo and LibTorch.",
      bench::facts());
  const io::Command& app = program.app();
  std::string vehicle = io::config_path("vehicles/hummingbird_nominal.toml");
  bench::SpeedOptions options;
  app.option("--vehicle", vehicle, "vehicle file").shows_default();
  app.option("--rounds", options.rounds, "rounds to take the median of").range(1, 1000).shows_default();
  app.option("--seconds", options.seconds, "of each measurement").range(0.01, 60.0).shows_default();
  std::string figures;
  app.option("--figures", figures, "append each figure to this file, a line of JSON with machine and commit");
  app.flag("!--no-peers", options.peers, "leave DART, MuJoCo and LibTorch out");
  io::Command convergence =
      app.command("convergence", "error against step size, and against work for other integrators");
  io::Command work_precision =
      app.command("work-precision", "error against processor time of our step, MuJoCo and DART");
  std::string flights;
  work_precision.option("--flights", flights, "only write 64 of the flights into this folder, for other engines");
  io::Command learner = app.command("learner", "updates per second of the learner, and of LibTorch");
  io::Command engines =
      app.command("engines", "training on lanes and on LibTorch: start, memory, updates/s, time to 90 %");
  int seeds = 5;
  engines.option("--seeds", seeds, "of each engine").range(1, 100).shows_default();
  std::string beside;
  engines.option("--beside", beside, "in place of LibTorch, the flappy-train of another build");
  io::Command telemetry =
      app.command("telemetry", "what it costs to show 1 and 16 flappers over DDS, and how late they are");
  double telemetry_s = 10;
  telemetry.option("--duration", telemetry_s, "seconds").range(0.1, 1000.0).shows_default();
  io::Command busy = app.command("busy", "work per second of processor time while others hold all processors");
  io::Command scale = app.command("scale", "time and memory of growing work: flappers, updates, logs, flights, jobs");
  std::vector<std::string> of;
  double share = 1;
  int jobs = 0;
  scale.option("--of", of, "only these: " + io::joined(bench::scales()));
  scale.option("--share", share, "up to this share of the largest sizes").range(0.001, 1.0).shows_default();
  scale.option("--jobs", jobs, "only put so many jobs through a queue").range(1, 1000000);
  io::Command batch = app.command("batch", "fly a batch at one input and summarise it");
  std::string config;
  std::vector<std::string> overrides;
  batch.option("config", config, "configuration of the batch").required();
  batch.option("--set", overrides, "override a key: a.b=c")
      .one_at_a_time();  // otherwise a --set in front of the config would take it as a second value
  app.expect_commands(0, 1);
  return program.run(argc, argv, [&] {
    const auto finish = [&](const char* command, const bench::Json& results) {
      program.write_json(results);
      if (!figures.empty()) bench::append_figures(figures, command, results);
    };
    if (batch.given()) return program.write_json(bench::fly_batch(config, overrides));
    if (jobs > 0) return bench::pass_jobs(static_cast<std::size_t>(jobs));
    if (scale.given()) return finish("scale", bench::scale(of, share));
    if (learner.given()) return finish("learner", bench::learner(options));
    if (telemetry.given()) return finish("telemetry", bench::telemetry(telemetry_s));
    if (engines.given()) return finish("engines", bench::engines(seeds, beside));
    const model::Vehicle v = model::read_vehicle(vehicle);
    if (convergence.given()) return finish("convergence", bench::convergence(v));
    if (!flights.empty()) return bench::write_flights(v, 64, flights);
    if (work_precision.given()) return finish("work-precision", bench::error_against_work(v, options));
    if (busy.given()) return finish("busy", bench::busy(v, options));
    finish("speed", bench::speed(v, options));
  });
}
