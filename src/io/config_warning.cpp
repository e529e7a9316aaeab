// Apart from config.cpp: an installed simulator reads configurations, and links no log.
#include "io/config.hpp"
#include "io/log.hpp"

namespace flappy::io {

void Table::warn(std::string_view key, std::string_view what) const {
  try {
    fail(key, what, "");
  } catch (const InputError& refusal) {  // has the line with the key's place
    log(LogLevel::warning, refusal.what());
  }
}

}  // namespace flappy::io
