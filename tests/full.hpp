// What only repeats is tried whole by `scripts/test --full`, and in part by every other run.
#pragma once

#include <cstdlib>

namespace flappy::test {

inline bool full() { return std::getenv("FLAPPY_FULL_TESTS") != nullptr; }

}  // namespace flappy::test
