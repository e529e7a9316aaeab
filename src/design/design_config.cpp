#include "design/design_config.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flappy/vehicle_file.hpp"
#include "io/files.hpp"
#include "io/sha256.hpp"

namespace flappy::design {
namespace {

Figure read_figure(const io::Table& t) {
  const std::string name = t.string("figure");
  if (const auto figure = figure_named(name)) return *figure;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kFigures; ++i) names.emplace_back(info_of(static_cast<Figure>(i)).name);
  t.fail("figure", "no figure has this name", io::joined(names) + io::did_you_mean(name, names));
}

rollout::FlyConfig read_flights(const io::Table& root, const std::string& key) {
  rollout::FlyConfig fly = rollout::read_fly_config(root.file(key));
  if (fly.fleet.controller.kind != flight::kind_of<flight::PidController>())
    root.fail(key, "its controller is " + flight::controller_name(fly.fleet.controller.kind),
              "flights by kind = \"pid\"");
  if (!(fly.fleet.task.constants.success.by_s > 0) || fly.welded || fly.excitation.acts() || fly.actor)
    root.fail(key, "its task defines no success, or it is held, excited or flown by an actor",
              "flights of a controller whose task has [success]");
  if (fly.randomisation && !fly.resolved.contains("randomisation.toml"))
    root.fail(key, "draws vehicles from a posterior, which is of one robot", "a file of randomisation, or none");
  return fly;
}

}  // namespace

DesignConfig read_design_config(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const io::Config file = io::Config::load(path, overrides);
  const io::Table root = file.root();
  root.schema(1);
  root.accept({"schema", "vehicle", "motors", "hover", "escape", "built", "workshop", "vary", "objective", "limit",
               "flights", "search", "verify"});
  DesignConfig c;
  c.judge.space = read_space(root);
  c.judge.hover = read_flights(root, "hover");
  c.judge.escape = read_flights(root, "escape");
  for (const auto& [name, text] : c.judge.hover.resolved) {
    const auto other = c.judge.escape.resolved.find(name);
    const bool own = name == "fly.toml" || name == "task.toml" || name == "vehicle.toml" || name == "controller.toml";
    if (!own && other != c.judge.escape.resolved.end() && other->second != text)
      root.fail("escape", "its " + name + " is not that of hover", "flights that share it");
  }

  for (const io::Table& t : root.tables("objective")) {
    t.accept({"figure"});
    const Figure figure = read_figure(t);
    if (std::ranges::count(c.search.objectives, figure) > 0)
      t.fail("figure", "is an objective already", "each figure in one objective");
    c.search.objectives.push_back(figure);
  }
  if (c.search.objectives.size() < 2) root.fail("objective", "there are too few", "two objectives or more");
  for (const io::Table& t : root.tables("limit")) {
    t.accept({"figure", "at_least", "at_most"});
    constexpr double kNone = std::numeric_limits<double>::infinity();
    Limit limit{read_figure(t), -kNone, kNone};
    if (std::ranges::count(c.judge.limits, limit.figure, &Limit::figure) > 0)
      t.fail("figure", "is limited already", "each figure in one limit, with at_least and at_most");
    if (t.has("at_least")) limit.at_least = t.number("at_least");
    if (t.has("at_most")) limit.at_most = t.number("at_most");
    if (limit.at_least == -kNone && limit.at_most == kNone) t.fail("", "limits nothing", "at_least or at_most");
    if (limit.at_least > limit.at_most)
      t.fail("at_least", "is above at_most", "a number below " + io::shortest_digits(limit.at_most));
    c.judge.limits.push_back(limit);
  }
  const io::Table flights = root.table("flights");
  c.judge.hover_flights = static_cast<std::size_t>(flights.integer("hover", 1, 100000));
  c.judge.escape_flights = static_cast<std::size_t>(flights.integer("escape", 1, 100000));
  c.judge.effect_flights = static_cast<std::size_t>(flights.integer("effects", 1, 100000));
  const io::Table search = root.table("search");
  c.search.random = search.choice_or("method", "nsga2", {"nsga2", "random"}) == "random";
  c.search.population = static_cast<unsigned>(search.integer("population", 8, 100000));
  if (c.search.population % 4 != 0) search.fail("population", "is no multiple of four", "8, 12, 16, ...");
  c.search.generations = static_cast<unsigned>(search.integer("generations", 1, 100000));
  c.search.seed = static_cast<std::uint64_t>(search.integer("seed", 0, INT64_MAX));
  c.search.threads = static_cast<int>(search.integer_or("threads", 0, 0, 1024));
  const io::Table verify = root.table("verify");
  c.verify.tune = rollout::read_tune_config(verify.file("tune"));
  c.verify.tune.generations = static_cast<unsigned>(verify.integer("generations", 0, 100000));
  if (c.verify.tune.start.kind != c.judge.hover.fleet.controller.kind)
    verify.fail("tune", "tunes another kind of controller", "the kind of the flights");
  c.verify.designs = static_cast<std::size_t>(verify.integer("designs", 0, 1000));
  c.verify.vehicles = static_cast<std::size_t>(verify.integer("vehicles", 1, 1'000'000));
  c.verify.step_s = verify.number("step_s", {1e-6, 1e-3});
  for (const double step_s : {c.judge.hover.fleet.batch.step_s, c.judge.escape.fleet.batch.step_s, c.verify.step_s})
    model::read_vehicle_for_steps(root.file("vehicle"), step_s);  // refuses a hold that is no multiple of the step
  for (const rollout::FlyConfig* fly : {&c.judge.hover, &c.judge.escape})
    if (const double steps = 1 / (fly->fleet.control_hz * c.verify.step_s);
        steps < 0.5 || std::abs(steps - std::round(steps)) > 1e-6)
      verify.fail("step_s", "is no whole share of the control period",
                  "1/n of " + io::shortest_digits(1 / fly->fleet.control_hz) + " s");
  root.finish();
  std::string others =
      io::read_text(root.file("vehicle")) + io::read_text(root.file("motors")) + io::read_text(verify.file("tune"));
  for (const rollout::FlyConfig* fly : {&c.judge.hover, &c.judge.escape})
    for (const auto& [name, text] : fly->resolved) others += text;
  c.resolved = file.resolved() + "# the files that it names: " + io::sha256(others) + "\n";
  return c;
}

}  // namespace flappy::design
