#include "gap/evidence/model_discrepancy.hpp"

#include <cmath>

#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

/// The table of configs/gap/model_discrepancy.toml that holds a channel.
std::string table_of(int channel) {
  if (channel <= kForceZ) return channel_name(channel);
  return channel < kPathX ? "drive" : channel < kTurnX ? "path" : "turn";
}

}  // namespace

double ModelDiscrepancy::background_sd(const std::string& effect) const {
  const auto at = background.find(effect);
  return at != background.end() ? at->second : background.at("other");
}

ModelDiscrepancy read_model_discrepancy(const std::filesystem::path& path) {
  using enum BasisFunction;
  const io::Config config = io::Config::load(path);
  const io::Table root = config.root();
  root.schema(1);
  ModelDiscrepancy d;
  double sum = 0;
  for (const std::vector<double>& row : root.rows("scales", 2, io::positive())) {
    d.scales.push_back({row[0], row[1]});
    sum += row[1];
  }
  if (!(std::abs(sum - 1) < 1e-9))
    root.fail("scales", "probabilities do not add up to 1", "[factor, probability], ...");
  d.form_error = root.number("form_error", io::non_negative());

  const io::Table ratios = root.table("relative_to_input");
  const std::pair<BasisFunction, double> relative[] = {{rate, ratios.number("rate", io::positive())},
                                                       {product, ratios.number("product", io::positive())},
                                                       {place, ratios.number("place", io::positive())}};
  const std::pair<BasisFunction, const char*> given[] = {
      {constant, "constant"},     {input, "input"},   {velocity_x, "velocity_x"}, {velocity_y, "velocity_y"},
      {velocity_z, "velocity_z"}, {drag_x, "drag_x"}, {drag_y, "drag_y"},         {drag_z, "drag_z"}};
  for (int channel = 0; channel < kChannels; ++channel) {
    const io::Table table = root.table("share").table(table_of(channel));
    auto& shares = d.shares[static_cast<std::size_t>(channel)];
    for (const auto& [function, key] : given) {
      const std::vector<double> by_harmonic = table.numbers(key, kHarmonics + 1, io::positive());
      for (std::size_t h = 0; h <= kHarmonics; ++h) shares[h][static_cast<std::size_t>(function)] = by_harmonic[h];
    }
    for (auto& of : shares)
      for (const auto& [function, ratio] : relative)
        of[static_cast<std::size_t>(function)] = ratio * of[static_cast<std::size_t>(input)];
  }

  const io::Table background = root.table("background_sd");
  d.background["other"] = background.number("other", io::positive());
  for (const std::string& key : background.keys())
    if (key == "other" || model::effect_index(key.c_str()) >= 0)
      d.background[key] = background.number(key, io::positive());
  root.finish();
  return d;
}

}  // namespace flappy::gap
