#include "gap/evidence/discrepancy_shares.hpp"

#include "io/text.hpp"

namespace flappy::gap {
namespace {

using enum BasisFunction;
constexpr std::pair<BasisFunction, const char*> kShareKeys[] = {
    {constant, "constant"},     {input, "input"},           {rate, "rate"},
    {product, "product"},       {place, "place"},           {flight, "flight"},
    {velocity_x, "velocity_x"}, {velocity_y, "velocity_y"}, {velocity_z, "velocity_z"},
    {drag_x, "drag_x"},         {drag_y, "drag_y"},         {drag_z, "drag_z"}};

constexpr const char* kSharesHead =
    R"(# Prior standard deviation of the coefficients of the regime basis, as a share of the channel's signal, for harmonics 0 (the mean) to 4 of the beat.
# Rows are kinds of functions: constant; the inputs; the rates of the body; products with an input; the place (height, heading, time, nearness of
# surfaces); an offset of each flight (a warm sensor, another day's battery); the velocity v in B; and |v| v. What no flight shows, as a channel that
# none has, or an offset of flights of one each, keeps the number from which learning started. bench_share: of runs on a bench, where it differs.
)";

}  // namespace

Shares read_shares(const io::Table& root) {
  Shares shares{};
  const io::Table air = root.table("share");
  const std::optional<io::Table> bench = root.optional_table("bench_share");
  for (int channel = 0; channel < kSettingChannels; ++channel) {
    const char* name = channel_name(channel % kChannels);
    const io::Table& share = channel >= kChannels && bench && bench->has(name) ? *bench : air;
    const io::Table table = share.table(share.has(name) || !share.has("all") ? name : "all");
    for (const auto& [function, key] : kShareKeys) {
      const std::vector<double> by_harmonic = table.numbers(key, kHarmonics + 1, io::positive());
      for (std::size_t h = 0; h <= kHarmonics; ++h)
        shares[static_cast<std::size_t>(channel)][h][static_cast<std::size_t>(function)] = by_harmonic[h];
    }
  }
  return shares;
}

std::string shares_text(const Shares& shares) {
  std::string text = kSharesHead;
  for (std::size_t channel = 0; channel < kSettingChannels; ++channel) {
    const bool bench = channel >= kChannels;
    if (bench && shares[channel] == shares[channel - kChannels]) continue;
    text +=
        std::string(bench ? "[bench_share." : "[share.") + channel_name(static_cast<int>(channel) % kChannels) + "]\n";
    for (const auto& [function, key] : kShareKeys) {
      text += std::string(key) + " = [";
      for (int h = 0; h <= kHarmonics; ++h)
        text += (h > 0 ? ", " : "") + io::format("%.4g", share_of(shares, static_cast<int>(channel), h, function));
      text += "]\n";
    }
    text += "\n";
  }
  return text;
}

}  // namespace flappy::gap
