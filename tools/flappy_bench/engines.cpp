#include "engines.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "io/installation.hpp"
#include "io/run_program.hpp"
#include "io/temporary_folder.hpp"
#include "learn/engine.hpp"

namespace flappy::bench {

std::vector<EngineRow> measure_engines(int seeds, const std::string& beside) {
  const io::TemporaryFolder work;
  const auto train = [&](const EngineRow& row, int seed, const std::vector<std::string>& more, double& peak_bytes) {
    const std::string name = row.name + std::to_string(seed) + (more.empty() ? "" : "_start");
    const std::filesystem::path folder = work / name;
    const auto build = std::filesystem::path(row.program).parent_path().parent_path();  // which has its own configs
    std::vector<std::string> command = {row.program, build / "share/flappy/configs/train/escape.toml",
                                        "--out",     folder,
                                        "--json",    folder.string() + ".json",
                                        "--set",     "learn.engine=" + row.engine,
                                        "--set",     "seed=" + std::to_string(seed)};
    for (const std::string& word : more) command.insert(command.end(), {"--set", word});
    const io::Finished done = io::run(command);
    if (done.exit_code != 0) throw io::InputError(done.err.substr(0, done.err.find('\n')));
    peak_bytes = std::max(peak_bytes, done.peak_bytes);
    return nlohmann::json::parse(io::read_text(folder.string() + ".json"));
  };
  const std::string own = io::beside_program("bin/flappy-train");
  std::vector<EngineRow> rows = {{"lanes", "lanes", own}};
  if (!beside.empty()) rows.push_back({"beside", "lanes", beside});
  else if (learn::has_libtorch()) rows.push_back({"libtorch", "libtorch", own});
  struct Runs {
    std::vector<double> updates_per_s, to_90_s, best;
  };
  std::vector<Runs> runs(rows.size());
  for (EngineRow& row : rows) {
    double peak_bytes = 0;
    const auto from = std::chrono::steady_clock::now();
    train(row, 0,
          {"learn.updates=1", "learn.updates_per_step=1", "collect.flappers=64", "collect.vehicles=1",
           "collect.steps_before=4", "evaluate.vehicles=1", "learn.replay=1024"},
          peak_bytes);
    row.start_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
  }
  for (int seed = 0; seed < seeds; ++seed)
    for (std::size_t e = 0; e < rows.size(); ++e) {
      const auto trained = train(rows[e], seed, {}, rows[e].peak_bytes);
      runs[e].updates_per_s.push_back(trained["updates"].get<double>() / trained["wall_s"].get<double>());
      runs[e].best.push_back(trained["best_success_rate"].get<double>());
      if (!trained["time_to_90_s"].is_number()) continue;
      runs[e].to_90_s.push_back(trained["time_to_90_s"].get<double>());
      ++rows[e].reached;
    }
  if (runs.size() > 1 && rows[0].reached == seeds && rows[1].reached == seeds) {
    std::vector<double> times;
    std::ranges::transform(runs[1].to_90_s, runs[0].to_90_s, std::back_inserter(times), std::divides());
    rows[1].times_lanes = summary(std::move(times));
  }
  for (std::size_t e = 0; e < rows.size(); ++e) {
    rows[e].updates_per_s = summary(std::move(runs[e].updates_per_s));
    rows[e].best_success = summary(std::move(runs[e].best));
    if (rows[e].reached > 0) rows[e].to_90_s = summary(std::move(runs[e].to_90_s));
  }
  return rows;
}

}  // namespace flappy::bench
