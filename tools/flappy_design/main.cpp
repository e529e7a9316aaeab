// flappy-design: searches for robots that no other beats in every objective, and flies the chosen ones again.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "design/study.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/read_files.hpp"
#include "io/sha256.hpp"
#include "io/text.hpp"
#include "training.hpp"

namespace {

using namespace flappy;

/// The last line of config.toml: judged by another version, a design has other figures.
constexpr std::string_view kJudgedBy = "# judged by flappy at commit ";

std::string kept_text(const design::DesignConfig& config) {
  return config.resolved + std::string(kJudgedBy) + io::commit() + "\n";
}

/// Records of an earlier run of the same configuration in `folder`; none where the folder is new.
std::vector<design::Record> known_records(const std::filesystem::path& folder, const design::DesignConfig& config) {
  if (std::filesystem::exists(folder) && !std::filesystem::is_directory(folder))
    throw io::InputError(folder.string() + ": is no folder; accepted: a new folder, or one to go on in");
  const std::filesystem::path file = folder / "config.toml", records = folder / "designs.csv";
  if (!std::filesystem::exists(file)) {
    if (std::filesystem::exists(folder) && !std::filesystem::is_empty(folder))
      throw io::InputError(folder.string() +
                           ": is no folder of flappy-design; accepted: a new folder, or one to go on in");
    return {};
  }
  const std::string kept = io::read_text(file);
  if (const std::string begins = config.resolved + std::string(kJudgedBy);
      kept.starts_with(begins) && kept != kept_text(config))
    throw io::InputError(file.string() + ": its designs were judged by flappy at commit " +
                         kept.substr(begins.size(), kept.find('\n', begins.size()) - begins.size()) +
                         "; accepted: a new folder, or that version");
  if (kept != kept_text(config))
    throw io::InputError(file.string() +
                         ": is another configuration; accepted: a new folder, or the same configuration");
  return std::filesystem::exists(records) ? design::read_records(records) : std::vector<design::Record>();
}

void show(const design::Search& search, const std::vector<double>& most) {
  for (std::size_t k = 0; k < most.size(); ++k) {
    const design::FigureInfo& info = design::info_of(search.config().objectives[k]);
    const double published = design::figure_of(search.published().figures, search.config().objectives[k]);
    const std::string has =
        std::string(info.words) + " (the published robot: " +
        (std::isfinite(published) ? io::format("%.4g %s", published, info.unit) : std::string("none")) + ")";
    if (most[k] > 0)
      std::printf("  %.1f %s better without loss elsewhere: %s\n", 100 * most[k],
                  design::is_share(search.config().objectives[k]) ? "points" : "%", has.c_str());
    else std::printf("  no better without loss elsewhere: %s\n", has.c_str());
  }
}

/// Which limits refused how many designs, where none is left.
void show_refusals(const std::vector<std::pair<std::string, std::size_t>>& refusals, std::size_t designs,
                   const std::filesystem::path& folder) {
  std::printf("no design met the limits; of %zu designs were refused:\n", designs);
  for (const auto& [why, count] : refusals) std::printf("  %zu: %s\n", count, why.c_str());
  std::printf("%s has the figures of each\n", (folder / "designs.csv").c_str());
}

/// False if it was interrupted; it then says what stands.
bool verify(const design::Judge& judge, const design::Search& search, const design::DesignConfig& config,
            const std::vector<design::Generation>& history, const std::filesystem::path& folder,
            const std::string& train_config) {
  std::vector<design::Record> chosen = design::choose(search, config.verify.designs);
  chosen.insert(chosen.begin(), search.published());
  std::vector<design::Verified> verified;
  {
    io::ProgressLine line("verified");
    for (std::size_t i = 0; i < chosen.size() && !io::interrupted(); ++i) {
      design::Verified one = design::verify(judge, search, config, chosen[i], io::format("%02zu", i));
      if (io::interrupted()) break;  // its gains may be half tuned
      const std::filesystem::path own = folder / "designs" / one.name;
      design::write_design(own, judge, one);
      if (!train_config.empty()) one.policy = trained(own, train_config);
      verified.push_back(std::move(one));
      design::write_results(folder, judge, search, history, verified);
      line.show(static_cast<double>(i + 1) / static_cast<double>(chosen.size()));
    }
  }
  if (!io::interrupted()) return true;
  std::printf(
      "stopped; the search and %zu of %zu verified designs stand in %s; the same command verifies them again, "
      "without another search\n",
      verified.size(), chosen.size(), folder.c_str());
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  io::Program program("flappy-design", "Searches for the best robots that a workshop can build, by flying them.", {});
  std::string config_name, out, train_config;
  std::vector<std::string> overrides;
  program.app().option("config", config_name, "what may change and what is wanted: configs/design/*.toml").required();
  program.app().option("--out", out, "folder for the results; one that was stopped goes on").required();
  program.app().option("--set", overrides, "override a key: search.generations=10").one_at_a_time();
  program.app().option("--train", train_config, "train a policy for each chosen design: configs/train/escape.toml");
  program.takes_ranks();
  int code = 0;
  const int failed = program.run(argc, argv, [&] {
    design::DesignConfig config = design::read_design_config(config_name, overrides);
    const std::filesystem::path folder = out;
    if (!train_config.empty()) io::read_text(train_config);  // it is needed late
    const std::vector<design::Record> known = known_records(folder, config);
    config.search.ranks = program.ranks("design: " + io::sha256(config.resolved) + "\n");
    if (config.search.ranks != nullptr && !train_config.empty())
      throw io::InputError(
          "--train: policies are trained by one process; accepted: several ranks for the search, then the same "
          "command with --train alone");
    io::stop_on_interrupt();
    if (program.writes()) {
      io::make_folder(folder);
      io::note_own_folder(folder);
      io::write_atomically(folder / "config.toml", kept_text(config));
    }
    const double start_s = io::steady_seconds();
    const design::Judge judge(config.judge);
    design::Search search(judge, config.search, known);
    std::vector<design::Generation> history;
    const bool done = search.run([&](const design::Generation& g) {
      history.push_back(g);
      std::printf("generation %u of %u: %zu designs, %zu on the front, hypervolume %.4f, %.3g s of flight, %.0f s\n",
                  g.number, config.search.generations, g.designs, g.front, g.hypervolume, g.flown_s,
                  io::steady_seconds() - start_s);
      std::fflush(stdout);
      if (program.writes()) design::write_records(folder, search, history);
      return !io::interrupted();
    });
    const bool none = done && history.back().front == 0;
    if (none) code = 1;  // of all ranks
    if (!program.writes()) return;
    if (!done) {
      design::write_records(folder, search, history);
      std::printf("stopped; the same command goes on\n");
      return;
    }
    const std::vector<double> most = design::given_away(search);
    const auto refusals = design::refusals(search.records());
    if (none) show_refusals(refusals, history.back().designs, folder);
    else show(search, most);
    if (!search.published().refused.empty())
      std::printf("the published robot misses limits: %s\n", search.published().refused.c_str());
    design::write_results(folder, judge, search, history, {});
    const bool verifies = !none && config.verify.designs > 0;
    if (verifies && !verify(judge, search, config, history, folder, train_config)) return;
    nlohmann::ordered_json refused = nlohmann::ordered_json::array();
    for (const auto& [why, count] : refusals) refused.push_back({{"why", why}, {"designs", count}});
    program.write_json({{"designs", history.back().designs},
                        {"front", history.back().front},
                        {"hypervolume", history.back().hypervolume},
                        {"given_away", most},
                        {"refused", refused},
                        {"published_misses", search.published().refused}});
    if (verifies) std::printf("%s\n", io::shown_by(folder.string()).c_str());
  });
  return failed != 0 ? failed : code;
}
