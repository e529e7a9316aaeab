#include "design/judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "io/statistics.hpp"
#include "io/text.hpp"
#include "model/effects/registry.hpp"
#include "sim/randomise.hpp"

namespace flappy::design {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSwing_rad = 10 * std::numbers::pi / 180;  // swing of which the bandwidth is the fastest

constexpr FigureInfo kFigureInfos[kFigures] = {
    {"mass_kg", "mass", "kg", false, Stage::built},
    {"lift_over_weight", "largest lift over weight", "1", true, Stage::stand},
    {"stroke_rad", "largest stroke angle in hover", "rad", false, Stage::stand},
    {"gear_torque_Nm", "largest torque of a gear in hover", "Nm", false, Stage::stand},
    {"stop_energy_J", "largest energy of a wing at its rotation stop", "J", false, Stage::stand},
    {"winding_C", "temperature of the winding in hover", "°C", false, Stage::stand},
    {"current_A", "largest current of a motor in hover", "A", false, Stage::stand},
    {"roll_authority_Nm", "roll moment at the limit of its input", "Nm", true, Stage::stand},
    {"pitch_authority_Nm", "pitch moment at the limit of its input", "Nm", true, Stage::stand},
    {"yaw_authority_Nm", "yaw moment at the limit of its input", "Nm", true, Stage::stand},
    {"coupling", "largest moment about another axis over the own", "1", false, Stage::stand},
    {"roll_bandwidth_Hz", "fastest roll by 10 degrees to both sides", "Hz", true, Stage::stand},
    {"pitch_bandwidth_Hz", "fastest pitch by 10 degrees to both sides", "Hz", true, Stage::stand},
    {"yaw_bandwidth_Hz", "fastest yaw by 10 degrees to both sides", "Hz", true, Stage::stand},
    {"hover_power_W", "electrical power in hover", "W", false, Stage::hover},
    {"hover_success", "share of drawn vehicles that hover", "1", true, Stage::hover},
    {"endurance_s", "hover on the battery", "s", true, Stage::hover},
    {"escape_success", "share of drawn vehicles that escape", "1", true, Stage::escape},
    {"escape_time_s", "time of the escape, median", "s", false, Stage::escape},
    {"effects_success", "share that hovers with an effect of the catalogue", "1", true, Stage::effects},
};

const char* name_of(Axis axis) { return axis == Axis::roll ? "roll" : axis == Axis::pitch ? "pitch" : "yaw"; }

double inertia(const WholeBody& body, Axis axis) {
  const model::InertiaTensor& i = body.inertia_kg_m2;
  return axis == Axis::roll ? i.xx : axis == Axis::pitch ? i.yy : i.zz;
}

void put_stand(const Robot& robot, const Stand& s, double weight_N, Figures& f) {
  const auto put = [&](Figure which, double value) { figure_of(f, which) = value; };
  put(Figure::lift_over_weight, s.most_lift_N / weight_N);
  if (!s.hovers) return;
  put(Figure::stroke, s.hover.stroke_rad);
  put(Figure::gear_torque, s.hover.gear_Nm);
  put(Figure::stop_energy, s.hover.stop_J);
  put(Figure::winding, s.hover.winding_C);
  put(Figure::current, s.hover.current_A);
  double coupling = 0;
  const WholeBody body = whole_body(robot.vehicle);
  for (std::size_t a = 0; a < kAxes; ++a) {
    put(static_cast<Figure>(static_cast<std::size_t>(Figure::roll_authority) + a), s.authority_Nm[a]);
    // theta sin(2 pi f t) needs the moment I theta (2 pi f)^2
    const double fastest = std::sqrt(s.authority_Nm[a] / (inertia(body, static_cast<Axis>(a)) * kSwing_rad));
    put(static_cast<Figure>(static_cast<std::size_t>(Figure::roll_bandwidth) + a), fastest / (2 * std::numbers::pi));
    for (std::size_t of = 0; of < kAxes; ++of)
      if (of != a) coupling = std::max(coupling, std::abs(s.moment_per_input[a][of] / s.moment_per_input[a][a]));
  }
  put(Figure::coupling, coupling);
}

}  // namespace

const FigureInfo& info_of(Figure figure) { return kFigureInfos[static_cast<std::size_t>(figure)]; }

bool is_share(Figure figure) { return std::string_view(info_of(figure).name).ends_with("_success"); }

std::optional<Figure> figure_named(const std::string& name) {
  for (std::size_t i = 0; i < kFigures; ++i)
    if (name == kFigureInfos[i].name) return static_cast<Figure>(i);
  return std::nullopt;
}

Judge::Judge(JudgeConfig config) : config_(std::move(config)) {
  double flown_s = 0;
  const rollout::FlyConfig& c = config_.hover;
  built_ = measure(build(config_.space, config_.space.built), config_.space.workshop, c.fleet.batch.step_s,
                   c.fleet.batch.world.gravity_m_s2, flown_s);
  if (!built_.hovers)
    throw io::InputError(c.vehicle_file_name + ": does not lift itself; accepted: a robot that hovers");
}

bool Judge::allowed(Judged& j, Stage stage, bool past_limits) const {
  for (const Limit& l : config_.limits) {
    if (info_of(l.figure).stage != stage) continue;
    const double value = figure_of(j.figures, l.figure);
    if (value >= l.at_least && value <= l.at_most) continue;
    const bool low = !(value >= l.at_least);
    j.refused += io::format("%s%s is %.4g, %s %.4g", j.refused.empty() ? "" : "; ", info_of(l.figure).name, value,
                            low ? "below" : "above", low ? l.at_least : l.at_most);
    if (!past_limits) return false;
  }
  return true;
}

flight::Controller Judge::fitted(const Robot& robot, const Stand& stand) const {
  flight::Controller c = config_.hover.fleet.controller;
  auto& k = c.constants.of<flight::PidController>();
  const WholeBody was = whole_body(config_.space.published), now = whole_body(robot.vehicle);
  const auto scale = [](flight::PidGains<double>& g, double factor) { g.p *= factor, g.i *= factor, g.d *= factor; };
  const auto moments = [&](Axis axis) {
    const auto a = static_cast<std::size_t>(axis);
    return inertia(now, axis) / stand.moment_per_input[a][a] / (inertia(was, axis) / built_.moment_per_input[a][a]);
  };
  scale(k.roll, moments(Axis::roll));
  scale(k.pitch, moments(Axis::pitch));
  scale(k.yaw, moments(Axis::yaw));
  scale(k.up, now.mass_kg / stand.lift_per_V_N / (was.mass_kg / built_.lift_per_V_N));
  const double hover_V = stand.hover.amplitude_V, limit_V = robot.vehicle.driver.amplitude_limit_V;
  k.lower_V *= hover_V / k.hover_V;  // the same share of the amplitude
  k.hover_V = hover_V;
  k.upper_V = limit_V - hover_V;
  return c;
}

rollout::FlyConfig Judge::flights(const rollout::FlyConfig& which, const Robot& robot,
                                  const flight::Controller& controller) const {
  rollout::FlyConfig c = which;
  c.vehicle = robot.vehicle;
  c.fleet.controller = controller;
  c.fleet.batch.threads = 1;
  if (which.randomisation)  // about this robot; parsed anew, as reading a table marks its keys
    c.randomisation = sim::read_randomisation(
        robot.vehicle, io::Config::parse(which.resolved.at("randomisation.toml"), "randomisation.toml").root());
  return c;
}

void Judge::fly(const rollout::FlyConfig& config, std::size_t count, std::uint32_t first_flapper, Stage stage,
                Judged& into) const {
  rollout::Evaluator evaluator(config, {.count = count, .first_flapper = first_flapper, .part = 1024});
  const rollout::Evaluation e = evaluator.fly({}, rollout::Detail::full);
  into.flown_s += e.steps * config.fleet.batch.step_s;
  std::vector<double> power_W, time_s;
  std::size_t successes = 0;
  for (const rollout::Outcome& o : e.flights) {
    successes += o.success();
    time_s.push_back(o.success() ? o.captured_s : kInfinity);
    if (o.success()) power_W.push_back(o.energy_J / o.manoeuvre_s);
  }
  const double share = static_cast<double>(successes) / static_cast<double>(count);
  if (stage == Stage::escape) {
    figure_of(into.figures, Figure::escape_success) = share;
    figure_of(into.figures, Figure::escape_time) = io::median(time_s);
  } else {
    const double mean_W = power_W.empty() ? kInfinity : io::mean(power_W);
    figure_of(into.figures, Figure::hover_success) = share;
    figure_of(into.figures, Figure::hover_power) = mean_W;
    figure_of(into.figures, Figure::endurance) = into.robot.battery_J / mean_W;
  }
}

Judged Judge::judged(const Values& values, Stage upto, bool past_limits) const {
  constexpr std::uint32_t first_flapper = rollout::kTrainingFlappers;
  Judged j{.robot = build(config_.space, values),
           .controller = config_.hover.fleet.controller,
           .figures = {},
           .refused = {}};
  j.figures.fill(kNaN);
  j.refused = j.robot.refused;
  if (!j.refused.empty()) return j;
  const WholeBody body = whole_body(j.robot.vehicle);
  figure_of(j.figures, Figure::mass) = body.mass_kg;
  if (!allowed(j, Stage::built, past_limits) || upto == Stage::built) return j;

  const rollout::FlyConfig& hover = config_.hover;
  const double gravity = hover.fleet.batch.world.gravity_m_s2;
  const Stand stand = measure(j.robot, config_.space.workshop, hover.fleet.batch.step_s, gravity, j.flown_s);
  put_stand(j.robot, stand, body.mass_kg * gravity, j.figures);
  j.reached = Stage::stand;
  std::string fault = stand.hovers ? "" : "cannot hold its weight";
  for (std::size_t a = 0; a < kAxes && fault.empty(); ++a)
    if (!(stand.moment_per_input[a][a] * built_.moment_per_input[a][a] > 0))
      fault = std::string(name_of(static_cast<Axis>(a))) + " answers its input the wrong way round";
  if (!fault.empty()) return j.refused = fault, j;
  if (!allowed(j, Stage::stand, past_limits)) return j;
  j.controller = fitted(j.robot, stand);
  if (upto == Stage::stand) return j;

  j.reached = Stage::hover;
  fly(flights(hover, j.robot, j.controller), config_.hover_flights, first_flapper, Stage::hover, j);
  if (!allowed(j, Stage::hover, past_limits) || upto == Stage::hover) return j;
  j.reached = Stage::escape;
  fly(flights(config_.escape, j.robot, j.controller), config_.escape_flights, first_flapper, Stage::escape, j);
  if (!allowed(j, Stage::escape, past_limits) || upto == Stage::escape) return j;

  j.reached = Stage::effects;
  double successes = 0;
  std::size_t effects = 0;
  for (const model::CatalogueEffect& effect : model::catalogue_of(j.robot.vehicle)) {
    rollout::FlyConfig c = flights(hover, j.robot, j.controller);
    c.added_effects[effect.info.id] = {};
    Judged with{.robot = j.robot, .controller = j.controller, .figures = {}, .refused = {}};
    fly(c, config_.effect_flights, first_flapper, Stage::hover, with);
    successes += figure_of(with.figures, Figure::hover_success);
    j.flown_s += with.flown_s;
    ++effects;
  }
  figure_of(j.figures, Figure::effects_success) = successes / static_cast<double>(effects);
  allowed(j, Stage::effects, past_limits);
  return j;
}

}  // namespace flappy::design
