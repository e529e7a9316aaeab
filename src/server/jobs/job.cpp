#include "server/jobs/job.hpp"

#include <algorithm>
#include <stdexcept>

namespace flappy::server {
namespace {

constexpr const char* kNames[] = {"queued", "running", "paused", "done", "failed", "cancelled"};

}  // namespace

const char* name_of(State state) { return kNames[static_cast<std::size_t>(state)]; }

State state_named(const std::string& name) {
  for (const State state : kStates)
    if (name == name_of(state)) return state;
  throw std::invalid_argument(name + ": no state of a job");
}

bool may_become(State from, State to) {
  switch (from) {
    case State::queued:
      // failed: the job cannot be started
      return to == State::running || to == State::paused || to == State::cancelled || to == State::failed;
    case State::running:
      return to != State::running;
    case State::paused:
      return to == State::queued || to == State::cancelled;
    case State::failed:
      return to == State::queued;
    case State::done:
    case State::cancelled:
      return false;
  }
  return false;
}

std::string shown(const std::string& text, std::size_t most) {
  std::string line = text.substr(0, most);
  if (line.size() < text.size())
    while (!line.empty() && (static_cast<unsigned char>(text[line.size()]) & 0xc0) == 0x80) line.pop_back();
  std::ranges::replace_if(
      line, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return line;
}

}  // namespace flappy::server
