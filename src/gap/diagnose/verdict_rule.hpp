// The constants by which evidence becomes a verdict. What each is for, and how it was learnt, stands in
// configs/gap/verdict.toml, whose tables and keys these are.
#pragma once

#include <algorithm>
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
    double by_chance_nats, further_screened_nats, vanished_size;
    double outside_by_chance_nats;     ///< .. of ..
    std::vector<std::string> outside;  ///< entries that are no part of what a model of the robot itself may get wrong
    double chance_of(const std::string& effect) const {
      return std::ranges::count(outside, effect) > 0 ? outside_by_chance_nats : by_chance_nats;
    }
  } gain;
  struct UnknownCause {
    double freeing_nats;
  } unknown;
  struct Refutation {
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
