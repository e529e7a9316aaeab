#include "gap/question/verdict_rule.hpp"

#include <cmath>

#include "io/config.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {

namespace {

VerdictRule rule_of(const io::Config& config) {
  constexpr io::Range kPositive = io::positive(), kNats = io::non_negative(), kShare{0, 1}, kOffset{-10, 10};
  const io::Table root = config.root();
  root.schema(1);
  VerdictRule r{};
  const io::Table prior = root.table("prior");
  r.prior = {prior.number("none", io::positive(1)),           prior.number("parameters", io::positive(1)),
             prior.number("effect", io::positive(1)),         prior.number("unknown", io::positive(1)),
             prior.number("further_effect", io::positive(1)), prior.number("remainder", io::positive(1))};
  if (!(std::abs(r.prior.none + r.prior.parameters + r.prior.effect + r.prior.unknown - 1) < 1e-9))
    prior.fail("", "none, parameters, effect and unknown do not add up to 1", "probabilities that do");
  const io::Table gain = root.table("gain");
  r.gain = {gain.number("by_chance_nats", kNats),
            gain.number("further_screened_nats", kNats),
            gain.number("vanished_magnitude", kPositive),
            {},
            {},
            {},
            {},
            {}};
  r.gain.uncovered_by_chance_nats = gain.number_or("uncovered_by_chance_nats", r.gain.by_chance_nats, kNats);
  if (const auto law = root.optional_table("another_law")) {
    r.gain.further_share = law->number("further_share", kShare);
    r.gain.remainder_share = law->number("remainder_share", kShare);
  }
  if (const auto outside = gain.optional_table("outside")) {
    r.gain.outside = outside->strings("effects");
    r.gain.outside_by_chance_nats = outside->number("by_chance_nats", kNats);
    for (const std::string& id : r.gain.outside)
      if (!model::is_effect(id))
        outside->fail("effects", "no effect \"" + id + "\"", "those that flappy-gap effects lists");
  }
  r.unknown = {root.table("unknown").number("penalty_nats", kNats)};
  if (const auto refutation = root.optional_table("refutation"))
    r.refutation.min_share = refutation->number("min_share", kShare);
  const io::Table interval = root.table("interval");
  r.interval = {interval.number("sd_factor", kPositive), interval.number("magnitude_error", kNats)};
  const io::Table tempering = root.table("tempering");
  r.tempering = {tempering.number("nats", kPositive), tempering.number("freedom", kPositive)};
  const io::Table naming = root.table("naming");
  r.naming = {naming.number("of_all", kShare), naming.number("of_pool", kShare),
              naming.number("member_of_pool", kShare), naming.number_or("least", 0, kShare)};
  if (const auto said = root.optional_table("said"))
    r.said = {said->number("slope", kPositive), said->number("offset", kOffset)};
  root.finish();
  return r;
}

}  // namespace

double VerdictRule::Said::operator()(double probability) const {
  if (probability <= 0 || probability >= 1) return probability;
  return 1 / (1 + std::exp(-slope * std::log(probability / (1 - probability)) - offset));
}

VerdictRule read_verdict_rule(const std::filesystem::path& path) { return rule_of(io::Config::load(path)); }

VerdictRule parse_verdict_rule(std::string_view text, const std::string& name) {
  return rule_of(io::Config::parse(text, name));
}

}  // namespace flappy::gap
