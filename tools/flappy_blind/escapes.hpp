// flappy-blind escape: flies a policy's manoeuvre many times and reports its success, as flappy-eval does.
#pragma once

#include <nlohmann/json.hpp>

#include "robots.hpp"

namespace flappy::blind {

struct EscapeOptions {
  RobotOptions robot;
  std::string policy, config;
  std::uint64_t draw = 0;
  std::size_t count = 50;
};

nlohmann::ordered_json fly_escapes(const EscapeOptions& o);

}  // namespace flappy::blind
