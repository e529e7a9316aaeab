#include "lab/benchmark/records.hpp"

#include <cstdio>
#include <set>

#include "gap/result/diagnosis_json.hpp"
#include "io/schema.hpp"
#include "io/sha256.hpp"
#include "lab/benchmark/families.hpp"

namespace flappy::benchmark {
namespace {

using Names = std::vector<std::string>;

[[noreturn]] void refuse_changed(const std::filesystem::path& file) {
  throw io::InputError(file.string() + ": has changed; accepted: what was sealed");
}

}  // namespace

std::string number_text(std::size_t number) {
  char text[24];
  std::snprintf(text, sizeof text, "%04zu", number);
  return text;
}

Json read_json(const std::filesystem::path& file) {
  const std::string text = io::read_text(file);
  try {
    return Json::parse(text);
  } catch (const Json::exception& e) {
    throw io::InputError(file.string() + ": is no JSON: " + e.what() + "; accepted: what flappy-blind wrote");
  }
}

namespace {

std::vector<std::filesystem::path> folders_in(const PublicCase& c, const std::filesystem::path& folder,
                                              const std::string& begin) {
  std::set<std::filesystem::path> all;
  for (const auto& [file, sha256] : c.files)
    if (const auto of = (folder / file).parent_path(); of.filename().string().starts_with(begin)) all.insert(of);
  return {all.begin(), all.end()};
}

}  // namespace

std::vector<std::filesystem::path> PublicCase::flights(const std::filesystem::path& folder) const {
  return folders_in(*this, folder, kFlightFolder);
}

std::vector<std::filesystem::path> PublicCase::references(const std::filesystem::path& folder) const {
  return folders_in(*this, folder, kReferenceFolder);
}

Json to_json(const Manifest& m) {
  Json cases = Json::array();
  for (const PublicCase& c : m.cases)
    cases.push_back({{"number", c.number}, {"withheld", c.withheld}, {"files", c.files}});
  return {{"schema", 2},
          {"family", m.family},
          {"set", m.set},
          {"vehicle", m.vehicle},
          {"vehicle_sha256", m.vehicle_sha256},
          {"labels_sha256", m.labels_sha256},
          {"commit", m.commit},
          {"engine", m.engine},
          {"cases", cases}};
}

Manifest read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "manifest.json";
  const Json json = read_json(file);
  try {
    if (const Json& schema = json.at("schema"); schema != 2)
      throw io::InputError(file.string() + ": schema " +
                           io::other_schema(schema.get<std::int64_t>(), 2, json.value("commit", "")) +
                           "; accepted: schema 2");
    Manifest m{json.at("family"),        json.at("set"),    json.at("vehicle"),       json.at("vehicle_sha256"),
               json.at("labels_sha256"), json.at("commit"), json.value("engine", ""), {}};
    for (const Json& c : json.at("cases"))
      m.cases.push_back({c.at("number"), c.at("withheld"), c.at("files").get<std::map<std::string, std::string>>()});
    return m;
  } catch (const Json::exception& e) {
    throw io::InputError(file.string() + ": " + e.what() + "; accepted: what flappy-blind make wrote");
  }
}

std::filesystem::path verdict_of_predictions(const std::filesystem::path& folder) {
  return folder / "predictions" / "verdict.toml";
}

std::filesystem::path prediction_file(const std::filesystem::path& folder, std::size_t number) {
  return folder / "predictions" / (number_text(number) + ".json");
}

void check_predictions(const std::filesystem::path& folder, const Manifest& manifest) {
  const std::string sums = io::read_text(folder / kSums);
  for (const PublicCase& c : manifest.cases)
    if (sums.find(sum_line(folder, c.number)) == std::string::npos) refuse_changed(prediction_file(folder, c.number));
}

std::string sum_line(const std::filesystem::path& folder, std::size_t number) {
  const std::filesystem::path file = prediction_file(folder, number);
  return io::sha256(io::read_text(file)) + "  " + file.lexically_relative(folder).string() + "\n";
}

std::filesystem::path true_fits(const std::filesystem::path& folder) { return folder / "true_fits"; }

Json open_labels(const std::filesystem::path& folder, const Manifest& manifest) {
  const std::filesystem::path sealed = folder / "sealed" / "labels.json";
  if (io::sha256(io::read_text(sealed)) != manifest.labels_sha256) refuse_changed(sealed);
  return read_json(sealed);
}

CaseTruth Label::truth() const {
  CaseTruth t{planned.part, {}, channels, regimes, planned.seed, draw, {}};
  for (const blind::BlindEffect& e : planned.effects) t.effects.push_back(e.id);
  for (const OverSessions& o : over_sessions) t.over_sessions.push_back(o.ratio);
  return t;
}

blind::Assignment Label::robot(const std::filesystem::path& vehicle) const {
  blind::Assignment a = assignment_of(planned, vehicle);
  a.seed = seed_of_draw(planned.seed, draw);
  return a;
}

Json to_json(const PlannedCase& p) {
  Json effects = Json::array();
  for (const blind::BlindEffect& e : p.effects) effects.push_back({{"id", e.id}, {"magnitude", e.magnitude}});
  Json json = {{"number", p.number},
               {"part", p.part},
               {"effects", effects},
               {"seed", p.seed},
               {"hover", p.hover},
               {"power", p.power},
               {"own_parameters", p.own_parameters},
               {"conventions", p.conventions},
               {"published", p.published},
               {"references", p.references},
               {"reference_sessions", p.reference_sessions},
               {"flights", p.flights},
               {"calm_reference", p.calm_reference},
               {"withheld", p.withheld}};
  if (p.bench) json["bench"] = true;  // plans without have the hash that they had before
  return json;
}

Json to_json(const Label& label) {
  Json json = to_json(label.planned);
  json["draw"] = label.draw;
  json["channels"] = label.channels;
  json["regimes"] = label.regimes;
  json["over_sessions"] = Json::array();
  for (const OverSessions& o : label.over_sessions)
    json["over_sessions"].push_back({{"channel", o.channel}, {"ratio", o.ratio}});
  return json;
}

Label label_from(const Json& json) {
  Label l;
  PlannedCase& p = l.planned;
  p.number = json.at("number");
  p.part = json.at("part");
  for (const Json& e : json.at("effects")) p.effects.push_back({e.at("id"), e.at("magnitude")});
  p.seed = json.at("seed");
  p.hover = json.at("hover");
  p.power = json.at("power");
  p.bench = json.value("bench", false);
  p.own_parameters = json.at("own_parameters");
  p.conventions = json.at("conventions");
  p.published = json.at("published");
  p.references = json.value("references", std::size_t{0});
  p.reference_sessions = json.value("reference_sessions", std::size_t{1});
  p.flights = json.value("flights", blind::Family::kFlights);
  p.calm_reference = json.value("calm_reference", false);
  p.withheld = json.at("withheld").get<Names>();
  l.draw = json.at("draw");
  l.channels = json.at("channels").get<Names>();
  l.regimes = json.at("regimes").get<Names>();
  for (const Json& o : json.value("over_sessions", Json::array()))
    l.over_sessions.push_back({o.at("channel"), o.at("ratio")});
  return l;
}

namespace {

Json rivals_json(const std::map<std::string, Rival>& rivals) {
  Json json = Json::object();
  for (const auto& [name, r] : rivals)
    json[name] = {{"named", r.named}, {"ranking", r.ranking}, {"strength", r.strength}};
  return json;
}

std::map<std::string, Rival> rivals_from(const Json& json) {
  std::map<std::string, Rival> rivals;
  for (const auto& [name, r] : json.items())
    rivals[name] = {r.at("named").get<Names>(), r.at("ranking").get<Names>(), r.at("strength")};
  return rivals;
}

Json number_or_null(const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); }
std::optional<double> optional_number(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

Json to_json(const Answer& a, const CaseTruth& truth) {
  Json sets = Json::array(), hypotheses = Json::array();
  double least = 1e-3;  // what is rarer than this, and than the truth, changes no score
  for (const gap::RankedHypothesis& s : a.sets)
    if (s.effects == truth.effects) least = std::min(least, s.probability);
  for (const gap::RankedHypothesis& s : a.sets)
    if (s.probability >= least || s.effects == a.effects)
      sets.push_back({{"effects", s.effects},
                      {"probability", s.probability},
                      {"loss", number_or_null(s.loss)},
                      {"loss_gain_sd", s.loss_gain_sd}});
  // of the hypotheses, the evidence of the best with the true effect and of the best without it
  if (truth.effects.size() == 1)
    for (const bool own : {true, false}) {
      const gap::RankedHypothesis* best = nullptr;
      for (const gap::RankedHypothesis& h : a.hypotheses)
        if ((std::ranges::count(h.effects, truth.effects.front()) > 0) == own &&
            (!best || h.explained() > best->explained()))
          best = &h;
      if (best) hypotheses.push_back({{"effects", best->effects}, {"explained", best->explained()}});
    }
  return {{"kind", a.kind},
          {"effects", a.effects},
          {"probability", a.probability},
          {"sets", sets},
          {"hypotheses", hypotheses},
          {"suspects", a.suspects},
          {"none", a.none},
          {"parameters", a.parameters},
          {"unknown", a.unknown},
          {"nominal", number_or_null(a.nominal)},
          {"refit", number_or_null(a.refit)},
          {"floor", number_or_null(a.floor)},
          {"rivals", rivals_json(a.rivals)},
          {"manoeuvre", a.manoeuvre},
          {"where", a.where ? Json::array({a.where->channel, a.where->regime}) : Json(nullptr)}};
}

Answer answer_from(const Json& json) {
  Answer a;
  a.kind = json.at("kind");
  a.effects = json.at("effects").get<Names>();
  a.probability = json.at("probability");
  for (const Json& s : json.at("sets")) {
    gap::RankedHypothesis& h = a.sets.emplace_back();
    h.effects = s.at("effects").get<Names>();
    h.probability = s.at("probability");
    h.loss = optional_number(s.at("loss"));
    h.loss_gain_sd = s.at("loss_gain_sd");
  }
  for (const Json& s : json.at("hypotheses")) {
    gap::RankedHypothesis& h = a.hypotheses.emplace_back();
    h.effects = s.at("effects").get<Names>();
    h.log_evidence = s.at("explained");
  }
  a.suspects = json.at("suspects").get<Names>();
  a.none = json.at("none"), a.parameters = json.at("parameters"), a.unknown = json.at("unknown");
  a.nominal = optional_number(json.at("nominal"));
  a.refit = optional_number(json.at("refit"));
  a.floor = optional_number(json.at("floor"));
  a.rivals = rivals_from(json.at("rivals"));
  a.manoeuvre = json.at("manoeuvre");
  if (const Json& w = json.at("where"); !w.is_null()) a.where = Where{w.at(0), w.at(1)};
  return a;
}

}  // namespace

Json to_json(const CaseRecord& r) {
  const CaseTruth& t = r.scored.truth;
  Json json = {{"family", r.family},
               {"set", r.set},
               {"commit", r.commit},
               {"number", r.number},
               {"bench", r.bench},
               {"row", r.row},
               {"part", t.part},
               {"effects", t.effects},
               {"channels", t.channels},
               {"regimes", t.regimes},
               {"seed", t.seed},
               {"draw", t.draw},
               {"over_sessions", t.over_sessions},
               {"answer", to_json(r.scored.prediction, t)}};
  if (r.scored.true_fit) json["true_fit"] = to_json(*r.scored.true_fit, t);
  if (r.scored.after_next) json["after_next"] = to_json(*r.scored.after_next, t);
  if (const auto& f = r.scored.foreseen) json["foreseen"] = Json::array({f->nats, f->probability});
  return json;
}

CaseRecord case_record_from(const Json& json, const std::string& where) {
  try {
    CaseRecord r{
        json.at("family"), json.at("set"), json.at("commit"), json.at("number"), json.at("bench"), json.at("row"), {}};
    CaseTruth& t = r.scored.truth;
    t.part = json.at("part");
    t.effects = json.at("effects").get<Names>();
    t.channels = json.at("channels").get<Names>();
    t.regimes = json.at("regimes").get<Names>();
    t.seed = json.at("seed"), t.draw = json.at("draw");
    t.over_sessions = json.at("over_sessions").get<std::vector<double>>();
    r.scored.prediction = answer_from(json.at("answer"));
    if (json.contains("true_fit")) r.scored.true_fit = answer_from(json.at("true_fit"));
    if (json.contains("after_next")) r.scored.after_next = answer_from(json.at("after_next"));
    if (json.contains("foreseen")) r.scored.foreseen = Foresight{json.at("foreseen").at(0), json.at("foreseen").at(1)};
    return r;
  } catch (const Json::exception& e) {
    throw io::InputError(where + ": " + e.what() + "; accepted: a line that flappy-blind score wrote");
  }
}

Json to_json(const Prediction& p) {
  return {{"diagnosis", to_json(p.diagnosis)},
          {"rivals", rivals_json(p.rivals)},
          {"corrected", p.corrected},
          {"crashed", p.crashed}};
}

Prediction read_prediction(const std::filesystem::path& file) {
  const Json json = read_json(file);
  try {
    Prediction p;
    p.diagnosis = gap::diagnosis_from(json.at("diagnosis"), file);
    p.rivals = rivals_from(json.at("rivals"));
    p.corrected = json.at("corrected");
    p.crashed = json.at("crashed");
    return p;
  } catch (const Json::exception& e) {
    throw io::InputError(file.string() + ": " + e.what() + "; accepted: what this flappy-blind score wrote");
  }
}

}  // namespace flappy::benchmark
