#include "gap/diagnose/report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kHalf90 = 1.645;
/// Of what was believed of a sensor, that counts as news.
constexpr double kNoticed = 0.25;
constexpr std::size_t kMostPlaces = 20;

std::vector<Moved> moved_by(const Fit& fit, const Hypothesis& hypothesis) {
  std::vector<Moved> moved;
  const Eigen::VectorXd mean = fit.mean();
  for (Eigen::Index i = 0; i < hypothesis.shared(); ++i)
    if (i != hypothesis.lag())  // that of a sensor
      moved.push_back({hypothesis.unknowns()[static_cast<std::size_t>(i)].name, mean[i]});
  std::ranges::stable_sort(moved, std::greater{}, [](const Moved& m) { return std::abs(m.prior_sd); });
  return moved;
}

/// Of what the channel's table has for all beats.
std::vector<double> over_noise(const std::vector<GapLocation>& places, const std::string& stage) {
  std::vector<double> ratio(kChannels, 0);
  for (const GapLocation& p : places)
    if (p.stage == stage && p.test == "channel" && p.noise_floor > 0)
      ratio[static_cast<std::size_t>(p.channel)] = p.gap / p.noise_floor;
  return ratio;
}

/// The most probable one.
const ScoredHypothesis* best_fitted(const Diagnosis& d) {
  const auto best = std::ranges::find_if(d.hypotheses, &ScoredHypothesis::fitted);
  return best == d.hypotheses.end() ? nullptr : &*best;
}

Json number(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

/// What a function of the basis grows with.
std::string regime_of(const std::string& function, BasisFunction kind) {
  switch (kind) {
    case BasisFunction::constant:
      return "always";
    case BasisFunction::flight:
      return "flight";
    case BasisFunction::rate:
      return "rate";
    case BasisFunction::input:
      return function;
    case BasisFunction::product:  // amplitude with something
      return function.substr(function.find(' ') + 1).substr(0, 8) == "velocity"
                 ? "velocity"
                 : function.substr(function.find(' ') + 1);
    case BasisFunction::place:
      if (function == "near ground") return "height";
      if (function == "near ceiling") return "ceiling";
      if (function == "near wall") return "wall";
      return function.ends_with("heading") ? "heading" : function;
    default:
      return "velocity";
  }
}

Json validation_json(const Validation& v) {
  Json ladder = Json::array(), controls = Json::array(), agreements = Json::array();
  for (const Validation::Rung& r : v.ladder) {
    Json errors = Json::object();
    for (const HeldOutError& e : r.errors)
      errors[e.channel] = {{"rms", e.rms}, {"low", e.low}, {"high", e.high}, {"by_type", e.by_type}};
    ladder.push_back({{"added", r.added}, {"held_out", errors}});
  }
  for (const Validation::Control& c : v.controls)
    controls.push_back(
        {{"effect", c.effect}, {"channel", c.channel}, {"gain", c.gain}, {"best_of_shifted", c.best_of_shifted}});
  for (const Validation::Agreement& a : v.agreements)
    agreements.push_back({{"name", a.name}, {"value", a.value}, {"sd", a.sd}, {"p_value", a.p_value}});
  return {{"ladder", ladder}, {"controls", controls}, {"agreements", agreements}};
}

}  // namespace

std::vector<SizeEstimate> sizes_of(const ScoredHypothesis& hypothesis, const sim::Randomisation& uncertain) {
  std::vector<SizeEstimate> sizes;
  if (hypothesis.fit.point.at.size() == 0) return sizes;
  const Hypothesis h(uncertain, hypothesis.effects);
  const Eigen::VectorXd mean = hypothesis.fit.mean();
  const Eigen::MatrixXd covariance = hypothesis.fit.covariance();
  for (Eigen::Index i = h.shared(); i < h.size(); ++i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
    const double reach = kHalf90 * std::sqrt(covariance(i, i));
    sizes.push_back({u.effect + "." + u.name, u.value(mean[i]), u.value(mean[i] - reach), u.value(mean[i] + reach),
                     unit_of(u.name)});
  }
  return sizes;
}

std::string unit_of(const std::string& name) {
  static const std::pair<const char*, const char*> kUnits[] = {
      {"m", "m"},    {"s", "s"},    {"V", "V"},   {"K", "K"},       {"W", "W"},     {"ohm", "ohm"},
      {"C", "C"},    {"N", "N"},    {"Nm", "Nm"}, {"kg", "kg"},     {"rad", "rad"}, {"m2", "m^2"},
      {"m3", "m^3"}, {"s2", "s^2"}, {"A", "A"},   {"rad2", "rad^2"}};
  // words from the end, as long as they are units: the first of them over the others
  std::vector<std::string> units;
  std::string rest = name;
  while (true) {
    const std::size_t cut = rest.rfind('_');
    const std::string word = cut == std::string::npos ? rest : rest.substr(cut + 1);
    const auto unit = std::ranges::find_if(kUnits, [&](const auto& u) { return u.first == word; });
    if (word == "per" && !units.empty()) units.insert(units.begin(), "1");
    if (cut == std::string::npos || unit == std::end(kUnits)) break;
    units.insert(units.begin(), unit->second);
    rest = rest.substr(0, cut);
  }
  std::string text;
  for (std::size_t i = 0; i < units.size(); ++i) text += (i == 0 ? "" : "/") + units[i];
  return text;
}

Report verdict_report_of(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                         const Diagnosis& d) {
  Report r;
  r.complete = d.complete;
  r.conclusion = d.conclusion;
  r.validation = d.validation;
  r.untestable = d.untestable;
  const RowContext around = row_context_of(flights, d.noise_sd);
  r.noise_floor = huber_floor();
  const Losses refit = losses_of(around, d.refit);
  r.nominal = losses_of(around, d.nominal).mean();
  r.refit = refit.mean();
  std::vector<Reported> others;
  for (const ScoredHypothesis& a : d.hypotheses) {
    const bool effect = a.kind == ScoredHypothesis::Kind::effect;
    Reported c;
    c.kind = a.kind;
    c.effects = a.effects;
    c.group = effect ? pool_name(a.effects) : kind_name(a.kind);
    c.probability = a.probability;
    c.log_evidence = a.log_evidence;
    c.remainder = effect && !a.terms.empty();
    if (effect) c.sizes = sizes_of(a, uncertain);
    if (a.fitted()) {
      const Losses left = losses_of(around, a.left);
      c.loss = left.mean();
      c.gain_sd = sd_of_difference(refit, left);
      c.closure = closure_of(refit, left, r.noise_floor);
      if (&a == best_fitted(d)) {
        r.effect = c.loss;
        r.closure = c.closure;
      }
    }
    (effect ? r.candidates : others).push_back(std::move(c));
  }
  r.candidates.insert(r.candidates.end(), others.begin(), others.end());
  const ScoredHypothesis& concluded = d.hypotheses[r.conclusion.hypothesis];
  const ScoredHypothesis& freest =
      concluded.terms.empty()
          ? *std::ranges::find(d.hypotheses, ScoredHypothesis::Kind::unknown, &ScoredHypothesis::kind)
          : concluded;
  const RegimeBasis basis(flights);
  const auto told = [&](const Term& t) -> Unexplained {
    return {channel_name(t.channel),
            std::to_string(t.harmonic),
            basis.name(t.function),
            regime_of(basis.name(t.function), basis.kind(t.function)),
            t.times,
            t.gain};
  };
  for (const Term& t : freest.terms) r.unexplained.push_back(told(t));
  if (concluded.otherwise) r.otherwise = told(*concluded.otherwise);
  r.jointly_with = freest.jointly_with;
  for (const SensorFinding& s : d.sensors) {
    const double reach = kHalf90 * s.sd;
    if (std::abs(s.value) > std::max(reach, kNoticed * s.believed_sd))
      r.sensors.push_back({s.name, s.value, s.value - reach, s.value + reach, unit_of(s.name)});
  }
  const ScoredHypothesis& fit = flown(d);
  const bool effects = fit.kind == ScoredHypothesis::Kind::effect;
  r.moved = moved_by(effects ? fit.fit : d.parameters, Hypothesis(uncertain, fit.effects));
  if (effects) r.background = sizes_of(fit, uncertain);
  std::erase_if(r.background, [&](const SizeEstimate& s) {
    return std::ranges::any_of(concluded.effects, [&](const std::string& e) { return s.name.starts_with(e + "."); });
  });
  return r;
}

Report report_of(const std::vector<std::string>& names, const std::vector<PredictedFlight>& flights,
                 const sim::Randomisation& uncertain, const Diagnosis& d) {
  Report r = verdict_report_of(flights, uncertain, d);
  r.flights = names;
  const RowContext around = row_context_of(flights, d.noise_sd);
  const ScoredHypothesis* best = best_fitted(d);
  const Residuals* stages[] = {&d.nominal, &d.refit, best != nullptr ? &best->left : nullptr};
  for (std::size_t i = 0; i < 3; ++i) {
    if (stages[i] != nullptr) {
      const std::vector<GapLocation> places = locate(around, *stages[i], kStages[i]);
      r.places.insert(r.places.end(), places.begin(), places.end());
    }
    r.over_noise[i] = over_noise(r.places, kStages[i]);
  }
  return r;
}

Report report_of(const std::vector<std::string>& names, std::vector<flightlog::DataFault> faults) {
  Report r;
  r.flights = names;
  r.faults = std::move(faults);
  r.conclusion.kind = Conclusion::Kind::data;
  r.conclusion.probability = 1;
  return r;
}

Json diagnosis_json(const Report& r) {
  Json faults = Json::array(), where = Json::array(), candidates = Json::array(), closed_loop = Json::array(),
       unexplained = Json::array();
  const auto term = [](const Unexplained& u) {
    return Json{{"channel", u.channel},
                {"harmonic", u.harmonic},
                {"function", u.function},
                {"times_usual", u.times},
                {"gain_nats", u.gain}};
  };
  for (const Unexplained& u : r.unexplained) unexplained.push_back(term(u));
  const auto finite = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
  for (const ClosedLoop& c : r.closed_loop)
    closed_loop.push_back({{"flight", c.flight},
                           {"quantity", c.quantity},
                           {"recorded", finite(c.recorded)},
                           {"nominal", finite(c.nominal)},
                           {"corrected", finite(c.corrected)}});
  for (const flightlog::DataFault& f : r.faults)
    faults.push_back({{"file", f.file}, {"line", f.line}, {"what", f.what}});
  for (const GapLocation& p : largest_discoveries(r.places, "refit", kMostPlaces))
    where.push_back({{"channel", channel_name(p.channel)},
                     {"regime", p.regime},
                     {"gap", p.gap},
                     {"noise_floor", p.noise_floor},
                     {"p_value", p.p_value}});
  const auto estimates = [](const std::vector<SizeEstimate>& list) {
    Json json = Json::object();
    for (const SizeEstimate& s : list)
      json[s.name] = {{"value", s.value}, {"low", s.low}, {"high", s.high}, {"unit", s.unit}};
    return json;
  };
  for (const Reported& c : r.candidates) {
    candidates.push_back({{"effects", c.effects},
                          {"group", c.group},
                          {"remainder", c.remainder},
                          {"probability", c.probability},
                          {"log_evidence", c.log_evidence},
                          {"parameters", estimates(c.sizes)},
                          {"closure", c.closure ? Json(c.closure->value) : Json(nullptr)}});
  }
  const auto closure = [&](double Closure::*part) { return r.closure ? Json((*r.closure).*part) : Json(nullptr); };
  Json courses = Json::array();
  if (r.next)
    for (const Course& c : r.next->courses)
      courses.push_back({{"quantity", c.quantity}, {"first", c.first}, {"second", c.second}});
  Json json = {{"schema", 1},
               {"flights", r.flights},
               {"data_faults", faults},
               {"verdict",
                {{"kind", kind_name(r.conclusion.kind)},
                 {"effects", r.conclusion.effects},
                 {"remainder", r.conclusion.remainder},
                 {"probability", r.conclusion.probability}}},
               {"background", estimates(r.background)},
               {"sensors", estimates(r.sensors)},
               {"where", where},
               {"candidates", candidates},
               {"otherwise", r.otherwise ? term(*r.otherwise) : Json(nullptr)},
               {"unexplained", {{"jointly_with", r.jointly_with}, {"terms", unexplained}}},
               {"gap",
                {{"nominal", number(r.nominal)},
                 {"refit", number(r.refit)},
                 {"effect", number(r.effect)},
                 {"noise_floor", r.noise_floor},
                 {"closure", closure(&Closure::value)},
                 {"closure_low", closure(&Closure::low)},
                 {"closure_high", closure(&Closure::high)}}},
               {"closed_loop", closed_loop},
               {"next_experiment", r.next ? Json({{"manoeuvre", r.next->manoeuvre},
                                                  {"separates", r.next->separates},
                                                  {"expected_nats", r.next->expected_nats},
                                                  {"course_step_s", kCourseStep_s},
                                                  {"courses", courses}})
                                          : Json(nullptr)}};
  if (!r.untestable.empty()) json["cannot_be_tested"] = r.untestable;
  if (r.validation) json["validation"] = validation_json(*r.validation);
  if (!r.complete) json["complete"] = false;
  return json;
}

}  // namespace flappy::gap
