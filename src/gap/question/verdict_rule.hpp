// The constants by which evidence becomes a verdict: tables and keys of configs/gap/verdict.toml, which explains them.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/installation.hpp"

namespace flappy::gap {

struct VerdictRule {
  struct Prior {
    double none, parameters, effect, unknown, further_effect, remainder;
  } prior{};
  struct Gain {
    double by_chance_nats, further_screened_nats, vanished_magnitude;
    double outside_by_chance_nats;  ///< replaces by_chance_nats for effects in `outside`
    /// Additional gain by chance of a further effect and of a remainder, as a share of what the effects before it gain.
    double further_share, remainder_share;
    /// Effects of surroundings and sensors: errors of a robot's model do not look like these.
    std::vector<std::string> outside;
    /// In a contrast, the gain by chance of effects of models (ModelDiscrepancy::of_models) where references do not
    /// cover the regimes of the tests.
    double uncovered_by_chance_nats;
    double chance_of(const std::string& effect) const {
      return std::ranges::count(outside, effect) > 0 ? outside_by_chance_nats : by_chance_nats;
    }
  } gain{};
  struct UnknownCause {
    double penalty_nats;
  } unknown{};
  struct Refutation {
    double min_share;  ///< 0: no hypothesis is refuted
  } refutation{};
  struct Interval {
    double sd_factor, magnitude_error;
  } interval{};
  struct Tempering {
    double nats, freedom;
  } tempering{};
  struct Naming {
    double of_all, of_pool, member_of_pool;
    /// Effects are named if the probabilities of all hypotheses that contain their groups add up to at least this.
    double least;
  } naming{};
  /// Maps the probability p that evidence and priors give a verdict to the probability that the verdict states,
  /// 1 / (1 + exp(-(slope logit(p) + offset))), so that this share of the verdicts that state it is right (Platt 1999).
  struct Said {
    double slope = 1, offset = 0;
    double operator()(double probability) const;
  } said{};
};

/// Reads the file; io::InputError with file and line for what is not accepted.
VerdictRule read_verdict_rule(const std::filesystem::path& path = io::config_path("gap/verdict.toml"));
/// The same for the text of a file. `name`: the file's name in messages.
VerdictRule parse_verdict_rule(std::string_view text, const std::string& name);

}  // namespace flappy::gap
