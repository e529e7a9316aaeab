#include "gap/result/diagnosis_json.hpp"

#include <cmath>
#include <limits>

#include "io/files.hpp"
#include "io/schema.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kThirds[] = {"all", "low", "middle", "high"};

Json optional(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

std::optional<double> optional_of(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

double number_of(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

template <class Enum, std::size_t count>
Enum value_named(const Json& json, const char* (*name)(Enum), const Enum (&all)[count]) {
  const std::string text = json.get<std::string>();
  for (const Enum value : all)
    if (text == name(value)) return value;
  throw Json::other_error::create(500, "unknown value \"" + text + "\"", &json);
}

constexpr HypothesisKind kHypotheses[] = {HypothesisKind::none, HypothesisKind::parameters, HypothesisKind::effect,
                                          HypothesisKind::unknown};
constexpr VerdictKind kVerdicts[] = {VerdictKind::effect, VerdictKind::group,   VerdictKind::parameters,
                                     VerdictKind::none,   VerdictKind::unknown, VerdictKind::data};
constexpr Fitted kFitted[] = {Fitted::nominal, Fitted::refit, Fitted::effect};
constexpr ResidualTest kTests[] = {ResidualTest::channel,   ResidualTest::regime, ResidualTest::phase,
                                   ResidualTest::frequency, ResidualTest::input,  ResidualTest::whiteness};

Json to_json(const std::vector<Estimate>& list) {
  Json json = Json::object();
  for (const Estimate& e : list)
    json[e.name] = {{"value", e.value}, {"low", e.low}, {"high", e.high}, {"unit", e.unit}};
  return json;
}

std::vector<Estimate> estimates_of(const Json& json) {
  std::vector<Estimate> list;
  for (const auto& [name, e] : json.items())
    list.push_back({name, e.at("value"), e.at("low"), e.at("high"), e.at("unit")});
  return list;
}

Json to_json(const std::optional<Closure>& c) {
  return c ? Json{{"value", c->value}, {"low", c->low}, {"high", c->high}} : Json(nullptr);
}

std::optional<Closure> closure_of(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return Closure{json.at("value"), json.at("low"), json.at("high")};
}

Json to_json(const UnexplainedTerm& t) {
  return {{"channel", t.channel},
          {"harmonic", t.harmonic},
          {"function", t.function},
          {"regime", t.regime},
          {"times_prior_scale", t.times_prior_scale},
          {"gain_nats", t.gain_nats}};
}

UnexplainedTerm term_of(const Json& json) {
  return {json.at("channel"), json.at("harmonic"),          json.at("function"),
          json.at("regime"),  json.at("times_prior_scale"), json.at("gain_nats")};
}

Json to_json(const ResidualLocation& l) {
  return {{"fitted", name_of(l.fitted)},
          {"test", name_of(l.test)},
          {"channel", l.channel},
          {"unit", l.unit},
          {"regime",
           {{"quantity", l.regime.quantity},
            {"third", kThirds[static_cast<int>(l.regime.third)]},
            {"low", optional(l.regime.low)},
            {"high", optional(l.regime.high)},
            {"unit", l.regime.unit}}},
          {"gap", l.gap},
          {"noise_floor", l.noise_floor},
          {"p_value", l.p_value},
          {"discovered", l.discovered}};
}

ResidualLocation location_of(const Json& json) {
  const Json& regime = json.at("regime");
  const std::string third = regime.at("third");
  const auto at = std::ranges::find(kThirds, third);
  if (at == std::end(kThirds)) throw Json::other_error::create(500, "unknown third \"" + third + "\"", &regime);
  return {value_named(json.at("fitted"), name_of, kFitted),
          value_named(json.at("test"), name_of, kTests),
          json.at("channel"),
          json.at("unit"),
          {regime.at("quantity"), static_cast<Regime::Third>(at - std::begin(kThirds)), optional_of(regime.at("low")),
           optional_of(regime.at("high")), regime.at("unit")},
          json.at("gap"),
          json.at("noise_floor"),
          json.at("p_value"),
          json.at("discovered")};
}

Json to_json(const RankedHypothesis& h) {
  return {{"kind", name_of(h.kind)},
          {"effects", h.effects},
          {"group", h.group},
          {"remainder", h.remainder},
          {"probability", h.probability},
          {"log_evidence", h.log_evidence},
          {"log_prior", h.log_prior},
          {"parameters", to_json(h.parameters)},
          {"loss", optional(h.loss)},
          {"loss_gain_sd", h.loss_gain_sd},
          {"closure", to_json(h.closure)}};
}

RankedHypothesis hypothesis_of(const Json& json) {
  return {value_named(json.at("kind"), name_of, kHypotheses),
          json.at("effects"),
          json.at("group"),
          json.at("remainder"),
          json.at("probability"),
          json.at("log_evidence"),
          json.at("log_prior"),
          estimates_of(json.at("parameters")),
          optional_of(json.at("loss")),
          json.at("loss_gain_sd"),
          closure_of(json.at("closure"))};
}

Json to_json(const SeenQuantity& s) {
  return {{"name", s.name},   {"unit", s.unit},       {"reference", s.reference},
          {"tests", s.tests}, {"scatter", s.scatter}, {"times", finite(s.times())}};
}

Json to_json(const OddFlight& o) {
  return {{"flight", o.flight},
          {"quantity", o.quantity},
          {"times", finite(o.times)},
          {"since_s", optional(o.since_s)},
          {"step", optional(o.step)}};
}

Json to_json(const LadderRung& r) {
  return {{"rung", r.rung},
          {"nominal", optional(r.nominal)},
          {"refit", optional(r.refit)},
          {"effect", optional(r.effect)},
          {"probability", r.probability}};
}

Json to_json(const Validation& v) {
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
    agreements.push_back({{"name", a.name}, {"value", a.value}, {"sd", a.sd}, {"p_value", finite(a.p_value)}});
  return {{"ladder", ladder}, {"controls", controls}, {"agreements", agreements}};
}

Validation validation_of(const Json& json) {
  Validation v;
  const auto require = [](bool has, const char* what, const Json& where) {
    if (!has) throw Json::other_error::create(500, what, &where);
  };
  const Json& ladder = json.at("ladder");
  require(!ladder.empty(), "\"ladder\" of validation is empty", ladder);
  for (const Json& r : ladder) {
    for (const auto& [channel, e] : ladder.front().at("held_out").items())
      require(r.at("held_out").contains(channel), "\"held_out\" of a rung lacks a channel of the first", r);
    v.ladder.push_back({r.at("added"), {}});
    for (const auto& [channel, e] : r.at("held_out").items())
      v.ladder.back().errors.push_back({channel, e.at("rms"), e.at("low"), e.at("high"), e.at("by_type")});
  }
  for (const Json& c : json.at("controls"))
    v.controls.push_back({c.at("effect"), c.at("channel"), c.at("gain"), c.at("best_of_shifted")});
  for (const Json& a : json.at("agreements")) {
    require(!a.at("value").empty(), "\"value\" of an agreement is empty", a);
    v.agreements.push_back({a.at("name"), a.at("value"), a.at("sd"), number_of(a.at("p_value"))});
  }
  return v;
}

Json to_json(const NextExperiment& n) {
  Json courses = Json::array();
  for (const Course& c : n.courses)
    courses.push_back({{"quantity", c.quantity}, {"first", c.first}, {"second", c.second}});
  return {{"manoeuvre", n.manoeuvre},
          {"change", n.change},
          {"cost", n.cost},
          {"separates", n.separates},
          {"expected_nats", n.expected_nats},
          {"information", n.information},
          {"course_step_s", n.course_step_s},
          {"courses", courses}};
}

NextExperiment next_of(const Json& json) {
  NextExperiment n{json.at("manoeuvre"),     json.value("change", ""), json.value("cost", ""),   json.at("separates"),
                   json.at("expected_nats"), json.at("information"),   json.at("course_step_s"), {}};
  for (const Json& c : json.at("courses")) n.courses.push_back({c.at("quantity"), c.at("first"), c.at("second")});
  return n;
}

Diagnosis read(const Json& json) {
  Diagnosis d;
  d.flights = json.at("flights");
  d.reference = json.value("reference", std::vector<std::string>());
  d.warnings = json.value("warnings", std::vector<std::string>());
  for (const Json& f : json.at("data_faults")) d.faults.push_back({f.at("file"), f.at("line"), f.at("what")});
  d.complete = json.at("complete");
  const Json& verdict = json.at("verdict");
  d.verdict = {value_named(verdict.at("kind"), name_of, kVerdicts), verdict.at("effects"), verdict.at("remainder"),
               verdict.at("probability")};
  for (const Json& s : json.value("seen", Json::array()))
    d.seen.push_back({s.at("name"), s.at("unit"), s.at("reference"), s.at("tests"), s.at("scatter")});
  for (const Json& o : json.value("odd_flights", Json::array()))
    d.odd.push_back({o.at("flight"), o.at("quantity"), number_of(o.at("times")), optional_of(o.at("since_s")),
                     optional_of(o.at("step"))});
  for (const Json& h : json.at("hypotheses")) d.hypotheses.push_back(hypothesis_of(h));
  for (const Json& t : json.at("unexplained").at("terms")) d.unexplained.push_back(term_of(t));
  d.jointly_with = json.at("unexplained").at("jointly_with");
  if (const Json& t = json.at("other_law"); !t.is_null()) d.other_law = term_of(t);
  d.background = estimates_of(json.at("background"));
  d.sensors = estimates_of(json.at("sensors"));
  for (const auto& [name, sd] : json.at("moved_parameters").items()) d.moved_parameters.emplace_back(name, sd);
  for (const Json& l : json.at("locations")) d.locations.push_back(location_of(l));
  const Json& gap = json.at("gap");
  d.nominal_loss = optional_of(gap.at("nominal"));
  d.refit_loss = optional_of(gap.at("refit"));
  d.effect_loss = optional_of(gap.at("effect"));
  d.noise_floor = gap.at("noise_floor");
  d.closure = closure_of(gap.at("closure"));
  for (const Json& r : json.value("ladder", Json::array()))
    d.ladder.push_back({r.at("rung"), optional_of(r.at("nominal")), optional_of(r.at("refit")),
                        optional_of(r.at("effect")), r.at("probability")});
  d.untestable = json.at("untestable");
  for (const Json& s : json.value("suspects", Json::array()))
    d.suspects.push_back({s.at("effect"), s.at("probability"), closure_of(s.at("closure"))});
  if (const Json& v = json.at("validation"); !v.is_null()) d.validation = validation_of(v);
  for (const Json& c : json.at("closed_loop"))
    d.closed_loop.push_back({c.at("flight"), c.at("quantity"), number_of(c.at("recorded")), number_of(c.at("nominal")),
                             number_of(c.at("corrected"))});
  if (const Json& n = json.at("next_experiment"); !n.is_null()) d.next = next_of(n);
  const Json sets = json.value("sets", Json::object());
  for (const auto& [name, set] : sets.items()) d.sets.push_back({name, read(set)});
  return d;
}

}  // namespace

Json to_json(const Diagnosis& d) {
  Json faults = Json::array(), hypotheses = Json::array(), terms = Json::array(), locations = Json::array(),
       closed_loop = Json::array(), moved = Json::object(), suspects = Json::array(), seen = Json::array(),
       odd = Json::array(), ladder = Json::array();
  for (const LadderRung& r : d.ladder) ladder.push_back(to_json(r));
  for (const SeenQuantity& s : d.seen) seen.push_back(to_json(s));
  for (const OddFlight& o : d.odd) odd.push_back(to_json(o));
  for (const flightlog::DataFault& f : d.faults)
    faults.push_back({{"file", f.file}, {"line", f.line}, {"what", f.what}});
  for (const RankedHypothesis& h : d.hypotheses) hypotheses.push_back(to_json(h));
  for (const Suspect& s : d.suspects)
    suspects.push_back({{"effect", s.effect}, {"probability", s.probability}, {"closure", to_json(s.closure)}});
  for (const UnexplainedTerm& t : d.unexplained) terms.push_back(to_json(t));
  for (const ResidualLocation& l : d.locations) locations.push_back(to_json(l));
  for (const auto& [name, sd] : d.moved_parameters) moved[name] = sd;
  for (const ClosedLoop& c : d.closed_loop)
    closed_loop.push_back({{"flight", c.flight},
                           {"quantity", c.quantity},
                           {"recorded", finite(c.recorded)},
                           {"nominal", finite(c.nominal)},
                           {"corrected", finite(c.corrected)}});
  Json sets = Json::object();
  for (const NamedDiagnosis& s : d.sets) sets[s.name] = to_json(s.diagnosis);
  Json json = {{"schema", kDiagnosisSchema},
               {"flights", d.flights},
               {"reference", d.reference},
               {"warnings", d.warnings},
               {"data_faults", faults},
               {"complete", d.complete},
               {"verdict",
                {{"kind", name_of(d.verdict.kind)},
                 {"effects", d.verdict.effects},
                 {"remainder", d.verdict.remainder},
                 {"probability", d.verdict.probability}}},
               {"hypotheses", hypotheses},
               {"suspects", suspects},
               {"unexplained", {{"jointly_with", d.jointly_with}, {"terms", terms}}},
               {"other_law", d.other_law ? to_json(*d.other_law) : Json(nullptr)},
               {"background", to_json(d.background)},
               {"sensors", to_json(d.sensors)},
               {"moved_parameters", moved},
               {"gap",
                {{"nominal", optional(d.nominal_loss)},
                 {"refit", optional(d.refit_loss)},
                 {"effect", optional(d.effect_loss)},
                 {"noise_floor", d.noise_floor},
                 {"closure", to_json(d.closure)}}},
               {"ladder", ladder},
               {"closed_loop", closed_loop},
               {"next_experiment", d.next ? to_json(*d.next) : Json(nullptr)},
               {"untestable", d.untestable},
               {"validation", d.validation ? to_json(*d.validation) : Json(nullptr)},
               {"locations", locations},
               {"sets", sets}};
  if (!d.seen.empty()) json["seen"] = seen, json["odd_flights"] = odd;
  return json;
}

void write_diagnosis(const std::filesystem::path& folder, const Diagnosis& diagnosis) {
  io::write_atomically(folder / kDiagnosisFile, to_json(diagnosis).dump(1) + "\n");
}

Diagnosis diagnosis_from(const Json& json, const std::filesystem::path& file) {
  try {
    if (const Json& schema = json.at("schema"); schema != kDiagnosisSchema)
      throw io::InputError(file.string() + ": schema " +
                           io::other_schema(schema.get<std::int64_t>(), kDiagnosisSchema) + "; accepted: schema " +
                           std::to_string(kDiagnosisSchema) + ", as flappy-gap diagnose writes it");
    return read(json);
  } catch (const Json::exception& e) {
    // "[json.exception.out_of_range.403] key 'verdict' not found"
    const std::string what = e.what();
    const std::size_t bracket = what.find("] ");
    throw io::InputError(file.string() + ": " + (bracket == std::string::npos ? what : what.substr(bracket + 2)) +
                         "; accepted: what flappy-gap diagnose wrote");
  }
}

}  // namespace flappy::gap
