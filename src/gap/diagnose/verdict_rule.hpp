// The constants by which evidence becomes a verdict. What each is for, and how it was learnt, stands in
// configs/gap/verdict.toml, whose tables and keys these are.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/installation.hpp"

namespace flappy::gap {

struct VerdictRule {
  struct Prior {
    double none, parameters, effect, unknown, further_effect, remainder;
  } prior;
  struct Gain {
    double by_chance_nats, by_model_nats, further_screened_nats, vanished_size;
    std::vector<std::string> of_models;  ///< entries that by_model_nats are of
    /// Those that published models of wings have or lack: what one explains, hypotheses without it have, too, at the price of its sizes.
    std::vector<std::string> of_some_models;
  } gain;
  struct UnknownCause {
    double freeing_nats;
  } unknown;
  struct Refutation {
    double share_of_gap;
    double least_share;  ///< of what smooth functions of the regime take away in flights held out; 0: not asked
  } refutation;
  struct Interval {
    double sd_factor, size_error;
  } interval;
  struct Doubt {
    double nats, freedom;
  } doubt;
  struct Naming {
    double of_all, of_pool, member_of_pool;
  } naming;
};

VerdictRule read_verdict_rule(const std::filesystem::path& path = io::config_path("gap/verdict.toml"));

}  // namespace flappy::gap
