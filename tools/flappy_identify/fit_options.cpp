#include "fit_options.hpp"

#include "io/installation.hpp"
#include "shared_options.hpp"

namespace flappy::identify {

void FitSettings::add(CLI::App& app) {
  config = io::config_path("identify/forces.toml");
  app.add_option("--config", config, "parameters and their bounds")->capture_default_str();
  app.add_option("--parameters", parameters, "fit these of the configuration alone, as a,b,c")->delimiter(',');
  app.add_option("--method", method, "gn: Gauss-Newton from several starts; ga: genetic algorithm; cmaes: CMA-ES")
      ->check(CLI::IsMember({"gn", "ga", "cmaes"}))
      ->capture_default_str();
  app.add_option("--starts", starts, "of gn: the vehicle as it is, then random ones")->check(CLI::Range(1, 1000));
  app.add_option("--population", population, "of ga and cmaes")->check(CLI::Range(8, 100000))->capture_default_str();
  app.add_option("--generations", generations, "of ga and cmaes")->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--fit-seed", seed, "of random starts and populations")->check(seeds())->capture_default_str();
}

FitConfig FitSettings::read_config(const model::Vehicle& vehicle) const {
  return read_fit_config(config, vehicle, parameters);
}

FitOptions FitSettings::options(const MapOptions& map) const {
  FitOptions o;
  o.method = method == "ga" ? Method::genetic : method == "cmaes" ? Method::cma_es : Method::gauss_newton;
  o.map = map;
  o.population = population + population % 2;  // pagmo's genetic algorithm pairs its individuals
  o.generations = generations;
  o.starts = starts;
  o.seed = seed;
  return o;
}

}  // namespace flappy::identify
