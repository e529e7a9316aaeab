#include "lab/benchmark/score_bench.hpp"

#include <chrono>
#include <cstdio>
#include <memory>
#include <set>
#include <sstream>
#include <tuple>

#include "flappy/vehicle_file.hpp"
#include "io/append_file.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"
#include "io/text.hpp"
#include "lab/benchmark/families.hpp"
#include "lab/benchmark/foresee_bench.hpp"
#include "lab/benchmark/proposal.hpp"
#include "lab/benchmark/records.hpp"
#include "lab/benchmark/work.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const std::string& what) {
  throw io::InputError(file.string() + ": " + what + "; accepted: what was sealed");
}

// ---- phase 1: predictions, which read nothing that is sealed

class Predictions {
 public:
  Predictions(const ScoreCommand& command, const fs::path& folder, const Manifest& manifest)
      : command_(command),
        folder_(folder),
        manifest_(manifest),
        vehicle_(command.vehicle_of(manifest)),
        sums_(folder / kSums) {}

  void check_inputs() const {
    if (io::sha256(io::read_text(vehicle_)) != manifest_.vehicle_sha256)
      refuse(vehicle_, "is not the vehicle declared");
    for (const PublicCase& c : manifest_.cases) {
      for (const auto& [file, sha256] : c.files)
        if (io::sha256(io::read_text(folder_ / file)) != sha256) refuse(folder_ / file, "has changed");
      std::vector<fs::path> flights = c.flights(folder_);
      std::ranges::move(c.references(folder_), std::back_inserter(flights));
      for (const fs::path& flight : flights)
        for (const fs::directory_entry& e : fs::directory_iterator(flight))
          if (!c.files.contains(e.path().lexically_relative(folder_).string())) refuse(e.path(), "is new");
    }
  }

  /// Makes and seals the missing predictions; false if interrupted.
  bool make() const {
    const fs::path options = folder_ / "predictions" / "options.txt";
    if (fs::exists(sums_)) {
      check_predictions(folder_, manifest_);
      if (const std::string other = fs::exists(options) ? command_.other_option(options) : ""; !other.empty())
        std::printf("%s: its predictions are sealed, and were made with another %s\n", folder_.c_str(), other.c_str());
      return true;
    }
    if (fs::exists(true_fits(folder_))) refuse(sums_, "is missing, though labels were opened");
    io::make_folder(folder_ / "predictions");
    if (io::writes(command_.ranks))
      if (const std::string other = command_.other_option(options); !other.empty())
        throw io::InputError(folder_.string() + ": its predictions were begun with another " + other +
                             "; accepted: the same options, or a new benchmark");
    if (io::writes(command_.ranks)) keep_verdict();
    std::vector<const PublicCase*> open;
    for (const PublicCase& c : manifest_.cases)
      if (!fs::exists(prediction_file(folder_, c.number))) open.push_back(&c);
    const bool all = work_through("diagnosing", open.size(), command_.threads, command_.ranks, [&](std::size_t i) {
      const PublicCase& c = *open[i];
      const auto start = std::chrono::steady_clock::now();
      Json json = to_json(command_.predictor(question(c, c.withheld)));
      json["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      json["commit"] = io::commit();
      io::write_atomically(prediction_file(folder_, c.number), json.dump(1) + "\n");
    });
    if (!all) return false;
    if (io::writes(command_.ranks)) seal();
    io::wait(command_.ranks);  // all predictions are sealed before any rank opens a label
    return true;
  }

  const fs::path& vehicle() const { return vehicle_; }
  fs::path verdict() const {
    if (!command_.verdict.empty()) return command_.verdict;
    const bool contrast = !manifest_.cases.empty() && !manifest_.cases.front().references(folder_).empty();
    return io::config_path(contrast ? "gap/contrast_verdict.toml" : "gap/verdict.toml");
  }
  Json read(std::size_t number) const { return read_json(prediction_file(folder_, number)); }

  Question question(const PublicCase& c, const std::vector<std::string>& withheld) const {
    Question q = command_.question(folder_, manifest_, c);
    q.withheld = withheld;
    q.experiments = command_.experiments;
    return q;
  }

 private:
  void keep_verdict() const {
    const fs::path kept = verdict_of_predictions(folder_);
    const std::string now = io::read_text(verdict());
    if (!fs::exists(kept)) io::write_atomically(kept, now);
    else if (io::read_text(kept) != now)
      throw io::InputError(folder_.string() +
                           ": its predictions were begun with another --verdict; accepted: " + kept.string());
  }
  void seal() const {
    std::string sums;
    for (const PublicCase& c : manifest_.cases) sums += sum_line(folder_, c.number);
    io::write_atomically(sums_, sums);
  }

  const ScoreCommand& command_;
  const fs::path& folder_;
  const Manifest& manifest_;
  fs::path vehicle_, sums_;
};

struct Bench {
  Bench(const ScoreCommand& command, const fs::path& at)
      : folder(at), manifest(read_manifest(at)), predictions(command, folder, manifest) {
    check_engine(folder, manifest.family, manifest.engine);
    if (io::writes(command.ranks)) lock.emplace(folder);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  void open() {
    truths = open_labels(folder, manifest);
    io::make_folder(true_fits(folder));
    for (const Json& json : truths.at("cases")) {
      Label l = label_from(json);
      labels.emplace(l.planned.number, std::move(l));
    }
    for (const PublicCase& c : manifest.cases)
      cases.push_back({labels.at(c.number).truth(), answer_of(read_prediction(prediction_file(folder, c.number))), {}});
    for (std::size_t i = 0; i < cases.size(); ++i)
      if (cases[i].truth.effects.size() == 1)
        cases[i].foreseen = read_foreseen(folder, manifest.cases[i].number, cases[i].truth.effects.front());
  }

  fs::path folder;
  Manifest manifest;
  std::optional<io::FolderLock> lock;
  Predictions predictions;
  Json truths;
  std::map<std::size_t, Label> labels;
  std::vector<ScoredCase> cases;  ///< in the order of the manifest
};

/// With only the true effects in the catalogue, where not fitted: closures are relative to them. False if interrupted.
bool fit_truths(const ScoreCommand& command, Bench& bench) {
  std::vector<std::size_t> open;
  const auto file_of = [&](std::size_t i) {
    return true_fits(bench.folder) / (number_text(bench.manifest.cases[i].number) + ".json");
  };
  for (std::size_t i = 0; i < bench.cases.size(); ++i)
    if (needs_true_fit(bench.cases[i]) && !fs::exists(file_of(i))) open.push_back(i);
  const bool all =
      work_through("fitting true effects", open.size(), command.threads, command.ranks, [&](std::size_t k) {
        const PublicCase& c = bench.manifest.cases[open[k]];
        std::vector<std::string> others;
        for (const model::CatalogueEffect& e : model::catalogue_of(model::read_vehicle(bench.predictions.vehicle())))
          if (std::ranges::count(bench.cases[open[k]].truth.effects, std::string(e.info.id)) == 0)
            others.emplace_back(e.info.id);
        Question q = bench.predictions.question(c, others);
        q.rivals = false;
        q.experiments.clear();
        io::write_atomically(file_of(open[k]), to_json(command.predictor(q)).dump(1) + "\n");
      });
  if (!all) return false;
  for (std::size_t i = 0; i < bench.cases.size(); ++i)
    if (needs_true_fit(bench.cases[i])) bench.cases[i].true_fit = answer_of(read_prediction(file_of(i)));
  return true;
}

/// Flies the proposals of part "hover", and with --proposals those of undecided singles. The family makes an
/// intervention's changes to its robot. Old and new flights are diagnosed together. False if interrupted.
bool fly_proposals(const ScoreCommand& command, Bench& bench) {
  const auto file_of = [&](std::size_t i) {
    return bench.folder / "proposed" / (number_text(bench.manifest.cases[i].number) + ".json");
  };
  std::vector<std::size_t> proposed, open;
  for (std::size_t i = 0; i < bench.cases.size(); ++i) {
    const ScoredCase& c = bench.cases[i];
    const bool asked =
        c.truth.part == "hover" || (command.proposals && c.truth.part == "singles" && abstains(c.prediction));
    if (!asked || c.prediction.manoeuvre.empty()) continue;
    proposed.push_back(i);
    if (!fs::exists(file_of(i))) open.push_back(i);
  }
  const std::vector<gap::Manoeuvre> manoeuvres = gap::read_manoeuvres(command.experiments);
  io::make_folder(bench.folder / "proposed");
  const bool all =
      work_through("flying what was proposed", open.size(), command.threads, command.ranks, [&](std::size_t k) {
        const PublicCase& c = bench.manifest.cases[open[k]];
        const Label& label = bench.labels.at(c.number);
        Question q = bench.predictions.question(c, c.withheld);
        q.rivals = false;
        q.experiments.clear();
        const std::string& name = bench.cases[open[k]].prediction.manoeuvre;
        const auto manoeuvre = std::ranges::find(manoeuvres, name, &gap::Manoeuvre::name);
        if (manoeuvre == manoeuvres.end())
          throw io::InputError(command.experiments.string() + ": has no manoeuvre \"" + name +
                               "\", which was proposed; accepted: what score began with");
        blind::Assignment a = label.robot(q.vehicle);
        const blind::ProposedFlight flight =
            proposed_flight(*manoeuvre, flightlog::read_flight_log(q.flights.front()).header);
        a.proposed = &flight;
        a.changes = manoeuvre->config.changes;
        const blind::FamilyFlight flown = family_named(bench.manifest.family).fly(a, kProposedFlight);
        Prediction p;
        if (flown.crashed) {
          p.crashed = true;
          std::printf("case %zu in %s: %s\n", c.number, name.c_str(), flown.how.c_str());
        } else {
          q.flights.push_back(bench.folder / "proposed" / number_text(c.number));
          flightlog::write_flight_log(q.flights.back(), flown.log);
          p = command.predictor(q);
        }
        io::write_atomically(file_of(open[k]), to_json(p).dump(1) + "\n");
      });
  if (!all) return false;
  for (const std::size_t i : proposed) bench.cases[i].after_next = answer_of(read_prediction(file_of(i)));
  return true;
}

std::string figure(const std::optional<double>& value) {
  if (!value) return "-";
  char text[24];
  std::snprintf(text, sizeof text, "%.3f", *value);
  return text;
}

std::string interval(const ScoreValue& s) { return s.value ? figure(s.low) + " to " + figure(s.high) : "-"; }

std::string table(const std::string& title, const Scores& scores) {
  std::string text;
  for (const ScoreLine& l : scores.lines)
    if (std::ranges::count(scores.beaten_on, l.key))
      text += (text.empty() ? "At the same share of false alarms a simple rival is better: " : "; ") + l.what + " (" +
              l.rival_name + " " + figure(l.rival->value) + ", the diagnosis " + figure(l.score.value) + ")";
  if (!text.empty()) text += ".\n\n";
  text +=
      "| " + title + " | must | aim | measured | 95 % interval | count | best rival |\n|---|---|---|---|---|---|---|\n";
  for (const ScoreLine& l : scores.lines)
    text += "| " + l.what + " | " + l.must + " | " + l.aim + " | " + figure(l.score.value) +
            (l.meets_must && !*l.meets_must ? " (missed)" : "") + " | " + interval(l.score) + " | " +
            std::to_string(l.score.count) + " | " + (l.rival ? figure(l.rival->value) + ", " + l.rival_name : "-") +
            " |\n";
  for (const auto& [name, alarms] : scores.unbounded_alarms)
    text += "\n" + name + ", if all that it says counts, names something at " + figure(alarms.value) +
            " of the harmless robots.";
  if (!scores.unbounded_alarms.empty()) text += "\n";
  return text;
}

void add(Json& json, const std::string& key, const ScoreValue& s) {
  const auto number = [&](double v) { return s.value ? Json(v) : Json(nullptr); };
  json[key] = s.value ? Json(*s.value) : Json(nullptr);
  json[key + "_low"] = number(s.low);
  json[key + "_high"] = number(s.high);
  json[key + "_count"] = s.count;
}

Json scores_json(const Scores& scores, std::size_t cases) {
  Json json = {{"cases", cases}};
  for (const ScoreLine& l : scores.lines) add(json, l.key, l.score);
  for (const ScoreLine& l : scores.lines)
    if (l.rival) {
      add(json["rival"], l.key, *l.rival);
      json["rival"][l.key + "_name"] = l.rival_name;
    }
  json["beaten_on"] = scores.beaten_on;
  for (const auto& [name, alarms] : scores.unbounded_alarms) add(json["unbounded_alarms"], name, alarms);
  return json;
}

/// Line of score.csv.
std::string case_line(const Bench& bench, std::size_t i, const Json& prediction) {
  const ScoredCase& c = bench.cases[i];
  const Answer& p = c.prediction;
  const Label& label = bench.labels.at(bench.manifest.cases[i].number);
  std::string magnitudes, over_sessions;
  for (const blind::BlindEffect& e : label.planned.effects)
    magnitudes += (magnitudes.empty() ? "" : "+") + io::shortest_digits(e.magnitude);
  for (const OverSessions& o : label.over_sessions)
    over_sessions += (over_sessions.empty() ? "" : "+") + io::format("%.3g", o.ratio);
  const ScoredCase asked = by_what_counts(c);
  const bool alone = c.truth.part == "singles" || c.truth.part == "changed";
  const std::optional<double> closed = alone ? closure(c) : std::nullopt;
  return io::joined({std::to_string(label.planned.number), c.truth.part, io::joined(c.truth.effects, "+"), magnitudes,
                     over_sessions, p.kind, io::joined(p.effects, "+"), figure(p.probability),
                     right(asked.truth, asked.prediction) ? "1" : "0", closed ? figure(closed) : "",
                     io::shortest_digits(prediction.at("seconds").get<double>()), p.where ? p.where->channel : "",
                     p.where ? p.where->regime : "", std::to_string(c.truth.seed), std::to_string(c.truth.draw),
                     bench.manifest.family, bench.manifest.set, prediction.at("commit").get<std::string>()},
                    ",");
}

std::vector<CaseRecord> records_of(const Bench& bench) {
  std::vector<CaseRecord> all;
  for (std::size_t i = 0; i < bench.cases.size(); ++i) {
    const std::size_t number = bench.manifest.cases[i].number;
    const Json prediction = bench.predictions.read(number);
    all.push_back({bench.manifest.family, bench.manifest.set, prediction.at("commit"), number,
                   bench.labels.at(number).planned.bench, case_line(bench, i, prediction), bench.cases[i]});
  }
  return all;
}

/// Adds the cases of a file; returns how many of its robots never flew.
std::size_t read_records(const fs::path& file, std::vector<CaseRecord>& all) {
  std::istringstream lines(io::read_text(file));
  std::size_t number = 0, never = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string where = file.string() + ":" + std::to_string(++number);
    const Json json = Json::parse(line, nullptr, false);
    if (json.is_discarded())
      throw io::InputError(where + ": is no JSON; accepted: a line that flappy-blind score wrote");
    if (json.contains("never_fly")) never += json.at("never_fly").get<std::size_t>();
    else all.push_back(case_record_from(json, where));
  }
  return never;
}

}  // namespace

Json score_bench(const ScoreCommand& command) {
  if (command.folders.empty() && (command.cases.empty() || command.out.empty()))
    throw io::InputError("score: no folders; accepted: folders of flappy-blind make, or --cases with --out");
  std::vector<std::unique_ptr<Bench>> benches;
  for (const fs::path& folder : command.folders) {
    benches.push_back(std::make_unique<Bench>(command, folder));
    benches.back()->predictions.check_inputs();
  }
  for (const auto& b : benches)
    if (!b->predictions.make()) {
      std::printf("stopped; what is predicted stays: the same command goes on\n");
      return nullptr;
    }
  for (const auto& b : benches) {
    b->open();
    if (!fit_truths(command, *b) || !fly_proposals(command, *b)) {
      std::printf("stopped; predictions are sealed: the same command goes on\n");
      return nullptr;
    }
  }

  std::vector<CaseRecord> records;
  std::size_t never = 0;
  for (const auto& b : benches) {
    std::ranges::move(records_of(*b), std::back_inserter(records));
    never += b->truths.at("never_fly").size();
  }
  for (const fs::path& file : command.cases) never += read_records(file, records);

  std::map<std::string, std::vector<ScoredCase>> by_family;
  std::vector<ScoredCase> all;
  std::set<std::string> sets, commits;
  std::set<std::tuple<std::string, std::string, std::string, std::uint64_t, std::size_t>> seen;
  std::size_t drawn_again = 0;
  std::optional<bool> clamped;
  std::string lines =
      "case,part,effects,magnitudes,over_sessions,verdict,named,probability,right,closure,seconds,channel,regime,seed,"
      "draw,family,set,commit\n";
  std::string json_lines;
  for (const CaseRecord& r : records) {
    const CaseTruth& t = r.scored.truth;
    // parts of a contrast are called alike in flight and on a bench
    const bool of_contrast = std::ranges::count(kContrastParts, t.part) > 0;
    if (of_contrast && r.bench != clamped.value_or(r.bench))
      throw io::InputError("case " + std::to_string(r.number) + " of family " + r.family + ": is " +
                           (r.bench ? "clamped and others fly" : "flown and others are clamped") +
                           "; accepted: one of both in a table");
    if (of_contrast) clamped = r.bench;
    if (!seen.emplace(r.family, r.set, t.part, t.seed, r.number).second)
      throw io::InputError("case " + std::to_string(r.number) + " of family " + r.family + ", " + t.part +
                           ": is given twice; accepted: each case once");
    by_family[r.family].push_back(r.scored);
    all.push_back(r.scored);
    sets.insert(r.set);
    commits.insert(r.commit);
    drawn_again += t.draw;
    lines += r.row + "\n";
    json_lines += to_json(r).dump() + "\n";
  }
  const Scores scores = score(all);
  Json json = scores_json(scores, all.size());
  std::string text;
  json["families"] = Json::object();
  for (const auto& [family, cases] : by_family) {
    const Scores own = score(cases);
    text += table("family " + family, own) + "\n";
    json["families"][family] = scores_json(own, cases.size());
  }
  if (by_family.size() > 1) text += table("all families", scores) + "\n";
  text += io::joined({sets.begin(), sets.end()}) + " seeds, " + std::to_string(all.size()) + " cases, " +
          std::to_string(drawn_again) + " robots that crashed drawn again, " + std::to_string(never) +
          " that never fly left out.\n";
  if (commits.size() > 1) text += "Predicted by " + std::to_string(commits.size()) + " different versions.\n";
  std::fputs(text.c_str(), stdout);
  if (!io::writes(command.ranks)) return nullptr;
  const fs::path out = command.out.empty() ? command.folders.front() : command.out;
  io::make_folder(out);
  io::write_atomically(out / "score.md", text);
  io::write_atomically(out / "score.csv", lines);
  if (never > 0) json_lines += Json{{"never_fly", never}}.dump() + "\n";
  io::write_atomically(out / "cases.jsonl", json_lines);
  std::printf("%s\n", io::shown_by(out.string()).c_str());
  json["never_fly"] = never;
  json["drawn_again"] = drawn_again;
  json["set"] = sets;
  json["commits"] = commits;
  return json;
}

}  // namespace flappy::benchmark
