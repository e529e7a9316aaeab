#include "fit_options.hpp"

#include "io/installation.hpp"
#include "shared_options.hpp"

namespace flappy::identify {

void FitSettings::add(const io::Command& app) {
  config = io::config_path("identify/forces.toml");
  app.option("--config", config, "parameters and their bounds").shows_default();
  app.option("--parameters", parameters, "fit these of the configuration alone, as a,b,c").separated_by(',');
  app.option("--method", method, "gn: Gauss-Newton from several starts; ga: genetic algorithm; cmaes: CMA-ES")
      .one_of({"gn", "ga", "cmaes"})
      .shows_default();
  app.option("--starts", starts, "of gn: the vehicle as it is, then random ones").range(1, 1000);
  app.option("--population", population, "of ga and cmaes").range(8, 100000).shows_default();
  app.option("--generations", generations, "of ga and cmaes").range(1, 100000).shows_default();
  app.option("--fit-seed", seed, "of random starts and populations")
      .range(std::uint64_t{0}, kLargestSeed)
      .shows_default();
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
