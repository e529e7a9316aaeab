// flappy-design: searches for robots that no other beats in every objective, and flies the chosen ones again.
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
  if (io::read_text(file) != config.resolved)
    throw io::InputError(file.string() +
                         ": is another configuration; accepted: a new folder, or the same configuration");
  return std::filesystem::exists(records) ? design::read_records(records) : std::vector<design::Record>();
}

void show(const design::Search& search, const std::vector<double>& most) {
  for (std::size_t k = 0; k < most.size(); ++k) {
    const design::FigureInfo& info = design::info_of(search.config().objectives[k]);
    const double published = design::figure_of(search.published().figures, search.config().objectives[k]);
    const std::string has = io::format("%s (the published robot: %.4g %s)", info.words, published, info.unit);
    if (most[k] > 0)
      std::printf("  %.1f %s better without loss elsewhere: %s\n", 100 * most[k],
                  design::is_share(search.config().objectives[k]) ? "points" : "%", has.c_str());
    else std::printf("  no better without loss elsewhere: %s\n", has.c_str());
  }
}

/// False if it was interrupted.
bool verify(const design::Judge& judge, const design::Search& search, const design::DesignConfig& config,
            const std::vector<design::Generation>& history, const std::filesystem::path& folder,
            const std::string& train_config) {
  std::vector<design::Record> chosen = design::choose(search, config.verify.designs);
  chosen.insert(chosen.begin(), search.published());
  std::vector<design::Verified> verified;
  io::ProgressLine line("verified");
  for (std::size_t i = 0; i < chosen.size() && !io::interrupted(); ++i) {
    verified.push_back(design::verify(judge, search, config, chosen[i], io::format("%02zu", i)));
    if (io::interrupted()) return false;  // its gains may be half tuned
    const std::filesystem::path own = folder / "designs" / verified.back().name;
    design::write_design(own, judge, verified.back());
    if (!train_config.empty()) verified.back().policy = trained(own, train_config);
    design::write_results(folder, judge, search, history, verified);
    line.show(static_cast<double>(i + 1) / static_cast<double>(chosen.size()));
  }
  return !io::interrupted();
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
  return program.run(argc, argv, [&] {
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
      io::write_atomically(folder / "config.toml", config.resolved);
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
    if (!program.writes()) return;
    const auto stopped = [] { std::printf("stopped; the same command goes on\n"); };
    if (!done) {
      design::write_records(folder, search, history);
      return stopped();
    }
    const std::vector<double> most = design::given_away(search);
    show(search, most);
    design::write_results(folder, judge, search, history, {});
    if (config.verify.designs > 0 && !verify(judge, search, config, history, folder, train_config)) return stopped();
    program.write_json({{"designs", history.back().designs},
                        {"front", history.back().front},
                        {"hypervolume", history.back().hypervolume},
                        {"given_away", most}});
    std::printf("%s\n", io::shown_by(folder.string()).c_str());
  });
}
