// What the user is told when something is refused.
#pragma once

#include <functional>
#include <string>

#include "io/files.hpp"

namespace flappy::test {

/// The line of the InputError that `call` throws; "accepted" without one.
inline std::string refusal(const std::function<void()>& call) {
  try {
    call();
    return "accepted";
  } catch (const io::InputError& error) {
    return error.what();
  }
}

}  // namespace flappy::test
