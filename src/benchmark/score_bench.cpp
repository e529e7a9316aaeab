#include "benchmark/score_bench.hpp"

#include <chrono>
#include <cstdio>
#include <set>

#include "benchmark/records.hpp"
#include "benchmark/work.hpp"
#include "io/append_file.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/sha256.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const std::string& what) {
  throw io::InputError(file.string() + ": " + what + "; accepted: what was sealed");
}

/// Made when the labels are opened: no prediction is accepted any more.
fs::path true_fits(const ScoreCommand& command) { return command.folder / "true_fits"; }

// ---- phase 1: nothing below reads what is sealed

class Predictions {
 public:
  Predictions(const ScoreCommand& command, const Manifest& manifest)
      : command_(command),
        manifest_(manifest),
        vehicle_(command.vehicle.empty() ? fs::path(manifest.vehicle) : command.vehicle),
        sums_(command.folder / "predictions.sha256") {}

  void check_inputs() const {
    if (io::sha256(io::read_text(vehicle_)) != manifest_.vehicle_sha256)
      refuse(vehicle_, "is not the vehicle declared");
    for (const PublicCase& c : manifest_.cases) {
      for (const auto& [file, sha256] : c.files)
        if (io::sha256(io::read_text(command_.folder / file)) != sha256) refuse(command_.folder / file, "has changed");
      for (const fs::path& flight : c.flights(command_.folder))
        for (const fs::directory_entry& e : fs::directory_iterator(flight))
          if (!c.files.contains(e.path().lexically_relative(command_.folder).string())) refuse(e.path(), "is new");
    }
  }

  /// False where it was interrupted.
  bool make() const {
    if (fs::exists(sums_)) {
      check();
      return true;
    }
    if (fs::exists(true_fits(command_))) refuse(sums_, "is missing, though labels were opened");
    io::make_folder(command_.folder / "predictions");
    std::vector<const PublicCase*> open;
    for (const PublicCase& c : manifest_.cases)
      if (!fs::exists(file_of(c.number))) open.push_back(&c);
    const bool all = work_through("diagnosing", open.size(), command_.threads, command_.ranks, [&](std::size_t i) {
      const PublicCase& c = *open[i];
      const auto start = std::chrono::steady_clock::now();
      Json json = to_json(command_.predictor(question(c, c.withheld)));
      json["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      json["commit"] = io::commit();
      io::write_atomically(file_of(c.number), json.dump(1) + "\n");
    });
    if (!all) return false;
    if (io::writes(command_.ranks)) seal();
    io::wait(command_.ranks);  // before anybody opens a label
    return true;
  }

  Json read(std::size_t number) const { return read_json(file_of(number)); }

  Question question(const PublicCase& c, const std::vector<std::string>& withheld) const {
    return {c.flights(command_.folder), vehicle_, command_.priors, withheld, true, command_.experiments};
  }

 private:
  void seal() const {
    std::string sums;  // as sha256sum writes and checks them
    for (const PublicCase& c : manifest_.cases) sums += sum_of(c.number) + "  " + name_of(c.number) + "\n";
    io::write_atomically(sums_, sums);
  }
  static std::string name_of(std::size_t number) { return "predictions/" + number_text(number) + ".json"; }
  fs::path file_of(std::size_t number) const { return command_.folder / name_of(number); }
  std::string sum_of(std::size_t number) const { return io::sha256(io::read_text(file_of(number))); }

  void check() const {
    const std::string sums = io::read_text(sums_);
    for (const PublicCase& c : manifest_.cases)
      if (sums.find(sum_of(c.number) + "  " + name_of(c.number) + "\n") == std::string::npos)
        refuse(file_of(c.number), "has changed");
  }

  const ScoreCommand& command_;
  const Manifest& manifest_;
  fs::path vehicle_, sums_;
};

// ---- phase 2: the labels

/// With the true effects alone in the catalogue: where a diagnosis did not fit them, its closure has no measure.
bool fit_truths(const ScoreCommand& command, const Manifest& manifest, const Predictions& predictions,
                const std::map<std::size_t, Label>& labels, std::vector<ScoredCase>& cases) {
  std::vector<std::size_t> open;
  const auto file_of = [&](std::size_t number) { return true_fits(command) / (number_text(number) + ".json"); };
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (needs_true_fit(cases[i]) && !fs::exists(file_of(manifest.cases[i].number))) open.push_back(i);
  const bool all =
      work_through("fitting true effects", open.size(), command.threads, command.ranks, [&](std::size_t k) {
        const PublicCase& c = manifest.cases[open[k]];
        std::vector<std::string> others;
        for (const model::EffectEntry& e : model::effects())
          if (std::ranges::count(labels.at(c.number).truth().effects, std::string(e.info.id)) == 0)
            others.emplace_back(e.info.id);
        Question q = predictions.question(c, others);
        q.baselines = false;
        q.experiments.clear();
        io::write_atomically(file_of(c.number), to_json(command.predictor(q)).dump(1) + "\n");
      });
  if (!all) return false;
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (needs_true_fit(cases[i])) cases[i].true_fit = prediction_from(read_json(file_of(manifest.cases[i].number)));
  return true;
}

// ---- what is told

std::string figure(const std::optional<double>& value) {
  if (!value) return "-";
  char text[24];
  std::snprintf(text, sizeof text, "%.3f", *value);
  return text;
}

std::string interval(const ScoreValue& s) { return s.value ? figure(s.low) + " to " + figure(s.high) : "-"; }

std::string table(const std::string& title, const std::vector<ScoreLine>& lines) {
  std::string text = "| " + title +
                     " | must | aim | measured | 95 % interval | count | largest residual | best RMSE | STLSQ |\n"
                     "|---|---|---|---|---|---|---|---|---|\n";
  for (const ScoreLine& l : lines) {
    text += "| " + l.what + " | " + l.must + " | " + l.aim + " | " + figure(l.score.value) +
            (l.meets_must && !*l.meets_must ? " (missed)" : "") + " | " + interval(l.score) + " | " +
            std::to_string(l.score.count);
    for (const char* name : kBaselines) {
      const auto b = l.baselines.find(name);
      text += " | " + (b == l.baselines.end() ? "-" : figure(b->second.value));
    }
    text += " |\n";
  }
  return text;
}

void add(Json& json, const std::string& key, const ScoreValue& s) {
  const auto number = [&](double v) { return s.value ? Json(v) : Json(nullptr); };
  json[key] = s.value ? Json(*s.value) : Json(nullptr);
  json[key + "_low"] = number(s.low);
  json[key + "_high"] = number(s.high);
  json[key + "_count"] = s.count;
}

Json lines_json(const std::vector<ScoreLine>& lines) {
  Json json = Json::object();
  for (const ScoreLine& l : lines) add(json, l.key, l.score);
  return json;
}

/// One line for each case, for whoever wants to know which ones went wrong.
std::string case_list(const Manifest& manifest, const std::map<std::size_t, Label>& labels,
                      const std::vector<ScoredCase>& cases, const Predictions& predictions) {
  std::string text = "case,part,effects,sizes,separable,verdict,named,probability,right,closure,seconds\n";
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const ScoredCase& c = cases[i];
    const std::size_t number = manifest.cases[i].number;
    std::string sizes;
    for (const blind::BlindEffect& e : labels.at(number).planned.effects)
      sizes += (sizes.empty() ? "" : "+") + io::shortest_digits(e.size);
    const std::optional<double> closed = c.truth.part == "singles" ? closure(c) : std::nullopt;
    text += std::to_string(number) + "," + c.truth.part + "," + io::joined(c.truth.effects, "+") + "," + sizes + "," +
            (c.truth.separable ? "1" : "0") + "," + c.prediction.kind + "," + io::joined(c.prediction.effects, "+") +
            "," + figure(c.prediction.probability) + "," + (right(c.truth, c.prediction) ? "1" : "0") + "," +
            (closed ? figure(closed) : "") + "," +
            io::shortest_digits(predictions.read(number).at("seconds").get<double>()) + "\n";
  }
  return text;
}

}  // namespace

Json score_bench(const ScoreCommand& command) {
  std::optional<io::FolderLock> lock;
  if (io::writes(command.ranks)) lock.emplace(command.folder);
  const Manifest manifest = read_manifest(command.folder);
  const Predictions predictions(command, manifest);
  predictions.check_inputs();
  if (!predictions.make()) {
    std::printf("stopped; what is predicted stays: the same command goes on\n");
    return nullptr;
  }

  const fs::path sealed = command.folder / "sealed" / "labels.json";
  if (io::sha256(io::read_text(sealed)) != manifest.labels_sha256) refuse(sealed, "has changed");
  io::make_folder(true_fits(command));
  const Json truths = read_json(sealed);
  std::map<std::size_t, Label> labels;
  for (const Json& json : truths.at("cases")) {
    Label l = label_from(json);
    labels.emplace(l.planned.number, std::move(l));
  }
  std::vector<ScoredCase> cases;
  std::set<std::string> commits;
  for (const PublicCase& c : manifest.cases) {
    const Json prediction = predictions.read(c.number);
    commits.insert(prediction.at("commit"));
    cases.push_back({labels.at(c.number).truth(), prediction_from(prediction), {}});
  }
  if (!fit_truths(command, manifest, predictions, labels, cases)) {
    std::printf("stopped; predictions are sealed: the same command goes on\n");
    return nullptr;
  }

  const Scores scores = score(cases);
  const auto undetectable = truths.at("undetectable").get<std::vector<std::string>>();
  std::string text = table("on 30 s of flights with rich excitation, twice the detectable size", scores.main);
  if (std::ranges::any_of(cases, [](const ScoredCase& c) { return c.truth.part == "typical"; }))
    text += "\n" + table("the same at typical sizes", scores.typical);
  text += "\n" + manifest.set + " seeds, " + std::to_string(cases.size()) + " cases, " +
          std::to_string(truths.at("never_fly").size()) +
          " robots that never fly left out. Undetectable, left out: " + std::to_string(undetectable.size()) +
          (undetectable.empty() ? "" : " (" + io::joined(undetectable) + ")") + ".\n";
  if (commits.size() > 1) text += "Predicted by " + std::to_string(commits.size()) + " different versions.\n";
  std::fputs(text.c_str(), stdout);
  if (!io::writes(command.ranks)) return nullptr;
  io::write_atomically(command.folder / "score.md", text);
  io::write_atomically(command.folder / "score.csv", case_list(manifest, labels, cases, predictions));

  Json json = {{"cases", cases.size()}};
  json.update(lines_json(scores.main));
  json["ece_calibrated_95"] = scores.ece_calibrated_95;
  json["typical"] = lines_json(scores.typical);
  json["typical"]["ece_calibrated_95"] = scores.typical_ece_calibrated_95;
  json["baselines"] = Json::object();
  for (const char* name : kBaselines) {
    Json own = Json::object();
    for (const ScoreLine& l : scores.main)
      if (const auto b = l.baselines.find(name); b != l.baselines.end()) add(own, l.key, b->second);
    json["baselines"][name] = std::move(own);
  }
  json["undetectable"] = undetectable;
  json["never_fly"] = truths.at("never_fly").size();
  json["set"] = manifest.set;
  json["commits"] = commits;
  return json;
}

}  // namespace flappy::benchmark
