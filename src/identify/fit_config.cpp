#include "identify/fit_config.hpp"

#include <algorithm>

#include "io/config.hpp"

namespace flappy::identify {

FitConfig read_fit_config(const std::filesystem::path& path, const model::Vehicle& vehicle,
                          const std::vector<std::string>& chosen) {
  const io::Table root = io::Config::load(path).root();
  root.schema(1);
  root.accept({"schema", "unseen_share", "parameter"});
  FitConfig config;
  config.unseen_share = root.number("unseen_share", io::positive(1));
  model::Vehicle copy = vehicle;
  const std::vector<model::Parameter> known = model::parameters(copy);
  std::vector<std::string> names, offered;
  for (const model::Parameter& p : known) names.push_back(p.path);
  for (const io::Table& t : root.tables("parameter")) {
    const std::string name = t.string("name");
    const auto found = std::ranges::find(known, name, &model::Parameter::path);
    if (found == known.end())
      t.fail("name", "no parameter \"" + name + "\" in the vehicle",
             "paths of the vehicle's file" + io::did_you_mean(name, names));
    if (name.starts_with("driver."))
      t.fail("name", "\"" + name + "\" is chosen, not fitted", "parameters of the body, wings, springs and motors");
    if (std::ranges::count(offered, name) > 0) t.fail("name", "\"" + name + "\" comes twice", "each parameter once");
    offered.push_back(name);
    const FitParameter p{name, t.number("low", {found->low, found->high}), t.number("high", {found->low, found->high})};
    if (!(p.low < p.high)) t.fail("high", "is not above low", "a number above " + io::shortest_digits(p.low));
    if (!chosen.empty() && std::ranges::count(chosen, name) == 0) continue;
    if (*found->value < p.low || *found->value > p.high)
      t.fail("", "leaves out the vehicle's " + name + " = " + io::shortest_digits(*found->value),
             "bounds around where the fit starts");
    config.parameters.push_back(p);
  }
  root.finish();
  if (offered.empty()) root.fail("parameter", "is missing", "at least one [[parameter]]");
  for (const std::string& name : chosen)
    if (std::ranges::count(offered, name) == 0)
      throw io::InputError("--parameters: \"" + name + "\" is not fitted by " + path.string() +
                           "; accepted: names of its parameters" + io::did_you_mean(name, offered));
  return config;
}

std::vector<double*> fitted_values(const FitConfig& config, model::Vehicle& vehicle) {
  const std::vector<model::Parameter> all = model::parameters(vehicle);
  std::vector<double*> values;
  for (const FitParameter& p : config.parameters)
    values.push_back(std::ranges::find(all, p.path, &model::Parameter::path)->value);
  return values;
}

}  // namespace flappy::identify
