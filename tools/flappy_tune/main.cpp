// flappy-tune: optimises the gains of a controller on many flights at once, and writes the controller's file.
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/config.hpp"
#include "io/program.hpp"
#include "io/progress.hpp"
#include "io/read_files.hpp"
#include "io/sha256.hpp"
#include "rollout/tune.hpp"

int main(int argc, char** argv) {
  using namespace flappy;
  io::Program program("flappy-tune", "Tunes the gains of a controller by an evolution strategy (CMA-ES).", {});
  std::string config_name, out;
  std::vector<std::string> overrides;
  program.app().option("config", config_name, "what to vary and how to judge: configs/tune/*.toml").required();
  program.app().option("out", out, "controller file to write").required();
  program.app().option("--set", overrides, "override a key: generations=10").one_at_a_time();
  program.takes_ranks();
  return program.run(argc, argv, [&] {
    rollout::TuneConfig config = rollout::read_tune_config(config_name, overrides);
    if (program.writes()) {
      io::allow_update(config.trials[0].fly.controller_file);
      io::check_output(out);
    }
    std::string agreed = "tuning: " + io::sha256(io::Config::load(config_name, overrides).resolved()) + "\n";
    for (const rollout::Trial& t : config.trials)
      for (const auto& [name, text] : t.fly.resolved) agreed += name + ": " + io::sha256(text) + "\n";
    config.ranks = program.ranks(agreed);
    const auto start = std::chrono::steady_clock::now();
    io::stop_on_interrupt();
    const double before = rollout::cost_of(config, config.start);
    std::printf("start: cost %.4f\n", before);
    unsigned generation = 0;
    const rollout::TuneResult result = rollout::tune(config, [&](const rollout::TuneResult& r) {
      const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      std::printf("generation %u of %u: cost %.4f, %.0f s\n", ++generation, config.generations, r.cost, wall_s);
      std::fflush(stdout);
      if (program.writes())
        io::write_atomically(out, rollout::controller_text(r.best, "Tuned by flappy-tune, generation " +
                                                                       std::to_string(r.generations) + "."));
      return !io::any(config.ranks, io::interrupted());
    });
    program.write_json({{"start_cost", before}, {"cost", result.cost}, {"generations", generation}});
  });
}
