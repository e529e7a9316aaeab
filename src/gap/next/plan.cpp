#include "gap/next/plan.hpp"

#include <algorithm>
#include <cmath>

#include "flappy/vehicle_file.hpp"
#include "flightlog/check/data_faults.hpp"
#include "gap/next/expected_nats.hpp"
#include "gap/next/next_experiment.hpp"
#include "gap/next/separation.hpp"
#include "gap/question/question.hpp"
#include "gap/replay/believed_vehicle.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "io/config.hpp"
#include "io/parallel.hpp"
#include "io/progress.hpp"
#include "io/toml_writer.hpp"
#include "model/effects/registry.hpp"
#include "rollout/simulated_flight.hpp"

namespace flappy::gap {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;

/// A probability from which on a verdict names an effect. Choice: as naming.of_all of verdict.toml.
constexpr double kNamed = 0.5;
/// Other numbers of flights that are weighed. Choice.
constexpr std::size_t kFew = 1, kMany = 6;

/// Hours of work, and what weighing a robot tells: configs/gap/plan_work.toml.
struct Work {
  double flight = 0, session = 0, currents = 0, film = 0, clamp = 0, weigh = 0, change = 0;
  double weighed_share = 1;
  std::vector<std::string> weighed;  ///< parts of the paths of parameters
};

Work read_work(const fs::path& path) {
  const io::Config config = io::Config::load(path);
  const io::Table root = config.root();
  root.schema(1);
  Work w;
  const io::Table hours = root.table("hours"), weighed = root.table("weighed");
  const std::pair<const char*, double*> all[] = {
      {"flight", &w.flight}, {"session", &w.session}, {"currents", &w.currents}, {"film", &w.film},
      {"clamp", &w.clamp},   {"weigh", &w.weigh},     {"change", &w.change}};
  for (const auto& [key, value] : all) *value = hours.number(key, io::positive(1e4));
  w.weighed_share = weighed.number("share", io::positive(1));
  w.weighed = weighed.strings("parameters");
  root.finish();
  return w;
}

/// The flights of a robot, and the sensors that log them.
struct Session {
  std::string name, what;
  const Manoeuvre* manoeuvre = nullptr;  ///< null: flights of PlanSettings::like
  std::size_t flights = 3;
  bool reference = false, power = false, wings = false;
  const Manoeuvre* further = nullptr;  ///< as many further flights of this, perhaps with an intervention; null: none
  bool films_further = false;          ///< whether only the wings of the further ones are filmed
  bool weighed = false;                ///< whether the robot was weighed and balanced
  double hours = 0;                    ///< hours of work that it takes beyond the session that was asked for
};

class Planner {
 public:
  explicit Planner(const PlanSettings& settings)
      : settings_(settings),
        threads_(io::thread_count(settings.threads)),
        vehicle_(read_vehicle(settings.vehicle)),
        uncertain_(
            sim::read_randomisation(vehicle_, io::Config::load(file(settings.priors, "gap/priors.toml")).root())),
        work_(read_work(file(settings.work, "gap/plan_work.toml"))),
        discrepancy_(read_model_discrepancy(file(settings.discrepancy, "gap/model_discrepancy.toml"))) {
    const fs::path folder =
        settings.experiments.empty() ? fs::path(io::config_path("gap/experiments")) : fs::path(settings.experiments);
    const std::vector<std::string> overrides =
        settings.sensors.empty() ? std::vector<std::string>()
                                 : std::vector{"sensors=" + io::toml_string(fs::absolute(settings.sensors).string())};
    manoeuvres_ = read_manoeuvres(folder, overrides);
    for (Manoeuvre& m : manoeuvres_)
      m.config.duration_s = std::min(m.config.duration_s, m.config.settle_s + settings.duration_s);
    if (settings.like.empty() && find(settings.manoeuvre) == nullptr) {
      std::vector<std::string> names;
      for (const Manoeuvre& m : manoeuvres_) names.push_back(m.name);
      throw io::InputError("--manoeuvre " + settings.manoeuvre + ": no such configuration in " + folder.string() +
                           "; accepted: " + io::joined(names) + io::did_you_mean(settings.manoeuvre, names));
    }
    for (const model::CatalogueEffect& e : model::catalogue_of(vehicle_)) asked_[e.info.id] = 1;
    for (const auto& [effect, times] : settings.magnitudes) {
      check_effect("--magnitude", effect, vehicle_);
      asked_[effect] = times;
      const double most = largest_factor(*model::find_effect(vehicle_, effect));
      if (!(times > 0 && times <= most))
        throw io::InputError("--magnitude " + effect + ": is " + io::shortest_digits(times) +
                             "; accepted: a factor above 0, at most " + io::shortest_digits(most));
    }
    std::vector<std::string> like = settings.like;
    like.insert(like.end(), settings.like_reference.begin(), settings.like_reference.end());
    flightlog::check_each_once(like);
  }

  Plan run() {
    const Session asked = asked_session();
    const std::optional<Separation> s = separation(asked, !settings_.matrix_only);
    if (!s)
      throw io::InputError("--manoeuvre " + settings_.manoeuvre + ": " + vehicle_.name +
                           " cannot fly it; accepted: a manoeuvre that the vehicle flies, as hover");
    Plan plan = described(*s);
    for (const Session& other : settings_.matrix_only ? std::vector<Session>() : choices(asked)) {
      plan.complete = !io::interrupted();
      if (!plan.complete) break;
      plan.choices.push_back(weighed(other, plan));
    }
    std::ranges::stable_sort(plan.choices, std::greater{}, &PlannedChoice::probability);
    return plan;
  }

 private:
  static model::Vehicle read_vehicle(const std::string& path) {
    const model::Vehicle any = model::read_any_vehicle(path);
    if (any.beat_averaged || any.jointed)
      throw io::InputError(path + ": has no wings that motors drive; accepted: a vehicle with wings and motors");
    return read_believed_vehicle(path);
  }
  const Manoeuvre* find(const std::string& name) const {
    const auto at = std::ranges::find(manoeuvres_, name, &Manoeuvre::name);
    return at == manoeuvres_.end() ? nullptr : &*at;
  }

  Session asked_session() const {
    Session s;
    s.manoeuvre = settings_.like.empty() ? find(settings_.manoeuvre) : nullptr;
    s.flights = settings_.like.empty() ? static_cast<std::size_t>(settings_.flights) : settings_.like.size();
    s.reference = settings_.reference;
    return s;
  }

  std::vector<Session> choices(const Session& asked) const {
    std::vector<Session> all;
    const auto add = [&](const std::string& name, const std::string& what, double hours, const auto& change) {
      all.push_back(asked);
      all.back().name = name, all.back().what = what, all.back().hours = hours;
      change(all.back());
    };
    if (asked.manoeuvre == nullptr) return all;
    const double flown = work_.flight * static_cast<double>(asked.flights), session = work_.session + flown;
    add(asked.reference ? "no_reference" : "reference",
        asked.reference ? "without reference flights" : "as many reference flights of the same robot",
        asked.reference ? 0 : session, [](Session& s) { s.reference = !s.reference; });
    add("currents", "battery voltage and motor currents logged, too", work_.currents,
        [](Session& s) { s.power = true; });
    add("filmed_wings", "the wings' angles filmed, too", work_.film, [](Session& s) { s.wings = true; });
    add("weighed", "the robot weighed and balanced before", work_.weigh, [](Session& s) { s.weighed = true; });
    for (const std::size_t n : {kFew, kMany})
      if (n != asked.flights)
        add(std::to_string(n) + (n == 1 ? "_flight" : "_flights"),
            std::to_string(n) + (n == 1 ? " flight" : " flights") + " in place of " + std::to_string(asked.flights),
            std::max(0.0, work_.flight * static_cast<double>(n) - flown), [n](Session& s) { s.flights = n; });
    for (const Manoeuvre& m : manoeuvres_) {
      if (&m == asked.manoeuvre) continue;
      const std::string further = std::to_string(asked.flights) + " further ";
      if (m.config.log.rig) {
        const double runs = (asked.reference ? 2 : 1) * (work_.clamp + session);
        add(m.name, further + "runs, clamped to a force sensor", runs, [&m](Session& s) { s.further = &m; });
        add(m.name + "_filmed", further + "runs, clamped to a force sensor, the wings filmed", runs + work_.film,
            [&m](Session& s) { s.further = &m, s.films_further = true; });
      } else if (m.config.changes.any())
        add(m.name, in_words(m.config.changes) + ", before " + further + "flights", work_.change + session,
            [&m](Session& s) { s.further = &m; });
      else
        add(m.name, "this manoeuvre in place of " + asked.manoeuvre->name, flown,
            [&m](Session& s) { s.manoeuvre = &m; });
    }
    return all;
  }

  /// Flights of the vehicle as the file has it; none if it cannot fly them.
  Flights fly(const Session& session) const {
    Flights flights;
    if (session.manoeuvre == nullptr) {
      const auto add = [&](const std::vector<std::string>& folders, FlightList& to) {
        for (const std::string& folder : folders)
          to.push_back(
              std::make_shared<ResetPrediction>(Recording(folder, flightlog::read_faultless_log(folder), vehicle_)));
      };
      if (session.reference)
        add(settings_.like_reference.empty() ? settings_.like : settings_.like_reference, flights.references);
      add(settings_.like, flights.tests);
      return flights;
    }
    const auto fly = [&](const Manoeuvre& manoeuvre, bool films, bool references) {
      rollout::FlyConfig config = manoeuvre.config;
      if (session.power)
        config.log.power = flightlog::PowerHeader{kBattery_V, kLog_Hz, 0, kVoltageNoise_V, kCurrentNoise_A};
      if (films) config.log.wings = flightlog::WingsHeader{kLog_Hz, kWingNoise_rad};
      std::vector<rollout::SimulatedFlight> flown =
          simulate(config, vehicle_, session.flights * (references ? 2 : 1), config.settle_s);
      for (std::size_t i = 0; i < flown.size(); ++i) {
        if (flown[i].lost || !flown[i].log) return false;
        (references && i < session.flights ? flights.references : flights.tests)
            .push_back(
                std::make_shared<ResetPrediction>(Recording(manoeuvre.name, std::move(*flown[i].log), vehicle_)));
      }
      return true;
    };
    if (!fly(*session.manoeuvre, session.wings, session.reference)) return {};
    if (session.further == nullptr) return flights;
    // a robot that is clamped after the change was clamped before it, too
    const bool before = session.reference && session.further->config.log.rig.has_value();
    if (!fly(*session.further, session.wings || session.films_further, before)) return {};
    return flights;
  }

  static fs::path file(const std::string& given, const char* standard) {
    return given.empty() ? fs::path(io::config_path(standard)) : fs::path(given);
  }

  VerdictRule rule_of(const Session& session) const {
    return read_verdict_rule(
        file(settings_.verdict, session.reference ? "gap/contrast_verdict.toml" : "gap/verdict.toml"));
  }

  std::optional<Separation> separation(const Session& session, bool sure) const {
    const Flights flights = fly(session);
    if (flights.tests.empty()) return {};
    ModelDiscrepancy discrepancy = discrepancy_;
    if (session.reference)
      discrepancy.session = read_session_variation(file(settings_.sessions, "gap/session_variation.toml"));
    const Question& question = question_of(flights);
    sim::Randomisation uncertain = uncertain_;
    if (session.weighed) uncertain.narrow(work_.weighed, work_.weighed_share);
    const RobotFit robot = RobotFit::planned(question, flights, uncertain, discrepancy, threads_);
    const VerdictRule rule = question.rule(robot, rule_of(session));
    return separation_of(flights, robot, asked_, rule, threads_, sure);
  }

  Plan described(const Separation& s) const {
    Plan plan;
    plan.vehicle = settings_.vehicle;
    plan.manoeuvre = settings_.like.empty() ? settings_.manoeuvre : io::joined(settings_.like);
    plan.flights = asked_session().flights;
    plan.reference = settings_.reference;
    plan.rivals = s.rivals;
    const VerdictRule rule = rule_of(asked_session());
    for (std::size_t i = 0; i < s.effects.size(); ++i) {
      const model::CatalogueEffect& e = *model::find_effect(vehicle_, s.effects[i]);
      PlannedEffect p{s.effects[i], pool_name({s.effects[i]}), {}, s.probability[i], s.sure_from[i], {}, {}};
      for (int k = 0; k < e.info.magnitudes; ++k) {
        const model::EffectParameter& m = e.parameters[static_cast<std::size_t>(k)];
        const double value = m.typical * asked_.at(p.effect);
        p.magnitudes.push_back({p.effect + "." + m.name, value, value, value, unit_of(m.name)});
      }
      for (std::size_t r = 0; r < plan.rivals.size(); ++r) {
        p.nats.push_back(s.nats(static_cast<Index>(i), static_cast<Index>(r)));
        if (plan.rivals[r] != p.effect && kept_odds(p.nats.back(), rule) > (1 - kSure) / kSure)
          p.alike.push_back(plan.rivals[r]);
      }
      plan.effects.push_back(std::move(p));
    }
    for (const model::CatalogueEffect& e : model::catalogue_of(vehicle_))
      if (!std::ranges::count(s.effects, e.info.id)) plan.unseen.emplace_back(e.info.id);
    plan.groups = groups_of(plan);
    return plan;
  }

  /// Effects that are each other's rivals, directly or by others, and that are seen at all.
  static std::vector<std::vector<std::string>> groups_of(const Plan& plan) {
    const std::size_t n = plan.effects.size();
    std::vector<std::size_t> group(n);
    for (std::size_t i = 0; i < n; ++i) group[i] = i;
    const auto seen = [&](const PlannedEffect& e) { return !std::ranges::count(e.alike, "parameters"); };
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < i; ++k) {
        const PlannedEffect &a = plan.effects[i], &b = plan.effects[k];
        if (!seen(a) || !seen(b) || !std::ranges::count(a.alike, b.effect) || !std::ranges::count(b.alike, a.effect))
          continue;
        const std::size_t from = group[i], to = group[k];
        for (std::size_t& g : group)
          if (g == from) g = to;
      }
    std::vector<std::vector<std::string>> groups;
    for (std::size_t g = 0; g < n; ++g) {
      std::vector<std::string> members;
      for (std::size_t i = 0; i < n; ++i)
        if (group[i] == g) members.push_back(plan.effects[i].effect);
      if (members.size() > 1) groups.push_back(std::move(members));
    }
    return groups;
  }

  /// The mean of what a plan gives its effects, 0 for one that it does not see (PlannedChoice::probability).
  static double mean_probability(const Plan& plan) {
    double sum = 0;
    for (const PlannedEffect& e : plan.effects) sum += e.probability;
    return sum / static_cast<double>(plan.effects.size() + plan.unseen.size());
  }

  PlannedChoice weighed(const Session& session, const Plan& plan) const {
    PlannedChoice c{session.name, session.what, true, 0, session.hours, 0, {}, {}};
    const std::optional<Separation> s = separation(session, false);
    c.flies = s.has_value();
    if (!s) return c;
    for (std::size_t i = 0; i < s->effects.size(); ++i) {
      c.probability += s->probability[i] / static_cast<double>(plan.effects.size() + plan.unseen.size());
      if (s->probability[i] < kNamed) continue;
      c.named.push_back(s->effects[i]);
      const auto before = std::ranges::find(plan.effects, s->effects[i], &PlannedEffect::effect);
      if (before == plan.effects.end() || before->probability < kNamed) c.gained.push_back(s->effects[i]);
    }
    if (c.hours > 0) c.gained_per_hour = (c.probability - mean_probability(plan)) / c.hours;
    return c;
  }

  /// Battery, and noise and rate of logs, of a planned flight. Source: configs/fly/open_loop.toml.
  static constexpr double kBattery_V = 18, kLog_Hz = 500, kVoltageNoise_V = 0.02, kCurrentNoise_A = 0.01,
                          kWingNoise_rad = 0.01;

  const PlanSettings& settings_;
  int threads_;
  model::Vehicle vehicle_;
  sim::Randomisation uncertain_;
  std::vector<Manoeuvre> manoeuvres_;
  std::map<std::string, double> asked_;  ///< [effect] magnitude over the typical one
  Work work_;
  ModelDiscrepancy discrepancy_;
};

}  // namespace

Plan make_plan(const PlanSettings& settings) { return Planner(settings).run(); }

}  // namespace flappy::gap
